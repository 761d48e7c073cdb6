//! IF and CASE: both sides are executed, and what they change is chosen by the condition.

use std::collections::HashMap;

use understudy_typed::{Case, Comparison, Statement, StatementKind};

use super::{Context, Execution, Left, Result};
use crate::term::Term;

/// Branches of one IF that are followed each within the one before.
const NESTED_BRANCHES: usize = 16;

impl Execution<'_> {
    pub(super) fn branches(
        &mut self,
        context: Context,
        branches: &[understudy_typed::Branch],
        otherwise: &[Statement],
    ) -> Result<Left> {
        if branches.len() > NESTED_BRANCHES {
            return self.many_branches(context, branches, otherwise);
        }
        let Some((first, rest)) = branches.split_first() else {
            return self.statements(context, otherwise);
        };
        let condition = self.number(context, &first.condition)?;
        if self.terms.is(condition, false) {
            self.keep(context, &first.body)?;
        }
        let left = self.either(
            condition,
            |this| this.statements(context, &first.body),
            |this| this.branches(context, rest, otherwise),
        )?;
        Ok(self.one_of(condition, left))
    }

    /// Assigns its value from before the scan to what statements that are never executed would assign: it is kept like what they assign elsewhere.
    fn keep(&mut self, context: Context, statements: &[Statement]) -> Result<()> {
        for statement in statements {
            if let StatementKind::Assign(place, _) = &statement.kind
                && let Some(of) = place.of.elementary()
                && place.indices.is_empty()
            {
                for (_, address) in self.places(context, place)? {
                    let value = self.get(address, of);
                    self.set(address, value);
                }
            }
        }
        Ok(())
    }

    /// As [`Self::branches`], one after the other: each under the condition that none before it was taken.
    fn many_branches(
        &mut self,
        context: Context,
        branches: &[understudy_typed::Branch],
        otherwise: &[Statement],
    ) -> Result<Left> {
        let mut left = self.staying();
        let mut open = self.terms.boolean(true);
        let mut all = Vec::new();
        for branch in branches {
            let (changes, condition) =
                self.within(open, |this| this.number(context, &branch.condition))?;
            self.merge(open, changes, HashMap::new());
            let here = self.terms.and(open, condition);
            self.side(context, here, &branch.body, &mut left, &mut all)?;
            let beyond = self.terms.not(condition);
            open = self.terms.and(open, beyond);
        }
        self.side(context, open, otherwise, &mut left, &mut all)?;
        self.merge_all(all);
        Ok(left)
    }

    /// Executes what is executed under a condition, and adds what it changes to `all`.
    fn side(
        &mut self,
        context: Context,
        condition: Term,
        body: &[Statement],
        left: &mut Left,
        all: &mut Vec<(Term, HashMap<u64, Term>)>,
    ) -> Result<()> {
        if self.terms.is(condition, false) {
            return Ok(());
        }
        let (changes, away) = self.within(condition, |this| this.statements(context, body))?;
        left.exit = self.terms.choose(condition, away.exit, left.exit);
        left.next = self.terms.choose(condition, away.next, left.next);
        left.back = self.terms.choose(condition, away.back, left.back);
        all.push((condition, changes));
        Ok(())
    }

    /// Keeps what was changed under conditions of which one at most holds.
    fn merge_all(&mut self, all: Vec<(Term, HashMap<u64, Term>)>) {
        for (condition, changes) in all {
            self.merge(condition, changes, HashMap::new());
        }
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
            self.side(context, condition, body, &mut left, &mut all)?;
        }
        self.merge_all(all);
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
