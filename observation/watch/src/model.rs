//! What the page knows of the run: the model of its journal, and what was done to its members.

use std::path::Path;
use std::time::Instant;

use understudy_journal::{Happening, Record};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Margin, Model as RunModel, Progress, Reading, Run, Source, Trouble};
use understudy_wire::{Member, ProgramId, StationId, StationSet};

use crate::changes::{Changes, Protected};
use crate::foreseen::Foresight;

/// Cycles by which a remote I/O that is alive may be behind the newest deadline.
const LAG_CYCLES: i64 = 3;

/// What is known of the run.
#[derive(Debug)]
pub(crate) struct Model {
    name: String,
    known: Option<Known>,
    /// Of the follower, when it had folded what is known.
    pub(crate) progress: Progress,
    /// Why nothing is known, while that is so.
    pub(crate) waits_for: String,
}

/// A run whose programs are known.
#[derive(Debug)]
pub(crate) struct Known {
    pub(crate) run: RunModel,
    pub(crate) changes: Changes,
    /// By program, as it was noted last among the changes.
    protected: Vec<Protected>,
    foresight: Foresight,
    /// Nothing more will come, and all of it is read.
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
            waits_for: "the run has not begun".to_owned(),
        }
    }

    /// The name of the run's directory.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// What runs, however it is now.
    pub(crate) fn known(&self) -> Option<&Known> {
        self.known.as_ref()
    }

    /// How the run is now; nothing before it has begun.
    pub(crate) fn present(&self) -> Result<Option<&Known>, Reading> {
        if self.known.is_some() {
            self.progress.current(Instant::now())?;
        }
        Ok(self.known.as_ref())
    }

    /// The programs of the run are known from now on; its records are to be read.
    pub(crate) fn begin(&mut self, run: &Run) -> Source {
        self.known = Some(Known::nothing_of(run, false));
        run.follow()
    }

    pub(crate) fn note(&mut self, found: Result<Record, Trouble>) {
        if let Some(known) = &mut self.known {
            known.note(found);
        }
    }

    /// Nothing more will come.
    pub(crate) fn end(&mut self) {
        if let Some(known) = &mut self.known {
            known.ended = true;
        }
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
            changes: Changes::default(),
            protected: vec![Protected::default(); run.cluster().controllers().len()],
            foresight: Foresight::default(),
            ended,
        }
    }

    /// All that a journal holds up to a cycle.
    pub(crate) fn of_journal(run: &Run, until: i64) -> Self {
        let mut known = Self::nothing_of(run, run.is_finished());
        let mut source = run.follow();
        while source.poll(&mut |found| known.note(found)) > 0 {
            let past = known.run.cycle().is_some_and(|newest| newest > until);
            if past && known.run.has_origin() {
                break;
            }
        }
        known
    }

    fn note(&mut self, found: Result<Record, Trouble>) {
        let record = match found {
            Ok(record) => record,
            Err(trouble) => {
                self.run.trouble(&trouble);
                return;
            }
        };
        let had_origin = self.run.has_origin();
        self.run.note(&record);
        if self.run.has_origin() && !had_origin {
            self.changes.begin_anew();
        }
        let felt = self.run.cycle().map_or(i64::MIN, |cycle| cycle + 1);
        self.changes.note(&record, felt);
        let is_ordinary = matches!(
            record.event,
            Happening::Station(_)
                | Happening::Plant(_)
                | Happening::RemoteIo(
                    RemoteIoEvent::Sampled { .. } | RemoteIoEvent::Applied { .. }
                )
        );
        if !is_ordinary {
            self.note_protection();
        }
    }

    /// What a remote I/O reports of its deadline is so in the cycle of that deadline.
    fn note_protection(&mut self) {
        let cycle = self.run.cycle().unwrap_or(i64::MIN);
        for (program, known) in (0..).map(ProgramId).zip(&mut self.protected) {
            let protection = self.run.protection(program);
            let lost = self.run.lost_state(program);
            if (known.protection.as_ref(), known.lost.as_ref()) != (protection, lost) {
                *known = Protected {
                    protection: protection.cloned(),
                    lost: lost.cloned(),
                };
                self.changes.protection(program, known.clone(), cycle);
            }
        }
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.ended || self.run.is_finished()
    }

    pub(crate) fn programs(&self) -> impl Iterator<Item = ProgramId> + use<> {
        (0..self.run.cluster().controllers().len()).map(|index| ProgramId(index as u8))
    }

    pub(crate) fn stations(&self) -> impl Iterator<Item = StationId> + use<> {
        (0..self.run.cluster().agreement().schedule.stations()).map(|rank| StationId(rank as u8))
    }

    /// The newest cycle whose deadline every remote I/O that lives has told of.
    pub(crate) fn newest(&self) -> Option<i64> {
        let newest = self.run.cycle()?;
        let told = self.programs().filter_map(|program| {
            let steps = self.run.history(program)?.steps().iter().rev();
            let mut driven = steps.filter(|step| step.driven.is_some());
            driven.next().map(|step| step.cycle)
        });
        Some(told.min().unwrap_or(newest).max(newest - LAG_CYCLES))
    }

    /// The oldest cycle that is remembered; cycles before the origin are not shown.
    pub(crate) fn oldest(&self) -> Option<i64> {
        let oldest = self.programs().filter_map(|program| {
            let steps = self.run.history(program)?.steps();
            Some(steps.front()?.cycle)
        });
        Some(oldest.max()?.max(0))
    }

    pub(crate) fn margin(&self, cycle: i64, excluded: &[StationSet]) -> std::sync::Arc<Margin> {
        self.foresight.margin(self, cycle, excluded)
    }
}
