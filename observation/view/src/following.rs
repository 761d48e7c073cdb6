//! Following a run so that its present is known soon: a long journal is begun near its end, and what is before is read behind it.
//!
//! ```text
//!   journal.000001 ─────────────── past ──────────────► (at the end: this is the model now)
//!                                     journal.000270 ── present ──►
//! ```
//!
//! Invariant: both take every record from where they begin. The model of the present says from which cycle on it has read
//! ([`Model::read_from`]); the one that replaces it has read everything.

use understudy_journal::Record;

use crate::model::{Bounds, Model};
use crate::run::Run;
use crate::source::{Progress, Source, Trouble};

/// A reader of a run, and of its past while that is not read.
#[derive(Debug)]
pub struct Following {
    source: Source,
    past: Option<Past>,
}

#[derive(Debug)]
struct Past {
    model: Model,
    source: Source,
}

impl Following {
    /// The model of a run before its first record, and the reader whose records it is to take.
    pub fn of(run: &Run, bounds: Bounds) -> (Model, Self) {
        let past = run.follow_newest().map(|newest| {
            let past = Past { model: run.model(bounds), source: run.follow() };
            (newest, past)
        });
        let (source, past) = match past {
            Some((newest, past)) => (newest, Some(past)),
            None => (run.follow(), None),
        };
        (run.model(bounds), Self { source, past })
    }

    /// Takes the records of the present that are there, as [`Source::poll`].
    pub fn poll(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> usize {
        self.source.poll(take)
    }

    /// Reads a piece of the past, some hundredths of a second. Where all of it is read the answer is the model that has read everything: it
    /// takes the next records.
    pub fn read_past(&mut self) -> Option<Model> {
        let past = self.past.as_mut()?;
        let model = &mut past.model;
        past.source.poll(&mut |found| model.take_found(found));
        if !past.source.progress().is_at_end() {
            return None;
        }
        let past = self.past.take()?;
        self.source = past.source;
        Some(past.model)
    }

    /// The model of what is read of the past, while not all of it is.
    pub fn past(&self) -> Option<&Model> {
        Some(&self.past.as_ref()?.model)
    }

    /// How much of the journal is read while its past is not, in percent.
    pub fn past_percent(&self) -> Option<u8> {
        Some(self.past.as_ref()?.source.progress().percent())
    }

    /// Progress of the reader of the present.
    pub fn progress(&self) -> Progress {
        self.source.progress()
    }
}
