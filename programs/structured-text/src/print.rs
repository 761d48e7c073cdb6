//! Syntax to Structured Text: readable, in one canonical form, accepted by other compilers and by [`crate::parse`].

mod declaration;
mod expression;
mod statement;

use crate::syntax::{
    Action, Body, Chart, Class, Declaration, File, Instruction, Span, Unit, UnitKind,
};

pub use expression::{expression, initializer, type_name};

/// A whole text: types, global variables, units, configuration.
pub fn file(file: &File) -> String {
    placed(file).text
}

/// A printed text, and where in it the statements are.
#[derive(Debug, Clone, Default)]
pub struct Placed {
    /// The text.
    pub text: String,
    /// Each statement, instruction, transition and action of a step: where it stands in the text that was read, and its first byte in this one, in the order of this one.
    pub places: Vec<(Span, usize)>,
}

/// As [`file()`], with the places of the statements.
pub fn placed(file: &File) -> Placed {
    let mut printer = Printer::default();
    printer.types(&file.types);
    for unit in &file.units {
        printer.unit(unit);
    }
    printer.configuration(file);
    Placed { text: printer.text, places: printer.places }
}

/// Statements, each on its line or lines.
pub fn statements(statements: &[crate::syntax::Statement]) -> String {
    let mut printer = Printer::default();
    printer.statements(statements);
    printer.text
}

/// Instructions, each on its line.
pub fn instructions(instructions: &[Instruction]) -> String {
    let mut printer = Printer::default();
    instructions.iter().for_each(|instruction| printer.instruction(instruction));
    printer.text
}

/// One program, function block, function or method.
pub fn unit(unit: &Unit) -> String {
    let mut printer = Printer::default();
    printer.unit(unit);
    printer.text
}

/// Blocks of variables.
pub fn declarations(declarations: &[Declaration]) -> String {
    let mut printer = Printer::default();
    printer.declarations(declarations);
    printer.text
}

/// Spaces of one level.
const INDENT: usize = 4;

#[derive(Default)]
struct Printer {
    text: String,
    depth: usize,
    /// The places of the statements, as [`Placed`] has them.
    places: Vec<(Span, usize)>,
}

impl Printer {
    fn line(&mut self, line: &str) {
        if !line.is_empty() {
            let width = self.depth * INDENT;
            self.text.extend(std::iter::repeat_n(' ', width));
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    fn within(&mut self, print: impl FnOnce(&mut Self)) {
        self.depth += 1;
        print(self);
        self.depth -= 1;
    }

    /// What is printed next is this part of the text that was read.
    fn place(&mut self, span: &Span) {
        self.places.push((span.clone(), self.text.len()));
    }

    fn comments(&mut self, comments: &[String]) {
        for comment in comments {
            self.line(&format!("(* {} *)", harmless(comment)));
        }
    }

    /// An empty line between two things.
    fn gap(&mut self) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
    }

    fn unit(&mut self, unit: &Unit) {
        self.gap();
        self.comments(&unit.comments);
        let word = match unit.kind {
            UnitKind::Program => "PROGRAM",
            UnitKind::FunctionBlock => "FUNCTION_BLOCK",
            UnitKind::Function => "FUNCTION",
            UnitKind::Method => "METHOD",
        };
        let mut header = format!("{word} {}", unit.name);
        if let Some(extends) = &unit.extends {
            header += &format!(" EXTENDS {extends}");
        }
        if !unit.implements.is_empty() {
            let names: Vec<&str> = unit.implements.iter().map(|name| name.as_str()).collect();
            header += &format!(" IMPLEMENTS {}", names.join(", "));
        }
        if let Some(result) = &unit.result {
            header += &format!(" : {}", type_name(result));
        }
        self.line(&header);
        self.declarations(&unit.declarations);
        for method in &unit.methods {
            self.within(|printer| printer.unit(method));
        }
        if !unit.declarations.is_empty() || !unit.methods.is_empty() {
            self.gap();
        }
        self.within(|printer| printer.body(&unit.body));
        self.line(&format!("END_{word}"));
    }

    fn body(&mut self, body: &Body) {
        match body {
            Body::Statements(statements) => self.statements(statements),
            Body::Chart(chart) => self.chart(chart),
            Body::Instructions(instructions) => {
                for instruction in instructions {
                    self.instruction(instruction);
                }
            }
        }
    }

    fn chart(&mut self, chart: &Chart) {
        for step in &chart.steps {
            let word = if step.is_initial { "INITIAL_STEP" } else { "STEP" };
            self.line(&format!("{word} {}:", step.name));
            self.within(|printer| {
                for association in &step.associations {
                    let mut inner = association.qualifier.to_string();
                    if let Some(duration) = &association.duration {
                        inner += &format!(", {}", expression(duration));
                    }
                    for indicator in &association.indicators {
                        inner += &format!(", {indicator}");
                    }
                    printer.place(&association.action.span());
                    printer.line(&format!("{}({inner});", association.action));
                }
            });
            self.line("END_STEP");
            self.gap();
        }
        for transition in &chart.transitions {
            let mut header = "TRANSITION".to_owned();
            if let Some(name) = &transition.name {
                header += &format!(" {name}");
            }
            if let Some(priority) = transition.priority {
                header += &format!(" (PRIORITY := {priority})");
            }
            let (from, to) = (step_names(&transition.from), step_names(&transition.to));
            self.place(&transition.span);
            self.line(&format!("{header} FROM {from} TO {to}"));
            let condition = format!(":= {};", expression(&transition.condition));
            self.within(|printer| printer.line(&condition));
            self.line("END_TRANSITION");
            self.gap();
        }
        for Action { name, body } in &chart.actions {
            self.line(&format!("ACTION {name}:"));
            self.within(|printer| printer.statements(body));
            self.line("END_ACTION");
            self.gap();
        }
    }

    fn instruction(&mut self, instruction: &Instruction) {
        let mut line = String::new();
        if let Some(label) = &instruction.label {
            line += &format!("{label}:");
            if !instruction.operator.is_empty() {
                line.push(' ');
            }
        }
        line += &instruction.operator;
        let operands = &instruction.operands;
        let printed = |operands: &[crate::syntax::Argument]| {
            let printed: Vec<String> = operands.iter().map(expression::argument).collect();
            printed.join(", ")
        };
        let is_placed = |operand: &crate::syntax::Argument| {
            matches!(operand, crate::syntax::Argument::Placed(_))
        };
        let is_call = instruction.operator.starts_with("CAL");
        if is_call && operands.len() > 1 {
            line += &format!(" {}({})", printed(&operands[..1]), printed(&operands[1..]));
        } else if operands.iter().all(is_placed) {
            if !operands.is_empty() {
                line += &format!(" {}", printed(operands));
            }
        } else {
            line += &format!("({})", printed(operands));
        }
        self.place(&instruction.span);
        self.line(&line);
    }
}

fn step_names(names: &[crate::syntax::Name]) -> String {
    let printed: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
    match printed.as_slice() {
        [one] => (*one).to_owned(),
        _ => format!("({})", printed.join(", ")),
    }
}

/// A comment that neither ends before its end nor contains another.
fn harmless(comment: &str) -> String {
    let mut comment = comment.replace("*)", "* )").replace("(*", "( *");
    if comment.ends_with(['*', '(']) {
        comment.push(' ');
    }
    comment
}

/// The word that begins a block of variables.
fn block_word(class: Class) -> &'static str {
    match class {
        Class::Input => "VAR_INPUT",
        Class::Output => "VAR_OUTPUT",
        Class::InOut => "VAR_IN_OUT",
        Class::Local => "VAR",
        Class::Temporary => "VAR_TEMP",
        Class::Static => "VAR_STAT",
        Class::External => "VAR_EXTERNAL",
        Class::Global => "VAR_GLOBAL",
    }
}

#[cfg(test)]
mod tests;
