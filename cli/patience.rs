//! Time limit and progress messages of a command.

use std::cell::{Cell, RefCell};
use std::fmt::Display;
use std::time::{Duration, Instant};

use understudy_verification::Work;

use crate::console::Console;

/// Interval of the progress messages.
const BETWEEN: Duration = Duration::from_secs(3);

/// Time limit of a command.
pub(crate) struct Patience<'c> {
    begin: Instant,
    told: Cell<Instant>,
    budget: Option<Duration>,
    about: RefCell<String>,
    console: RefCell<&'c mut Console>,
}

impl<'c> Patience<'c> {
    /// Starts now and ends after `budget`, if given.
    pub(crate) fn new(budget: Option<Duration>, console: &'c mut Console) -> Self {
        let now = Instant::now();
        Self {
            begin: now,
            told: Cell::new(now),
            budget,
            about: RefCell::default(),
            console: RefCell::new(console),
        }
    }

    /// Sets the subject of the progress messages.
    pub(crate) fn turn_to(&self, about: String) {
        self.about.replace(about);
    }

    /// Whether time is left; prints the progress on the subject every few seconds.
    pub(crate) fn goes_on(&self, work: Work) -> bool {
        self.goes_on_with(format_args!("{}, {work}", self.about.borrow()))
    }

    /// The same with all words of the progress.
    pub(crate) fn goes_on_with(&self, progress: impl Display) -> bool {
        let now = Instant::now();
        if now - self.told.get() >= BETWEEN {
            self.told.set(now);
            let line = format!("{} s: {progress}", self.seconds());
            self.console.borrow_mut().note(&line);
        }
        self.budget.is_none_or(|budget| now - self.begin < budget)
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
