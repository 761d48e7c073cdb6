//! Properties of programs with numbers, and of several programs that read each other's signals.
//!
//! The circuit of a [`System`] has every run of it and more; the methods for Boolean programs decide about the circuit:
//!
//! ```text
//! circuit: holds, property of all runs      holds
//! circuit: fails, with a run                the run is repeated with numbers: fails, or undecided with the comparison that matters
//! the property depends on no free value     what is true of the circuit is true of the system
//! ```

mod compared;
mod difference;
mod replay;
#[cfg(test)]
mod tests;

use std::collections::HashSet;

use understudy_bits::{Derivation, Inexact, Meaning, Member, Node, System, Unsupported, Variable};
use understudy_logic::Circuit;
use understudy_text::Diagnostic;
use understudy_typed::Program;

use crate::program::{Answer as CircuitAnswer, Bounds, OutputFinding, Subject, of_some_run};
use crate::property::{Asked, Formula, Path, Property};
use crate::symbolic::{Cone, Resolved, Signal, Trace, resolve};
use compared::Refused;
pub use difference::Difference;
use replay::Replay;
pub use replay::{Driven, Row};

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
    /// Every input of the run, of the programs and of what fails between them.
    pub inputs: Vec<Driven>,
}

/// A system and its derivation, ready for questions.
pub struct Model {
    system: System,
    derivation: Derivation,
    subject: Subject,
    refused: Refused,
}

impl Model {
    /// One program, whose inputs are within their subranges. Its properties name its BOOL points and variables, and the comparisons of
    /// numbers that are `asked`. An assumption that is [refused](Self::wrong_assumption) is left out.
    ///
    /// # Errors
    /// What of the program cannot be followed; a scan in which the circuit does something else.
    pub fn of_program(program: &Program, asked: &Asked<'_>) -> Result<Self, Inexact> {
        let names = compared::names(&asked.compared);
        let system = System::within_subranges(program, names)?;
        let own = program.outputs.iter().filter(|point| point.name != Program::FAULT);
        let own: HashSet<&str> = own.map(|point| point.name.as_str()).collect();
        let outputs = system.observed.iter().take_while(|(name, _)| own.contains(name.as_str()));
        let outputs = outputs.count();
        Self::of(system, outputs, asked)?.beside(&[program])
    }

    /// All programs of a cluster; their signals stand behind the names of their controllers and a dot.
    ///
    /// # Errors
    /// As [`Self::of_program`].
    pub fn of_cluster(
        name: &str,
        members: &[Member<'_>],
        asked: &Asked<'_>,
    ) -> Result<Self, Inexact> {
        let names = compared::names(&asked.compared);
        let model = Self::of(System::of_cluster(name, members, names)?, 0, asked)?;
        let programs: Vec<&Program> = members.iter().map(|member| member.program).collect();
        model.beside(&programs)
    }

    /// The same, where its circuit does in some hundred scans what the programs do.
    fn beside(self, programs: &[&Program]) -> Result<Self, Inexact> {
        self.derivation.beside(&self.system, programs)?;
        Ok(self)
    }

    /// The first BOOLs that can be named are the outputs of a program.
    fn of(mut system: System, outputs: usize, asked: &Asked<'_>) -> Result<Self, Unsupported> {
        let refused = compared::add(&mut system, &asked.compared);
        let assumed = compared::assume(&mut system, &asked.assumed);
        let derivation = Derivation::new(&system)?;
        let is_restart = |meaning: &Meaning| match *meaning {
            Meaning::Bit(input, _) => system.restarting.contains(&input),
            _ => false,
        };
        let restarting = derivation.meanings.iter().enumerate();
        let restarting = restarting.filter(|(_, meaning)| is_restart(meaning));
        let restarting = restarting.map(|(place, _)| place).collect();
        let subject = Subject::of(derivation.circuit.clone(), outputs)
            .with_assumed(assumed)
            .with_restarts(restarting)
            .never_restarted(&asked.assumed);
        Ok(Self { system, derivation, subject, refused })
    }

    /// The circuit, where it does what the programs do and nothing else.
    ///
    /// # Errors
    /// The values of the programs that it does not follow bit by bit.
    pub fn exact_circuit(&self) -> Result<&Circuit, Inexact> {
        let gaps = self.derivation.gaps(&self.system);
        if gaps.is_empty() { Ok(self.circuit()) } else { Err(Inexact::Gaps(gaps)) }
    }

    /// The program as its circuit alone, where that is exact.
    ///
    /// # Errors
    /// The values of the program that the circuit does not follow bit by bit.
    pub fn exact(self) -> Result<Subject, Inexact> {
        let gaps = self.derivation.gaps(&self.system);
        if gaps.is_empty() { Ok(self.subject) } else { Err(Inexact::Gaps(gaps)) }
    }

    /// Whether each BOOL output can always be switched on and off again; nothing of a program without an exact circuit.
    pub fn switches(&self, bounds: Bounds<'_>) -> Vec<(Signal, OutputFinding)> {
        if self.exact_circuit().is_err() {
            return Vec::new();
        }
        self.subject.switches(bounds)
    }

    /// As [`Subject::restarting`].
    pub fn restarting(&self) -> impl Iterator<Item = &str> {
        self.subject.restarting()
    }

    /// The circuit that stands for the programs.
    pub fn circuit(&self) -> &Circuit {
        self.subject.circuit()
    }

    /// Names of the inputs that are assumed to be finite numbers: those of type REAL and LREAL.
    pub fn finite_inputs(&self) -> impl Iterator<Item = &str> {
        let inputs = self.system.inputs.iter().filter(|input| input.of.is_real());
        inputs.map(|input| input.name.as_str())
    }

    /// The formula of `property` over the signals of the circuit.
    ///
    /// # Errors
    /// Every name that is no BOOL of the programs, and every comparison that is none (U0435).
    pub fn resolve(&self, property: &Property) -> Result<Resolved, Vec<Diagnostic>> {
        let is_number = |name: &str| compared::type_of(&self.system, name).is_some();
        resolve(&property.formula, self.circuit()).map_err(|unknown| {
            let told =
                unknown.into_iter().map(|named| match self.refused.get(&named.to_string()) {
                    Some(why) => compared::diagnostic(named, why),
                    None => compared::number_alone(&self.system, named)
                        .unwrap_or_else(|| self.subject.unknown(named, &is_number)),
                });
            told.collect()
        })
    }

    /// As [`Subject::assuming`].
    pub fn assuming(
        &self,
        properties: &[Resolved],
        fair: &[Resolved],
    ) -> (Vec<Resolved>, Vec<Resolved>) {
        self.subject.assuming(properties, fair)
    }

    /// Whether a property is about inputs alone: each takes every value, whatever the programs do.
    pub fn is_of_inputs(&self, property: &Property) -> bool {
        let names = property.formula.signals();
        !names.is_empty() && names.iter().all(|named| compared::is_of_inputs(&self.system, named))
    }

    /// What keeps a property from being an assumption: it is about inputs in one scan (U0434, U0435).
    pub fn wrong_assumption(&self, assumed: &Property) -> Vec<Diagnostic> {
        match self.resolve(assumed) {
            Ok(_) => compared::wrong_assumption(&self.system, assumed),
            Err(unknown) => unknown,
        }
    }

    /// Decides `properties`; `fair` and the assumptions restrict the runs considered. Each property is reported when it is decided.
    pub fn check(
        &self,
        properties: &[Resolved],
        fair: &[Resolved],
        bounds: Bounds<'_>,
        answered: &mut dyn FnMut(),
    ) -> Vec<Answer> {
        let (questions, is_reached) = of_some_run(properties);
        let (properties, fair) = &self.assuming(&questions, fair);
        let answered = &mut |_: usize, _: &_| answered();
        let answers = self.subject.check_assuming(properties, fair.to_vec(), bounds, answered);
        let pairs = properties.iter().zip(answers).zip(is_reached);
        let concrete = pairs.map(|((property, answer), is_reached)| {
            match (self.concrete(property, fair, answer, bounds), is_reached) {
                (Answer::Holds(_), true) => Answer::Fails(None),
                (Answer::Fails(run), true) => Answer::Holds(run),
                (answer, _) => answer,
            }
        });
        concrete.collect()
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
        let assumed = self.subject.assumed();
        let replay = Replay::new(&self.system, &self.derivation, assumed, bounds.go_on);
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
        match self.derivation.meanings[input as usize] {
            Meaning::Bit(..) => true,
            Meaning::Boundary(term, _) => {
                matches!(self.system.terms.node(term), Node::Variable(Variable::Input(_)))
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
