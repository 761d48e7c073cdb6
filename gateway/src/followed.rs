//! A run that is followed: a thread reads its journal while it is written, and whoever asks gets what is newest.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use understudy_cluster::Cluster;
use understudy_view::{Bounds, Event, Holders, Margin, Model, Run, Snapshot, Source};
use understudy_wire::ProgramId;

use crate::error::GatewayError;
use crate::metrics::Metrics;

/// Between two looks at a journal that says nothing new.
const LOOK: Duration = Duration::from_millis(40);

/// Between two snapshots, however much is new.
const SHOW: Duration = Duration::from_millis(100);

/// Gateways show what is the case; what was is for the views.
pub const BOUNDS: Bounds = Bounds {
    cycles: 64,
    events: 1000,
    changes: 64,
    timings: 600,
};

/// What is newest of a run.
#[derive(Debug)]
pub struct Followed {
    cluster: Arc<Cluster>,
    metrics: Arc<Metrics>,
    newest: Arc<RwLock<Newest>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What is the case, and how fresh that is.
#[derive(Debug, Clone)]
pub struct Observation {
    /// All that a view shows.
    pub snapshot: Arc<Snapshot>,
    /// By program: x(i) at its last sample, element 1 first; nothing where the journal does not tell it.
    pub states: Vec<Option<Vec<bool>>>,
    /// When the last record was read.
    pub heard: Instant,
}

impl Observation {
    /// Of what `model` knows, which read its last record at `heard`.
    pub fn new(model: &Model, snapshot: Snapshot, heard: Instant) -> Self {
        let programs = 0..snapshot.programs.len();
        let state = |program: usize| {
            let program = ProgramId(u8::try_from(program).ok()?);
            let mut steps = model.history(program)?.steps().iter().rev();
            let sampled = steps.find_map(|step| step.sampled.as_ref())?;
            Some(sampled.state.bits().collect())
        };
        Self {
            states: programs.map(state).collect(),
            snapshot: Arc::new(snapshot),
            heard,
        }
    }
}

#[derive(Debug)]
struct Newest {
    observation: Arc<Observation>,
    /// Newer ones than were asked for the last time, and the number of the newest.
    events: Vec<Event>,
}

impl Followed {
    /// Begins to follow `run` from its first record.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn new(run: &Run) -> Result<Self, GatewayError> {
        let metrics = Arc::new(Metrics::new(run.cluster()));
        let model = run.model(BOUNDS);
        let heard = Instant::now();
        let newest = Arc::new(RwLock::new(Newest {
            observation: Arc::new(Observation::new(&model, model.snapshot(), heard)),
            events: Vec::new(),
        }));
        let ends = Arc::new(AtomicBool::new(false));
        let mut reader = Reader {
            source: run.follow(),
            run: run.clone(),
            model,
            margin: None,
            heard,
            metrics: Arc::clone(&metrics),
            newest: Arc::clone(&newest),
            said_events: 0,
        };
        let ended = Arc::clone(&ends);
        let thread = Builder::new()
            .name("gateway-journal".into())
            .spawn(move || reader.run(&ended))
            .map_err(|source| GatewayError::System {
                what: "a thread to read the journal with",
                source,
            })?;
        Ok(Self {
            cluster: Arc::clone(run.cluster()),
            metrics,
            newest,
            ends,
            thread: Some(thread),
        })
    }

    /// What the run is of.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// Everything that was counted.
    pub fn metrics(&self) -> &Arc<Metrics> {
        &self.metrics
    }

    /// What is the case.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        Arc::clone(&self.observation().snapshot)
    }

    /// The same with the states of programs, and with how fresh it is.
    pub fn observation(&self) -> Arc<Observation> {
        let newest = self.newest.read().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(&newest.observation)
    }

    /// Events since the last time that somebody asked, a thousand at most; the oldest go first.
    pub fn take_events(&self) -> Vec<Event> {
        let mut newest = self.newest.write().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut newest.events)
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
    source: Source,
    run: Run,
    model: Model,
    /// Of the same holders it is the same.
    margin: Option<(Holders, Margin)>,
    heard: Instant,
    metrics: Arc<Metrics>,
    newest: Arc<RwLock<Newest>>,
    said_events: u64,
}

impl Reader {
    fn run(&mut self, ends: &AtomicBool) {
        let mut shown = Instant::now();
        let mut unshown = true;
        while !ends.load(Ordering::Relaxed) {
            let is_finished = !self.model.is_finished() && self.run.is_finished();
            let (model, metrics) = (&mut self.model, &self.metrics);
            let taken = self.source.poll(&mut |found| match found {
                Ok(record) => {
                    metrics.note(&record);
                    model.note(&record);
                }
                Err(trouble) => model.trouble(&trouble),
            });
            self.metrics.times(&self.model);
            if taken > 0 {
                self.heard = Instant::now();
                unshown = true;
            } else if is_finished {
                // Its results lie beside the journal, which was read to its end since.
                self.model.end();
                unshown = true;
            }
            // A long journal is read through before it is shown often.
            if unshown && (taken == 0 || shown.elapsed() >= SHOW) {
                self.show();
                shown = Instant::now();
                unshown = false;
            }
            if taken == 0 {
                std::thread::sleep(LOOK);
            }
        }
    }

    fn show(&mut self) {
        let holders = self.model.holders();
        let known = self.margin.take().filter(|(of, _)| *of == holders);
        let (holders, margin) = known.unwrap_or_else(|| {
            let margin = holders.margin();
            (holders, margin)
        });
        let snapshot = self.model.snapshot_with(&margin);
        self.margin = Some((holders, margin));
        self.metrics.state(&snapshot);
        let observation = Arc::new(Observation::new(&self.model, snapshot, self.heard));
        let said = self.said_events;
        let fresh: Vec<Event> = self
            .model
            .events()
            .filter(|event| event.number > said)
            .cloned()
            .collect();
        self.said_events = fresh.last().map_or(said, |event| event.number);
        let mut newest = self.newest.write().unwrap_or_else(PoisonError::into_inner);
        newest.observation = observation;
        newest.events.extend(fresh);
        let over = newest.events.len().saturating_sub(BOUNDS.events);
        newest.events.drain(..over);
    }
}
