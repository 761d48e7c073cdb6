//! IF and CASE: both sides are executed, and what they change is chosen by the condition.

use std::collections::HashMap;

use understudy_typed::{Case, Comparison, Statement};

use super::{Context, Execution, Left, Result};
use crate::term::Term;

impl Execution<'_> {
    pub(super) fn branches(
        &mut self,
        context: Context,
        branches: &[understudy_typed::Branch],
        otherwise: &[Statement],
    ) -> Result<Left> {
        let Some((first, rest)) = branches.split_first() else {
            return self.statements(context, otherwise);
        };
        let condition = self.number(context, &first.condition)?;
        let left = self.either(
            condition,
            |this| this.statements(context, &first.body),
            |this| this.branches(context, rest, otherwise),
        )?;
        Ok(self.one_of(condition, left))
    }

    pub(super) fn cases(
        &mut self,
        context: Context,
        selector: Term,
        cases: &[Case],
        otherwise: &[Statement],
    ) -> Result<Left> {
        let mut left = self.staying();
        let mut open = self.terms.boolean(true);
        let mut sides = Vec::new();
        for case in cases {
            let mut inside = self.terms.boolean(false);
            for &(low, high) in &case.ranges {
                let here = self.between(selector, low.into(), high.into());
                inside = self.terms.or(inside, here);
            }
            sides.push((self.terms.and(open, inside), &case.body[..]));
            let outside = self.terms.not(inside);
            open = self.terms.and(open, outside);
        }
        sides.push((open, otherwise));
        let mut all = Vec::new();
        for (condition, body) in sides {
            if self.terms.is(condition, false) {
                continue;
            }
            let (changes, away) = self.within(condition, |this| this.statements(context, body))?;
            left.exit = self.terms.choose(condition, away.exit, left.exit);
            left.next = self.terms.choose(condition, away.next, left.next);
            left.back = self.terms.choose(condition, away.back, left.back);
            all.push((condition, changes));
        }
        // One condition at most holds.
        for (condition, changes) in all {
            self.merge(condition, changes, HashMap::new());
        }
        Ok(left)
    }

    /// Whether an integer lies between two numbers, which may lie outside its type.
    pub(super) fn between(&mut self, value: Term, low: i128, high: i128) -> Term {
        let of = self.terms.of(value);
        let (least, greatest) = of.limits();
        if low > greatest || high < least || low > high {
            return self.terms.boolean(false);
        }
        let mut side = |comparison, bound: i128| {
            let bound = self.terms.constant(of, bound as u64);
            self.terms.compare(comparison, value, bound)
        };
        if low == high {
            return side(Comparison::Equal, low);
        }
        let above = (low > least).then(|| side(Comparison::GreaterOrEqual, low));
        let below = (high < greatest).then(|| side(Comparison::LessOrEqual, high));
        match (above, below) {
            (Some(above), Some(below)) => self.terms.and(above, below),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => self.terms.boolean(true),
        }
    }
}
