//! CTL with fairness on a circuit, by sets of states as decision diagrams.
//!
//! A state is (x, u): the registers before a scan and the inputs in it; outputs are h(x, u), and the scan leads to every (f(x, u), u').
//! So a set S is entered in one step from
//!
//! ```text
//! EX S = { (x, u) : there is u' with (f(x, u), u') in S }
//! ```
//!
//! which is a quantification and a substitution; no relation between old and new bits is ever built. Only what a property depends on is
//! looked at: its signals, the registers in their functions, and so on; the rest of the program cannot change its truth.

mod check;
mod core;
mod jumps;
mod model;
mod trace;

use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;

use crate::effort::{ALWAYS, GoOn, Stopped};
use crate::property::{Formula, Named};

pub(crate) use self::core::Core;
pub(crate) use model::Cone;
pub(crate) use trace::rows;
pub use trace::{ScanRow, Trace};

/// Nodes for each register of functions that are usual.
const USUAL: usize = 200;

/// Nodes of functions that are small however few registers they are of, and of those that are large however many.
const SMALL_FUNCTIONS: usize = 1 << 15;
const LARGE_FUNCTIONS: usize = 1 << 17;

/// A property whose signals are known to be those of a circuit, by their number in it.
pub type Resolved = Formula<Signal>;

/// A signal of a circuit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Signal {
    /// An output, by its index.
    Output(usize),
    /// An input, by its index.
    Input(usize),
}

/// The formula over the signals of `circuit`; an output goes before an input of the same name.
///
/// # Errors
/// The names in it that are no signals of the circuit.
pub fn resolve<'f>(
    formula: &'f Formula<Named>,
    circuit: &Circuit,
) -> Result<Resolved, Vec<&'f Named>> {
    let resolved = formula.map(&|named: &Named| signal(&named.to_string(), circuit));
    resolved.ok_or_else(|| {
        let names = formula.signals().into_iter();
        names.filter(|named| signal(&named.to_string(), circuit).is_none()).collect()
    })
}

fn signal(name: &str, circuit: &Circuit) -> Option<Signal> {
    let output = circuit.outputs().iter().position(|output| output.name == name);
    let input = || circuit.inputs().iter().position(|input| input == name);
    output.map(Signal::Output).or_else(|| input().map(Signal::Input))
}

/// What came of one property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It holds; the scans show how, where scans can show it (that something can be reached).
    Holds(Option<Trace>),
    /// It does not hold; the scans show why, where scans can show it.
    Fails(Option<Trace>),
}

/// Whether the functions of the registers that `properties` depend on are small diagrams in the order of the circuit. Where they are large, sets of
/// states are larger, and looking for a better order takes seconds.
pub(crate) fn has_small_functions<'f>(
    circuit: &Circuit,
    properties: impl IntoIterator<Item = &'f Resolved>,
    go_on: GoOn<'_>,
) -> bool {
    let cone = Cone::of(circuit, properties);
    let nodes = (USUAL * cone.registers().count()).clamp(SMALL_FUNCTIONS, LARGE_FUNCTIONS);
    let diagrams = |order| Diagrams::new(order, nodes);
    model::Model::new(circuit, cone, &[], diagrams, None, go_on).is_ok()
}

/// When the order of variables changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Fixed,
    Early,
    ByNeed,
}

/// Decides properties of one circuit.
pub struct Checker<'c> {
    circuit: &'c Circuit,
    fair: Vec<Resolved>,
    nodes: usize,
    go_on: GoOn<'c>,
    order: Order,
    single: Option<usize>,
    /// That of the last property, for the next one that depends on the same part of the circuit.
    model: Option<model::Model<'c>>,
    /// The part of the circuit that was too large, and why: it is not tried again.
    too_large: Option<(Cone, Stopped)>,
}

impl Signal {
    /// Its name in `circuit`.
    pub fn name(self, circuit: &Circuit) -> &str {
        match self {
            Self::Output(output) => &circuit.outputs()[output].name,
            Self::Input(input) => &circuit.inputs()[input],
        }
    }
}

impl<'c> Checker<'c> {
    /// Over the runs in which each of `fair` comes again and again (all runs where there is none), with at most `nodes` nodes alive.
    pub fn new(circuit: &'c Circuit, fair: Vec<Resolved>, nodes: usize) -> Self {
        Self {
            circuit,
            fair,
            nodes,
            go_on: ALWAYS,
            order: Order::ByNeed,
            single: None,
            model: None,
            too_large: None,
        }
    }

    /// The same, as long as `go_on` says so.
    #[must_use]
    pub fn while_wanted(self, go_on: GoOn<'c>) -> Self {
        Self { go_on, ..self }
    }

    /// The same, in the order of the circuit: what needs another one is soon too large.
    #[must_use]
    pub fn in_fixed_order(self) -> Self {
        Self { order: Order::Fixed, ..self }
    }

    /// The same, but the order is changed as soon as diagrams have some thousand nodes: the times of timers that begin each other need another order
    /// than that of the program.
    #[must_use]
    pub fn reordered_early(self) -> Self {
        Self { order: Order::Early, ..self }
    }

    /// The same, but after this number of steps a search goes through many scans at once where only timers count. Verdicts are the same; runs
    /// that show them are as short as can be as long as they have no more scans.
    #[must_use]
    pub fn with_single_scans(self, single: usize) -> Self {
        Self { single: Some(single), ..self }
    }

    /// Whether every first scan satisfies `property`: the registers as they start, the inputs any.
    ///
    /// # Errors
    /// The diagrams need more nodes than allowed, or the caller stopped the proof.
    pub fn check(&mut self, property: &Resolved) -> Result<Verdict, Stopped> {
        let cone = model::Cone::of(self.circuit, self.fair.iter().chain([property]));
        if let Some((_, error)) = self.too_large.as_ref().filter(|(large, _)| {
            // More signals make it no smaller.
            large.variables.is_subset(&cone.variables)
        }) {
            return Err(*error);
        }
        let known = self.model.take();
        let known = known.filter(|model| model.cone.variables == cone.variables);
        let mut model = match known {
            Some(model) => model,
            // What other properties need is dropped: the bound is on what is alive at once.
            None => self.model_of(&cone).inspect_err(|&error| {
                self.too_large = Some((cone.clone(), error));
            })?,
        };
        model.show(cone)?;
        let verdict = check::check(&model, property);
        self.model = Some(model);
        verdict
    }

    fn model_of(&self, cone: &Cone) -> Result<model::Model<'c>, Stopped> {
        let (nodes, changes) = (self.nodes, self.order);
        let diagrams = |order| {
            let diagrams = Diagrams::new(order, nodes);
            match changes {
                Order::Fixed => diagrams,
                Order::Early => diagrams.reordered_early(),
                Order::ByNeed => diagrams.reordered_by_need(),
            }
        };
        let (cone, fair) = (cone.clone(), &self.fair);
        model::Model::new(self.circuit, cone, fair, diagrams, self.single, self.go_on)
    }
}
