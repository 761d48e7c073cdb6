//! Proofs of the properties of a ladder program, requested and standard.

mod conclusion;
mod part;
mod questions;
mod remarks;
mod sampled;
mod search;
mod stages;
mod unasked;

use std::cell::OnceCell;
use std::time::Duration;

use understudy_ladder::{Block, Comparison, LowerError, MAXIMUM_PRESET_VALUE, Program};
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;

use crate::assumed::{assuming, with_assumptions};
use crate::effort::{ALWAYS, GoOn};
use crate::explicit::Explicit;
use crate::induction::reduced;
use crate::property::{Asked, Formula, Named, Path, Property};
use crate::symbolic::{Resolved, Signal, Trace, resolve};

pub use conclusion::Conclusion;
pub use remarks::{Remark, Remarks};
pub(crate) use sampled::words;
use stages::Stages;
pub use stages::Undecided;
pub use unasked::{Lamp, OutputFinding};

/// Bounds of a proof.
#[derive(Clone, Copy)]
pub struct Bounds<'a> {
    /// Nodes of decision diagrams alive at once.
    pub nodes: usize,
    /// States, each with inputs, that are listed where diagrams grow large; four bytes each.
    pub states: usize,
    /// Scans of induction.
    pub scans: u32,
    /// Whether anybody still waits.
    pub go_on: GoOn<'a>,
}

impl Default for Bounds<'_> {
    fn default() -> Self {
        Self { nodes: Diagrams::DEFAULT_LIMIT, states: 1 << 26, scans: 20, go_on: ALWAYS }
    }
}

/// The count that a property compares, and the comparison as it is written.
fn compared_count(program: &Program, named: &Named) -> Option<(String, Comparison)> {
    let compared = named.compared.as_ref()?;
    let counter = named.name.strip_suffix(".CV")?;
    let mut blocks = program.blocks().into_iter();
    let is_counter =
        |block: &&Block| block.name.as_str() == counter && block.kind.preset_value().is_some();
    let counter = blocks.find(is_counter)?.name.clone();
    let relation = compared.comparison;
    // A count is an INT.
    let value = compared.with.parse().ok().filter(|value| *value <= MAXIMUM_PRESET_VALUE)?;
    Some((named.to_string(), Comparison { counter, relation, value }))
}

/// What came of one property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// It holds in every run; where it says that something can happen, the scans show how.
    Holds(Option<Trace>),
    /// It does not hold; the scans show a run, where a run can show it.
    Fails(Option<Trace>),
    /// Neither was proved within the bounds.
    Undecided(Undecided),
}

impl Answer {
    /// That of the negation.
    fn turned(self) -> Self {
        match self {
            Self::Holds(_) => Self::Fails(None),
            Self::Fails(trace) => Self::Holds(trace),
            undecided @ Self::Undecided(_) => undecided,
        }
    }
}

/// `EF p` asks for one run to p, with any inputs in its first scan: the question whether `AG !p` fails, for each that is such a property.
pub(crate) fn of_some_run(properties: &[Resolved]) -> (Vec<Resolved>, Vec<bool>) {
    let asked = properties.iter().map(|property| match property {
        Formula::Eventually(Path::Some, end) => (end.as_ref().clone().negated().always(), true),
        other => (other.clone(), false),
    });
    asked.unzip()
}

/// A program as its properties see it.
#[derive(Debug)]
pub struct Subject {
    circuit: Circuit,
    outputs: usize,
    /// Whether the assumptions have held so far.
    assumed: Option<Signal>,
    /// The inputs that restart a program.
    restarting: Vec<usize>,
    /// Those that an assumption keeps FALSE.
    never_restarting: Vec<usize>,
    /// What is proved with, computed on first use.
    reduced: OnceCell<Circuit>,
    /// All reachable states, computed on first use.
    listed: OnceCell<Explicit>,
}

impl Subject {
    /// `program`, one scan a `period`; memory bits and pins of blocks (`pause.Q`) can be named in properties too, and the comparisons of counts
    /// (`parts.CV >= 3`) that are `asked`. An assumption that is [refused](Self::wrong_assumption) is left out.
    ///
    /// # Errors
    /// The program has errors, or the period is out of bounds.
    pub fn new(program: &Program, period: Duration, asked: &Asked<'_>) -> Result<Self, LowerError> {
        let compared = asked.compared.iter();
        let compared = compared.filter_map(|named| compared_count(program, named)).collect();
        let circuit = program.lower_comparing(period, &compared)?;
        let last = circuit.inputs().len().saturating_sub(1);
        let mut subject = Self::of(circuit, program.outputs.len());
        if !program.retained.is_empty() {
            subject.restarting.push(last);
        }
        let right = asked.assumed.iter().filter(|it| subject.wrong_assumption(it).is_empty());
        let assumed: Vec<Resolved> = right.filter_map(|it| subject.resolve(it).ok()).collect();
        subject = subject.never_restarted(&asked.assumed);
        if !assumed.is_empty() {
            subject.circuit = with_assumptions(&subject.circuit, &assumed);
            subject.assumed = Some(Signal::Output(subject.circuit.outputs().len() - 1));
        }
        Ok(subject)
    }

    /// A circuit as it is, of which the first outputs are the program's own.
    pub(crate) fn of(circuit: Circuit, outputs: usize) -> Self {
        Self {
            outputs,
            circuit,
            assumed: None,
            restarting: Vec::new(),
            never_restarting: Vec::new(),
            reduced: OnceCell::new(),
            listed: OnceCell::new(),
        }
    }

    /// The same where these assumptions may say that a program is not restarted.
    pub(crate) fn never_restarted(mut self, assumed: &[&Property]) -> Self {
        let forbidden = |input: &&usize| {
            let name = &self.circuit.inputs()[**input];
            assumed.iter().any(|assumed| assumed.forbids(name))
        };
        self.never_restarting = self.restarting.iter().filter(forbidden).copied().collect();
        self
    }

    /// The same where these inputs restart a program.
    pub(crate) fn with_restarts(self, restarting: Vec<usize>) -> Self {
        Self { restarting, ..self }
    }

    /// The inputs that are TRUE in the first scan of a warm start, of programs with retentive variables; without those that an assumption keeps FALSE.
    pub fn restarting(&self) -> impl Iterator<Item = &str> {
        let restarting = self.restarting.iter();
        let restarting = restarting.filter(|input| !self.never_restarting.contains(input));
        restarting.map(|&input| self.circuit.inputs()[input].as_str())
    }

    /// The same where an output of the circuit says whether the assumptions have held so far.
    pub(crate) fn with_assumed(self, assumed: Option<Signal>) -> Self {
        Self { assumed, ..self }
    }

    /// The signal that says whether the assumptions have held so far.
    pub(crate) fn assumed(&self) -> Option<Signal> {
        self.assumed
    }

    /// What keeps a property from being an assumption: it is about inputs in one scan (U0434, U0435).
    pub fn wrong_assumption(&self, assumed: &Property) -> Vec<Diagnostic> {
        assumed.wrong_assumption(&|named| self.is_input(named))
    }

    /// What is proved about: the program's outputs come first, then its memory and pins.
    pub fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// The same circuit, in which registers that are always equal are one.
    fn reduced(&self) -> &Circuit {
        self.reduced.get_or_init(|| reduced(&self.circuit))
    }

    /// The program's own outputs.
    pub fn outputs(&self) -> impl Iterator<Item = Signal> + use<> {
        (0..self.outputs).map(Signal::Output)
    }

    /// The formula of `property` over the program's signals; what is wrong has places in the property's file.
    ///
    /// # Errors
    /// Every name that is not a signal of the program (U0435).
    pub fn resolve(&self, property: &Property) -> Result<Resolved, Vec<Diagnostic>> {
        resolve(&property.formula, &self.circuit).map_err(|unknown| {
            unknown.into_iter().map(|named| self.unknown(named, &|_| false)).collect()
        })
    }

    /// What is wrong with a name that is no BOOL. Of the bits of a number, the number is known.
    pub(crate) fn unknown(&self, named: &Named, is_number: &dyn Fn(&str) -> bool) -> Diagnostic {
        if named.compared.is_some() {
            let program = self.circuit.name();
            let message = format!("`{named}` is no comparison of a number of `{program}`");
            let help =
                "the numbers of a ladder are its counts, from 0 to 32767, such as `parts.CV >= 3`";
            return Diagnostic::error("U0435", message, named.span.clone()).with_help(help);
        }
        let outputs = self.circuit.outputs().iter().map(|output| &output.name);
        let names = outputs.chain(self.circuit.inputs()).map(|name| match name.rsplit_once('.') {
            Some((number, _)) if is_number(number) => number,
            _ => name,
        });
        let mut known: Vec<&str> = names.collect();
        known.dedup();
        let help = suggestion(&named.name, known);
        let message = format!("`{}` is not a signal of `{}`", named.name, self.circuit.name());
        Diagnostic::error("U0435", message, named.span.clone()).with_help(help)
    }

    /// Whether a property is about inputs alone: each takes every value, whatever the program does.
    pub fn is_of_inputs(&self, property: &Property) -> bool {
        let names = property.formula.signals();
        !names.is_empty() && names.iter().all(|named| self.is_input(named))
    }

    fn is_input(&self, named: &Named) -> bool {
        let is = |name: &String| *name == named.name;
        let written = self.circuit.outputs().iter().any(|output| is(&output.name));
        named.compared.is_none() && !written && self.circuit.inputs().iter().any(is)
    }

    /// Decides `properties`; `fair` and the assumptions restrict the runs considered. Each result is reported immediately.
    pub fn check(
        &self,
        properties: &[Resolved],
        fair: Vec<Resolved>,
        bounds: Bounds<'_>,
        answered: &mut dyn FnMut(usize, &Answer),
    ) -> Vec<Answer> {
        let (questions, is_reached) = of_some_run(properties);
        let (questions, fair) = self.assuming(&questions, &fair);
        let answers = self.check_assuming(&questions, fair, bounds, answered);
        let answers = answers.into_iter().zip(is_reached);
        answers
            .map(|(answer, is_reached)| if is_reached { answer.turned() } else { answer })
            .collect()
    }

    /// What properties say of the fair runs in which the assumptions hold, as formulas about all runs, and what is fair then.
    pub fn assuming(
        &self,
        properties: &[Resolved],
        fair: &[Resolved],
    ) -> (Vec<Resolved>, Vec<Resolved>) {
        let (properties, mut fair) = (properties.iter(), fair.to_vec());
        let Some(ok) = self.assumed else {
            return (properties.cloned().collect(), fair);
        };
        // Without conditions each run that keeps the assumptions goes on.
        if !fair.is_empty() {
            fair.push(Formula::Signal(ok));
        }
        (properties.map(|property| assuming(property, ok)).collect(), fair)
    }

    /// As [`Self::check`], for properties of [`Self::assuming`].
    pub(crate) fn check_assuming(
        &self,
        properties: &[Resolved],
        fair: Vec<Resolved>,
        bounds: Bounds<'_>,
        answered: &mut dyn FnMut(usize, &Answer),
    ) -> Vec<Answer> {
        if self.assumed.is_some() || !fair.is_empty() {
            let there = self.assumed.map_or(Formula::Constant(true), Formula::Signal);
            let never = [there.negated().always()];
            let excluded = Stages::new(self, &never, fair.clone(), bounds, &mut |_, _| {}).run();
            if let [Answer::Holds(_)] = excluded.as_slice() {
                let nothing = Undecided { why: None, unbroken: None, listed: None };
                return vec![Answer::Undecided(nothing); properties.len()];
            }
        }
        Stages::new(self, properties, fair, bounds, answered).run()
    }
}
