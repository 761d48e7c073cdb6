//! Where a reader can begin in the middle of a journal: checkpoints within a segment, and the continuation that a segment begins with.
//!
//! ```text
//!   journal, continues, in-effect, in-effect, …, [records of this segment], checkpoint, [records], checkpoint, …
//!            └ what a reader of the segments before would know of the present ┘
//! ```
//!
//! Invariant: whoever starts at a checkpoint or a continuation counts cycles as whoever started at the first record.

use serde::{Deserialize, Serialize};
use understudy_node::Event as Station;
use understudy_remote_io::{Event as RemoteIo, Missing};
use understudy_wire::{Image, Member, Moment, StationSet};

use crate::cycles::Cycles;
use crate::in_effect::InEffect;
use crate::numbering::Numbering;
use crate::record::{Happening, Record, RunEvent, moment};
use crate::tally::{Deadlines, Tally};

/// Text between two checkpoints: half of what is packed together, so that each packed piece has one.
const BETWEEN: usize = 128 * 1024;

/// What the segments before have counted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// The newest cycle of the run.
    pub cycle: i64,
    /// The number of cycle 0.
    pub origin: i64,
    /// The count of cycles.
    pub numbering: Numbering,
    /// The stations that have taken a turn: they have reported one, or a remote I/O has received one.
    pub received: StationSet,
    /// By program, its remote I/Os; nothing before their first deadline.
    pub programs: Vec<Option<ProgramSoFar>>,
}

/// A program at its remote I/O, as the segments before tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProgramSoFar {
    /// Its deadlines.
    #[serde(flatten)]
    pub deadlines: Deadlines,
    /// u(i) as last sampled.
    pub inputs: Option<Image>,
}

#[derive(Debug, Clone)]
struct Track {
    tally: Tally,
    inputs: Option<Image>,
}

/// Follows the records of a run while they are written.
#[derive(Debug, Default)]
pub(crate) struct Followed {
    cycles: Cycles,
    newest: Option<(Moment, i64)>,
    received: StationSet,
    programs: Vec<Track>,
    in_effect: InEffect,
    /// Bytes since the last checkpoint.
    written: usize,
}

impl Followed {
    /// Takes a record that was written with so many bytes; a checkpoint where one is due.
    pub(crate) fn after(&mut self, record: &Record, bytes: usize) -> Option<Record> {
        self.note(record);
        self.written += bytes;
        let (moment, cycle) = self.newest.filter(|_| self.written >= BETWEEN)?;
        // Deadlines without a cycle are not counted by a reader that begins among them.
        if !self.cycles.has_origin() || self.cycles.latest() != Some(cycle) {
            return None;
        }
        self.written = 0;
        let is_changed = self.in_effect.is_changed();
        let event = RunEvent::Checkpoint { moment, cycle, is_changed };
        Some(Record::of_run(record.at_ns, event))
    }

    /// The records that a segment begins with which goes on after a record of this time; none while the origin of the run is not known.
    pub(crate) fn continuation(&self, at_ns: u64) -> Vec<Record> {
        let (Some(origin), Some(cycle)) = (self.cycles.origin(), self.cycles.latest()) else {
            return Vec::new();
        };
        let continuation = Continuation {
            cycle,
            origin,
            numbering: self.cycles.numbering().clone(),
            received: self.received,
            programs: self.programs.iter().map(Track::so_far).collect(),
        };
        let continues = RunEvent::Continues(Box::new(continuation));
        let in_effect = self.in_effect.records();
        let in_effect = in_effect
            .map(|(cycle, record)| RunEvent::InEffect { cycle, record: Box::new(record.clone()) });
        let events = std::iter::once(continues).chain(in_effect);
        events.map(|event| Record::of_run(at_ns, event)).collect()
    }

    fn note(&mut self, record: &Record) {
        match (&record.event, record.member) {
            (
                Happening::RemoteIo(RemoteIo::Applied {
                    moment,
                    missing,
                    source,
                    heard,
                    sampled,
                    ..
                }),
                Some(Member::RemoteIo(program) | Member::Twin(program)),
            ) => {
                let idle = *missing == Some(Missing::NoCycle);
                let cycle = self.cycles.deadline(program, *moment, idle);
                self.move_to_origin();
                // The moment of an idle deadline is the one of the last cycle.
                if !idle {
                    self.newest = Some((*moment, cycle));
                }
                self.received = self.received.or(*heard);
                if self.programs.len() <= program.index() {
                    self.programs.resize(program.index() + 1, Track::new());
                }
                let track = &mut self.programs[program.index()];
                track.tally.push(cycle, *source, record.at_ns);
                if let Some(sampled) = sampled {
                    track.inputs = Some(sampled.clone());
                }
            }
            (Happening::Station(Station::Published { .. }), Some(Member::Station(station))) => {
                self.received.insert(station);
                self.in_effect.note(record, self.cycles.of(moment(&record.event)));
            }
            (Happening::Run(RunEvent::Origin { moment, cycle }), _) => {
                let cycle = i64::try_from(*cycle).unwrap_or(i64::MAX / 2);
                self.cycles.origin_is_recorded(*moment, cycle);
                self.move_to_origin();
            }
            _ => {
                let cycle = self.cycles.of(moment(&record.event));
                self.in_effect.note(record, cycle);
            }
        }
    }

    fn move_to_origin(&mut self) {
        if let Some(by) = self.cycles.take_shift() {
            self.newest = self.newest.map(|(moment, cycle)| (moment, cycle + by));
            for track in &mut self.programs {
                track.tally.shift(by);
            }
            self.in_effect.shift(by);
        }
    }
}

impl Track {
    fn new() -> Self {
        Self { tally: Tally::new(KEPT), inputs: None }
    }

    fn so_far(&self) -> Option<ProgramSoFar> {
        Some(ProgramSoFar { deadlines: self.tally.deadlines()?, inputs: self.inputs.clone() })
    }
}

/// Rows of a tally: only the newest is told, and those before the origin are not counted.
const KEPT: usize = 16;
