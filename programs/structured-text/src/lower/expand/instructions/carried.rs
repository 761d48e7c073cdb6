//! Results that continue behind a label: every way to it stores its result in one variable.

use std::collections::HashMap;

use understudy_text::Diagnostic;
use understudy_typed::Elementary;

use super::super::written::{assign, declare, elementary, path, variable};
use super::Writer;
use crate::syntax::{
    Class, Declaration, Expression, ExpressionKind, Instruction, Literal, Name, Operator, Span,
    Step, TypeKind, TypeName,
};

/// The variables of the labels behind which the result is used, by labels in capitals.
#[derive(Default)]
pub(super) struct Carried {
    variables: HashMap<String, Variable>,
}

struct Variable {
    name: String,
    of: Option<TypeName>,
    span: Span,
}

impl Carried {
    /// Finds the labels behind which the result is used before there is a new one.
    pub(super) fn of(list: &[Instruction]) -> Self {
        let mut carried = Self::default();
        for (at, instruction) in list.iter().enumerate() {
            let Some(label) = &instruction.label else {
                continue;
            };
            if uses_result(&list[at..]) {
                let variable = Variable {
                    name: format!("list.result.{}", carried.variables.len()),
                    of: None,
                    span: label.span(),
                };
                carried.variables.insert(label.key(), variable);
            }
        }
        carried
    }
}

/// Whether a row of instructions reads the result before it makes one.
fn uses_result(list: &[Instruction]) -> bool {
    for instruction in list {
        match instruction.operator.as_str() {
            "" | "CAL" => {}
            "LD" | "LDN" | "JMP" | "RET" => return false,
            _ => return true,
        }
    }
    false
}

/// Whether two types have one name.
fn is_same(left: &TypeName, right: &TypeName) -> bool {
    match (&left.kind, &right.kind) {
        (TypeKind::Named(left), TypeKind::Named(right)) => left == right,
        (TypeKind::Text { .. }, TypeKind::Text { .. }) => true,
        (TypeKind::Subrange(left, ..), TypeKind::Named(right))
        | (TypeKind::Named(left), TypeKind::Subrange(right, ..))
        | (TypeKind::Subrange(left, ..), TypeKind::Subrange(right, ..)) => left == right,
        _ => false,
    }
}

impl Writer<'_> {
    /// Stores the result for the part behind a label, where that uses it.
    pub(super) fn carry(&mut self, label: &Name, span: &Span) {
        let Some(variable) = self.carried.variables.get(&label.key()) else {
            return;
        };
        let name = variable.name.clone();
        let Some(value) = self.taken(span) else {
            return;
        };
        let of = self.type_of(&value);
        let is_open =
            matches!(value.kind, ExpressionKind::Literal(Literal::Integer { of: None, .. }));
        if of.is_none() && !is_open {
            let message =
                format!("the type of the result that continues at `{label}` is not known");
            let found = Diagnostic::error("U1017", message, span.clone());
            let help = "store it in a variable, and load that behind the label";
            self.diagnostics.push(found.with_help(help));
            return;
        }
        if let Some(variable) = self.carried.variables.get_mut(&label.key())
            && let Some(of) = of
        {
            let known = variable.of.get_or_insert_with(|| of.clone());
            if !is_same(known, &of) {
                let message = format!("results of different types continue at `{label}`");
                let found = Diagnostic::error("U1017", message, span.clone());
                let help = "convert one of them, such as with INT_TO_REAL";
                self.diagnostics.push(found.with_help(help));
                return;
            }
        }
        self.push(assign(path(&name, None, span), value, span));
    }

    /// The result at a label.
    pub(super) fn arrived(&mut self, label: &Name) -> Option<Expression> {
        let found = self.carried.variables.get(&label.key())?;
        Some(variable(&found.name, &label.span()))
    }

    /// Declares the variables that were needed.
    pub(super) fn declare_carried(&mut self) {
        let mut variables: Vec<Variable> =
            std::mem::take(&mut self.carried).variables.into_values().collect();
        variables.sort_by_key(|variable| variable.span.start);
        for variable in variables {
            let span = &variable.span;
            let of = variable.of.unwrap_or_else(|| elementary(Elementary::Dint, span));
            let class = Class::Temporary;
            self.declarations.push(declare(&variable.name, class, of, None, span));
        }
    }

    /// The type of a result, as far as names and literals say it.
    fn type_of(&self, value: &Expression) -> Option<TypeName> {
        let span = &value.span;
        let known = |of| Some(elementary(of, span));
        match &value.kind {
            ExpressionKind::Literal(Literal::Boolean(_)) => known(Elementary::Bool),
            ExpressionKind::Literal(Literal::Time { of, .. }) => known(*of),
            ExpressionKind::Literal(Literal::Real { of, .. }) => {
                known(of.unwrap_or(Elementary::Lreal))
            }
            ExpressionKind::Literal(Literal::Integer { of, .. }) => (*of).and_then(known),
            ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => self.type_of(inner),
            ExpressionKind::Chain(_, rest)
                if rest.iter().any(|(operator, _)| matches!(operator, Operator::Compare(_))) =>
            {
                known(Elementary::Bool)
            }
            ExpressionKind::Chain(first, rest) => {
                let mut values =
                    std::iter::once(&**first).chain(rest.iter().map(|(_, value)| value));
                values.find_map(|value| self.type_of(value))
            }
            ExpressionKind::Variable(found) => match found.steps.as_slice() {
                [] => self.declared(&found.root, span),
                [Step::Field(part)] if part.is("ET") => known(Elementary::Time),
                [Step::Field(part)] if part.is("CV") => known(Elementary::Int),
                [Step::Field(part)]
                    if ["Q", "Q1", "QU", "QD", "X"].iter().any(|known| part.is(known)) =>
                {
                    known(Elementary::Bool)
                }
                _ => None,
            },
            ExpressionKind::Call(function, arguments) => {
                let key = function.root.key();
                if let Some((_, to)) = key.split_once("_TO_") {
                    let kind = TypeKind::Named(Name::new(to, span.clone()));
                    return Some(TypeName { kind, span: span.clone() });
                }
                arguments.iter().find_map(|argument| match argument {
                    crate::syntax::Argument::Placed(value)
                    | crate::syntax::Argument::Given(_, value) => self.type_of(value),
                    crate::syntax::Argument::Taken { .. } => None,
                })
            }
            _ => None,
        }
    }

    fn declared(&self, name: &Name, span: &Span) -> Option<TypeName> {
        let of = match name.as_str().get(..3).map(str::to_ascii_uppercase).as_deref() {
            Some("%IB" | "%QB" | "%MB") => Elementary::Byte,
            Some("%IW" | "%QW" | "%MW") => Elementary::Word,
            Some("%ID" | "%QD" | "%MD") => Elementary::Dword,
            Some("%IL" | "%QL" | "%ML") => Elementary::Lword,
            _ if name.as_str().starts_with('%') => Elementary::Bool,
            _ => {
                let mut all = self.unit.declarations.iter().chain(&self.declarations);
                let found: Option<&Declaration> = all.find(|found| found.name == *name);
                return found.map(|found| found.of.clone());
            }
        };
        Some(elementary(of, span))
    }
}
