//! What the page knows of the run: the model of its journal, once the run has begun.

use std::path::Path;
use std::time::Instant;

use understudy_cluster::Cluster;
use understudy_journal::Record;
use understudy_view::{Bounds, Model as RunModel, Progress, Reading, Run, Source, Trouble};
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

    /// The run has started: its records are read from the returned source.
    pub(crate) fn begin(&mut self, run: &Run) -> Source {
        self.known = Some(Known::nothing_of(run, false));
        run.follow()
    }

    pub(crate) fn note(&mut self, found: Result<Record, Trouble>) {
        if let Some(known) = &mut self.known {
            known.note(found);
        }
    }

    /// The journal is complete.
    pub(crate) fn end(&mut self) {
        if let Some(known) = &mut self.known {
            known.ended = true;
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
    /// Before the first record.
    fn nothing_of(run: &Run, ended: bool) -> Self {
        Self {
            run: run.model(Bounds::default()),
            ended,
        }
    }

    /// All that a journal holds up to a cycle.
    pub(crate) fn of_journal(run: &Run, until: i64) -> Self {
        let mut known = Self::nothing_of(run, run.is_finished());
        let mut source = run.follow();
        while source.poll(&mut |found| known.note(found)) > 0 {
            let past = known.run.newest().is_some_and(|newest| newest > until);
            if past && known.run.has_origin() {
                break;
            }
        }
        known
    }

    fn note(&mut self, found: Result<Record, Trouble>) {
        match found {
            Ok(record) => self.run.note(&record),
            Err(trouble) => self.run.trouble(&trouble),
        }
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.ended || self.run.is_finished()
    }
}
