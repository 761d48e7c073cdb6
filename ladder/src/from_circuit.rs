//! A circuit as a ladder: any [`Circuit`], the generated parity controller too.
//!
//! Products are contacts in series, sums are branches, an exclusive or is two branches, and what is used more than once is a
//! memory bit of its own. The order of the rungs is that of [`crate::plan`], so the scan equals the synchronous circuit.

use understudy_logic::{Circuit, Expression, Operation, Variable};

use crate::names::{Language, Namer};
use crate::plan::{Operand, Plan, Target};
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
    let mut name = |wanted: &str| namer.name(wanted);
    let inputs: Vec<String> = circuit.inputs().iter().map(|input| name(input)).collect();
    let outputs = circuit.outputs().iter();
    let outputs: Vec<String> = outputs.map(|output| name(&output.name)).collect();
    let registers = circuit.registers().iter();
    let registers: Vec<String> = registers.map(|register| name(&register.name)).collect();
    let shared = 0..plan.shared_count;
    let shared: Vec<String> = shared.map(|k| name(&format!("shared_{}", k + 1))).collect();
    let mut next = vec![String::new(); registers.len()];
    let mut memory: Vec<Signal> = circuit
        .registers()
        .iter()
        .zip(&registers)
        .map(|(register, name)| Signal {
            initial: Some(register.initial),
            ..Signal::new(name.as_str())
        })
        .collect();
    memory.extend(shared.iter().map(|name| Signal::new(name.as_str())));
    for assignment in &plan.assignments {
        if let Target::Next(index) = assignment.target {
            next[index] = name(&format!("{}.next", registers[index]));
            memory.push(Signal::new(next[index].as_str()));
        }
    }
    let writer = Writer {
        plan: &plan,
        inputs: &inputs,
        registers: &registers,
        shared: &shared,
    };
    let mut rungs = Vec::with_capacity(plan.assignments.len());
    let mut section = "";
    for assignment in &plan.assignments {
        let (heading, target) = match assignment.target {
            Target::Shared(k) => (
                "Expressions that are used more than once, or long.",
                &shared[k],
            ),
            Target::Output(k) => ("Outputs.", &outputs[k]),
            Target::Register(k) => (
                "The new state; nobody reads the old value of these any more.",
                &registers[k],
            ),
            Target::Next(k) => ("The new state, held until all of it is known.", &next[k]),
            Target::Takeover(k) => ("The new state is taken over.", &registers[k]),
        };
        let mut rung = match assignment.target {
            Target::Takeover(k) => rung(vec![contact(&next[k], true)], CoilKind::Plain, target),
            _ => writer.rung(assignment.expression, target),
        };
        if section != heading {
            rung.comments.push(heading.into());
            section = heading;
        }
        rungs.push(rung);
    }
    let signals = |names: &[String]| {
        names
            .iter()
            .map(|name| Signal::new(name.as_str()))
            .collect()
    };
    Program {
        name: Name::from(Namer::new(Language::Ladder).name(circuit.name())),
        inputs: signals(&inputs),
        outputs: signals(&outputs),
        memory,
        rungs,
        ..Program::default()
    }
}

fn rung(network: Series, kind: CoilKind, target: &str) -> Rung {
    Rung {
        network,
        coils: vec![Coil {
            kind,
            target: target.into(),
        }],
        ..Rung::default()
    }
}

fn contact(operand: &str, positive: bool) -> Element {
    Element::Contact(Contact {
        kind: if positive {
            ContactKind::NormallyOpen
        } else {
            ContactKind::NormallyClosed
        },
        operand: operand.into(),
    })
}

struct Writer<'a> {
    plan: &'a Plan<'a>,
    inputs: &'a [String],
    registers: &'a [String],
    shared: &'a [String],
}

impl Writer<'_> {
    /// The rung that gives `expression` to `target`, whether it is shared or not.
    fn rung(&self, expression: Expression, target: &str) -> Rung {
        match self.plan.operand(expression) {
            Operand::Shared(number) if self.shared[number] != target => rung(
                vec![contact(&self.shared[number], true)],
                CoilKind::Plain,
                target,
            ),
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
            Operand::Shared(number) => vec![contact(&self.shared[number], positive)],
            Operand::Variable(Variable::Input(index)) => {
                vec![contact(&self.inputs[index as usize], positive)]
            }
            Operand::Variable(Variable::Register(index)) => {
                vec![contact(&self.registers[index as usize], positive)]
            }
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
                vec![Element::Branches(vec![
                    pair(true, !positive),
                    pair(false, positive),
                ])]
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
