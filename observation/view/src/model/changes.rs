//! The changes of the standing by cycle, so that the standing of every remembered cycle is known.
//!
//! Invariant: `now` is `first` with all of `later` applied, in ascending order of cycles and, within a cycle, in the order of the records.
//! Bounded: at the bound the oldest change becomes part of `first`.

use std::borrow::Cow;
use std::collections::{BTreeMap, VecDeque};

use understudy_wire::Member;

use super::standing::{Change, Standing};

/// Changes that are kept apart.
const MOST: usize = 10_000;

#[derive(Debug, Clone)]
pub(super) struct Changes {
    first: Standing,
    later: VecDeque<(i64, Change)>,
    now: Standing,
    /// The newest cycle that was shown: no change is of it or of an earlier one any more.
    shown: Option<i64>,
    /// The cycle in which the process of a member last began or ended.
    begun: BTreeMap<Member, i64>,
}

impl Changes {
    pub(super) fn new(stations: usize, programs: usize) -> Self {
        let nothing = Standing::new(stations, programs);
        Self {
            first: nothing.clone(),
            later: VecDeque::new(),
            now: nothing,
            shown: None,
            begun: BTreeMap::new(),
        }
    }

    /// The standing with every change.
    pub(super) fn now(&self) -> &Standing {
        &self.now
    }

    /// The standing in a cycle.
    pub(super) fn at(&self, cycle: i64) -> Cow<'_, Standing> {
        if self.later.back().is_none_or(|(at, _)| *at <= cycle) {
            return Cow::Borrowed(&self.now);
        }
        let mut standing = self.first.clone();
        for (at, change) in self.later.iter().take_while(|(at, _)| *at <= cycle) {
            standing.apply(change, *at);
        }
        Cow::Owned(standing)
    }

    /// The standing in the newest cycle, with the later changes that are no reports of members.
    pub(super) fn present(&self, cycle: i64) -> Cow<'_, Standing> {
        let mut later = self.later.iter().rev().take_while(|(at, _)| *at > cycle);
        if later.all(|(_, change)| !change.is_report()) {
            return Cow::Borrowed(&self.now);
        }
        let mut standing = self.first.clone();
        let present = self.later.iter();
        for (at, change) in present.filter(|(at, change)| *at <= cycle || !change.is_report()) {
            standing.apply(change, *at);
        }
        Cow::Owned(standing)
    }

    /// Cycles up to this one are shown: a change that is read later takes effect in the next one.
    pub(super) fn shown(&mut self, cycle: Option<i64>) {
        self.shown = cycle;
    }

    /// What was done to a process is so from `cycle` on.
    pub(super) fn process(&mut self, member: Member, cycle: i64, change: Change) {
        let cycle = self.unshown(cycle);
        self.begun.insert(member, cycle);
        self.push(cycle, change);
    }

    /// What a member reports is so from `cycle` on, and not before its process began. A report that is read after the end of its process
    /// is void.
    pub(super) fn reported(&mut self, by: Member, cycle: i64, change: Change) {
        if !self.now.is_down(by) {
            let begun = self.begun.get(&by).copied().unwrap_or(i64::MIN);
            self.push(cycle.max(begun), change);
        }
    }

    fn unshown(&self, cycle: i64) -> i64 {
        self.shown.map_or(cycle, |shown| cycle.max(shown.saturating_add(1)))
    }

    pub(super) fn push(&mut self, cycle: i64, change: Change) {
        let cycle = self.unshown(cycle);
        let place = self.later.partition_point(|(at, _)| *at <= cycle);
        if place == self.later.len() {
            self.now.apply(&change, cycle);
            self.later.push_back((cycle, change));
        } else {
            self.later.insert(place, (cycle, change));
            self.now = self.first.clone();
            for (at, change) in &self.later {
                self.now.apply(change, *at);
            }
        }
        if self.later.len() > MOST
            && let Some((at, oldest)) = self.later.pop_front()
        {
            self.first.apply(&oldest, at);
        }
    }

    pub(super) fn shift(&mut self, by: i64) {
        self.first.shift(by);
        self.now.shift(by);
        for (cycle, change) in &mut self.later {
            *cycle = cycle.saturating_add(by);
            if let Change::Program(_, change) = change {
                change.shift(by);
            }
        }
        self.shown = self.shown.map(|shown| shown.saturating_add(by));
        for cycle in self.begun.values_mut() {
            *cycle = cycle.saturating_add(by);
        }
    }
}

#[cfg(test)]
mod tests {
    use understudy_journal::Process;
    use understudy_wire::{ProgramId, StationId};

    use super::super::standing::StationChange;
    use super::*;
    use crate::station::StationStanding;

    const MEMBER: Member = Member::Station(StationId(0));

    fn killed() -> Change {
        Change::Process(MEMBER, Process::Killed)
    }

    fn restarted() -> Change {
        Change::Process(MEMBER, Process::Running)
    }

    #[test]
    fn a_cycle_shows_what_was_done_before_it() {
        let other = Member::RemoteIo(ProgramId(1));
        let mut changes = Changes::new(2, 2);
        changes.process(MEMBER, 5, killed());
        changes.push(12, Change::Cut(MEMBER, other));
        // Read later, and of an earlier cycle.
        changes.process(MEMBER, 9, restarted());
        let process = |cycle| changes.at(cycle).process(MEMBER);
        assert_eq!(process(4), None);
        assert_eq!(process(5), Some(Process::Killed));
        assert_eq!(process(8), Some(Process::Killed));
        assert_eq!(process(9), Some(Process::Running));
        assert_eq!(changes.now().process(MEMBER), Some(Process::Running));
        let cut_from = |cycle| -> Vec<Member> { changes.at(cycle).cut_from(MEMBER).collect() };
        assert_eq!(cut_from(11), []);
        assert_eq!(cut_from(12), [other]);
    }

    #[test]
    fn a_shown_cycle_stays_as_it_was_shown() {
        let mut changes = Changes::new(2, 2);
        let is_flagged = |standing: &Standing| {
            standing.station(StationId(0)).is_some_and(StationStanding::is_flagged)
        };
        let flagged = || Change::Station(StationId(0), StationChange::Flagged(ProgramId(1)));
        changes.shown(Some(7));
        changes.reported(Member::RemoteIo(ProgramId(1)), 5, flagged());
        assert!(!is_flagged(&changes.at(7)));
        assert!(!is_flagged(&changes.present(7)), "a report of the next cycle");
        changes.process(MEMBER, 9, killed());
        assert_eq!(changes.present(7).process(MEMBER), Some(Process::Killed));
        assert!(!is_flagged(&changes.present(7)));
        assert!(is_flagged(&changes.present(8)) && is_flagged(&changes.at(8)));
    }

    #[test]
    fn a_killed_station_is_no_cycle_master() {
        let mut changes = Changes::new(2, 2);
        changes.push(1, Change::BecameCycleMaster(StationId(1)));
        changes.push(2, Change::BecameCycleMaster(StationId(0)));
        changes.process(MEMBER, 5, killed());
        let masters = |cycle| -> Vec<StationId> { changes.at(cycle).cycle_masters().collect() };
        assert_eq!(masters(4), [StationId(0), StationId(1)]);
        assert_eq!(masters(5), [StationId(1)]);
    }

    #[test]
    fn the_dead_report_nothing() {
        let mut changes = Changes::new(2, 2);
        changes.process(MEMBER, 5, killed());
        changes.reported(MEMBER, 6, Change::BecameCycleMaster(StationId(0)));
        assert_eq!(changes.now().cycle_masters().count(), 0);
        changes.process(MEMBER, 9, restarted());
        // Of an epoch whose cycles cannot be numbered yet.
        changes.reported(MEMBER, 4, Change::BecameCycleMaster(StationId(0)));
        assert_eq!(changes.at(8).cycle_masters().count(), 0);
        assert_eq!(changes.at(9).cycle_masters().count(), 1);
    }

    #[test]
    fn changes_are_bounded() {
        let mut changes = Changes::new(1, 1);
        for cycle in 0..MOST as i64 + 10 {
            changes.process(MEMBER, cycle, killed());
        }
        assert_eq!(changes.later.len(), MOST);
        assert_eq!(changes.at(0).process(MEMBER), Some(Process::Killed));
    }
}
