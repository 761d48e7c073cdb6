//! Checkpoints: records that say which cycle of the run a place of the journal belongs to.
//!
//! Invariant: whoever starts at a checkpoint counts cycles as whoever started at the first record.

use understudy_remote_io::{Event as RemoteIo, Missing};
use understudy_wire::{Member, Moment};

use crate::numbering::Numbering;
use crate::record::{Happening, Record, RunEvent};

/// Text between two checkpoints: half of what is packed together, so that each packed piece has one.
const BETWEEN: usize = 128 * 1024;

/// Counts the cycles of a run while its records are written.
#[derive(Debug, Default)]
pub(crate) struct Checkpoints {
    numbering: Numbering,
    /// The number of cycle 0.
    origin: Option<i64>,
    /// An origin whose epoch is not known yet.
    awaited: Option<(Moment, i64)>,
    newest: Option<(Moment, i64)>,
    written: usize,
}

impl Checkpoints {
    /// Takes a record that was written with so many bytes; a checkpoint where one is due.
    pub(crate) fn after(&mut self, record: &Record, bytes: usize) -> Option<Record> {
        self.count(record);
        self.written += bytes;
        let (moment, number) = self.newest.filter(|_| self.written >= BETWEEN)?;
        let cycle = number.checked_sub(self.origin?)?;
        self.written = 0;
        let event = RunEvent::Checkpoint { moment, cycle };
        Some(Record::of_run(record.at_ns, event))
    }

    fn count(&mut self, record: &Record) {
        match (&record.event, record.member) {
            (
                Happening::RemoteIo(RemoteIo::Applied {
                    moment, missing, ..
                }),
                Some(Member::RemoteIo(program)),
            ) => {
                let idle = *missing == Some(Missing::NoCycle);
                let number = self.numbering.deadline(program, *moment, idle);
                // The moment of an idle deadline is the one of the last cycle.
                if !idle {
                    self.newest = Some((*moment, number));
                }
            }
            (Happening::Run(RunEvent::Origin { moment, cycle }), _) => {
                let cycle = i64::try_from(*cycle).unwrap_or(i64::MAX / 2);
                self.awaited = Some((*moment, cycle));
            }
            _ => return,
        }
        if let Some((moment, cycle)) = self.awaited
            && let Some(number) = self.numbering.of(moment)
        {
            self.origin = Some(number.saturating_sub(cycle));
            self.awaited = None;
        }
    }
}
