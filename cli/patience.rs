//! Time limit and progress messages of a command.

use std::cell::{Cell, RefCell};
use std::fmt::{self, Display};
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::Serialize;
use understudy_verification::Work;

use crate::console::Console;

/// Interval of the progress messages.
const BETWEEN: Duration = Duration::from_secs(3);

/// Age of a command without a time limit at which its progress names the option.
const LONG: Duration = Duration::from_secs(20);

/// Time limit of a command.
pub(crate) struct Patience<'c> {
    begin: Instant,
    told: Cell<Instant>,
    budget: Option<Duration>,
    /// Whether the progress has named the option, or there is none.
    named: Cell<bool>,
    about: RefCell<String>,
    console: RefCell<&'c mut Console>,
    most: Cell<Most>,
}

/// The largest amounts of work so far.
#[derive(Debug, Clone, Copy, Default)]
struct Most {
    nodes: usize,
    states: usize,
    scans: u32,
}

/// What a command has used for its proofs.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(crate) struct Resources {
    /// Time since the start of the command, in seconds.
    seconds: f64,
    /// The most nodes that the decision diagrams had after a step, with those of no use that were not removed yet.
    nodes: usize,
    /// The most states that were listed one by one.
    states: usize,
    /// Length of the longest runs that were searched as clauses, in scans.
    scans: u32,
    /// The most memory that the process had at once, in bytes; null where the system does not tell.
    memory_bytes: Option<u64>,
}

impl Display for Resources {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, nodes, states, scans, memory_bytes } = self;
        write!(
            formatter,
            "{seconds:.3} s, {nodes} nodes of decision diagrams, {states} states listed, runs of {scans} scans, "
        )?;
        match memory_bytes {
            Some(bytes) => write!(formatter, "{:.1} MiB of memory", *bytes as f64 / 1_048_576.0),
            None => formatter.write_str("memory unknown"),
        }
    }
}

/// The most memory that this process had at once, where the system tells.
fn most_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

impl<'c> Patience<'c> {
    /// Starts now and ends after `budget`, if given.
    pub(crate) fn new(budget: Option<Duration>, console: &'c mut Console) -> Self {
        let now = Instant::now();
        Self {
            begin: now,
            told: Cell::new(now),
            budget,
            named: Cell::new(true),
            about: RefCell::default(),
            console: RefCell::new(console),
            most: Cell::default(),
        }
    }

    /// The same, of a command that has the option `--budget`: the progress names it once.
    pub(crate) fn naming_budget(self) -> Self {
        self.named.set(false);
        self
    }

    /// Sets the subject of the progress messages.
    pub(crate) fn turn_to(&self, about: String) {
        self.about.replace(about);
    }

    /// Whether time is left; prints the progress on the subject every few seconds.
    pub(crate) fn goes_on(&self, work: Work) -> bool {
        let mut most = self.most.get();
        match work {
            Work::Diagrams { nodes, .. } => most.nodes = most.nodes.max(nodes),
            Work::States(states) => most.states = most.states.max(states),
            Work::Scans(scans) => most.scans = most.scans.max(scans),
        }
        self.most.set(most);
        self.goes_on_with(format_args!("{}, {work}", self.about.borrow()))
    }

    /// The same with all words of the progress.
    pub(crate) fn goes_on_with(&self, progress: impl Display) -> bool {
        let now = Instant::now();
        if now - self.told.get() >= BETWEEN {
            self.told.set(now);
            let is_long = self.budget.is_none() && now - self.begin >= LONG;
            let line = match is_long && !self.named.replace(true) {
                true => format!("{} s: {progress}; --budget 5min would end it", self.seconds()),
                false => format!("{} s: {progress}", self.seconds()),
            };
            self.console.borrow_mut().note(&line);
        }
        self.budget.is_none_or(|budget| now - self.begin < budget)
    }

    /// What was used so far.
    pub(crate) fn resources(&self) -> Resources {
        let Most { nodes, states, scans } = self.most.get();
        let seconds = self.begin.elapsed().as_secs_f64();
        Resources { seconds, nodes, states, scans, memory_bytes: most_memory() }
    }

    /// Whole seconds since the start.
    pub(crate) fn seconds(&self) -> u64 {
        self.begin.elapsed().as_secs()
    }

    /// Whether the time limit has passed.
    pub(crate) fn is_over(&self) -> bool {
        self.budget.is_some_and(|budget| self.begin.elapsed() >= budget)
    }
}
