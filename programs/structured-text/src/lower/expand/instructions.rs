//! Instruction lists as statements: the result at hand is an expression, and what is stored, set or called is a statement.
//!
//! ```text
//! LD   a          result: a
//! AND( b          result: b, a waits
//! ORN  c          result: b OR NOT c
//! )               result: a AND (b OR NOT c)
//! ST   y          y := a AND (b OR NOT c);
//! ```
//!
//! A list with labels becomes a loop over a CASE whose cases are the parts between labels; where the part behind a
//! label uses the result, every way to the label stores it.

mod carried;

use std::collections::HashMap;

use understudy_text::Diagnostic;
use understudy_typed::Elementary;

use crate::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, Instruction, Name, Operator, Path,
    Span, Statement, StatementKind, Step, Unit,
};

use crate::jumps::in_parts;

use carried::Carried;

use super::written::{
    assign, boolean, declare, elementary, integer, is_chained, join, not, path, statement,
    variable, when,
};

/// Operators around each other in one result.
const MAXIMUM_DEPTH: usize = 80;

/// Brackets that may be open at once.
const MAXIMUM_OPEN: usize = 32;

/// The variable that says which part of the list is next.
const NEXT: &str = "list.next";

/// The counter of loops of one turn.
const TURN: &str = "list.turn";

/// What waits for its bracket.
struct Open {
    before: Option<Expression>,
    operator: Operator,
    negated: bool,
}

struct Writer<'a> {
    unit: &'a Unit,
    labels: HashMap<String, i128>,
    declarations: Vec<Declaration>,
    /// The statements of each part.
    parts: Vec<Vec<Statement>>,
    result: Option<Expression>,
    /// Where the result was made that nothing has taken yet.
    idle: Option<Span>,
    open: Vec<Open>,
    /// How many operators and functions are around each other in the result, and the last one.
    depth: usize,
    last: Option<Operator>,
    carried: Carried,
    /// The instruction before is a jump that is always taken.
    is_over: bool,
    diagnostics: &'a mut Vec<Diagnostic>,
}

/// The statements of a list, and the variables that they need.
pub(super) fn statements(
    list: &[Instruction],
    unit: &Unit,
    diagnostics: &mut Vec<Diagnostic>,
) -> (Vec<Declaration>, Vec<Statement>) {
    let mut writer = Writer {
        unit,
        labels: HashMap::new(),
        declarations: Vec::new(),
        parts: vec![Vec::new()],
        result: None,
        idle: None,
        open: Vec::new(),
        depth: 0,
        last: None,
        carried: Carried::of(list),
        is_over: false,
        diagnostics,
    };
    for label in list.iter().filter_map(|instruction| instruction.label.as_ref()) {
        let part = writer.labels.len() as i128 + 1;
        if writer.labels.insert(label.key(), part).is_some() {
            let message = format!("two labels are called `{label}`");
            writer.error("U1016", message, label.span());
        }
    }
    for instruction in list {
        if let Some(label) = &instruction.label {
            if !writer.is_over {
                writer.carry(label, &label.span());
            }
            writer.lost();
            writer.result = writer.arrived(label);
            writer.parts.push(Vec::new());
        }
        writer.is_over = matches!(instruction.operator.as_str(), "JMP" | "RET");
        writer.instruction(instruction);
    }
    writer.lost();
    if !writer.open.is_empty() {
        let message = "a bracket of the instruction list is not closed";
        writer.error("U1017", message.to_owned(), unit.name.span());
    }
    writer.declare_carried();
    writer.finish()
}

/// The operator of an instruction; EXPT is a function.
fn operator(word: &str) -> Option<Operator> {
    let word = if word == "&" { "AND" } else { word };
    Operator::of_word(word).filter(|operator| *operator != Operator::Power)
}

/// An operator with its negation and its bracket.
fn operation(word: &str) -> Option<(Operator, bool, bool)> {
    let (word, opens) = match word.strip_suffix('(') {
        Some(word) => (word, true),
        None => (word, false),
    };
    if let Some(operator) = operator(word) {
        return Some((operator, false, opens));
    }
    operator(word.strip_suffix('N')?).map(|operator| (operator, true, opens))
}

impl Writer<'_> {
    fn error(&mut self, code: &'static str, message: String, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    /// Reports a result that nothing has taken.
    fn lost(&mut self) {
        if let Some(span) = self.idle.take() {
            let message = "this result has no effect: nothing stores it".to_owned();
            let found = Diagnostic::warning("U1023", message, span);
            let help = "store it with ST, or remove the instruction";
            self.diagnostics.push(found.with_help(help));
        }
    }

    /// The parts as one row, or as a loop over a CASE.
    fn finish(self) -> (Vec<Declaration>, Vec<Statement>) {
        let mut declarations = self.declarations;
        let mut parts = self.parts;
        if parts.len() == 1 {
            return (declarations, parts.pop().unwrap_or_default());
        }
        let span = self.unit.name.span();
        let of = elementary(Elementary::Dint, &span);
        declarations.push(declare(NEXT, Class::Temporary, of, None, &span));
        let of = elementary(Elementary::Dint, &span);
        declarations.push(declare(TURN, Class::Temporary, of, None, &span));
        (declarations, in_parts(parts, NEXT, TURN, &span))
    }

    fn push(&mut self, statement: Statement) {
        if let Some(part) = self.parts.last_mut() {
            part.push(statement);
        }
    }

    /// The result, which must be known.
    fn taken(&mut self, span: &Span) -> Option<Expression> {
        self.idle = None;
        if self.result.is_none() {
            let message = "no result yet: an LD is missing before this instruction";
            self.error("U1017", message.to_owned(), span.clone());
        }
        self.result.clone()
    }

    /// The result as a BOOL in a variable, so that what it is made of may change.
    fn held(&mut self, span: &Span) -> Option<Expression> {
        let value = self.taken(span)?;
        if let ExpressionKind::Literal(_) = value.kind {
            return Some(value);
        }
        let name = format!("list.{}", self.declarations.len());
        let of = elementary(Elementary::Bool, span);
        self.declarations.push(declare(&name, Class::Temporary, of, None, span));
        self.push(assign(path(&name, None, span), value, span));
        self.result = Some(variable(&name, span));
        self.result.clone()
    }

    fn instruction(&mut self, instruction: &Instruction) {
        let span = &instruction.span;
        let word = instruction.operator.as_str();
        let first = instruction.operands.iter().find_map(|operand| match operand {
            Argument::Placed(value) => Some(value.clone()),
            _ => None,
        });
        match word {
            "" => {}
            ")" => self.close(span),
            "NOT" => {
                self.last = None;
                if self.deeper(span) {
                    self.result = self.taken(span).map(not);
                }
            }
            "CAL" | "CALC" | "CALCN" | "CALN" => self.call(word, instruction),
            "RET" | "RETC" | "RETCN" | "RETN" => {
                let condition = self.condition(word, "RET", span);
                let kind = statement(StatementKind::Return, span);
                self.conditional(condition, vec![kind], span);
            }
            "JMP" | "JMPC" | "JMPCN" | "JMPN" => self.jump(word, first, span),
            _ if operation(word).is_some_and(|(_, _, opens)| opens) => {
                self.operate(word, first, span)
            }
            _ => match first {
                Some(first) => self.with_operand(word, first, instruction),
                None if operation(word).is_some()
                    || matches!(word, "LD" | "LDN" | "ST" | "STN" | "S" | "R") =>
                {
                    self.error("U1017", format!("{word} has no operand"), span.clone());
                }
                None => self.function(instruction),
            },
        }
    }

    fn with_operand(&mut self, word: &str, first: Expression, instruction: &Instruction) {
        let span = &instruction.span;
        match word {
            "LD" | "LDN" => {
                self.lost();
                self.idle = Some(span.clone());
                if self.open.is_empty() {
                    (self.depth, self.last) = (0, None);
                }
                self.result = Some(if word == "LDN" { not(first) } else { first });
            }
            "ST" | "STN" => {
                let Some(to) = self.stored(&first) else {
                    return;
                };
                let Some(value) = self.taken(span) else {
                    return;
                };
                let value = if word == "STN" { not(value) } else { value };
                self.push(assign(to, value, span));
                self.result = Some(if word == "STN" { not(first) } else { first });
            }
            "S" | "R" => {
                let Some(to) = self.stored(&first) else {
                    return;
                };
                let Some(condition) = self.held(span) else {
                    return;
                };
                let value = boolean(word == "S", span);
                self.push(when(condition, vec![assign(to, value, span)], span));
            }
            // An input of a block: it is given the result, and the block is called.
            "S1" | "R1" | "CLK" | "CU" | "CD" | "PV" | "IN" | "PT" => {
                let Some(to) = self.stored(&first) else {
                    return;
                };
                let Some(value) = self.taken(span) else {
                    return;
                };
                let mut input = to.clone();
                input.steps.push(Step::Field(Name::new(word, span.clone())));
                self.push(assign(input, value, span));
                if !matches!(word, "PV" | "PT") {
                    self.push(statement(StatementKind::Call(to, Vec::new()), span));
                }
            }
            _ if operation(word).is_some() => self.operate(word, Some(first), span),
            _ => self.function(instruction),
        }
    }

    fn stored(&mut self, target: &Expression) -> Option<Path> {
        match &target.kind {
            ExpressionKind::Variable(path) => Some(path.clone()),
            _ => {
                let message = "a variable is expected here".to_owned();
                self.error("U1017", message, target.span.clone());
                None
            }
        }
    }

    fn operate(&mut self, word: &str, first: Option<Expression>, span: &Span) {
        let Some((operator, negated, opens)) = operation(word) else {
            return;
        };
        let Some(before) = self.taken(span) else {
            return;
        };
        if opens {
            if self.open.len() >= MAXIMUM_OPEN {
                let message = format!("more than {MAXIMUM_OPEN} brackets are open");
                self.error("U1017", message, span.clone());
                return;
            }
            self.open.push(Open { before: Some(before), operator, negated });
            self.result = first;
            return;
        }
        if let Some(first) = first {
            let right = if negated { not(first) } else { first };
            let is_flat = self.last == Some(operator) && is_chained(operator);
            self.last = Some(operator);
            if is_flat || self.deeper(span) {
                self.result = Some(join(before, operator, right));
            }
            self.idle = Some(span.clone());
        }
    }

    /// Goes one operator deeper. Past the bound the result is faulty, and what follows has none of it.
    fn deeper(&mut self, span: &Span) -> bool {
        self.depth += 1;
        let fits = self.depth <= MAXIMUM_DEPTH;
        if !fits {
            let message = format!("a result of more than {MAXIMUM_DEPTH} operators");
            let found = Diagnostic::error("U1033", message, span.clone());
            let help = "store it with ST, and load it with LD";
            self.diagnostics.push(found.with_help(help));
            self.result = Some(Expression { kind: ExpressionKind::Faulty, span: span.clone() });
            (self.depth, self.last) = (0, None);
        }
        fits
    }

    fn close(&mut self, span: &Span) {
        let Some(open) = self.open.pop() else {
            let message = "this bracket closes none".to_owned();
            self.error("U1017", message, span.clone());
            return;
        };
        let value = self.taken(span);
        if let (Some(before), Some(value)) = (open.before, value) {
            let value = if open.negated { not(value) } else { value };
            self.last = None;
            if self.deeper(span) {
                self.result = Some(join(before, open.operator, value));
            }
        }
    }

    /// What a conditional instruction asks of the result; nothing for one that is always done.
    fn condition(&mut self, word: &str, plain: &str, span: &Span) -> Option<Expression> {
        match word.strip_prefix(plain) {
            Some("C") => self.held(span),
            Some("CN" | "N") => self.held(span).map(not),
            _ => None,
        }
    }

    fn conditional(&mut self, condition: Option<Expression>, body: Vec<Statement>, span: &Span) {
        match condition {
            Some(condition) => self.push(when(condition, body, span)),
            None => {
                for statement in body {
                    self.push(statement);
                }
            }
        }
    }

    fn jump(&mut self, word: &str, label: Option<Expression>, span: &Span) {
        let name = match label.map(|label| label.kind) {
            Some(ExpressionKind::Variable(path)) => path.root,
            _ => {
                let message = format!("{word} needs a label");
                return self.error("U1017", message, span.clone());
            }
        };
        let Some(&part) = self.labels.get(&name.key()) else {
            let message = format!("no label is called `{name}`");
            return self.error("U1016", message, name.span());
        };
        let condition = self.condition(word, "JMP", span);
        self.carry(&name, span);
        let next = assign(path(NEXT, None, span), integer(part, span), span);
        let go = statement(StatementKind::Continue, span);
        self.conditional(condition, vec![next, go], span);
    }

    fn call(&mut self, word: &str, instruction: &Instruction) {
        let span = &instruction.span;
        let mut operands = instruction.operands.iter().cloned();
        let instance = match operands.next() {
            Some(Argument::Placed(instance)) => self.stored(&instance),
            _ => {
                let message = format!("{word} needs an instance of a block");
                return self.error("U1017", message, span.clone());
            }
        };
        let Some(instance) = instance else { return };
        let condition = self.condition(word, "CAL", span);
        let call = statement(StatementKind::Call(instance, operands.collect()), span);
        self.conditional(condition, vec![call], span);
    }

    /// A function: the result at hand is its first input.
    fn function(&mut self, instruction: &Instruction) {
        let span = &instruction.span;
        let named = |operand: &Argument| !matches!(operand, Argument::Placed(_));
        let mut arguments = Vec::new();
        if !instruction.operands.iter().any(named) {
            let Some(value) = self.taken(span) else {
                return;
            };
            arguments.push(Argument::Placed(value));
        }
        arguments.extend(instruction.operands.iter().cloned());
        let name = path(&instruction.operator, None, span);
        let value = Expression { kind: ExpressionKind::Call(name, arguments), span: span.clone() };
        self.last = None;
        if self.deeper(span) {
            self.result = Some(value);
        }
        self.idle = Some(span.clone());
    }
}
