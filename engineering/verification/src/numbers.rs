//! Properties of programs with numbers, and of several programs that read each other's signals.
//!
//! A program becomes a *system*: terms for the value of each cell of memory after a scan (`execute`). Its *abstraction* is a circuit that has
//! every run of the system and more (`abstraction`), which the methods for Boolean programs decide:
//!
//! ```text
//! circuit: holds, property of all runs      holds
//! circuit: fails, with a run                the run is repeated with numbers: fails, or undecided with the comparison that matters
//! the property depends on no free value     what is true of the circuit is true of the system
//! ```

mod abstraction;
mod execute;
mod program;
mod replay;
mod term;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

use understudy_logic::Circuit;
use understudy_text::Diagnostic;
use understudy_typed::Elementary;

use crate::program::{Answer as CircuitAnswer, Bounds, Subject};
use crate::property::{Formula, Path, Property};
use crate::symbolic::{Cone, Resolved, Signal, Trace};
use abstraction::{Abstraction, Meaning};
pub use execute::Unsupported;
pub use program::{Code, Member};
use replay::Replay;
pub use replay::Row;
use term::{Term, Terms, Variable};

/// An input of a system.
#[derive(Debug, Clone)]
struct Input {
    name: String,
    of: Elementary,
    term: Term,
    /// Positions between which its values lie.
    limits: (i128, i128),
}

/// A number that a scan keeps for the next one.
#[derive(Debug, Clone)]
struct Cell {
    name: String,
    of: Elementary,
    initial: u64,
    term: Term,
    next: Term,
}

/// Programs on terms, one step a cycle.
#[derive(Debug)]
pub struct System {
    name: String,
    terms: Terms,
    inputs: Vec<Input>,
    cells: Vec<Cell>,
    /// BOOLs that properties can name.
    observed: Vec<(String, Term)>,
    /// Values that a run shows beside them.
    shown: Vec<(String, Term)>,
}

/// An input of a program in a system.
#[derive(Debug, Clone)]
pub enum Source {
    /// Any value of its type between two stored ones; reals are finite.
    Any(Option<RangeInclusive<u64>>),
    /// An output of a program of the system in the cycle before.
    Signal {
        /// Number of the program, in the order in which they are given.
        program: usize,
        /// Its output.
        output: String,
        /// Stored value while the signal is not valid.
        default: u64,
        /// Cycles for which the newest value is kept.
        stale_after: u32,
    },
    /// Whether the signal that another input takes is valid.
    Valid {
        /// The name of the other input.
        of: String,
    },
}

/// What came of one property.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// It holds in every run.
    Holds(Option<Run>),
    /// It does not; the run shows it, where one run can.
    Fails(Option<Run>),
    /// Neither was proved, and why.
    Undecided(String),
}

/// A run with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The Boolean signals of the property and those it depends on.
    pub trace: Trace,
    /// Numbers of the run: inputs, and outputs that are no BOOLs.
    pub numbers: Vec<Row>,
}

impl System {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            terms: Terms::default(),
            inputs: Vec::new(),
            cells: Vec::new(),
            observed: Vec::new(),
            shown: Vec::new(),
        }
    }

    fn input(&mut self, name: String, of: Elementary, range: Option<&RangeInclusive<u64>>) -> Term {
        let number = self.inputs.len() as u32;
        let term = self.terms.variable(of, Variable::Input(number));
        let position = |stored| abstraction::boundaries::position(of, stored).unwrap_or(0);
        let limits = match range {
            Some(range) => (position(*range.start()), position(*range.end())),
            None => match of {
                Elementary::Real => {
                    (position(f32::MIN.to_bits().into()), position(f32::MAX.to_bits().into()))
                }
                Elementary::Lreal => (position(f64::MIN.to_bits()), position(f64::MAX.to_bits())),
                _ => execute::range(of),
            },
        };
        self.inputs.push(Input { name, of, term, limits });
        term
    }

    /// A cell that keeps its value until [`Cell::next`] is set.
    fn cell(&mut self, name: String, of: Elementary, initial: u64) -> u32 {
        let number = self.cells.len() as u32;
        let term = self.terms.variable(of, Variable::Cell(number));
        self.cells.push(Cell { name, of, initial: initial & of.mask(), term, next: term });
        number
    }

    fn name_of(&self, variable: Variable) -> String {
        match variable {
            Variable::Input(number) => self.inputs[number as usize].name.clone(),
            Variable::Cell(number) => self.cells[number as usize].name.clone(),
        }
    }

    fn describe(&self, term: Term) -> String {
        self.terms.describe(term, &|variable| self.name_of(variable))
    }
}

/// A system and its abstraction, ready for questions.
pub struct Model {
    system: System,
    abstraction: Abstraction,
    subject: Subject,
}

impl Model {
    fn of(system: System) -> Result<Self, Unsupported> {
        let abstraction = Abstraction::new(&system)?;
        let subject = Subject::of(abstraction.circuit.clone());
        Ok(Self { system, abstraction, subject })
    }

    /// The circuit that stands for the programs.
    pub fn circuit(&self) -> &Circuit {
        self.subject.circuit()
    }

    /// The formula of `property` over the signals of the circuit.
    ///
    /// # Errors
    /// Every name that is no BOOL of the programs (U0435).
    pub fn resolve(&self, property: &Property) -> Result<Resolved, Vec<Diagnostic>> {
        self.subject.resolve(property)
    }

    /// Decides `properties`; `fair` restricts the runs considered. Each property is reported when it is decided.
    pub fn check(
        &self,
        properties: &[Resolved],
        fair: &[Resolved],
        bounds: Bounds<'_>,
        answered: &mut dyn FnMut(),
    ) -> Vec<Answer> {
        let answers = self.subject.check(properties, fair.to_vec(), bounds, &mut |_, _| answered());
        let pairs = properties.iter().zip(answers);
        pairs.map(|(property, answer)| self.concrete(property, fair, answer, bounds)).collect()
    }

    fn concrete(
        &self,
        property: &Resolved,
        fair: &[Resolved],
        answer: CircuitAnswer,
        bounds: Bounds<'_>,
    ) -> Answer {
        let cone = Cone::of(self.circuit(), fair.iter().chain([property]));
        let is_exact = cone.variables.iter().all(|variable| self.is_exact(*variable));
        let replay = Replay::new(&self.system, &self.abstraction, bounds.go_on);
        match answer {
            CircuitAnswer::Holds(None) if is_exact || is_of_all_runs(property) => {
                Answer::Holds(None)
            }
            CircuitAnswer::Holds(trace) if is_exact => {
                Answer::Holds(trace.and_then(|trace| replay.follow(&trace, &[]).run))
            }
            // What holds in all runs holds, whatever run shows it.
            CircuitAnswer::Holds(_) if is_of_all_runs(property) => Answer::Holds(None),
            CircuitAnswer::Holds(_) => Answer::Undecided(
                "it says that something can happen, and depends on comparisons of computed numbers"
                    .to_owned(),
            ),
            CircuitAnswer::Fails(None) if is_exact => Answer::Fails(None),
            CircuitAnswer::Fails(Some(trace)) => {
                let kept = crate::induction::invariant(property);
                let followed = replay.follow(&trace, kept.as_slice());
                let is_run = is_exact && followed.mismatch.is_none();
                match (kept, followed.run) {
                    (Some(_), Some(run)) if followed.is_broken => Answer::Fails(Some(run)),
                    (None, Some(run)) if is_run => Answer::Fails(Some(run)),
                    (kept, _) => {
                        if let Some(run) = kept.and_then(|kept| replay.search(&trace, kept)) {
                            return Answer::Fails(Some(run));
                        }
                        let reason = match followed.mismatch {
                            Some(comparison) => format!(
                                "no run with numbers was found that breaks it; it depends on `{comparison}`"
                            ),
                            None => "the run that breaks it was not found with numbers".to_owned(),
                        };
                        Answer::Undecided(reason)
                    }
                }
            }
            CircuitAnswer::Fails(None) => {
                Answer::Undecided("it depends on comparisons of computed numbers".to_owned())
            }
            CircuitAnswer::Undecided(undecided) => Answer::Undecided(undecided.to_string()),
        }
    }

    /// Whether an input or register of the circuit takes every value that it can take in the programs, and no other one.
    fn is_exact(&self, variable: understudy_logic::Variable) -> bool {
        let understudy_logic::Variable::Input(input) = variable else {
            return true;
        };
        match self.abstraction.meanings[input as usize] {
            Meaning::Bit(..) => true,
            Meaning::Boundary(term, _) => {
                matches!(self.system.terms.node(term), term::Node::Variable(Variable::Input(_)))
            }
            Meaning::NotANumber(_) | Meaning::Less(..) | Meaning::Equal(..) | Meaning::Free(..) => {
                false
            }
        }
    }
}

/// Whether a formula speaks of all runs alone: what is true in more runs is true in fewer.
fn is_of_all_runs(formula: &Resolved) -> bool {
    fn walk(formula: &Resolved, negated: bool) -> bool {
        let path = |path: Path| (path == Path::All) != negated;
        match formula {
            Formula::Constant(_) | Formula::Signal(_) => true,
            Formula::Not(inner) => walk(inner, !negated),
            Formula::And(left, right) | Formula::Or(left, right) => {
                walk(left, negated) && walk(right, negated)
            }
            Formula::Implies(left, right) => walk(left, !negated) && walk(right, negated),
            Formula::Same(left, right) => left.is_of_one_scan() && right.is_of_one_scan(),
            Formula::Next(along, inner)
            | Formula::Eventually(along, inner)
            | Formula::Always(along, inner)
            | Formula::Within(along, _, inner) => path(*along) && walk(inner, negated),
            Formula::Until(along, left, right) => {
                path(*along) && walk(left, negated) && walk(right, negated)
            }
        }
    }
    walk(formula, false)
}

/// A signal of a formula in one scan of a run.
fn holds_in(formula: &Resolved, signal: &dyn Fn(Signal) -> bool) -> bool {
    let of = |inner: &Resolved| holds_in(inner, signal);
    match formula {
        Formula::Constant(value) => *value,
        Formula::Signal(which) => signal(*which),
        Formula::Not(inner) => !of(inner),
        Formula::And(left, right) => of(left) && of(right),
        Formula::Or(left, right) => of(left) || of(right),
        Formula::Implies(left, right) => !of(left) || of(right),
        Formula::Same(left, right) => of(left) == of(right),
        // Invariants speak of one scan.
        _ => true,
    }
}
