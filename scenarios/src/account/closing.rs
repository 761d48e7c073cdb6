//! The end of a cycle, and of a run: what was open is counted.

use understudy_wire::{ProgramId, ProgramSet};

use super::presence::{Interval, Presence, Presences};
use super::stalls::Stall;
use super::{Account, OpenCycle};
use understudy_journal::is_provable;

impl Account {
    pub(super) fn close(&mut self, number: i64, cycle: &OpenCycle) {
        let Some(at) = self.since_origin(number).filter(|&at| at < self.cycles) else {
            return;
        };
        self.presences.close_cycle(at, cycle.heard);
        let stalled = self.stalls.explains(number);
        // A stall of the host hides for a moment who is there, and changes nothing about it.
        let synchronised = cycle.content == ProgramSet::first(self.services.len());
        if !stalled || synchronised {
            self.protected = synchronised;
        }
        for (program, service) in self.services.iter_mut().enumerate() {
            let outcome = cycle.outcomes.get(&ProgramId(program as u8)).copied();
            service.close_cycle(at, outcome, stalled);
        }
        for (during, finding) in &mut self.during {
            if !(during.from..during.to).contains(&at) {
                continue;
            }
            let source = cycle.outcomes.get(&during.remote_io).map(|outcome| outcome.source);
            if source.is_some_and(|source| during.sources.contains(&source)) {
                continue;
            }
            // A stall explains a missed cycle, and nothing else.
            let is_missed = !source.is_some_and(is_provable);
            if stalled && is_missed {
                finding.missed_by_stall += 1;
            } else {
                finding.missed += 1;
                finding.first.get_or_insert((at, source));
            }
        }
    }

    /// Closes every cycle. Answers with how many there were from the origin on, the presences by rank, and the stalls.
    pub(crate) fn finish(&mut self) -> Finished {
        while !self.open.is_empty() {
            self.close_oldest();
        }
        let cycles_run = self
            .services
            .first()
            .map_or(0, |service| service.intervals.last().map_or(0, |last| last.to));
        let stations = self.terms.agreement.schedule.stations();
        let presences = std::mem::replace(&mut self.presences, Presences::new(stations, 1));
        let stalls = std::mem::take(&mut self.stalls);
        let listed = stalls.listed.iter().filter_map(|(number, member, late)| {
            Some(Stall {
                cycle: self.since_origin(*number)?,
                name: self.terms.members.name(*member).to_owned(),
                late_us: u64::try_from(late.as_micros()).unwrap_or(u64::MAX),
            })
        });
        let listed: Vec<Stall> = listed.filter(|stall| stall.cycle < self.cycles).collect();
        Finished { cycles_run, presences: presences.finish(cycles_run), stalls: listed }
    }

    /// Why remote I/Os pass no deadlines in the end; nothing where all of them do.
    pub(crate) fn absences(&self) -> Option<String> {
        self.absences.text(&self.terms.members)
    }

    /// How often a remote I/O that was killed took the records of its last samples with it, so that its outputs were not judged for a time.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = (ProgramId, u64)> {
        let referees = self.terms.referees.iter().enumerate();
        let gaps = referees.map(|(program, referee)| (ProgramId(program as u8), referee.gaps()));
        gaps.filter(|(_, gaps)| *gaps > 0)
    }
}

/// See [`Account::finish`].
pub(crate) struct Finished {
    pub(crate) cycles_run: u64,
    pub(crate) presences: Vec<(Vec<Interval<Presence>>, u64)>,
    pub(crate) stalls: Vec<Stall>,
}
