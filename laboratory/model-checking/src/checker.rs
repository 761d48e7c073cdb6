//! Trying everything, and what came of it.

use stateright::{Checker, Model as _};
use understudy_simulator::Fault;

use crate::properties::{ALL, Promise};
use crate::step::Step;
use crate::world::Model;

/// What came of trying everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Different states that were reached.
    pub states: usize,
    /// Steps of the longest run.
    pub depth: usize,
    /// One for each property that does not hold, by name.
    pub counterexamples: Vec<Counterexample>,
}

/// How a property is broken.
#[derive(Debug, Clone, PartialEq)]
pub struct Counterexample {
    /// Which.
    pub property: &'static str,
    /// What it promises of a run of these faults.
    pub promise: Promise,
    /// Cycles of that run.
    pub cycles: u64,
    /// What is done; all steps but waiting.
    pub steps: Vec<Step>,
    /// The same, for the simulator.
    pub faults: Vec<Fault>,
}

/// Tries every run within the budget of `model`, on `threads` threads.
pub fn check(model: Model, threads: usize) -> Verdict {
    let checker = model.checker().threads(threads).spawn_dfs().join();
    let mut counterexamples: Vec<Counterexample> = checker
        .discoveries()
        .into_iter()
        .map(|(property, path)| {
            let path = path.into_actions();
            let faults = checker.model().faults(&path);
            let steps = path.into_iter().filter(|&step| step != Step::Wait).collect();
            let named = ALL.iter().find(|known| known.name == property);
            Counterexample {
                property,
                promise: named.map_or(Promise::NothingWrong, |known| known.promise),
                cycles: checker.model().cycles(),
                steps,
                faults,
            }
        })
        .collect();
    counterexamples.sort_by_key(|example| example.property);
    Verdict { states: checker.unique_state_count(), depth: checker.max_depth(), counterexamples }
}
