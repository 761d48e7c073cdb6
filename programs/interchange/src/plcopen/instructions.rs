//! Instruction lists: the result at hand as an expression, and statements where something is written or called.
//!
//! ```text
//! LD   a          result: a
//! AND( b          result: b, a waits
//! ORN  c          result: b OR NOT c
//! )               result: a AND (b OR NOT c)
//! ST   y          y := a AND (b OR NOT c);
//! ```
//!
//! What is written or called may change what the result was made of, so the result is held in a bit before it, where it is
//! asked for afterwards. Jumps and RET go on, as in ladders, and the result is not known behind a label.

use std::collections::HashSet;
use std::ops::Range;

use understudy_text::Diagnostic;

use super::plan::MAXIMUM_JUMPS;
use super::statements::{OPERATORS, Statements};
use super::xml::Passage;

/// Operators in each other past which a result is held.
const MAXIMUM_DEPTH: usize = 12;

/// Letters of a result past which it is held.
const MAXIMUM_LENGTH: usize = 2_000;

/// Brackets that may be open at once.
const MAXIMUM_OPEN: usize = 32;

/// One line.
struct Instruction {
    label: Option<String>,
    /// In capitals.
    operator: String,
    operand: String,
    span: Range<usize>,
}

/// The result at hand.
#[derive(Debug, Clone)]
struct Value {
    text: String,
    /// That joins its parts; none where brackets are not needed around it.
    operator: Option<&'static str>,
    depth: usize,
    kind: String,
}

impl Value {
    fn bracketed(&self) -> String {
        match self.operator {
            None => self.text.clone(),
            Some(_) => format!("({})", self.text),
        }
    }

    fn negated(&self) -> Self {
        Self {
            text: format!("NOT ({})", self.text),
            operator: Some("NOT"),
            depth: self.depth + 1,
            kind: "BOOL".into(),
        }
    }
}

/// What waits for a bracket to be closed.
struct Open {
    before: Value,
    operator: &'static str,
    negated: bool,
}

struct List<'s, 'a> {
    own: &'s mut Statements<'a>,
    result: Option<Value>,
    /// Whether something was made of the result.
    is_used: bool,
    open: Vec<Open>,
    /// Those on their way, with the bits that say whether they are done.
    jumps: Vec<(Option<String>, String)>,
    passed: HashSet<String>,
    diagnostics: &'s mut Vec<Diagnostic>,
}

impl Statements<'_> {
    /// The statements of an instruction list.
    pub(crate) fn instruction_list(&mut self, text: &Passage, diagnostics: &mut Vec<Diagnostic>) {
        let mut list = List {
            own: self,
            result: None,
            is_used: true,
            open: Vec::new(),
            jumps: Vec::new(),
            passed: HashSet::new(),
            diagnostics,
        };
        for instruction in instructions(text) {
            list.instruction(&instruction);
        }
        let end = text.span().end;
        let end = end..end;
        list.forget(&end);
        if !list.open.is_empty() {
            list.error(
                "U1017",
                "a bracket of the instruction list is not closed".into(),
                end.clone(),
            );
        }
        let missing = list.jumps.iter().find_map(|(label, _)| label.clone());
        if let Some(label) = missing {
            list.error(
                "U1016",
                format!("a jump goes to `{label}`, and no label further down is called so"),
                end,
            );
        }
    }
}

/// The operator of Structured Text behind one of instruction lists.
fn operator(word: &str) -> Option<&'static str> {
    let word = if word == "&" { "AND" } else { word };
    let found = OPERATORS.iter().find(|(known, _)| *known == word);
    found.map(|(_, operator)| *operator)
}

fn is_comparison(operator: &str) -> bool {
    matches!(operator, "=" | "<>" | "<" | "<=" | ">" | ">=")
}

impl List<'_, '_> {
    fn error(&mut self, code: &'static str, message: String, span: Range<usize>) {
        self.diagnostics
            .push(Diagnostic::error(code, message, span));
    }

    fn read(&self, operand: &str) -> Value {
        let signed = operand.starts_with('-');
        Value {
            text: operand.to_owned(),
            operator: signed.then_some("-"),
            depth: 0,
            kind: self.own.kind_of(operand),
        }
    }

    /// A new result.
    fn load(&mut self, value: Value, span: &Range<usize>) {
        self.forget(span);
        self.result = Some(value);
        self.is_used = false;
    }

    /// The result is not known any more. One that nothing was made of is held, so that what it names is looked at all the same.
    fn forget(&mut self, span: &Range<usize>) {
        let result = self.result.take();
        if let Some(value) = result.filter(|_| !self.is_used) {
            let message = format!(
                "the result `{}` has no effect: nothing stores it",
                value.text
            );
            let warning = Diagnostic::warning("U1023", message, span.clone());
            self.diagnostics
                .push(warning.with_help("store it with ST, or remove what makes it"));
            self.held(value, span);
        }
        self.is_used = true;
    }

    /// The result, which must be known.
    fn taken(&mut self, span: &Range<usize>) -> Option<Value> {
        self.is_used = true;
        if self.result.is_none() {
            let message = "no result yet: an LD is missing before this instruction";
            self.error("U1017", message.into(), span.clone());
        }
        self.result.clone()
    }

    fn joined(
        &mut self,
        left: &Value,
        operator: &'static str,
        negated: bool,
        right: Value,
        span: &Range<usize>,
    ) -> Value {
        let right = if negated { right.negated() } else { right };
        let chains =
            matches!(operator, "AND" | "OR" | "XOR" | "+") && left.operator == Some(operator);
        let (start, depth) = if chains {
            (left.text.clone(), left.depth.max(right.depth + 1))
        } else {
            (left.bracketed(), left.depth.max(right.depth) + 1)
        };
        let kind = match operator {
            "AND" | "OR" | "XOR" => "BOOL".to_owned(),
            _ if is_comparison(operator) => "BOOL".to_owned(),
            _ => left.kind.clone(),
        };
        let joined = Value {
            text: format!("{start} {operator} {}", right.bracketed()),
            operator: Some(operator),
            depth,
            kind,
        };
        self.settled(joined, span)
    }

    /// The value, held where it is deep or long.
    fn settled(&mut self, value: Value, span: &Range<usize>) -> Value {
        if value.depth > MAXIMUM_DEPTH || value.text.len() > MAXIMUM_LENGTH {
            self.held(value, span)
        } else {
            value
        }
    }

    /// The same value in a variable of its own.
    fn held(&mut self, value: Value, span: &Range<usize>) -> Value {
        let name = self.own.declare("result", &value.kind);
        let jumps = &self.jumps;
        self.own.unless(jumps, span, |own| {
            own.push(&format!("{name} := {};\n", value.text), span);
        });
        Value {
            text: name,
            operator: None,
            depth: 0,
            kind: value.kind,
        }
    }

    fn write(&mut self, text: &str, span: &Range<usize>) {
        let jumps = &self.jumps;
        self.own.unless(jumps, span, |own| own.push(text, span));
    }

    fn instruction(&mut self, instruction: &Instruction) {
        let span = &instruction.span;
        if let Some(label) = &instruction.label {
            self.jumps
                .retain(|(target, _)| target.as_ref() != Some(label));
            self.forget(span);
            if !self.passed.insert(label.clone()) {
                self.error(
                    "U1016",
                    format!("two labels are called `{label}`"),
                    span.clone(),
                );
            }
        }
        let (word, operand) = (instruction.operator.as_str(), instruction.operand.as_str());
        let needs_operand = matches!(word, "LD" | "LDN" | "ST" | "STN" | "S" | "R")
            || operator(word.strip_suffix('N').unwrap_or(word)).is_some();
        if needs_operand && operand.is_empty() {
            self.error("U1017", format!("{word} has no operand"), span.clone());
            return;
        }
        match word {
            "" => {}
            "LD" | "LDN" => {
                let value = self.read(operand);
                let value = if word == "LDN" {
                    value.negated()
                } else {
                    value
                };
                self.load(value, span);
            }
            "ST" | "STN" => {
                let Some(value) = self.taken(span) else {
                    return;
                };
                let negated = word == "STN";
                let stored = if negated { value.negated() } else { value };
                self.write(&format!("{operand} := {};\n", stored.text), span);
                let now = self.read(operand);
                self.result = Some(if negated { now.negated() } else { now });
            }
            "S" | "R" => {
                let Some(value) = self.taken(span) else {
                    return;
                };
                let value = self.held(value, span);
                let literal = if word == "S" { "TRUE" } else { "FALSE" };
                self.write(
                    &format!("IF {} THEN {operand} := {literal}; END_IF;\n", value.text),
                    span,
                );
                self.result = Some(value);
            }
            "NOT" => {
                if let Some(value) = self.taken(span) {
                    let negated = self.settled(value.negated(), span);
                    self.load(negated, span);
                }
            }
            ")" => self.close(span),
            "CAL" => {
                self.forget(span);
                self.write(&format!("{}\n", called(operand)), span);
            }
            "CALC" | "CALCN" => {
                if let Some(condition) = self.condition(word == "CALCN", span) {
                    let call = format!("IF {condition} THEN {} END_IF;\n", called(operand));
                    self.write(&call, span);
                }
            }
            "JMP" | "RET" => self.jump("TRUE", word == "JMP", operand, span),
            "JMPC" | "JMPCN" | "RETC" | "RETCN" => {
                if let Some(condition) = self.condition(word.ends_with('N'), span) {
                    self.jump(&condition, word.starts_with('J'), operand, span);
                }
            }
            _ => self.operation(word, operand, span),
        }
    }

    /// The result as a condition that stays.
    fn condition(&mut self, negated: bool, span: &Range<usize>) -> Option<String> {
        let value = self.taken(span)?;
        let value = self.held(value, span);
        let text = value.text.clone();
        self.result = Some(value);
        Some(if negated { format!("NOT {text}") } else { text })
    }

    fn jump(&mut self, condition: &str, has_label: bool, operand: &str, span: &Range<usize>) {
        let label = has_label.then(|| operand.to_uppercase());
        if let Some(label) = label.as_ref().filter(|label| self.passed.contains(*label)) {
            let message =
                format!("a jump goes back to `{label}`: only jumps further down are taken");
            self.error("U1016", message, span.clone());
            return;
        }
        if self.jumps.len() >= MAXIMUM_JUMPS {
            let message = format!("more than {MAXIMUM_JUMPS} jumps are on their way");
            self.error("U1016", message, span.clone());
            return;
        }
        let done = self.own.declare("jumped", "BOOL");
        self.own.push(&format!("{done} := FALSE;\n"), span);
        self.write(&format!("{done} := {condition};\n"), span);
        self.jumps.push((label, done));
        if condition == "TRUE" {
            self.forget(span);
        }
    }

    fn close(&mut self, span: &Range<usize>) {
        let Some(open) = self.open.pop() else {
            self.error("U1017", "no bracket is open here".into(), span.clone());
            return;
        };
        if let Some(right) = self.taken(span) {
            let joined = self.joined(&open.before, open.operator, open.negated, right, span);
            self.load(joined, span);
        }
    }

    /// AND, ANDN, ADD and the like, with an operand or an open bracket, and functions.
    fn operation(&mut self, word: &str, operand: &str, span: &Range<usize>) {
        let Some(left) = self.taken(span) else { return };
        let negated = matches!(word, "ANDN" | "ORN" | "XORN" | "&N");
        let base = word.strip_suffix('N').filter(|_| negated).unwrap_or(word);
        let Some(operator) = operator(base) else {
            let kind = self.own.kind_of(word);
            let text = match operand {
                "" => format!("{word}({})", left.text),
                _ => format!("{word}({}, {operand})", left.text),
            };
            let answer = Value {
                text,
                operator: None,
                depth: left.depth + 1,
                kind,
            };
            let answer = self.settled(answer, span);
            self.load(answer, span);
            return;
        };
        let Some(inner) = operand.strip_prefix('(') else {
            let right = self.read(operand);
            let joined = self.joined(&left, operator, negated, right, span);
            self.load(joined, span);
            return;
        };
        if self.open.len() >= MAXIMUM_OPEN {
            let message =
                format!("more than {MAXIMUM_OPEN} brackets of an instruction list are open");
            self.error("U1017", message, span.clone());
            return;
        }
        self.open.push(Open {
            before: left,
            operator,
            negated,
        });
        let closed = inner.trim_end().strip_suffix(')');
        let first = closed.unwrap_or(inner).trim();
        self.forget(span);
        if !first.is_empty() {
            let first = self.read(first);
            self.load(first, span);
        }
        if closed.is_some() {
            self.close(span);
        }
    }
}

/// A call as a statement.
fn called(operand: &str) -> String {
    if operand.contains('(') {
        format!("{operand};")
    } else {
        format!("{operand}();")
    }
}

/// The lines of a list; a call goes on until its bracket is closed.
fn instructions(text: &Passage) -> Vec<Instruction> {
    let clear = without_comments(text.as_str());
    let mut found: Vec<Instruction> = Vec::new();
    let mut at = 0;
    let mut open = 0_usize;
    for line in clear.split_inclusive('\n') {
        let start = at + (line.len() - line.trim_start().len());
        at += line.len();
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let span = text.place(start..start + line.len());
        let count = |letter| line.matches(letter).count();
        if let Some(call) = found.last_mut().filter(|_| open > 0) {
            call.operand.push(' ');
            call.operand.push_str(line);
            call.span.end = span.end;
            open = (open + count('(')).saturating_sub(count(')'));
            continue;
        }
        let (label, rest) = match line.split_once(':') {
            Some((label, rest)) if is_name(label.trim()) && !rest.starts_with('=') => {
                (Some(label.trim().to_uppercase()), rest.trim())
            }
            _ => (None, line),
        };
        let end = rest
            .find(|letter: char| !letter.is_alphanumeric() && letter != '_' && letter != '&')
            .unwrap_or(rest.len());
        // A bracket alone is an operator of one letter.
        let end = if end == 0 {
            rest.chars().next().map_or(0, char::len_utf8)
        } else {
            end
        };
        let (word, operand) = rest.split_at(end);
        let operator = word.to_uppercase();
        if operator.starts_with("CAL") {
            open = count('(').saturating_sub(count(')'));
        }
        found.push(Instruction {
            label,
            operator,
            operand: operand.trim().to_owned(),
            span,
        });
    }
    found
}

fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters
        .next()
        .is_some_and(|first| first.is_alphabetic() || first == '_')
        && letters.all(|letter| letter.is_alphanumeric() || letter == '_')
}

/// Blanks in the place of `(* … *)`, byte for byte.
fn without_comments(text: &str) -> String {
    let mut clear = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find("(*") {
        clear.push_str(&rest[..start]);
        let end = rest[start..]
            .find("*)")
            .map_or(rest.len(), |end| start + end + 2);
        clear.extend(
            rest[start..end]
                .bytes()
                .map(|byte| if byte == b'\n' { '\n' } else { ' ' }),
        );
        rest = &rest[end..];
    }
    clear.push_str(rest);
    clear
}
