//! A run that lies in a directory, or is written there now.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use understudy_cluster::Cluster;
use understudy_journal::{
    Commander, Happening, JournalError, PointsInEffect, Present, Record, RunEvent, TimesOfDay,
    Writing, check_journal, continuation_before, kept_cluster, open_file, place_before,
    segments_of, writing,
};
use understudy_node::STATES_EVERY;
use understudy_wire::{Cycle, Epoch, Moment};

use crate::error::ViewError;
use crate::listing::{Filter, Listing};
use crate::model::{Bounds, Model};
use crate::source::{Source, Trouble};
use crate::why::Why;

const JOURNAL: &str = "journal.jsonl";

/// A run: its journal, and the cluster that it ran.
#[derive(Debug, Clone)]
pub struct Run {
    path: PathBuf,
    cluster: Arc<Cluster>,
}

/// The directory of a run that a person names: itself, the newest of a directory of runs, or the folder of a journal.
///
/// # Errors
/// [`ViewError::NoRun`].
pub fn find_run(path: &Path) -> Result<PathBuf, ViewError> {
    let has_journal =
        |folder: &Path| segments_of(&folder.join(JOURNAL)).is_ok_and(|files| !files.is_empty());
    let is_run = |folder: &Path| has_journal(folder) || folder.join("cluster").is_dir();
    if path.is_dir() {
        if is_run(path) {
            return Ok(path.to_owned());
        }
        let latest = path.join("latest");
        if is_run(&latest) {
            return Ok(latest);
        }
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    if path.is_file()
        && path.extension().is_some_and(|extension| extension == "jsonl" || extension == "packed")
    {
        return Ok(folder.to_owned());
    }
    let replica = path.join("replica-1");
    let hint = if replica.is_dir() {
        format!(": each replica is one, such as {}", replica.display())
    } else if !path.exists() {
        ": there is nothing; `understudy demo` and `lab` leave runs below runs/".to_owned()
    } else {
        ": it has no journal.jsonl".to_owned()
    };
    Err(ViewError::NoRun { path: path.to_owned(), hint })
}

/// The newest run of a cluster below a directory of runs: of one with the same configuration, or at least the same name.
///
/// # Errors
/// [`ViewError::NoRun`] where none of the newest `LOOKED_AT` is.
pub fn find_run_of(runs: &Path, cluster: &Cluster) -> Result<Run, ViewError> {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(runs)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.is_dir() && !path.is_symlink())
        .collect();
    // Their names are times.
    folders.sort();
    let newest = folders.iter().rev().take(LOOKED_AT);
    let opened: Vec<Run> = newest.filter_map(|folder| Run::open(folder).ok()).collect();
    let configuration = |cluster: &Cluster| cluster.agreement().configuration;
    let same = |run: &&Run| configuration(&run.cluster) == configuration(cluster);
    let namesake = |run: &&Run| run.cluster.name() == cluster.name();
    let found = opened.iter().find(same).or_else(|| opened.iter().find(namesake));
    found.cloned().ok_or_else(|| ViewError::NoRun {
        path: runs.to_owned(),
        hint: format!(": none of the newest there is one of `{}`", cluster.name()),
    })
}

/// The run of a cluster, with the same configuration, that a process writes now, where there is one below a directory of runs.
pub fn find_running(runs: &Path, cluster: &Cluster) -> Option<Run> {
    let configuration = cluster.agreement().configuration;
    running(runs).find(|run| run.cluster.agreement().configuration == configuration)
}

/// As [`find_running`], and where none has the same configuration, the newest of the same name: the command line may have changed its period.
pub fn find_running_of(runs: &Path, cluster: &Cluster) -> Option<Run> {
    let namesake = |run: &Run| run.cluster.name() == cluster.name();
    find_running(runs, cluster).or_else(|| running(runs).find(namesake))
}

/// The runs that a process writes now, the newest first.
fn running(runs: &Path) -> impl Iterator<Item = Run> {
    let folders = std::fs::read_dir(runs).into_iter().flatten().flatten();
    let mut written: Vec<PathBuf> = folders
        .map(|entry| entry.path())
        .filter(|path| !path.is_symlink() && writing(path) == Writing::Now)
        .collect();
    written.sort();
    let newest = written.into_iter().rev().take(LOOKED_AT);
    newest.filter_map(|path| Run::open(&path).ok())
}

/// Runs that are opened to find one of a cluster.
const LOOKED_AT: usize = 50;

impl Run {
    /// A run in a directory, finished or not.
    ///
    /// # Errors
    /// There is none, its journal has another version, or it does not contain its cluster.
    pub fn open(path: &Path) -> Result<Self, ViewError> {
        let path = find_run(path)?;
        let journal = path.join(JOURNAL);
        match check_journal(&journal) {
            Err(JournalError::Version(wrong)) => {
                return Err(ViewError::Version { path: journal, wrong });
            }
            Err(error @ JournalError::Line { .. }) => {
                return Err(ViewError::Journal { path: journal, reason: error.to_string() });
            }
            // A file that cannot be read is reported by its follower.
            Err(JournalError::Read(_)) | Ok(()) => {}
        }
        let cluster = Arc::new(kept_cluster(&path)?);
        Ok(Self { path, cluster })
    }

    /// Its directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it ran.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// The points that count after its newest record.
    pub fn points(&self) -> PointsInEffect {
        let mut present = Present::of(Arc::clone(&self.cluster));
        let begun = self.source_before(i64::MAX).map(|begun| begun.source);
        let mut source = begun.unwrap_or_else(|| self.follow());
        let mut take = |found: Result<Record, Trouble>| {
            let Ok(record) = found else {
                return;
            };
            match &record.event {
                Happening::Run(RunEvent::InEffect { record, .. }) => present.take(record),
                _ => present.take(&record),
            };
        };
        while source.poll(&mut take) > 0 {}
        present.points().clone()
    }

    /// Whether its journal is complete: its results are there, or its writer has ended.
    pub fn is_finished(&self) -> bool {
        self.has_results() || writing(&self.path) == Writing::Over
    }

    /// Whether its results are there. A run whose process was killed has none.
    pub fn has_results(&self) -> bool {
        self.path.join("summary.json").is_file()
    }

    /// Whether a process that lives writes it.
    pub fn is_written(&self) -> bool {
        writing(&self.path) == Writing::Now
    }

    /// Reaches the process that writes it.
    pub fn commander(&self) -> Commander {
        Commander::of_run(self.path.clone())
    }

    /// Its records, also those that are still to be written.
    pub fn follow(&self) -> Source {
        Source::following(&self.path.join(JOURNAL))
    }

    /// Its newest records, also those that are still to be written, in a long run: a model of them knows the present when it has taken some
    /// megabytes, and says from which cycle on it knows all. Nothing in a run that is not longer than that.
    pub fn follow_newest(&self) -> Option<Source> {
        self.follow_segment(i64::MAX, NEWEST)
    }

    /// Its records from some seconds before a cycle on, so that the states of the programs are known in it; nothing where that is near the first
    /// record.
    pub fn follow_from(&self, cycle: i64) -> Option<Source> {
        self.follow_segment(cycle.saturating_sub(self.unknown_at_first()), 0)
    }

    fn follow_segment(&self, cycle: i64, newest: usize) -> Option<Source> {
        let journal = self.path.join(JOURNAL);
        let place = continuation_before(&journal, cycle, newest).ok()??;
        Source::following_from(&journal, place).ok()
    }

    /// A model that knows nothing yet of it but where its cycles are counted from.
    pub fn model(&self, bounds: Bounds) -> Model {
        let mut model = Model::new(Arc::clone(&self.cluster), bounds);
        if let Some(moment) = self.origin_of_summary() {
            model.origin_is(moment, 0);
        }
        model
    }

    /// A model of all that is in its journal now.
    ///
    /// # Errors
    /// [`ViewError::Journal`].
    pub fn read(&self, bounds: Bounds) -> Result<Model, ViewError> {
        self.read_until(bounds, i64::MAX)
    }

    /// A model of its journal up to a few cycles behind `cycle`: what is asked of this cycle can be answered with it, also where
    /// the run is longer than the bounds.
    ///
    /// # Errors
    /// [`ViewError::Journal`].
    pub fn read_until(&self, bounds: Bounds, cycle: i64) -> Result<Model, ViewError> {
        self.read_from(bounds, None, cycle)
    }

    /// A model of what its journal says of some cycles: their states are known, and nothing of what happened before them.
    ///
    /// # Errors
    /// [`ViewError::Journal`].
    pub fn read_between(&self, bounds: Bounds, from: i64, to: i64) -> Result<Model, ViewError> {
        let source = self.follow_from(from).unwrap_or_else(|| self.follow());
        self.read_source(self.model(bounds), source, to)
    }

    /// Why a signal had its value in a cycle, or has it in the newest one. It reads as much of the journal as the answer needs.
    ///
    /// # Errors
    /// [`ViewError`].
    pub fn why(&self, signal: &str, cycle: Option<i64>) -> Result<Why, ViewError> {
        let until = cycle.unwrap_or(i64::MAX);
        let bounds = Bounds::default();
        let remembered = i64::try_from(bounds.cycles).unwrap_or(i64::MAX);
        if let Some(newest) = self.source_before(until) {
            let of = cycle.unwrap_or(newest.cycle);
            for back in [NEAR, remembered] {
                let before = of.saturating_sub(back + self.unknown_at_first());
                let Some(begun) = self.source_before(before) else {
                    break;
                };
                let model = self.read_from(bounds, Some(begun), until)?;
                let why = model.why(signal, cycle);
                // A model of the whole run remembers no more cycles either.
                if why.is_ok() && (!model.wanted_more() || back >= remembered) {
                    return why;
                }
            }
        }
        let model = self.read_from(bounds, None, until)?;
        match model.why(signal, cycle) {
            // It was read up to this cycle only.
            Err(ViewError::NoCycle { cycle: absent, program, known }) => {
                let whole = self.read_from(bounds, None, i64::MAX)?;
                let why = whole.why(signal, cycle);
                match (why, known) {
                    (Err(ViewError::NoCycle { known: Some((_, to)), .. }), Some((from, _))) => {
                        let known = Some((from, to));
                        Err(ViewError::NoCycle { cycle: absent, program, known })
                    }
                    (why, _) => why,
                }
            }
            why => why,
        }
    }

    /// Cycles at the beginning of a reading in which the states of the programs may not be known yet.
    fn unknown_at_first(&self) -> i64 {
        let period = self.cluster.agreement().schedule.period();
        let cycles = 2 * STATES_EVERY.as_nanos() / period.as_nanos().max(1);
        i64::try_from(cycles).unwrap_or(i64::MAX / 2) + BEHIND
    }

    fn read_from(
        &self,
        bounds: Bounds,
        begun: Option<Begun>,
        cycle: i64,
    ) -> Result<Model, ViewError> {
        let mut model = self.model(bounds);
        let source = match begun {
            Some(begun) => {
                if let Some(moment) = begun.moment {
                    model.begins_at(moment, begun.cycle);
                    model.times_are(self.clocks_before(begun.cycle));
                }
                begun.source
            }
            None => self.follow(),
        };
        self.read_source(model, source, cycle)
    }

    /// Takes the records of a source up to a few cycles behind `cycle`.
    fn read_source(
        &self,
        mut model: Model,
        mut source: Source,
        cycle: i64,
    ) -> Result<Model, ViewError> {
        let mut any = false;
        let is_finished = self.is_finished();
        loop {
            let taken = source.poll(&mut |found| model.take_found(found));
            any |= taken > 0;
            let past = model.has_origin()
                && model.cycle().is_some_and(|newest| newest > cycle.saturating_add(BEHIND));
            if taken == 0 && is_finished {
                model.end(self.has_results());
            }
            if taken == 0 || past {
                break;
            }
        }
        match source.failure() {
            Some(Trouble::Read { path, reason }) if !any => {
                Err(ViewError::Journal { path, reason })
            }
            _ => Ok(model),
        }
    }

    /// Its journal as a list, with its records from a place on that is before all wanted ones. It counts cycles from the origin also before the
    /// record of it.
    ///
    /// # Errors
    /// Every name and word of the filter that does not exist.
    pub fn listing(&self, filter: Filter) -> Result<(Listing, Source), Vec<ViewError>> {
        let from = filter.from;
        let mut listing = Listing::new(&self.cluster, filter)?;
        // The state of an alarm depends on all that was before.
        if let Some(from) = from.filter(|_| self.cluster.alarms().is_empty())
            && let Some(found) = self.source_before(from - self.unknown_at_first())
        {
            if let Some(moment) = found.moment {
                listing.begins_at(moment, found.cycle);
                listing.times_are(self.clocks_before(found.cycle));
            }
            return Ok((listing, found.source));
        }
        if let Some(moment) = self.origin_of_summary() {
            listing.origin_is(moment, 0);
        }
        let mut source = self.follow();
        while !listing.has_origin() {
            let taken = source.poll(&mut |found| {
                if let Ok(record) = found {
                    listing.take(&record);
                }
            });
            if taken == 0 {
                break;
            }
        }
        Ok((listing.again(), self.follow()))
    }

    /// The wall clocks that were recorded at the beginning of the segment that a cycle is in.
    fn clocks_before(&self, cycle: i64) -> TimesOfDay {
        let mut times = TimesOfDay::new(self.cluster.agreement().schedule.period());
        let mut source = self.follow_segment(cycle, 0).unwrap_or_else(|| self.follow());
        source.poll(&mut |found| {
            if let Ok(record) = found {
                times.note_all(&record);
            }
        });
        times
    }

    /// The records from a checkpoint on that is not after `cycle`. Where programs have changed before it, from the beginning of its segment, which says how.
    fn source_before(&self, cycle: i64) -> Option<Begun> {
        let journal = self.path.join(JOURNAL);
        let found = place_before(&journal, cycle).ok().flatten()?;
        if found.is_changed {
            let source = self.follow_segment(found.cycle, 0)?;
            return Some(Begun { source, moment: None, cycle: found.cycle });
        }
        let source = Source::following_from(&journal, found.place).ok()?;
        Some(Begun { source, moment: Some(found.moment), cycle: found.cycle })
    }

    /// The origin of the summary, for journals whose own record of it is gone.
    fn origin_of_summary(&self) -> Option<Moment> {
        let summary = open_file(&self.path.join("summary.json")).ok()?;
        let summary: Value = serde_json::from_reader(std::io::BufReader::new(summary)).ok()?;
        let (epoch, cycle) = summary["origin"].as_str()?.split_once(':')?;
        Some(Moment { epoch: Epoch(epoch.parse().ok()?), cycle: Cycle(cycle.parse().ok()?) })
    }
}

/// Records of a run from a checkpoint on, or from before it.
struct Begun {
    source: Source,
    /// A moment of the checkpoint; nothing where the records say first how cycles are counted.
    moment: Option<Moment>,
    /// The cycle of the checkpoint.
    cycle: i64,
}

/// Most causes of a value are in so many cycles before it.
const NEAR: i64 = 1024;

/// Segments of the present: the one that is written has few records when it is new.
const NEWEST: usize = 1;

/// Lines of different members may be a few cycles apart.
const BEHIND: i64 = 64;
