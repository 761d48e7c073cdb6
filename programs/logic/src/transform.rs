//! The transformations between Boolean algebra and GF(2), on graphs, with their sharing kept.
//!
//! ```text
//! a ∨ b → a + b + ab     a ∧ b → ab     ¬a → 1 + a             (3)
//! a + b → (a ∧ ¬b) ∨ (¬a ∧ b)           ab → a ∧ b             (6)
//! ```
//!
//! One [`Graph`] holds both: `Xor` is the sum and `And` the product of GF(2), and `Not` is 1 + a. A graph without `Or`
//! is one of polynomials, a graph without `Xor` is one of Boolean functions. Both directions are linear.

use crate::expression::{Expression, Graph, Operation};

/// The transformation (3): the same functions in sums, products and 1 + a alone, in the order of `roots`.
pub fn to_field(graph: &Graph, roots: &[Expression]) -> (Graph, Vec<Expression>) {
    let mut target = Graph::new();
    let copies = target.copy(graph, roots, |target, operation| match operation {
        Operation::Or(left, right) => {
            let sum = target.xor(left, right);
            let product = target.and(left, right);
            target.xor(sum, product)
        }
        same => target.apply(same),
    });
    (target, copies)
}

/// The inverse transformation (6): the same functions in ∨, ∧ and ¬ alone, in the order of `roots`.
pub fn to_boolean(graph: &Graph, roots: &[Expression]) -> (Graph, Vec<Expression>) {
    let mut target = Graph::new();
    let copies = target.copy(graph, roots, |target, operation| match operation {
        Operation::Xor(left, right) => {
            let not_right = target.not(right);
            let not_left = target.not(left);
            let first = target.and(left, not_right);
            let second = target.and(not_left, right);
            target.or(first, second)
        }
        same => target.apply(same),
    });
    (target, copies)
}
