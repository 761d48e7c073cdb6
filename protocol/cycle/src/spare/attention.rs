//! What a spare knows of a group, from the deadlines of a few of its remote I/Os.
//!
//! A *witness* is a remote I/O whose reports are followed. Each report names the stations whose turns it misses; turns go to all
//! remote I/Os, so a few witnesses see every station. A station is flagged for as many cycles as every followed witness has missed it in a row: a broken link of one witness is no failure of a station.
//!
//! ```text
//!   witness 0  ■ ■ ■ □ □ □ □ □ □    flagged for 6
//!   witness 1  ■ ■ ■ ■ ■ □ □ □ □    flagged for 4      the station: flagged for 4
//! ```

use understudy_wire::{ProgramId, StationId, StationSet};

use super::attendance::AttendanceReport;
use crate::{Agreement, Mode};

/// Remote I/Os of a group that are followed, at most.
pub const WITNESSES: usize = 3;

/// Further cycles that a slot waits for each slot before it: where that one wakes, this one is not needed.
const NEXT_SLOT_AFTER: u32 = 100;

/// A station that was never received counts after this many times `spare_after`: groups start station by station.
const FIRST_TIME: u32 = 10;

/// Attention to one group.
#[derive(Debug, Clone, Hash)]
pub struct Attention {
    controllers: usize,
    /// Whether one more understudy masks anything: not in the paper's mode.
    takes_spares: bool,
    /// Understudies that are no slots of spares.
    understudies: StationSet,
    slots: StationSet,
    own: StationId,
    stations: usize,
    flag_after: u32,
    spare_after: u32,
    /// Stations that a witness has received.
    known: StationSet,
    witnesses: Vec<Option<Witness>>,
}

/// A remote I/O that is followed.
#[derive(Debug, Clone, Hash)]
struct Witness {
    /// By rank: deadlines in a row without a turn of the station.
    silent: Vec<u32>,
    /// Deadlines in a row at which the group was complete without the own slot.
    complete: u32,
    /// Deadlines that it has passed.
    deadlines: u64,
}

/// What is known of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Standing {
    /// Whether enough remote I/Os of it are followed.
    pub seen: bool,
    /// Whether a station holds a state that a spare could adopt.
    pub served: bool,
    /// Failures of stations that are masked when the group is complete.
    pub full: u32,
    /// Failures that are masked now, without the own slot.
    pub redundancy: u32,
    /// Cycles for which the group has been complete without the own slot.
    pub complete: u32,
    /// Whether the station of the own slot publishes.
    pub publishes: bool,
}

impl Attention {
    /// No deadline has been seen. `own` is the slot of the spare.
    pub fn new(agreement: &Agreement, own: StationId, spare_after: u32) -> Self {
        let schedule = &agreement.schedule;
        let (controllers, slots) = (schedule.controllers(), schedule.spare_slots());
        let before = slots.iter().filter(|slot| slot.0 < own.0).count();
        let later = u32::try_from(before).unwrap_or(u32::MAX).saturating_mul(NEXT_SLOT_AFTER);
        // In the paper's mode one more understudy masks nothing.
        let takes_spares = agreement.mode == Mode::Full;
        let understudies = schedule.expected().without(StationSet::first(controllers));
        Self {
            controllers,
            takes_spares,
            understudies,
            slots: if takes_spares { slots } else { StationSet::EMPTY },
            own,
            stations: schedule.stations(),
            flag_after: agreement.flag_after,
            spare_after: spare_after.max(agreement.flag_after).saturating_add(later),
            known: StationSet::EMPTY,
            witnesses: vec![None; controllers.min(WITNESSES)],
        }
    }

    /// A witness has passed a deadline at which it had received these stations.
    pub fn deadline(&mut self, witness: usize, heard: StationSet) {
        let Some(place) = self.witnesses.get(witness) else {
            return;
        };
        let before = place.as_ref();
        let silent = (0..self.stations).map(|rank| {
            let silent = before.map_or(0, |it| it.silent[rank]);
            let present = heard.contains(StationId(rank as u8));
            if present { 0 } else { silent.saturating_add(1) }
        });
        let silent: Vec<u32> = silent.collect();
        let deadlines = before.map_or(0, |it| it.deadlines).saturating_add(1);
        self.told(witness, &AttendanceReport { deadlines, longest: silent.clone(), silent });
    }

    /// A witness reports the stations that it misses.
    pub fn told(&mut self, witness: usize, report: &AttendanceReport) {
        let AttendanceReport { deadlines, silent, longest } = report;
        let has_all = [silent, longest].iter().all(|counts| counts.len() == self.stations);
        let Some(place) = self.witnesses.get_mut(witness).filter(|_| has_all) else {
            return;
        };
        // What was before the first report is not known.
        let fresh = || Witness { silent: Vec::new(), complete: 0, deadlines: *deadlines };
        let mut seen = place.take().unwrap_or_else(fresh);
        // One that has started again counts from the beginning.
        let passed = u32::try_from(deadlines.saturating_sub(seen.deadlines)).unwrap_or(u32::MAX);
        seen.deadlines = *deadlines;
        seen.silent.clone_from(silent);
        let ranks = (0..self.stations).map(|rank| StationId(rank as u8));
        let received = ranks.filter(|it| seen.silent[it.index()] == 0);
        self.known = self.known.or(received.collect());
        // A slot after the own one does not count: of two spares for one failure the later one retires.
        let before: StationSet = self.slots.iter().filter(|slot| slot.0 < self.own.0).collect();
        let present = |station: StationId| longest[station.index()] < self.flag_after;
        let full = self.full();
        let is_complete = self.masked(before, present).is_some_and(|masked| masked >= full);
        seen.complete = if is_complete { seen.complete.saturating_add(passed.max(1)) } else { 0 };
        self.witnesses[witness] = Some(seen);
    }

    /// A witness is not followed any more.
    pub fn lost(&mut self, witness: usize) {
        if let Some(place) = self.witnesses.get_mut(witness) {
            *place = None;
        }
    }

    /// Cycles for which a station has been missed by all witnesses; 0 where none is followed.
    pub fn silent(&self, station: StationId) -> u32 {
        let silent = self.followed().map(|witness| witness.silent.get(station.index()));
        silent.min().flatten().copied().unwrap_or(0)
    }

    /// Stations, other than slots, that have been flagged for long enough to wake the spare.
    pub fn failed(&self) -> impl Iterator<Item = StationId> + '_ {
        let controllers = StationSet::first(self.controllers);
        let expected = controllers.or(self.understudies);
        let stations = (0..self.stations).map(|rank| StationId(rank as u8));
        stations.filter(move |it| expected.contains(*it) && self.silent(*it) >= self.limit(*it))
    }

    /// What is known now.
    pub fn standing(&self) -> Standing {
        let followed = self.followed().count();
        let others = self.slots.without(StationSet::only(self.own));
        // A slot is empty as soon as it is flagged; any other station is missed for longer before that counts.
        let present = |station: StationId| self.silent(station) < self.limit(station);
        let masked = if followed == 0 { None } else { self.masked(others, present) };
        Standing {
            seen: followed > 0 && followed >= self.witnesses.len().div_ceil(2),
            served: masked.is_some() && self.takes_spares,
            full: self.full(),
            redundancy: masked.unwrap_or(0),
            complete: self.followed().map(|witness| witness.complete).min().unwrap_or(0),
            publishes: followed > 0 && self.silent(self.own) == 0,
        }
    }

    /// Cycles without a turn after which a station counts as failed.
    fn limit(&self, station: StationId) -> u32 {
        if self.slots.contains(station) {
            self.flag_after
        } else if self.known.contains(station) {
            self.spare_after
        } else {
            self.spare_after.saturating_mul(FIRST_TIME)
        }
    }

    fn followed(&self) -> impl Iterator<Item = &Witness> {
        self.witnesses.iter().flatten()
    }

    /// Each output is proved by its controller and by each understudy; one of them is enough.
    fn full(&self) -> u32 {
        self.understudies.len() as u32
    }

    /// Failures of stations that are masked whichever they are, among the programs that a station still executes; none
    /// where there is no such program.
    fn masked(&self, slots: StationSet, present: impl Fn(StationId) -> bool) -> Option<u32> {
        let understudies = self.understudies.or(slots);
        let understudies = understudies.iter().filter(|it| present(*it)).count() as u32;
        let programs = (0..self.controllers).map(|place| ProgramId(place as u8));
        let provers =
            programs.map(|program| understudies + u32::from(present(program.controller())));
        provers.filter(|provers| *provers > 0).min().map(|provers| provers - 1)
    }
}

#[cfg(test)]
mod tests;
