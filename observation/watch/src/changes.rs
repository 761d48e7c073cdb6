//! What was done to the members, so that a page can show how they stood in any cycle: processes, cuts, forces, exclusions.
//!
//! The model of [`understudy_view`] says what was said and driven in each cycle; this says what stands behind it. Bounded: at the bound
//! the oldest changes become the standing that all others start from.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use understudy_journal::{Action, Happening, Record, RunEvent};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{LostState, Protection};
use understudy_wire::{Force, Member, ProgramId, SignalPlace, StationId, StationSet};

/// Changes that are kept apart.
const MOST: usize = 10_000;

/// How a process is, as far as whoever runs it knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Process {
    Running,
    StandsStill,
    Killed,
    Ended,
}

/// How everything stood in a cycle.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standing {
    processes: BTreeMap<Member, Process>,
    cuts: BTreeSet<(Member, Member)>,
    /// Stations that have started cycles since their process began.
    cycle_masters: BTreeSet<StationId>,
    /// Members of a cluster elsewhere whose journal is not told here.
    detached: BTreeSet<Member>,
    forced: BTreeMap<(ProgramId, SignalPlace), Force>,
    excluded: BTreeMap<ProgramId, StationSet>,
    protection: BTreeMap<ProgramId, Protected>,
}

/// Whether a program is protected, and what is left of a state that is lost, as far as this is known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Protected {
    pub(crate) protection: Option<Protection>,
    pub(crate) lost: Option<LostState>,
}

impl Standing {
    /// Nothing where whoever runs the member has said nothing of it.
    pub(crate) fn process(&self, member: Member) -> Option<Process> {
        self.processes.get(&member).copied()
    }

    /// Whom nothing reaches any more that it says.
    pub(crate) fn cut_from(&self, member: Member) -> impl Iterator<Item = Member> {
        let cuts = self.cuts.iter();
        cuts.filter(move |(from, _)| *from == member)
            .map(|(_, to)| *to)
    }

    /// By rank, those that have started cycles. A host that stands still makes another one start a cycle now and then, and the first of
    /// those that live goes on without saying so again.
    pub(crate) fn cycle_masters(&self) -> impl Iterator<Item = StationId> {
        self.cycle_masters.iter().copied()
    }

    /// Whether its own journal is told here no more, so that only others say how it is.
    pub(crate) fn is_detached(&self, member: Member) -> bool {
        self.detached.contains(&member)
    }

    pub(crate) fn forced(&self, program: ProgramId) -> impl Iterator<Item = &Force> {
        let of_program = self.forced.iter();
        of_program
            .filter(move |((of, _), _)| *of == program)
            .map(|(_, force)| force)
    }

    pub(crate) fn excluded(&self, program: ProgramId) -> StationSet {
        self.excluded
            .get(&program)
            .copied()
            .unwrap_or(StationSet::EMPTY)
    }

    pub(crate) fn protection(&self, program: ProgramId) -> Protected {
        self.protection.get(&program).cloned().unwrap_or_default()
    }

    fn apply(&mut self, change: &Change) {
        match change {
            Change::Process(member, process) => {
                self.processes.insert(*member, *process);
                if let Member::Station(station) = member {
                    self.cycle_masters.remove(station);
                }
                // What a remote I/O was told it forgets with its process.
                if let (Member::RemoteIo(program), Process::Running) = (member, process) {
                    self.forced.retain(|(of, _), _| of != program);
                    self.excluded.remove(program);
                }
            }
            Change::GoesOn(member) => {
                self.processes.insert(*member, Process::Running);
            }
            Change::Cut(from, to) => {
                self.cuts.insert((*from, *to));
            }
            Change::Healed(from, to) => {
                self.cuts.remove(&(*from, *to));
            }
            Change::Attached(member) => {
                self.detached.remove(member);
            }
            Change::Detached(member) => {
                self.detached.insert(*member);
            }
            Change::BecameCycleMaster(station) => {
                self.cycle_masters.insert(*station);
            }
            Change::Forced(program, force) => {
                self.forced.insert((*program, force.signal), force.clone());
            }
            Change::Unforced(program, signal) => {
                self.forced.remove(&(*program, *signal));
            }
            Change::Excluded(program, stations) => {
                let all = self.excluded(*program).or(*stations);
                self.excluded.insert(*program, all);
            }
            Change::Released(program) => {
                self.excluded.remove(program);
            }
            Change::Protection(program, protected) => {
                self.protection.insert(*program, protected.as_ref().clone());
            }
        }
    }
}

#[derive(Debug, Clone)]
enum Change {
    Process(Member, Process),
    GoesOn(Member),
    Cut(Member, Member),
    Healed(Member, Member),
    Attached(Member),
    Detached(Member),
    BecameCycleMaster(StationId),
    Forced(ProgramId, Force),
    Unforced(ProgramId, SignalPlace),
    Excluded(ProgramId, StationSet),
    Released(ProgramId),
    Protection(ProgramId, Box<Protected>),
}

/// All that was done.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    first: Standing,
    later: VecDeque<(i64, Change)>,
}

impl Changes {
    /// Takes the next record; what it does is felt in `cycle`.
    pub(crate) fn note(&mut self, record: &Record, cycle: i64) {
        if let Some(change) = change_of(record) {
            self.push(change, cycle);
        }
    }

    /// The protection of a program is another one from `cycle` on.
    pub(crate) fn protection(&mut self, program: ProgramId, protected: Protected, cycle: i64) {
        self.push(Change::Protection(program, Box::new(protected)), cycle);
    }

    fn push(&mut self, change: Change, cycle: i64) {
        if self.later.len() == MOST
            && let Some((_, oldest)) = self.later.pop_front()
        {
            self.first.apply(&oldest);
        }
        self.later.push_back((cycle, change));
    }

    /// Cycles are counted from another one from now on: what came before is before all of them.
    pub(crate) fn begin_anew(&mut self) {
        for (_, change) in self.later.drain(..) {
            self.first.apply(&change);
        }
    }

    pub(crate) fn at(&self, cycle: i64) -> Standing {
        let mut standing = self.first.clone();
        let until = self.later.iter().filter(|(at, _)| *at <= cycle);
        until.for_each(|(_, change)| standing.apply(change));
        standing
    }
}

fn change_of(record: &Record) -> Option<Change> {
    match (&record.event, record.member) {
        (Happening::Run(event), _) => of_run(event),
        (
            Happening::Station(StationEvent::BecameCycleMaster { .. }),
            Some(Member::Station(station)),
        ) => Some(Change::BecameCycleMaster(station)),
        (Happening::RemoteIo(event), Some(Member::RemoteIo(program))) => {
            of_remote_io(program, event)
        }
        _ => None,
    }
}

fn of_run(event: &RunEvent) -> Option<Change> {
    match event {
        RunEvent::Attached { member } => Some(Change::Attached(*member)),
        RunEvent::Detached { member, .. } => Some(Change::Detached(*member)),
        RunEvent::Started { member } => Some(Change::Process(*member, Process::Running)),
        RunEvent::Ended { member, .. } => Some(Change::Process(*member, Process::Ended)),
        RunEvent::Fault { action, member, .. } => match action {
            Action::Crash => Some(Change::Process(*member, Process::Killed)),
            Action::Stop => Some(Change::Process(*member, Process::StandsStill)),
            Action::Continue => Some(Change::GoesOn(*member)),
            Action::Cut { to } => Some(Change::Cut(*member, *to)),
            Action::Heal { to } => Some(Change::Healed(*member, *to)),
            Action::Restart => Some(Change::Process(*member, Process::Running)),
            _ => None,
        },
        _ => None,
    }
}

fn of_remote_io(program: ProgramId, event: &RemoteIoEvent) -> Option<Change> {
    match event {
        RemoteIoEvent::Forced { force, .. } => Some(Change::Forced(program, force.clone())),
        RemoteIoEvent::Unforced { signal, .. } => Some(Change::Unforced(program, *signal)),
        RemoteIoEvent::ValueFault {
            accused,
            located: true,
            ..
        } => Some(Change::Excluded(program, *accused)),
        RemoteIoEvent::Released { .. } | RemoteIoEvent::StartedCold { .. } => {
            Some(Change::Released(program))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{Cycle, Epoch, Moment};

    use super::*;

    fn fault(action: Action) -> Record {
        let event = RunEvent::Fault {
            action,
            member: Member::Station(StationId(0)),
            asked: 0,
        };
        Record::of_run(0, event)
    }

    #[test]
    fn a_cycle_shows_what_was_done_before_it() {
        let (member, other) = (
            Member::Station(StationId(0)),
            Member::RemoteIo(ProgramId(1)),
        );
        let mut changes = Changes::default();
        changes.note(&fault(Action::Crash), 5);
        changes.note(&fault(Action::Restart), 9);
        changes.note(&fault(Action::Cut { to: other }), 12);
        let process = |changes: &Changes, cycle| changes.at(cycle).process(member);
        assert_eq!(process(&changes, 4), None);
        assert_eq!(process(&changes, 5), Some(Process::Killed));
        assert_eq!(process(&changes, 8), Some(Process::Killed));
        assert_eq!(process(&changes, 9), Some(Process::Running));
        let cut_from = |changes: &Changes, cycle| -> Vec<Member> {
            changes.at(cycle).cut_from(member).collect()
        };
        assert_eq!(cut_from(&changes, 11), []);
        assert_eq!(cut_from(&changes, 12), [other]);
        changes.begin_anew();
        assert_eq!(cut_from(&changes, 0), [other]);
    }

    #[test]
    fn who_is_killed_starts_no_cycles() {
        let is_cycle_master = |rank| {
            let moment = Moment {
                epoch: Epoch(1),
                cycle: Cycle(0),
            };
            let said = Happening::Station(StationEvent::BecameCycleMaster { moment });
            Record {
                member: Some(Member::Station(StationId(rank))),
                event: said,
                ..fault(Action::Crash)
            }
        };
        let mut changes = Changes::default();
        changes.note(&is_cycle_master(1), 1);
        changes.note(&is_cycle_master(0), 2);
        changes.note(&fault(Action::Crash), 5);
        let cycle_masters =
            |cycle| -> Vec<StationId> { changes.at(cycle).cycle_masters().collect() };
        assert_eq!(cycle_masters(4), [StationId(0), StationId(1)]);
        assert_eq!(cycle_masters(5), [StationId(1)]);
    }

    #[test]
    fn changes_are_bounded() {
        let mut changes = Changes::default();
        for cycle in 0..MOST as i64 + 10 {
            changes.note(&fault(Action::Stop), cycle);
        }
        assert_eq!(changes.later.len(), MOST);
        let member = Member::Station(StationId(0));
        assert_eq!(changes.at(0).process(member), Some(Process::StandsStill));
    }
}
