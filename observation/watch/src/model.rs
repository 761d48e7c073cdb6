//! What the page knows of the run: the model of its journal, once the run has begun.

use std::path::Path;
use std::time::Instant;

use understudy_cluster::Cluster;
use understudy_journal::Record;
use understudy_view::{
    Bounds, Following, Model as RunModel, Progress, Reading, Run, Trouble, ViewError,
};
use understudy_wire::Member;

/// The run that the page follows.
#[derive(Debug)]
pub(crate) struct Model {
    name: String,
    known: Option<Known>,
    /// Progress of the follower.
    pub(crate) progress: Progress,
    /// Reason why nothing is known yet.
    pub(crate) waits_for: String,
}

/// A run whose programs are known.
#[derive(Debug)]
pub(crate) struct Known {
    pub(crate) run: RunModel,
    /// The run is over, and its journal was read to the end.
    ended: bool,
    /// How much of the journal is read while its past is not, in percent.
    pub(crate) past_percent: Option<u8>,
}

impl Model {
    pub(crate) fn new(run: &Path) -> Self {
        let name = std::fs::canonicalize(run).ok();
        let name = name.as_deref().unwrap_or(run).file_name();
        Self {
            name: name.map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            known: None,
            progress: Progress::default(),
            waits_for: "the run has not started".to_owned(),
        }
    }

    /// The name of the run's directory.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The run, even if its present state is not known.
    pub(crate) fn known(&self) -> Option<&Known> {
        self.known.as_ref()
    }

    /// The run with its present state; nothing before it has started.
    pub(crate) fn present(&self) -> Result<Option<&Known>, Reading> {
        if self.known.is_some() {
            self.progress.current(Instant::now())?;
        }
        Ok(self.known.as_ref())
    }

    /// The run has started: its records are read by the returned reader.
    pub(crate) fn begin(&mut self, run: &Run) -> Following {
        let (run, following) = Following::of(run, Bounds::default());
        self.known = Some(Known { run, ended: false, past_percent: following.past_percent() });
        following
    }

    pub(crate) fn note(&mut self, found: Result<Record, Trouble>) {
        if let Some(known) = &mut self.known {
            known.run.take_found(found);
        }
    }

    /// A piece of the past was read: all of it where there is the model that has read everything.
    pub(crate) fn past_is_read(&mut self, whole: Option<RunModel>, percent: Option<u8>) {
        if let Some(known) = &mut self.known {
            known.past_percent = percent;
            if let Some(mut whole) = whole {
                if known.run.is_finished() {
                    whole.end(!known.run.is_interrupted());
                }
                known.run = whole;
            }
        }
    }

    /// The journal is complete.
    pub(crate) fn end(&mut self, has_results: bool) {
        if let Some(known) = &mut self.known {
            known.ended = true;
            known.run.end(has_results);
        }
    }

    /// The cluster of the run, where it is known.
    pub(crate) fn cluster(&self) -> Option<&Cluster> {
        Some(self.known.as_ref()?.run.cluster())
    }

    pub(crate) fn member(&self, name: &str) -> Option<Member> {
        self.known.as_ref()?.run.members().find(name)
    }
}

impl Known {
    /// What a journal says of a cycle that is not the newest.
    ///
    /// # Errors
    /// [`ViewError`].
    pub(crate) fn of_journal(run: &Run, cycle: i64) -> Result<Self, ViewError> {
        Ok(Self {
            run: run.read_between(Bounds::default(), cycle, cycle)?,
            ended: run.is_finished(),
            past_percent: None,
        })
    }

    /// The first cycle whose records were read, while what is before is read.
    pub(crate) fn past(&self) -> Option<(i64, u8)> {
        self.run.read_from().zip(self.past_percent)
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.ended || self.run.is_finished()
    }
}
