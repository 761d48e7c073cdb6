//! What was done to the parties, so that a page can show how they stood in any cycle: processes, cuts, forces, exclusions.
//!
//! The model of [`understudy_view`] says what was said and driven in each cycle; this says what stands behind it. Bounded: at the bound
//! the oldest changes become the standing that all others start from.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_scenarios::{Action, Happening, Record, RunEvent};
use understudy_view::{LostState, Protection};
use understudy_wire::{Force, Party, ProgramId, SignalPlace, StationId, StationSet};

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
    processes: BTreeMap<Party, Process>,
    cuts: BTreeSet<(Party, Party)>,
    /// Stations that have started cycles since their process began.
    paced: BTreeSet<StationId>,
    /// Parties of a cluster elsewhere whose journal is not told here.
    detached: BTreeSet<Party>,
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
    /// Nothing where whoever runs the party has said nothing of it.
    pub(crate) fn process(&self, party: Party) -> Option<Process> {
        self.processes.get(&party).copied()
    }

    /// Whom nothing reaches any more that it says.
    pub(crate) fn cut_from(&self, party: Party) -> impl Iterator<Item = Party> {
        let cuts = self.cuts.iter();
        cuts.filter(move |(from, _)| *from == party)
            .map(|(_, to)| *to)
    }

    /// By rank, those that have started cycles. A host that stands still makes another one start a cycle now and then, and the first of
    /// those that live goes on without saying so again.
    pub(crate) fn paced(&self) -> impl Iterator<Item = StationId> {
        self.paced.iter().copied()
    }

    /// Whether its own journal is told here no more, so that only others say how it is.
    pub(crate) fn is_detached(&self, party: Party) -> bool {
        self.detached.contains(&party)
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
            Change::Process(party, process) => {
                self.processes.insert(*party, *process);
                if let Party::Station(station) = party {
                    self.paced.remove(station);
                }
                // What a remote I/O was told it forgets with its process.
                if let (Party::RemoteIo(program), Process::Running) = (party, process) {
                    self.forced.retain(|(of, _), _| of != program);
                    self.excluded.remove(program);
                }
            }
            Change::GoesOn(party) => {
                self.processes.insert(*party, Process::Running);
            }
            Change::Cut(from, to) => {
                self.cuts.insert((*from, *to));
            }
            Change::Healed(from, to) => {
                self.cuts.remove(&(*from, *to));
            }
            Change::Attached(party) => {
                self.detached.remove(party);
            }
            Change::Detached(party) => {
                self.detached.insert(*party);
            }
            Change::Paces(station) => {
                self.paced.insert(*station);
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
    Process(Party, Process),
    GoesOn(Party),
    Cut(Party, Party),
    Healed(Party, Party),
    Attached(Party),
    Detached(Party),
    Paces(StationId),
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
    match (&record.event, record.party) {
        (Happening::Run(event), _) => of_run(event),
        (Happening::Station(StationEvent::Paces { .. }), Some(Party::Station(station))) => {
            Some(Change::Paces(station))
        }
        (Happening::RemoteIo(event), Some(Party::RemoteIo(program))) => {
            of_remote_io(program, event)
        }
        _ => None,
    }
}

fn of_run(event: &RunEvent) -> Option<Change> {
    match event {
        RunEvent::Attached { party } => Some(Change::Attached(*party)),
        RunEvent::Detached { party, .. } => Some(Change::Detached(*party)),
        RunEvent::Started { party } => Some(Change::Process(*party, Process::Running)),
        RunEvent::Ended { party, .. } => Some(Change::Process(*party, Process::Ended)),
        RunEvent::Fault { action, party, .. } => match action {
            Action::Crash => Some(Change::Process(*party, Process::Killed)),
            Action::Stop => Some(Change::Process(*party, Process::StandsStill)),
            Action::Continue => Some(Change::GoesOn(*party)),
            Action::Cut { to } => Some(Change::Cut(*party, *to)),
            Action::Heal { to } => Some(Change::Healed(*party, *to)),
            Action::Restart => Some(Change::Process(*party, Process::Running)),
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
            party: Party::Station(StationId(0)),
            asked: 0,
        };
        Record::of_run(0, event)
    }

    #[test]
    fn a_cycle_shows_what_was_done_before_it() {
        let (party, other) = (Party::Station(StationId(0)), Party::RemoteIo(ProgramId(1)));
        let mut changes = Changes::default();
        changes.note(&fault(Action::Crash), 5);
        changes.note(&fault(Action::Restart), 9);
        changes.note(&fault(Action::Cut { to: other }), 12);
        let process = |changes: &Changes, cycle| changes.at(cycle).process(party);
        assert_eq!(process(&changes, 4), None);
        assert_eq!(process(&changes, 5), Some(Process::Killed));
        assert_eq!(process(&changes, 8), Some(Process::Killed));
        assert_eq!(process(&changes, 9), Some(Process::Running));
        let cut_from = |changes: &Changes, cycle| -> Vec<Party> {
            changes.at(cycle).cut_from(party).collect()
        };
        assert_eq!(cut_from(&changes, 11), []);
        assert_eq!(cut_from(&changes, 12), [other]);
        changes.begin_anew();
        assert_eq!(cut_from(&changes, 0), [other]);
    }

    #[test]
    fn who_is_killed_starts_no_cycles() {
        let paces = |rank| {
            let moment = Moment {
                epoch: Epoch(1),
                cycle: Cycle(0),
            };
            let said = Happening::Station(StationEvent::Paces { moment });
            Record {
                party: Some(Party::Station(StationId(rank))),
                event: said,
                ..fault(Action::Crash)
            }
        };
        let mut changes = Changes::default();
        changes.note(&paces(1), 1);
        changes.note(&paces(0), 2);
        changes.note(&fault(Action::Crash), 5);
        let paced = |cycle| -> Vec<StationId> { changes.at(cycle).paced().collect() };
        assert_eq!(paced(4), [StationId(0), StationId(1)]);
        assert_eq!(paced(5), [StationId(1)]);
    }

    #[test]
    fn changes_are_bounded() {
        let mut changes = Changes::default();
        for cycle in 0..MOST as i64 + 10 {
            changes.note(&fault(Action::Stop), cycle);
        }
        assert_eq!(changes.later.len(), MOST);
        let party = Party::Station(StationId(0));
        assert_eq!(changes.at(0).process(party), Some(Process::StandsStill));
    }
}
