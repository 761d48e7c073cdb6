//! Loops: unrolled as long as their condition is known, or for a bounded number of turns.

use std::collections::HashMap;

use understudy_typed::{Comparison, Elementary, For, Operation};

use super::{ALL_TURNS, Context, Execution, Left, Loop, Result, Test, UNKNOWN_TURNS};
use crate::term::Term;

impl Execution<'_> {
    pub(super) fn repeat_for(&mut self, context: Context, each: &For) -> Result<Term> {
        let of = each.counter.of.elementary().unwrap_or(Elementary::Lint);
        let counter = self.address(context, &each.counter)?;
        let from = self.number(context, &each.from)?;
        self.set(counter, from);
        let to = self.number(context, &each.to)?;
        let by = self.number(context, &each.by)?;
        if self.terms.value(by).is_none() {
            return self.unsupported(context, "a FOR whose BY is not constant");
        }
        let test = Test::For { counter: (counter, of), to, by };
        let body = &each.body;
        self.turns(context, &Loop { body, test }, 0)
    }

    /// Whether a turn begins.
    pub(super) fn begins(&mut self, context: Context, each: &Loop<'_>) -> Result<Term> {
        match &each.test {
            Test::While(condition) => self.number(context, condition),
            Test::Repeat(_) => Ok(self.terms.boolean(true)),
            Test::For { counter, to, by } => {
                let (address, of) = *counter;
                let value = self.get(address, of);
                let is_upward = self.terms.value(*by).is_some_and(|by| of.signed(by) >= 0);
                let comparison = match is_upward {
                    true => Comparison::LessOrEqual,
                    false => Comparison::GreaterOrEqual,
                };
                Ok(self.terms.compare(comparison, value, *to))
            }
        }
    }

    /// What is done behind a turn; answers whether another one may begin.
    pub(super) fn advances(&mut self, context: Context, each: &Loop<'_>) -> Result<Term> {
        match &each.test {
            Test::While(_) => Ok(self.terms.boolean(true)),
            Test::Repeat(condition) => {
                let ended = self.number(context, condition)?;
                Ok(self.terms.not(ended))
            }
            Test::For { counter, by, .. } => {
                let (address, of) = *counter;
                let value = self.get(address, of);
                let step = self.terms.value(*by).map_or(0, |by| of.signed(by));
                let (least, greatest) = of.limits();
                let fits = match step >= 0 {
                    true => self.between(value, least, greatest - step),
                    false => self.between(value, least - step, greatest),
                };
                let sum = self.terms.apply(Operation::Add(of), of, &[value, *by]);
                let next = self.terms.choose(fits, sum, value);
                self.set(address, next);
                Ok(fits)
            }
        }
    }

    /// Turns of a loop; answers under which condition the routine is left.
    pub(super) fn turns(
        &mut self,
        context: Context,
        each: &Loop<'_>,
        unknown: u32,
    ) -> Result<Term> {
        let statement = self.terms.statement;
        loop {
            self.terms.statement = statement;
            let begins = self.begins(context, each)?;
            if self.terms.is(begins, false) {
                return Ok(begins);
            }
            self.turns += 1;
            if unknown > UNKNOWN_TURNS || self.turns > ALL_TURNS {
                return self.unsupported(
                    context,
                    "a loop whose number of turns depends on values, or is too large to follow",
                );
            }
            if !self.terms.is(begins, true) {
                let (changes, back) = self.within(begins, |this| {
                    let left = this.statements(context, each.body)?;
                    this.after(context, each, left, unknown + 1)
                })?;
                self.merge(begins, changes, HashMap::new());
                return Ok(self.terms.and(begins, back));
            }
            let left = self.statements(context, each.body)?;
            let leaves = self.terms.or(left.exit, left.back);
            if !self.terms.is(leaves, false) {
                return self.after(context, each, left, unknown + 1);
            }
            let more = self.advances(context, each)?;
            if self.terms.is(more, false) {
                return Ok(more);
            }
            if !self.terms.is(more, true) {
                let (changes, back) =
                    self.within(more, |this| this.turns(context, each, unknown + 1))?;
                self.merge(more, changes, HashMap::new());
                return Ok(self.terms.and(more, back));
            }
        }
    }

    /// What follows a turn that may have left the loop.
    pub(super) fn after(
        &mut self,
        context: Context,
        each: &Loop<'_>,
        left: Left,
        unknown: u32,
    ) -> Result<Term> {
        let leaves = self.terms.or(left.exit, left.back);
        let stays = self.terms.not(leaves);
        if self.terms.is(stays, false) {
            return Ok(left.back);
        }
        let (changes, back) = self.within(stays, |this| {
            let more = this.advances(context, each)?;
            if this.terms.is(more, false) {
                return Ok(more);
            }
            let (changes, back) = this.within(more, |this| this.turns(context, each, unknown))?;
            this.merge(more, changes, HashMap::new());
            Ok(this.terms.and(more, back))
        })?;
        self.merge(stays, changes, HashMap::new());
        let later = self.terms.and(stays, back);
        Ok(self.terms.or(left.back, later))
    }
}
