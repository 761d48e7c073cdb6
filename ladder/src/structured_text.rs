//! A circuit as Structured Text of IEC 61131-3, for a real PLC.
//!
//! One PROGRAM with BOOL variables and assignments in the order of [`crate::plan`], so that one execution is one step of the
//! synchronous circuit. Only NOT, AND, XOR, OR and brackets are used.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_logic::{Circuit, Expression, Operation};

use crate::names::{Language, Namer};
use crate::plan::{Named, Operand, Plan, Target};
use crate::program::{Address, Program};

/// Characters of a line past which an assignment is broken before an operator.
const LINE_WIDTH: usize = 96;

impl Program {
    /// The addresses of inputs and outputs by name, as [`structured_text`] takes them.
    pub fn addresses(&self) -> HashMap<String, Address> {
        let signals = self.inputs.iter().chain(&self.outputs);
        let known = signals.filter_map(|signal| {
            let address = signal.address.clone()?;
            Some((signal.name.to_string(), address))
        });
        known.collect()
    }
}

/// The text of a PROGRAM whose execution is one step of `circuit`.
///
/// Inputs and outputs with an entry in `addresses` (by their name in the circuit) are located there, `AT %IX0.3`; the others
/// are VAR_INPUT and VAR_OUTPUT. Names become identifiers of the standard; what was changed is said in a comment.
pub fn structured_text(circuit: &Circuit, addresses: &HashMap<String, Address>) -> String {
    let plan = Plan::new(circuit, false);
    let mut namer = Namer::new(Language::StructuredText);
    let program = namer.name(circuit.name());
    let names = Named::new(circuit, &plan, &mut namer, "_next");

    let mut text = format!("PROGRAM {program}\n");
    let wanted_inputs: Vec<&str> = circuit.inputs().iter().map(String::as_str).collect();
    let wanted_outputs = circuit.outputs().iter().map(|output| output.name.as_str());
    let wanted_outputs: Vec<&str> = wanted_outputs.collect();
    located(
        &mut text,
        "VAR_INPUT",
        &wanted_inputs,
        &names.inputs,
        addresses,
    );
    located(
        &mut text,
        "VAR_OUTPUT",
        &wanted_outputs,
        &names.outputs,
        addresses,
    );
    let state = circuit
        .registers()
        .iter()
        .zip(&names.registers)
        .map(|(register, name)| {
            let initial = if register.initial { "TRUE" } else { "FALSE" };
            format!(
                "{name} : BOOL := {initial};{}",
                origin(&register.name, name)
            )
        });
    section(&mut text, "VAR", state.collect());
    let helpers = names.shared.iter().map(String::as_str).chain(names.held());
    section(
        &mut text,
        "VAR",
        helpers.map(|name| format!("{name} : BOOL;")).collect(),
    );

    let writer = Writer {
        plan: &plan,
        names: &names,
    };
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
    text
}

/// Declares signals, those with an address apart from those without.
fn located(
    text: &mut String,
    word: &str,
    wanted: &[&str],
    names: &[String],
    addresses: &HashMap<String, Address>,
) {
    let (mut at, mut free) = (Vec::new(), Vec::new());
    for (wanted, name) in wanted.iter().zip(names) {
        let origin = origin(wanted, name);
        match addresses.get(*wanted) {
            Some(address) => at.push(format!("{name} AT {address} : BOOL;{origin}")),
            None => free.push(format!("{name} : BOOL;{origin}")),
        }
    }
    section(text, "VAR", at);
    section(text, word, free);
}

fn section(text: &mut String, word: &str, lines: Vec<String>) {
    if lines.is_empty() {
        return;
    }
    let _ = writeln!(text, "  {word}");
    for line in lines {
        let _ = writeln!(text, "    {line}");
    }
    text.push_str("  END_VAR\n");
}

/// A comment with the name in the circuit, where it had to be changed.
fn origin(wanted: &str, name: &str) -> String {
    if wanted == name {
        return String::new();
    }
    let harmless = |character: char| {
        if character.is_control() {
            ' '
        } else {
            character
        }
    };
    let wanted: String = wanted.chars().map(harmless).collect();
    // Comments do not nest everywhere, so nothing in one may look like the beginning or the end of another.
    format!("  (* {} *)", wanted.replace(['*', '(', ')'], "_"))
}

fn statement(text: &mut String, words: &[String]) {
    let is_operator = |word: &String| matches!(word.as_str(), "AND" | "OR" | "XOR");
    let mut line = String::from(" ");
    for (place, word) in words.iter().enumerate() {
        if is_operator(word) {
            let behind = words[place + 1..]
                .iter()
                .take_while(|word| !is_operator(word));
            let length: usize = behind.map(|word| word.len() + 1).sum();
            if line.len() + 1 + word.len() + length > LINE_WIDTH {
                let _ = writeln!(text, "{line}");
                line = String::from("     ");
            }
        }
        if !line.ends_with('(') && word != ")" {
            line.push(' ');
        }
        line.push_str(word);
    }
    let _ = writeln!(text, "{line};");
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

    /// Writes an expression that stands where only `least` or a tighter binding needs no brackets.
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
