//! Which numbers variables can be at a place of a body, from the conditions around it and from what was assigned before it.
//!
//! Only warnings depend on it. A call, a loop and a write whose place is computed end what is known.

use std::collections::HashMap;

use understudy_text::Diagnostic;
use understudy_typed::{
    Comparison, Declared, Elementary, Expression, ExpressionKind, Operation, Place, Root, Type,
};

use crate::syntax::{self, Span};

use super::Lowering;
use super::convert::{is_whole, limits};
use super::ranges::{Interval, ranges};

/// Variables that are followed at once.
const MAXIMUM: usize = 256;

/// Findings among which one on the same value is sought.
const NEAR: usize = 8;

/// What is known at a place, by the variable: its root, slot and bit.
#[derive(Debug, Clone, Default)]
pub(super) struct Facts(HashMap<(Root, u32, u32), Interval>);

fn key(place: &Place) -> Option<(Root, u32, u32)> {
    let is_known = place.indices.is_empty() && place.of.elementary().is_some_and(is_whole);
    is_known.then_some((place.root, place.offset, place.bit))
}

fn is_reference(root: Root) -> bool {
    matches!(root, Root::OwnReference(_) | Root::FrameReference(_))
}

impl Facts {
    /// The numbers that a variable can be, where more is known than its type and its subrange say.
    pub(super) fn of(&self, place: &Place) -> Option<Interval> {
        self.0.get(&key(place)?).copied()
    }

    pub(super) fn forget(&mut self) {
        self.0.clear();
    }

    fn set(&mut self, place: &Place, found: Interval) {
        if let Some(key) = key(place)
            && (self.0.len() < MAXIMUM || self.0.contains_key(&key))
        {
            self.0.insert(key, found);
        }
    }

    /// After something is stored at a place.
    pub(super) fn stored(&mut self, place: &Place, value: &Expression) {
        let mut found = ranges(value, Some(self)).possible;
        // What leaves its subrange is told once.
        if let Some((low, high)) = place.range {
            found = Interval::new(low, high).meet(found);
        }
        // A reference may stand for any variable.
        if is_reference(place.root) {
            self.forget();
        } else {
            self.0.retain(|(root, ..), _| !is_reference(*root));
        }
        match key(place) {
            Some(_) => self.set(place, found),
            None if place.indices.is_empty() && place.of.elementary().is_some() => {}
            // What it means is computed, or has parts.
            None => self.0.retain(|(root, ..), _| *root != place.root),
        }
    }

    /// Where two ways meet.
    pub(super) fn join(&mut self, other: &Self) {
        self.0.retain(|key, found| match other.0.get(key) {
            Some(other) => {
                *found = found.hull(*other);
                true
            }
            None => false,
        });
    }

    /// Within a range that is known, such as the labels of a CASE.
    pub(super) fn is_in(&mut self, value: &Expression, bounds: (i128, i128)) {
        let low = Interval::just(bounds.0);
        let high = Interval::just(bounds.1);
        self.narrow(value, Comparison::GreaterOrEqual, low);
        self.narrow(value, Comparison::LessOrEqual, high);
    }

    /// Where a condition is known to be TRUE or FALSE.
    pub(super) fn refine(&mut self, condition: &Expression, holds: bool) {
        let ExpressionKind::Apply(operation, operands) = &condition.kind else {
            if let ExpressionKind::Choose(parts) = &condition.kind {
                self.chosen(parts, holds);
            }
            return;
        };
        match (operation, operands.as_slice()) {
            (Operation::Not(Elementary::Bool), [inner]) => self.refine(inner, !holds),
            (Operation::And(Elementary::Bool), parts) if holds => {
                parts.iter().for_each(|part| self.refine(part, true));
            }
            (Operation::Or(Elementary::Bool), parts) if !holds => {
                parts.iter().for_each(|part| self.refine(part, false));
            }
            (Operation::Compare(comparison, of), [left, right]) if is_whole(*of) => {
                let comparison = if holds { *comparison } else { comparison.opposite() };
                let (low, high) = (ranges(left, Some(self)), ranges(right, Some(self)));
                self.narrow(left, comparison, high.possible);
                self.narrow(right, comparison.mirrored(), low.possible);
            }
            _ => {}
        }
    }

    /// AND_THEN and OR_ELSE.
    fn chosen(&mut self, [left, then, otherwise]: &[Expression; 3], holds: bool) {
        let is = |value: &Expression, constant: u64| matches!(value.kind, ExpressionKind::Constant(found) if found == constant);
        if holds && is(otherwise, 0) {
            self.refine(left, true);
            self.refine(then, true);
        } else if !holds && is(then, 1) {
            self.refine(left, false);
            self.refine(otherwise, false);
        }
    }

    fn narrow(&mut self, value: &Expression, comparison: Comparison, bound: Interval) {
        let ExpressionKind::Load(place) = &variable(value).kind else {
            return;
        };
        let (low, high) = ranges(variable(value), Some(self)).possible.ends();
        let (least, most) = bound.ends();
        let (low, high) = match comparison {
            Comparison::Equal => (low.max(least), high.min(most)),
            Comparison::NotEqual if least == most => {
                (low + i128::from(low == least), high - i128::from(high == least))
            }
            Comparison::NotEqual => (low, high),
            Comparison::Less => (low, high.min(most.saturating_sub(1))),
            Comparison::LessOrEqual => (low, high.min(most)),
            Comparison::Greater => (low.max(least.saturating_add(1)), high),
            Comparison::GreaterOrEqual => (low.max(least), high),
        };
        // Nothing comes where no number is left.
        if low <= high {
            self.set(place, Interval::new(low, high));
        }
    }
}

/// The variable whose number a conversion gives.
fn variable(value: &Expression) -> &Expression {
    match &value.kind {
        ExpressionKind::Apply(
            Operation::Convert(from, to) | Operation::Reinterpret(from, to),
            inner,
        ) if is_whole(*from) && is_whole(*to) => {
            let ((least, most), (low, high)) = (limits(*to), limits(*from));
            match inner.first() {
                Some(inner) if least <= low && high <= most => variable(inner),
                _ => value,
            }
        }
        _ => value,
    }
}

impl Lowering<'_> {
    /// What is stored where a subrange is declared: a value that is known to be outside is an error, one that can be is a warning.
    pub(super) fn within(&mut self, value: &Expression, place: &Place, span: &Span) -> Option<()> {
        let (Some(range), Some(of)) = (place.range, place.of.elementary()) else {
            return Some(());
        };
        let found = ranges(value, Some(&self.facts)).possible;
        if found.is_within(range) {
            return Some(());
        }
        let declared = Declared { range: Some(range), ..of.into() };
        let (low, high) = found.ends();
        if low == high {
            let message = format!("{low} is outside {declared}");
            let help = "write a value of the range, or declare a wider range";
            self.error_with("U1043", message, span.clone(), help);
            return None;
        }
        if !self.in_library() && self.silent == 0 && !self.is_told(span) {
            let message = format!("this can be {low} to {high}, and its variable is {declared}");
            let found = Diagnostic::warning("U1054", message, span.clone());
            let help = format!(
                "limit it first, such as with LIMIT({}, …, {}), or declare a wider range",
                range.0, range.1
            );
            self.subranges.push(found.with_help(help));
        }
        Some(())
    }

    /// Whether a warning says already that a number leaves its type there.
    pub(super) fn is_told(&self, span: &Span) -> bool {
        let is_within = |found: &Diagnostic| {
            found.code == "U1054" && span.start <= found.span.start && found.span.end <= span.end
        };
        self.diagnostics.iter().rev().take(NEAR).any(is_within)
    }

    /// An expression as what is stored at a place.
    pub(super) fn stored_at(
        &mut self,
        value: &syntax::Expression,
        to: &Place,
    ) -> Option<Expression> {
        let found = self.expression(value, &to.of)?;
        self.within(&found, to, &value.span)?;
        Some(found)
    }

    /// Warns where a product leaves the type in which it is computed.
    pub(super) fn product(&mut self, value: &Expression, span: &Span) {
        let ExpressionKind::Apply(Operation::Multiply(of), operands) = &value.kind else {
            return;
        };
        let (Type::Elementary(_), [left, right]) = (&value.of, operands.as_slice()) else {
            return;
        };
        if !is_whole(*of) {
            return;
        }
        let likely = |operand| ranges(operand, Some(&self.facts)).likely;
        let found = likely(left).times(likely(right));
        let (least, most) = limits(*of);
        if found.is_within((least, most)) {
            return;
        }
        let (low, high) = found.ends();
        let message = format!(
            "this product can be {low} to {high}, and {of} is {least} to {most}: a number beyond wraps around"
        );
        let help = match of.bits() {
            64 => "limit its factors first".to_owned(),
            _ => "limit its factors first, or multiply in a wider type".to_owned(),
        };
        self.warn("U1054", message, span.clone(), help);
    }
}
