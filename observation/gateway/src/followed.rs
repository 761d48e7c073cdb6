//! A followed run: a thread reads its journal while it is written, and callers get the present state. Until its end is reached there is none:
//! every question is answered by [`Reading`]. A long journal is begun near its end; while its past is read, what depends on it is not
//! told: alarms, events and the counters of the metrics.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use understudy_cluster::Cluster;
use understudy_journal::PointsInEffect;
use understudy_view::{Alarm, Bounds, Event, Following, Model, Progress, Reading, Run, Snapshot};
use understudy_wire::{Image, ProgramId};

use crate::error::GatewayError;
use crate::metrics::Metrics;

/// Time between two polls of a journal that has nothing new.
const LOOK: Duration = Duration::from_millis(40);

/// Time between two snapshots, at least.
const SHOW: Duration = Duration::from_millis(100);

/// Gateways show the present; the past is for the views.
pub const BOUNDS: Bounds = Bounds { cycles: 64, events: 1000, changes: 64, timings: 600 };

/// The newest state of a run.
#[derive(Debug)]
pub struct Followed {
    cluster: Arc<Cluster>,
    metrics: Arc<Metrics>,
    newest: Arc<RwLock<Newest>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The present state of a run, and its age.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The snapshot that every view shows.
    pub snapshot: Arc<Snapshot>,
    /// By program: x(i) at its last sample, as stations hold it; nothing where the journal does not contain it, and where an online change has replaced the
    /// program with which the run began.
    pub states: Vec<Option<Image>>,
    /// The newest events, oldest first.
    pub recent: Vec<Event>,
    /// The alarms that are open, and the newest of the others, in the order of their numbers.
    pub alarms: Vec<Alarm>,
    /// How much of the journal is read while its past is not, in percent: alarms and events of then are not known.
    pub past_percent: Option<u8>,
    /// The time at which the newest record was written.
    pub heard: Instant,
    /// The time at which the newest cycle was recorded; for a cycle that was in the journal when the reader started, that of the newest record then.
    pub advanced: Instant,
}

/// Events in [`Observation::recent`].
const RECENT: usize = 20;

/// Newest alarms in [`Observation::alarms`].
const RECENT_ALARMS: usize = 200;

impl Observation {
    /// The observation of a model whose newest record was written at `heard`.
    pub fn new(model: &Model, snapshot: Snapshot, heard: Instant) -> Self {
        let programs = 0..snapshot.programs.len();
        let until = snapshot.cycle.unwrap_or(i64::MAX);
        let state = |program: usize| {
            let program = ProgramId(u8::try_from(program).ok()?);
            let steps = model.history(program)?.steps().iter().rev();
            let mut steps = steps.filter(|step| step.cycle <= until);
            let sampled = steps.find_map(|step| step.sampled.as_ref())?;
            let first = model.cluster().controllers().get(program.index())?.hash;
            (sampled.program == first).then(|| sampled.state.clone())
        };
        let mut recent: Vec<Event> = model.events().rev().take(RECENT).cloned().collect();
        recent.reverse();
        Self {
            states: programs.map(state).collect(),
            alarms: alarms(model, until),
            snapshot: Arc::new(snapshot),
            recent,
            past_percent: None,
            heard,
            advanced: heard,
        }
    }
}

/// The alarms that are open in a cycle, and the newest of the others.
pub(crate) fn alarms(model: &Model, cycle: i64) -> Vec<Alarm> {
    let newest = model.alarms_at(cycle).rev().enumerate();
    let kept = newest.filter(|(place, alarm)| *place < RECENT_ALARMS || alarm.is_open());
    let mut kept: Vec<Alarm> = kept.map(|(_, alarm)| alarm).collect();
    kept.reverse();
    kept
}

#[derive(Debug)]
struct Newest {
    observation: Arc<Observation>,
    /// Events since they were taken last.
    events: Vec<Event>,
    /// Progress of the reader when it made the observation.
    progress: Progress,
}

impl Newest {
    /// The present state, unless it is not known yet.
    fn current(newest: &RwLock<Self>) -> Result<RwLockReadGuard<'_, Self>, Reading> {
        let newest = newest.read().unwrap_or_else(PoisonError::into_inner);
        newest.progress.current(Instant::now())?;
        Ok(newest)
    }
}

impl Followed {
    /// Starts to follow `run`.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn new(run: &Run) -> Result<Self, GatewayError> {
        let metrics = Arc::new(Metrics::new(run.cluster()));
        let (model, following) = Following::of(run, BOUNDS);
        let heard = Instant::now();
        let newest = Arc::new(RwLock::new(Newest {
            observation: Arc::new(Observation::new(&model, model.snapshot(), heard)),
            events: Vec::new(),
            progress: Progress::default(),
        }));
        let ends = Arc::new(AtomicBool::new(false));
        let mut reader = Reader {
            following,
            run: run.clone(),
            model,
            metrics: Arc::clone(&metrics),
            newest: Arc::clone(&newest),
            present_since_ns: None,
            passed_on: None,
            newest_cycle: None,
        };
        let ended = Arc::clone(&ends);
        let thread = Builder::new()
            .name("gateway-journal".into())
            .spawn(move || reader.run(&ended))
            .map_err(|source| GatewayError::System {
                what: "a thread to read the journal with",
                source,
            })?;
        Ok(Self { cluster: Arc::clone(run.cluster()), metrics, newest, ends, thread: Some(thread) })
    }

    /// The cluster of the run.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// The metrics in the OpenMetrics text format.
    pub fn exposition(&self) -> impl Fn() -> Result<String, Reading> + Clone + use<> {
        let (metrics, newest) = (Arc::clone(&self.metrics), Arc::clone(&self.newest));
        move || {
            {
                let newest = Newest::current(&newest)?;
                if let Some(percent) = newest.observation.past_percent {
                    return Err(Reading { percent });
                }
                let now = Instant::now();
                metrics.dated(&newest.observation, newest.progress.age(now), now);
            }
            Ok(metrics.exposition())
        }
    }

    /// The points that count, as they are shown.
    pub(crate) fn naming(&self) -> Naming {
        Naming(Arc::clone(&self.newest))
    }

    /// The present snapshot.
    ///
    /// # Errors
    /// [`Reading`].
    pub fn snapshot(&self) -> Result<Arc<Snapshot>, Reading> {
        Ok(Arc::clone(&self.observation()?.snapshot))
    }

    /// The present snapshot with the states of programs and its age.
    ///
    /// # Errors
    /// [`Reading`].
    pub fn observation(&self) -> Result<Arc<Observation>, Reading> {
        Ok(Arc::clone(&Newest::current(&self.newest)?.observation))
    }

    /// Events since the last call, a thousand at most; the oldest are dropped first. Events that were in the journal when the present was
    /// first known are not among them.
    pub fn take_events(&self) -> Vec<Event> {
        let mut newest = self.newest.write().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut newest.events)
    }
}

/// The points that count in a followed run.
#[derive(Debug)]
pub(crate) struct Naming(Arc<RwLock<Newest>>);

impl Naming {
    /// Those of the newest snapshot.
    pub(crate) fn points(&self) -> PointsInEffect {
        let newest = self.0.read().unwrap_or_else(PoisonError::into_inner);
        newest.observation.snapshot.points.clone()
    }
}

impl Drop for Followed {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Reader {
    following: Following,
    run: Run,
    model: Model,
    metrics: Arc<Metrics>,
    newest: Arc<RwLock<Newest>>,
    /// The time of the newest record when the present was first known.
    present_since_ns: Option<u64>,
    /// Number of the newest event that was passed on; nothing before the present is known and the past is read.
    passed_on: Option<u64>,
    /// The newest cycle that was shown, and when it was recorded.
    newest_cycle: Option<(i64, Instant)>,
}

impl Reader {
    fn run(&mut self, ends: &AtomicBool) {
        let mut shown = Instant::now();
        let mut unshown = true;
        while !ends.load(Ordering::Relaxed) {
            let is_finished = !self.model.is_finished() && self.run.is_finished();
            let model = &mut self.model;
            let taken = self.following.poll(&mut |found| model.take_found(found));
            let had_past = self.following.past_percent().is_some();
            if let Some(whole) = self.following.read_past() {
                let has_ended = self.model.is_finished();
                self.model = whole;
                if has_ended {
                    self.model.end(self.run.has_results());
                }
                unshown = true;
            }
            self.metrics.times(self.following.past().unwrap_or(&self.model));
            unshown |= taken > 0;
            if taken == 0 && is_finished {
                // Its results were there before the journal was read to its end.
                self.model.end(self.run.has_results());
                unshown = true;
            }
            let ended = self.model.is_finished();
            let progress = self.following.progress().of_ended(ended);
            // The end of the journal is shown before it counts as the present.
            if unshown && (progress.is_at_end() || shown.elapsed() >= SHOW) {
                self.show(progress);
                shown = Instant::now();
                unshown = false;
            } else {
                self.newest_mut().progress = progress;
            }
            if taken == 0 && !had_past {
                std::thread::sleep(LOOK);
            }
        }
    }

    fn newest_mut(&self) -> RwLockWriteGuard<'_, Newest> {
        self.newest.write().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&mut self, progress: Progress) {
        let snapshot = self.model.snapshot();
        let past_percent = self.following.past_percent();
        if past_percent.is_none() {
            self.metrics.show(&self.model, &snapshot);
        }
        let now = Instant::now();
        let heard = progress.age(now).and_then(|age| now.checked_sub(age));
        let heard = heard.unwrap_or(now);
        let cycle = snapshot.cycle;
        let mut observation = Observation::new(&self.model, snapshot, heard);
        let shown = self.newest_cycle.filter(|(shown, _)| Some(*shown) == cycle);
        self.newest_cycle = shown.or(cycle.map(|cycle| (cycle, heard)));
        observation.advanced = self.newest_cycle.map_or(heard, |(_, at)| at);
        observation.past_percent = past_percent;
        if self.present_since_ns.is_none() && progress.is_at_end() {
            self.present_since_ns = Some(self.model.at_ns());
        }
        let fresh = self.fresh_events(past_percent.is_some());
        let mut newest = self.newest_mut();
        newest.observation = Arc::new(observation);
        newest.progress = progress;
        newest.events.extend(fresh);
        let over = newest.events.len().saturating_sub(BOUNDS.events);
        newest.events.drain(..over);
    }

    /// The events that were not passed on, from the present on. Their numbers are known when the past is.
    fn fresh_events(&mut self, reads_past: bool) -> Vec<Event> {
        let Some(since_ns) = self.present_since_ns.filter(|_| !reads_past) else {
            return Vec::new();
        };
        let count = self.model.event_count();
        let passed_on = self.passed_on.replace(count).unwrap_or_else(|| {
            let mut before = self.model.events().rev();
            let before = before.find(|event| event.at_ns <= since_ns);
            before.map_or(0, |event| event.number)
        });
        let events = self.model.events().filter(|event| event.number > passed_on);
        events.cloned().collect()
    }
}
