//! Proves that a circuit is the parity controller of its members, without the generator:
//!
//! ```text
//! f(N+1) = [f(1), .., f(N)], x(N+1)(0) = [x(1)(0), .., x(N)(0)]      (7)
//! h(N+1) = h(1) + .. + h(N)                                         (9)
//! ```
//!
//! Signals are matched by name, `program.signal`, not by place; so an order that the generator chose is not believed but found.
//! Each function is compared as a decision diagram, which is canonical: equal diagrams mean equal functions, for every state
//! and every input. The variables of a program stand together in the order of the diagrams; so the diagram of a sum over
//! programs, which share no variables, is as large as those of its terms together.

use std::collections::HashMap;
use std::fmt;

use understudy_logic::bdd::{Builder, Diagram, Diagrams, depth_first_order};
use understudy_logic::{Circuit, Expression, Variable};

use crate::effort::{ALWAYS, GoOn, Stopped, Work};

/// What was compared, all found equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Proof {
    /// Next-state functions and initial values.
    pub registers: usize,
    /// Outputs.
    pub outputs: usize,
}

/// A function of the generated circuit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// f of the register of this name.
    Register(String),
    /// h of the output of this name.
    Output(String),
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Register(name) => write!(formatter, "the next state of `{name}`"),
            Self::Output(name) => write!(formatter, "the output `{name}`"),
        }
    }
}

/// Values of signals by name; signals that are not in it do not matter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment(pub Vec<(String, bool)>);

impl fmt::Display for Assignment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return formatter.write_str("any values");
        }
        for (place, (name, value)) in self.0.iter().enumerate() {
            let comma = if place > 0 { ", " } else { "" };
            write!(formatter, "{comma}{name} = {}", u8::from(*value))?;
        }
        Ok(())
    }
}

/// Why the circuit is not the parity controller of the members.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refutation {
    /// A signal of a member is not there.
    #[error("U0420: the {kind} `{name}` is missing in `{circuit}`")]
    Missing {
        /// "input" or "register".
        kind: &'static str,
        /// `program.signal`.
        name: String,
        /// The generated circuit.
        circuit: String,
    },
    /// Another number of inputs, registers or outputs than the members call for.
    #[error("U0421: `{circuit}` has {found} {kind}, and its members call for {expected}")]
    Count {
        /// "inputs", "registers" or "outputs".
        kind: &'static str,
        /// In the generated circuit.
        found: usize,
        /// By the members.
        expected: usize,
        /// The generated circuit.
        circuit: String,
    },
    /// Two members have a signal of the same full name.
    #[error("U0422: two members both have `{name}`, so no circuit can hold a copy of each")]
    SameName {
        /// `program.signal`.
        name: String,
    },
    /// A copy starts otherwise than its program.
    #[error("U0423: `{name}` starts as {}, and its program starts it as {}", u8::from(*.found), u8::from(!*.found))]
    Initial {
        /// `program.register`.
        name: String,
        /// In the generated circuit.
        found: bool,
    },
    /// A function that is not the one of the members.
    #[error("U0424: {place} is {} where its members say {}, for example at {counterexample}", u8::from(*.found), u8::from(!*.found))]
    Function {
        /// Which function.
        place: Place,
        /// Its value in the generated circuit.
        found: bool,
        /// Where the two differ.
        counterexample: Assignment,
    },
    /// Neither proved nor refuted.
    #[error("U0425: {place} could not be decided: {error}")]
    Undecided {
        /// Which function.
        place: Place,
        /// What was in the way.
        error: Stopped,
    },
}

impl Refutation {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "U0420",
            Self::Count { .. } => "U0421",
            Self::SameName { .. } => "U0422",
            Self::Initial { .. } => "U0423",
            Self::Function { .. } => "U0424",
            Self::Undecided { .. } => "U0425",
        }
    }
}

/// Proves that `generated` is the parity controller (7)-(9) of `members`; outputs are matched by place, as in (9).
///
/// # Errors
/// The first thing that is not as it must be, with a counterexample; or a function that is too large to decide.
pub fn prove_parity(members: &[Circuit], generated: &Circuit) -> Result<Proof, Refutation> {
    prove_parity_within(members, generated, Diagrams::DEFAULT_LIMIT)
}

/// [`prove_parity`] with at most `nodes` nodes of decision diagrams alive at once.
///
/// # Errors
/// As [`prove_parity`].
pub fn prove_parity_within(
    members: &[Circuit],
    generated: &Circuit,
    nodes: usize,
) -> Result<Proof, Refutation> {
    prove_parity_while(members, generated, nodes, ALWAYS)
}

/// Functions that are compared before anybody is asked whether to go on.
const AT_LEAST: usize = 200;

/// [`prove_parity_within`], as long as `go_on` says so.
///
/// # Errors
/// As [`prove_parity`].
pub fn prove_parity_while(
    members: &[Circuit],
    generated: &Circuit,
    nodes: usize,
    go_on: GoOn<'_>,
) -> Result<Proof, Refutation> {
    let places = Places::of(members, generated)?;
    for (member, registers) in members.iter().zip(&places.registers) {
        for (register, &place) in member.registers().iter().zip(registers) {
            let copy = &generated.registers()[place as usize];
            if copy.initial != register.initial {
                return Err(Refutation::Initial { name: copy.name.clone(), found: copy.initial });
            }
        }
    }
    let order = members.iter().enumerate().flat_map(|(number, member)| {
        let places = &places;
        let read = depth_first_order(member.graph(), &member.roots());
        read.into_iter().map(move |variable| places.place(number, variable))
    });
    // The generated circuit may depend, wrongly, on what no member reads.
    let stray = depth_first_order(generated.graph(), &generated.roots());
    let diagrams = Diagrams::new(order.chain(stray), nodes);
    let mut comparison = Comparison {
        diagrams: &diagrams,
        generated,
        copies: diagrams.builder(generated.graph(), |variable| variable),
        originals: (0..)
            .zip(members)
            .map(|(number, member)| {
                let places = &places;
                diagrams.builder(member.graph(), move |variable| places.place(number, variable))
            })
            .collect(),
        go_on,
        compared: 0,
    };
    for (number, member) in members.iter().enumerate() {
        for (register, &place) in member.registers().iter().zip(&places.registers[number]) {
            let copy = &generated.registers()[place as usize];
            let place = Place::Register(copy.name.clone());
            comparison.compare(place, copy.next, &[(number, register.next)])?;
        }
    }
    for (index, output) in generated.outputs().iter().enumerate() {
        let terms: Vec<(usize, Expression)> = members
            .iter()
            .enumerate()
            .filter_map(|(number, member)| Some((number, member.outputs().get(index)?.value)))
            .collect();
        comparison.compare(Place::Output(output.name.clone()), output.value, &terms)?;
    }
    Ok(Proof { registers: generated.registers().len(), outputs: generated.outputs().len() })
}

/// Where each member's signals are among those of the generated circuit, by member and by place.
struct Places {
    inputs: Vec<Vec<u32>>,
    registers: Vec<Vec<u32>>,
}

impl Places {
    fn of(members: &[Circuit], generated: &Circuit) -> Result<Self, Refutation> {
        let inputs = generated.inputs().iter().map(String::as_str);
        let registers = generated.registers().iter();
        let names = |member: &Circuit| -> Vec<String> {
            let registers = member.registers().iter();
            registers.map(|register| register.name.clone()).collect()
        };
        let widest = members.iter().map(|member| member.outputs().len()).max();
        check_count(generated, "outputs", generated.outputs().len(), widest.unwrap_or(0))?;
        Ok(Self {
            inputs: find(members, generated, "input", inputs.collect(), |member| {
                member.inputs().to_vec()
            })?,
            registers: find(
                members,
                generated,
                "register",
                registers.map(|register| register.name.as_str()).collect(),
                names,
            )?,
        })
    }

    fn place(&self, member: usize, variable: Variable) -> Variable {
        match variable {
            Variable::Input(index) => Variable::Input(self.inputs[member][index as usize]),
            Variable::Register(index) => Variable::Register(self.registers[member][index as usize]),
        }
    }
}

fn check_count(
    generated: &Circuit,
    kind: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), Refutation> {
    if found == expected {
        return Ok(());
    }
    Err(Refutation::Count { kind, found, expected, circuit: generated.name().to_owned() })
}

/// For each member, where its signals are in `there`; each place is used once, and all are.
fn find(
    members: &[Circuit],
    generated: &Circuit,
    kind: &'static str,
    there: Vec<&str>,
    signals: impl Fn(&Circuit) -> Vec<String>,
) -> Result<Vec<Vec<u32>>, Refutation> {
    let places: HashMap<&str, u32> = there.iter().copied().zip(0..).collect();
    let mut used = vec![false; there.len()];
    let mut found = Vec::new();
    for member in members {
        let mut own = Vec::new();
        for signal in signals(member) {
            let name = format!("{}.{signal}", member.name());
            let Some(&place) = places.get(name.as_str()) else {
                return Err(Refutation::Missing {
                    kind,
                    name,
                    circuit: generated.name().to_owned(),
                });
            };
            if std::mem::replace(&mut used[place as usize], true) {
                return Err(Refutation::SameName { name });
            }
            own.push(place);
        }
        found.push(own);
    }
    let expected = used.iter().filter(|used| **used).count();
    let kinds = if kind == "input" { "inputs" } else { "registers" };
    check_count(generated, kinds, there.len(), expected)?;
    Ok(found)
}

struct Comparison<'a> {
    diagrams: &'a Diagrams,
    generated: &'a Circuit,
    copies: Builder<'a>,
    originals: Vec<Builder<'a>>,
    go_on: GoOn<'a>,
    compared: usize,
}

impl Comparison<'_> {
    /// Refutes unless `copy` is the sum of `terms`, each a function of the member of that number.
    fn compare(
        &mut self,
        place: Place,
        copy: Expression,
        terms: &[(usize, Expression)],
    ) -> Result<(), Refutation> {
        let difference = match self.difference(copy, terms) {
            Ok(None) => return Ok(()),
            Ok(Some(difference)) => difference,
            Err(error) => return Err(Refutation::Undecided { place, error }),
        };
        let found = copy_value(self.generated, copy, &difference);
        let named = difference
            .into_iter()
            .map(|(variable, value)| (self.generated.variable_name(variable).to_owned(), value));
        Err(Refutation::Function { place, found, counterexample: Assignment(named.collect()) })
    }

    fn difference(
        &mut self,
        copy: Expression,
        terms: &[(usize, Expression)],
    ) -> Result<Option<Vec<(Variable, bool)>>, Stopped> {
        self.compared += 1;
        let work = Work::Diagrams { steps: self.compared as u64, nodes: self.diagrams.nodes() };
        if !(self.go_on)(work) && self.compared > AT_LEAST {
            return Err(Stopped::Time);
        }
        let found: Diagram = self.copies.diagram(copy)?;
        let mut expected = self.diagrams.constant(false);
        // The last program is the lowest in the order, and a sum is cheapest from the bottom up.
        for &(number, term) in terms.iter().rev() {
            let term = self.originals[number].diagram(term)?;
            expected = self.diagrams.xor(&term, &expected)?;
        }
        Ok(self.diagrams.difference(&found, &expected)?)
    }
}

/// The function's own value at the counterexample, what is not named in it being 0.
fn copy_value(generated: &Circuit, copy: Expression, at: &[(Variable, bool)]) -> bool {
    let values: HashMap<Variable, bool> = at.iter().copied().collect();
    let value = |variable| values.get(&variable).copied().unwrap_or(false);
    generated.graph().evaluate(copy, value)
}
