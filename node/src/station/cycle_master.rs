//! Where one cycle ends and the next begins.
//!
//! The cycle master is the lowest-ranked living station. Every other one waits a guard time for each that comes before
//! it, so that the next rank takes over when the cycle master is not received; two that start the same cycle at once do
//! no harm.

use std::time::Duration;

use understudy_wire::{Body, Moment, StationSet, Time};

use super::{Company, CycleNotes, Role, Station, Token};
use crate::event::Event;

/// Cycles of a second, and at least three.
fn missing_after(period: Duration) -> u32 {
    let cycles = Duration::from_secs(1).as_nanos() / period.as_nanos().max(1);
    u32::try_from(cycles).unwrap_or(u32::MAX).max(3)
}

impl Station {
    /// Ends the current cycle: updates the flags, and the replicas in shadow mode.
    pub(super) fn close_cycle(&mut self) {
        let Some(moment) = self.member.clock.moment() else {
            return;
        };
        if self.cycle.token == Token::Passed {
            self.member.attendance.receive_turn(self.own());
        }
        self.member.close_cycle();
        let follows = self.closed.is_some_and(|closed| moment <= closed.plus(1));
        self.closed = Some(moment);
        let [last, earlier] = self.company;
        let remote_ios = self.relay.direct();
        let now = Company { remote_ios, stations: self.cycle.receives_station };
        if !follows || now.is_none() {
            for replica in &mut self.replicas {
                replica.was_isolated(last.or(earlier).exceeds(replica.id()));
            }
        }
        if !now.is_none() {
            self.company = [now, last];
        }
        for replica in &mut self.replicas {
            if replica.close_cycle(moment) {
                let program = replica.id();
                self.member.report(Event::Synchronised { moment, program });
            }
        }
        self.note_samples(moment);
        self.joining = self.cycle.joiners;
        self.relay.close_cycle();
        self.differed = std::mem::take(&mut self.cycle.differs);
        self.cycle = CycleNotes::default();
    }

    /// Reports the programs whose samples are missing, and those whose samples have returned.
    fn note_samples(&mut self, moment: Moment) {
        let agreement = &self.settings.agreement;
        // One that stood still goes through what it has missed at once: those cycles took no time in which samples could come.
        let began = self.member.clock.anchor();
        let took_time = agreement.schedule.took_time(began.since(self.looked_at));
        self.looked_at = began;
        // A remote I/O that starts listens first, longest where a station is missing.
        let bound = missing_after(agreement.schedule.period()).max(agreement.listen_cycles * 6);
        for (place, replica) in self.replicas.iter().enumerate() {
            let program = replica.id();
            let is_sampled = self.relay.has_sample(program);
            let unsampled = &mut self.unsampled[place];
            if is_sampled {
                if *unsampled >= bound {
                    self.member.report(Event::SamplesReturned { moment, program });
                }
                *unsampled = 0;
            } else if took_time && *unsampled < bound {
                *unsampled += 1;
                if *unsampled == bound {
                    self.member.report(Event::SamplesMissing { moment, program });
                }
            }
        }
    }

    /// Time at which this station starts the next cycle if no other one does: a guard time later for each living lower
    /// rank.
    pub(super) fn starts_cycle_at(&self) -> Time {
        let agreement = &self.settings.agreement;
        let (schedule, own) = (&agreement.schedule, self.own());
        let lower = StationSet::first(own.index());
        if self.role == Role::Listening {
            let listens = schedule.period() * agreement.listen_cycles;
            return self.started + listens + schedule.guard() * u32::from(own.0);
        }
        let living = self.living();
        let first = if self.publishes() {
            living.and(lower)
        } else {
            living.or(self.joining.and(lower)).without(StationSet::only(own))
        };
        self.member.clock.anchor() + schedule.period() + schedule.guard() * first.len() as u32
    }

    fn living(&self) -> StationSet {
        let all = StationSet::first(self.settings.agreement.schedule.stations());
        all.without(self.member.flagged())
    }

    /// Time at which this station repeats the Sync of the cycle master: it is the next rank, and lacks a sample. A remote I/O that does not receive the cycle
    /// master begins the cycle with this Sync; the turns of those that wait for its sample would come too late.
    pub(super) fn repeats_sync_at(&self) -> Option<Time> {
        let lower = self.living().and(StationSet::first(self.own().index()));
        let lacks_sample =
            || self.replicas.iter().any(|replica| !self.relay.has_sample(replica.id()));
        let repeats = self.role == Role::Following
            && !self.cycle.has_repeated_sync
            && self.publishes()
            && lower.len() == 1
            && lacks_sample();
        let guard = self.settings.agreement.schedule.guard();
        repeats.then(|| self.member.clock.anchor() + guard)
    }

    pub(super) fn repeat_sync_if_due(&mut self, now: Time) {
        if self.repeats_sync_at().is_some_and(|due| due <= now) {
            self.cycle.has_repeated_sync = true;
            self.member.send_cyclic(now, Body::Sync);
        }
    }

    pub(super) fn start_cycle(&mut self, now: Time, planned: Time) {
        self.close_cycle();
        // A cycle master keeps to its plan, so that late wake-ups do not add up; one that is far behind starts from
        // now.
        let schedule = &self.settings.agreement.schedule;
        let anchor = if now.since(planned) < schedule.guard() { planned } else { now };
        let moment = self.member.clock.pace(now, self.settings.founds, anchor, schedule.period());
        if self.role != Role::CycleMaster {
            self.role = Role::CycleMaster;
            self.report(Event::BecameCycleMaster { moment });
        }
        self.member.send_cyclic(now, Body::Sync);
    }
}
