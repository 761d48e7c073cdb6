//! A circuit as Structured Text: BOOL variables and assignments in the order of [`crate::plan`], so that one execution is one step
//! of the synchronous circuit. Only NOT, AND, XOR, OR and brackets are used.

use std::fmt::Write;
use std::time::Duration;

use understudy_logic::{Circuit, Expression, Operation};

use super::{comment, configuration, section, statement};
use crate::names::{Language, Namer};
use crate::plan::{Named, Operand, Plan, Target};

/// A PROGRAM whose execution is one step of `circuit`, and the task that executes it every `period`.
///
/// Inputs and outputs are VAR_INPUT and VAR_OUTPUT. Names become identifiers of the standard; the name in the circuit follows one that
/// was changed.
pub fn circuit_as_structured_text(circuit: &Circuit, period: Duration) -> String {
    let plan = Plan::new(circuit, false);
    let mut namer = Namer::new(Language::StructuredText);
    let program = namer.name(circuit.name());
    let names = Named::new(circuit, &plan, &mut namer, "_next");

    let mut text = format!("PROGRAM {program}\n");
    let inputs = circuit.inputs().iter().zip(&names.inputs);
    let inputs: Vec<String> =
        inputs.map(|(wanted, name)| format!("{name} : BOOL;{}", origin(wanted, name))).collect();
    section(&mut text, "VAR_INPUT", &inputs);
    let outputs = circuit.outputs().iter().zip(&names.outputs);
    let outputs: Vec<String> = outputs
        .map(|(output, name)| format!("{name} : BOOL;{}", origin(&output.name, name)))
        .collect();
    section(&mut text, "VAR_OUTPUT", &outputs);
    let state: Vec<String> = circuit
        .registers()
        .iter()
        .zip(&names.registers)
        .map(|(register, name)| {
            let initial = if register.initial { "TRUE" } else { "FALSE" };
            format!("{name} : BOOL := {initial};{}", origin(&register.name, name))
        })
        .collect();
    section(&mut text, "VAR", &state);
    let helpers = names.shared.iter().map(String::as_str).chain(names.held());
    let helpers: Vec<String> = helpers.map(|name| format!("{name} : BOOL;")).collect();
    section(&mut text, "VAR", &helpers);

    let writer = Writer { plan: &plan, names: &names };
    let mut section = "";
    for assignment in &plan.assignments {
        let heading = assignment.target.heading();
        if section != heading {
            let _ = writeln!(text, "\n  (* {heading} *)");
            section = heading;
        }
        let target = names.target(assignment.target);
        let mut words = vec![target.to_owned(), ":=".into()];
        match assignment.target {
            Target::Takeover(k) => words.push(names.next(k).to_owned()),
            _ => writer.assignment(assignment.expression, target, &mut words),
        }
        statement(&mut text, &words);
    }
    text.push_str("END_PROGRAM\n");
    configuration(&mut text, &program, period, &mut namer);
    text
}

/// A comment with the name in the circuit, where it had to be changed.
fn origin(wanted: &str, name: &str) -> String {
    if wanted == name {
        return String::new();
    }
    format!("  {}", comment(wanted))
}

/// How tightly an operation binds; NOT binds tightest, then AND, XOR, OR.
fn binding(operation: Operation) -> u8 {
    match operation {
        Operation::Or(_, _) => 0,
        Operation::Xor(_, _) => 1,
        Operation::And(_, _) => 2,
        Operation::Not(_) => 3,
        Operation::Constant(_) | Operation::Variable(_) => 4,
    }
}

struct Writer<'a> {
    plan: &'a Plan<'a>,
    names: &'a Named,
}

impl Writer<'_> {
    fn assignment(&self, expression: Expression, target: &str, words: &mut Vec<String>) {
        match self.plan.operand(expression) {
            Operand::Shared(number) if self.names.shared[number] == target => {
                self.operation(self.plan.operation(expression), words);
            }
            _ => self.expression(expression, 0, words),
        }
    }

    /// Writes an expression where only `least` or a tighter binding needs no brackets.
    fn expression(&self, expression: Expression, least: u8, words: &mut Vec<String>) {
        match self.plan.operand(expression) {
            Operand::Shared(number) => words.push(self.names.shared[number].clone()),
            Operand::Variable(variable) => words.push(self.names.variable(variable).to_owned()),
            Operand::Operation(operation) if binding(operation) < least => {
                words.push("(".into());
                self.operation(operation, words);
                words.push(")".into());
            }
            Operand::Operation(operation) => self.operation(operation, words),
        }
    }

    fn operation(&self, operation: Operation, words: &mut Vec<String>) {
        let own = binding(operation);
        let mut join = |left, word: &str, right| {
            self.expression(left, own, words);
            words.push(word.into());
            self.expression(right, own, words);
        };
        match operation {
            Operation::Constant(true) => words.push("TRUE".into()),
            // A variable is an operand and never comes here.
            Operation::Constant(false) | Operation::Variable(_) => words.push("FALSE".into()),
            Operation::Not(operand) => {
                words.push("NOT".into());
                self.expression(operand, own, words);
            }
            Operation::And(left, right) => join(left, "AND", right),
            Operation::Or(left, right) => join(left, "OR", right),
            Operation::Xor(left, right) => join(left, "XOR", right),
        }
    }
}
