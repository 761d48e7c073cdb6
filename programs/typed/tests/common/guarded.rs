//! Random assignments under a condition.

use understudy_typed::{
    Branch, Comparison, Elementary, Expression, ExpressionKind, Operation, Place, Statement,
    StatementKind, Type,
};

use super::code::{Writer, constant};

impl Writer<'_> {
    /// An assignment of at most one operation under a variable, a comparison or the test of a bit.
    pub(super) fn guarded(&mut self) -> StatementKind {
        let of = *self.to.random.pick(&[
            Elementary::Bool,
            Elementary::Int,
            Elementary::Udint,
            Elementary::Lint,
            Elementary::Real,
            Elementary::Lreal,
        ]);
        let Some(place) = self.place(&Type::Elementary(of), true) else {
            return self.assign();
        };
        let load = |place: &Place| Expression {
            of: place.of.clone(),
            kind: ExpressionKind::Load(Box::new(place.clone())),
        };
        let apply = |of, operation, operands| Expression {
            of: Type::Elementary(of),
            kind: ExpressionKind::Apply(operation, operands),
        };
        let value = match self.below(3) {
            0 if of != Elementary::Bool => {
                let added = constant(of, self.to.random.value(of) % 3);
                apply(of, Operation::Add(of), vec![load(&place), added])
            }
            1 => self.number(of, 1),
            _ => self.number(of, 0),
        };
        let condition = match self.below(3) {
            0 => self.number(Elementary::Bool, 0),
            1 => self.number(Elementary::Bool, 1),
            _ => {
                let mask = 1 << self.below(32);
                let word = self.number(Elementary::Dword, 0);
                let mask = constant(Elementary::Dword, mask);
                let (comparison, wanted) = match self.percent(50) {
                    true => (Comparison::Equal, mask.clone()),
                    false => (Comparison::NotEqual, constant(Elementary::Dword, 0)),
                };
                let and = Operation::And(Elementary::Dword);
                let masked = apply(Elementary::Dword, and, vec![word, mask]);
                let compare = Operation::Compare(comparison, Elementary::Dword);
                apply(Elementary::Bool, compare, vec![masked, wanted])
            }
        };
        let line = self.line;
        let body = vec![Statement { line, kind: StatementKind::Assign(place, value) }];
        StatementKind::If(vec![Branch { condition, body }], Vec::new())
    }
}
