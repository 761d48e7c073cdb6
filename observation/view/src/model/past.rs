//! A model that begins in the middle of a run: the present is known, and of the past what the journal says where it goes on.
//!
//! ```text
//!   journal.000001 … │ journal.000271: continues, in-effect, in-effect, … │ records, as in a model of everything
//!        not read    │ counts and standing of the present                 │
//! ```
//!
//! Invariant: the standing, the counts of deadlines and the cycles are those of a model that has read everything. Events, counters, trends and
//! alarms of before are missing, and the snapshot says from which cycle on they are there.

use understudy_journal::{
    Continuation, Cycles, Happening, ProgramSoFar, Record, RunEvent, is_provable, moment,
};
use understudy_wire::{Member, Moment, ProgramId, Source};

use super::Model;
use super::programs::FAIL_SAFE;
use super::standing::{Change, StationChange};
use crate::describe::program_name;
use crate::history::History;

/// Cycles in which an alarm that lasts is found that was raised before.
const FOUND_WITHIN: i64 = 64;

impl Model {
    /// The first cycle whose records were read; nothing where it is the first of the run.
    pub fn read_from(&self) -> Option<i64> {
        self.read_from
    }

    /// Takes a record of the journal that is of no moment of the run; whether it is one.
    pub(super) fn is_of_journal(&mut self, record: &Record) -> bool {
        match &record.event {
            Happening::Run(RunEvent::Checkpoint { .. } | RunEvent::Journal { .. }) => {}
            Happening::Run(RunEvent::Continues(continuation)) => {
                // Whoever has read what was before knows it.
                self.continues = self.cycles.latest().is_none();
                if self.continues {
                    self.goes_on_from(continuation);
                }
            }
            Happening::Run(RunEvent::InEffect { cycle, record }) => {
                if self.continues {
                    self.in_effect(*cycle, record);
                }
            }
            _ => {
                self.continues = false;
                return false;
            }
        }
        true
    }

    /// The records before are not read: `moment` is cycle `cycle` of the run, and nothing is known of what was before.
    pub(crate) fn begins_at(&mut self, moment: Moment, cycle: i64) {
        self.cycles = Cycles::at(moment, cycle);
        self.knows_from(cycle);
    }

    fn knows_from(&mut self, cycle: i64) {
        self.read_from = Some(cycle);
        self.alarms.found_until = Some(cycle.saturating_add(FOUND_WITHIN));
        self.histories.iter_mut().for_each(History::misses_records);
    }

    fn goes_on_from(&mut self, continuation: &Continuation) {
        self.cycles = Cycles::continuing(continuation.numbering.clone(), continuation.origin);
        self.knows_from(continuation.cycle);
        for station in continuation.received.iter() {
            // It is not known when; whatever was reported of it afterwards counts.
            let change = Change::Station(station, StationChange::Received);
            self.changes.push(i64::MIN / 2, change);
        }
        let programs = (0..).map(ProgramId);
        let counted = programs.zip(self.programs.iter_mut().zip(&continuation.programs));
        for (program, (track, so_far)) in counted {
            let Some(ProgramSoFar { deadlines, inputs }) = so_far else {
                continue;
            };
            track.inputs.clone_from(inputs);
            let before = deadlines.before;
            track.tally.continues(deadlines);
            self.reports.goes_on(program, deadlines.until.saturating_sub(1));
            track.served =
                is_provable(deadlines.source) || before.direct > 0 || before.reconstructed > 0;
            if deadlines.source == Source::FailSafe && track.served {
                let remote_io = self.present.members().name(Member::RemoteIo(program));
                let text =
                    format!("{}: fail-safe outputs", program_name(program, self.present.members()));
                self.alarms.now_ns = deadlines.since_ns;
                self.alarms.raise_critical(
                    (remote_io.to_owned(), FAIL_SAFE),
                    deadlines.since,
                    text,
                );
            }
        }
        self.reports.find_complete(&self.received);
    }

    /// Takes a record of before: it changes the standing and is no event.
    fn in_effect(&mut self, cycle: i64, record: &Record) {
        self.cycles.fix(Some((cycle, moment(&record.event))));
        self.at_ns = record.at_ns;
        self.times.note(record);
        self.now = None;
        self.alarms.now_ns = record.at_ns;
        self.alarms.now = None;
        self.take(record);
        self.cycles.fix(None);
        self.events.clear();
        self.histories.iter_mut().for_each(History::misses_records);
    }
}
