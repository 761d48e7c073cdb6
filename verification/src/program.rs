//! A ladder against its properties, and against what everybody wants of a ladder without saying so.

mod remarks;
mod sampled;
mod unasked;

use std::time::Duration;

use understudy_diagnostic::Diagnostic;
use understudy_diagnostic::spelling::suggestion;
use understudy_ladder::{LowerError, Program};
use understudy_logic::Circuit;
use understudy_logic::bdd::{BddError, Diagrams};

use crate::explicit::Explicit;
use crate::property::{Named, Property};
use crate::symbolic::{Checker, Cone, Resolved, Signal, Trace, Verdict, resolve, rows};

pub use remarks::{Remark, Remarks};
pub use unasked::{Lamp, OutputFinding};

/// Nodes with which most properties of ladders are decided, in a second or two.
const FEW_NODES: usize = 1 << 20;

/// Bounds of a proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Nodes of decision diagrams alive at once.
    pub nodes: usize,
    /// States, each with inputs, that are listed where diagrams grow large; four bytes each.
    pub states: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            nodes: Diagrams::DEFAULT_LIMIT,
            states: 1 << 26,
        }
    }
}

/// What came of one property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// It holds in every run; where it says that something can happen, the scans show how.
    Holds(Option<Trace>),
    /// It does not hold; the scans show a run, where a run can show it.
    Fails(Option<Trace>),
    /// Neither was proved within the bounds.
    Undecided(BddError),
}

/// A program as its properties see it.
#[derive(Debug)]
pub struct Subject {
    circuit: Circuit,
    outputs: usize,
}

impl Subject {
    /// `program`, one scan a `period`; memory bits and pins of blocks (`pause.Q`) can be named in properties too.
    ///
    /// # Errors
    /// The program has errors, or the period is out of bounds.
    pub fn new(program: &Program, period: Duration) -> Result<Self, LowerError> {
        Ok(Self {
            circuit: program.lower_observed(period)?,
            outputs: program.outputs.len(),
        })
    }

    /// What is proved about: the program's outputs come first, then its memory and pins.
    pub fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// The program's own outputs.
    pub fn outputs(&self) -> impl Iterator<Item = Signal> + use<> {
        (0..self.outputs).map(Signal::Output)
    }

    /// The formula of `property` over the program's signals; what is wrong has places in the property's file.
    ///
    /// # Errors
    /// Every name that is no signal of the program (U0435).
    pub fn resolve(&self, property: &Property) -> Result<Resolved, Vec<Diagnostic>> {
        resolve(&property.formula, &self.circuit).map_err(|unknown| {
            unknown
                .into_iter()
                .map(|named| self.unknown(named))
                .collect()
        })
    }

    fn unknown(&self, named: &Named) -> Diagnostic {
        let outputs = self.circuit.outputs().iter().map(|output| &output.name);
        let names = outputs.chain(self.circuit.inputs()).map(String::as_str);
        let help = suggestion(&named.name, names);
        let message = format!("`{}` is no signal of `{}`", named.name, self.circuit.name());
        Diagnostic::error("U0435", message, named.span.clone()).with_help(help)
    }

    /// Decides `properties` one after the other; `fair` restricts the runs that are looked at. Each answer is told as it comes.
    ///
    /// Diagrams of few nodes come first. Once they are not enough, the states that can be reached are listed, where they are not too many; what is left is
    /// tried with as many nodes as allowed.
    pub fn check(
        &self,
        properties: &[Resolved],
        fair: Vec<Resolved>,
        bounds: Bounds,
        answered: &mut dyn FnMut(usize, &Answer),
    ) -> Vec<Answer> {
        let few = bounds.nodes.min(FEW_NODES);
        let lists = fair.is_empty() && bounds.nodes > few;
        let first = if lists { few } else { bounds.nodes };
        let mut answers = Vec::with_capacity(properties.len());
        let mut tell = |answer: Answer| {
            answered(answers.len(), &answer);
            answers.push(answer);
            answers.len()
        };
        let mut checker = Checker::new(&self.circuit, fair.clone(), first);
        let mut place = 0;
        for property in properties {
            let answer = decided(checker.check(property));
            if lists && matches!(answer, Answer::Undecided(_)) {
                break;
            }
            place = tell(answer);
        }
        let left = &properties[place..];
        if left.is_empty() {
            return answers;
        }
        drop(checker);
        if let Ok(listed) = Explicit::new(&self.circuit, bounds.states) {
            for (property, (holds, run)) in left.iter().zip(listed.check(left)) {
                let trace = run.map(|run| {
                    let cone = Cone::of(&self.circuit, [property]);
                    rows(&self.circuit, &cone, run)
                });
                tell(if holds {
                    Answer::Holds(trace)
                } else {
                    Answer::Fails(trace)
                });
            }
            return answers;
        }
        let mut checker = Checker::new(&self.circuit, fair, bounds.nodes);
        for property in left {
            tell(decided(checker.check(property)));
        }
        answers
    }
}

fn decided(verdict: Result<Verdict, BddError>) -> Answer {
    match verdict {
        Ok(Verdict::Holds(trace)) => Answer::Holds(trace),
        Ok(Verdict::Fails(trace)) => Answer::Fails(trace),
        Err(error) => Answer::Undecided(error),
    }
}
