//! A circuit as a ladder: any [`Circuit`], the generated parity controller too.
//!
//! Products are contacts in series, sums are branches, an exclusive or is two branches, and what is used more than once is a
//! memory bit of its own. The order of the rungs is that of [`crate::plan`], so the scan equals the synchronous circuit.

use understudy_logic::{Circuit, Expression, Operation};

use crate::names::{Language, Namer};
use crate::plan::{Named, Operand, Plan, Target};
use crate::program::{
    Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Rung, Series, Signal,
};

/// A ladder program whose scan does what `circuit` does.
///
/// Inputs and outputs keep their order, registers become the first memory bits in their order, with their initial values.
/// Names are kept where the format allows them, and otherwise changed to be names and to be unique.
pub fn from_circuit(circuit: &Circuit) -> Program {
    let plan = Plan::new(circuit, true);
    let mut namer = Namer::new(Language::Ladder);
    let names = Named::new(circuit, &plan, &mut namer, ".next");
    let registers = circuit.registers().iter().zip(&names.registers);
    let mut memory: Vec<Signal> = registers
        .map(|(register, name)| Signal {
            initial: Some(register.initial),
            ..Signal::new(name.as_str())
        })
        .collect();
    let helpers = names.shared.iter().map(String::as_str).chain(names.held());
    memory.extend(helpers.map(Signal::new));
    let writer = Writer { plan: &plan, names: &names };
    let mut rungs = Vec::with_capacity(plan.assignments.len());
    let mut section = "";
    for assignment in &plan.assignments {
        let target = names.target(assignment.target);
        let mut rung = match assignment.target {
            Target::Takeover(k) => {
                rung(vec![contact(names.next(k), true)], CoilKind::Plain, target)
            }
            _ => writer.rung(assignment.expression, target),
        };
        let heading = assignment.target.heading();
        if section != heading {
            rung.comments.push(sentence(heading));
            section = heading;
        }
        rungs.push(rung);
    }
    let signals = |names: &[String]| names.iter().map(|name| Signal::new(name.as_str())).collect();
    Program {
        name: Name::from(Namer::new(Language::Ladder).name(circuit.name())),
        inputs: signals(&names.inputs),
        outputs: signals(&names.outputs),
        memory,
        rungs,
        ..Program::default()
    }
}

/// With a capital at its begin and a full stop at its end.
fn sentence(heading: &str) -> String {
    let (first, rest) = heading.split_at(1);
    format!("{}{rest}.", first.to_uppercase())
}

fn rung(network: Series, kind: CoilKind, target: &str) -> Rung {
    Rung { network, coils: vec![Coil { kind, target: target.into() }], ..Rung::default() }
}

fn contact(operand: &str, positive: bool) -> Element {
    Element::Contact(Contact {
        kind: if positive { ContactKind::NormallyOpen } else { ContactKind::NormallyClosed },
        operand: operand.into(),
    })
}

struct Writer<'a> {
    plan: &'a Plan<'a>,
    names: &'a Named,
}

impl Writer<'_> {
    /// The rung that gives `expression` to `target`, whether it is shared or not.
    fn rung(&self, expression: Expression, target: &str) -> Rung {
        match self.plan.operand(expression) {
            Operand::Shared(number) if self.names.shared[number] != target => {
                rung(vec![contact(&self.names.shared[number], true)], CoilKind::Plain, target)
            }
            _ => match self.plan.operation(expression) {
                // A wire cannot be off; a negated coil on it is.
                Operation::Constant(false) => rung(Vec::new(), CoilKind::Negated, target),
                Operation::Variable(_) => {
                    rung(self.series(expression, true), CoilKind::Plain, target)
                }
                operation => rung(self.operation(operation, true), CoilKind::Plain, target),
            },
        }
    }

    /// A series that passes power while `expression` is `positive`.
    fn series(&self, expression: Expression, positive: bool) -> Series {
        match self.plan.operand(expression) {
            Operand::Shared(number) => vec![contact(&self.names.shared[number], positive)],
            Operand::Variable(variable) => vec![contact(self.names.variable(variable), positive)],
            Operand::Operation(operation) => self.operation(operation, positive),
        }
    }

    fn operation(&self, operation: Operation, positive: bool) -> Series {
        match (operation, positive) {
            // Only at the top, where 1 is a wire: a graph has no constants below an operation.
            (Operation::Constant(_) | Operation::Variable(_), _) => Vec::new(),
            (Operation::Not(operand), _) => self.series(operand, !positive),
            (Operation::And(left, right), true) | (Operation::Or(left, right), false) => {
                let mut series = self.series(left, positive);
                series.extend(self.series(right, positive));
                series
            }
            (Operation::Or(left, right), true) | (Operation::And(left, right), false) => {
                let mut branches = self.branches(left, positive);
                branches.extend(self.branches(right, positive));
                vec![Element::Branches(branches)]
            }
            (Operation::Xor(left, right), _) => {
                let pair = |first: bool, second: bool| {
                    let mut series = self.series(left, first);
                    series.extend(self.series(right, second));
                    series
                };
                vec![Element::Branches(vec![pair(true, !positive), pair(false, positive)])]
            }
        }
    }

    /// The branches of a sum, without brackets in brackets.
    fn branches(&self, expression: Expression, positive: bool) -> Vec<Series> {
        let mut series = self.series(expression, positive);
        match series.as_mut_slice() {
            [Element::Branches(branches)] => std::mem::take(branches),
            _ => vec![series],
        }
    }
}
