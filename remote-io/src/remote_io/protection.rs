//! Whether the failure of one station would be masked now: the controller and an understudy, or two understudies, prove
//! the output of this program in this cycle. Protection lost for `flag_after` cycles in a row is reported, with the
//! reason.
//!
//! A remote I/O that has started reports which it is once an output was proved. After a cold start it gives the other
//! stations time to start too; a state that it adopts is that of a cluster that runs.

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Mode;
use understudy_wire::{Body, Holding, Lineage, Moment, StationId, StationSet, Turn};

use super::RemoteIo;
use crate::event::{Event, Lacking, LackingReason};

/// Sets of stations, each of which proves the output by itself.
const STATIONS_NEEDED: usize = 2;

/// A program that has started cold and was never protected is reported after this time: its understudy may join later than its controller.
const FIRST_PROTECTION: Duration = Duration::from_secs(5);

/// State kept from deadline to deadline.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(super) struct Protection {
    /// Last reported state; `None` until the first report.
    reported: Option<bool>,
    /// Whether the program has started cold.
    cold: bool,
    /// Deadlines in a row without protection, and the cycle of the first of them.
    missed: u32,
    since: Moment,
}

impl Protection {
    /// The program starts, cold or from a state that a station holds.
    pub(super) fn starts(&mut self, cold: bool) {
        self.cold = cold;
    }
}

impl RemoteIo {
    /// Evaluates the turns of a cycle at its deadline, where it was sampled.
    pub(super) fn watch_protection(&mut self) {
        if let Some(run) = self.arbiter.knowledge.run().filter(|run| run.sampled) {
            self.note_protection(self.lacking(run.history.head()));
        }
    }

    /// A deadline without a cycle: no station proves an output.
    pub(super) fn note_idle(&mut self) {
        let reason = LackingReason::NotReceived;
        if !self.is_author() {
            return;
        }
        let all = self.arbiter.holders.stations();
        self.note_protection(all.map(|station| Lacking { station, reason }).collect());
    }

    fn note_protection(&mut self, lacking: SmallVec<[Lacking; 2]>) {
        let stations = self.arbiter.holders.stations().count();
        if stations < STATIONS_NEEDED {
            return;
        }
        let moment = self.moment();
        let proving = stations.saturating_sub(lacking.len());
        // In the paper's mode stations of other programs may lack, and this one is driven.
        let own = lacking.iter().filter(|one| one.reason != LackingReason::Failed);
        let is_driven = own.count() < stations;
        let paper = self.settings.agreement.mode == Mode::Paper;
        let protected = proving >= STATIONS_NEEDED && (lacking.is_empty() || !paper);
        let agreement = &self.settings.agreement;
        let protection = &mut self.protection;
        let is_first = protection.reported.is_none();
        let patience = if is_first && protection.cold {
            let period = agreement.schedule.period().as_nanos().max(1);
            let cycles = u32::try_from(FIRST_PROTECTION.as_nanos() / period).unwrap_or(u32::MAX);
            cycles.max(agreement.listen_cycles * 20).max(agreement.flag_after)
        } else {
            agreement.flag_after
        };
        if protected {
            protection.missed = 0;
            if protection.reported.replace(true) != Some(true) {
                self.report(Event::Protected { moment });
            }
            return;
        }
        if protection.missed == 0 {
            if is_first && !is_driven {
                return;
            }
            protection.since = moment;
        }
        protection.missed = protection.missed.saturating_add(1);
        if protection.missed >= patience && protection.reported != Some(false) {
            protection.reported = Some(false);
            let since = protection.since;
            // The empty slot of a spare is no loss.
            let slots = agreement.schedule.spare_slots();
            let is_empty = |one: &Lacking| {
                one.reason == LackingReason::NotReceived && slots.contains(one.station)
            };
            let lacking = lacking.into_iter().filter(|one| !is_empty(one)).collect();
            self.report(Event::Unprotected { moment, since, lacking });
        }
    }

    /// Stations that do not prove this program's output in this cycle, with the reason; in the paper's mode also failed
    /// stations of other programs.
    fn lacking(&self, head: Lineage) -> SmallVec<[Lacking; 2]> {
        let own = self.arbiter.holders.stations().filter_map(|station| {
            let reason = self.lacks(station, head)?;
            Some(Lacking { station, reason })
        });
        let mut lacking: SmallVec<[Lacking; 2]> = own.collect();
        if self.settings.agreement.mode == Mode::Paper {
            let all = StationSet::first(self.turns.len());
            let part: StationSet = self.arbiter.holders.stations().collect();
            let failed = all.without(part).without(self.member.published());
            let reason = LackingReason::Failed;
            lacking.extend(failed.iter().map(|station| Lacking { station, reason }));
        }
        lacking
    }

    /// Reason why a station does not prove this program's output in this cycle.
    fn lacks(&self, station: StationId, head: Lineage) -> Option<LackingReason> {
        if self.arbiter.trust.excluded().contains(station) {
            return Some(LackingReason::Excluded);
        }
        let Some(turn) = self.turn_of(station) else {
            let joins = self.member.flagged().contains(station);
            return Some(if joins && self.arbiter.holders.is_living(station) {
                LackingReason::Joining
            } else {
                LackingReason::NotReceived
            });
        };
        let program = self.settings.program;
        let Some(holding) = Holding::of(&turn.holdings, program) else {
            return Some(LackingReason::Joining);
        };
        let says = turn.words.iter().any(|word| word.mask.contains(program));
        let stepped = holding.stepped;
        (!says || holding.lineage != head).then_some(LackingReason::Behind { stepped })
    }

    fn turn_of(&self, station: StationId) -> Option<&Turn> {
        match &self.turns.get(station.index())?.as_ref()?.body {
            Body::Turn(turn) => Some(turn),
            _ => None,
        }
    }
}
