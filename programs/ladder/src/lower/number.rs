//! Unsigned numbers as expressions, the low bit first.

use understudy_logic::{Expression, Graph};

use crate::program::Relation;

/// Bits of a number, the low one first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Number(pub(super) Vec<Expression>);

/// Bits that a number from 0 to `maximum` needs.
pub(super) fn width(maximum: u64) -> usize {
    (u64::BITS - maximum.leading_zeros()) as usize
}

impl Number {
    /// True where it is `value`.
    pub(super) fn equals(&self, graph: &mut Graph, value: u64) -> Expression {
        if width(value) > self.0.len() {
            return graph.constant(false);
        }
        let mut bits = Vec::with_capacity(self.0.len());
        for (place, &bit) in self.0.iter().enumerate() {
            let expected = value >> place & 1 == 1;
            bits.push(if expected { bit } else { graph.not(bit) });
        }
        graph.all(bits)
    }

    /// True where it is `value` or more: from the low bit up, the highest bit that differs decides.
    fn at_least(&self, graph: &mut Graph, value: u64) -> Expression {
        if width(value) > self.0.len() {
            return graph.constant(false);
        }
        let mut holds = graph.constant(true);
        for (place, &bit) in self.0.iter().enumerate() {
            holds =
                if value >> place & 1 == 1 { graph.and(bit, holds) } else { graph.or(bit, holds) };
        }
        holds
    }

    /// True where the relation holds between it and `value`.
    pub(super) fn compare(&self, graph: &mut Graph, relation: Relation, value: u64) -> Expression {
        match relation {
            Relation::Equal => self.equals(graph, value),
            Relation::NotEqual => {
                let equal = self.equals(graph, value);
                graph.not(equal)
            }
            Relation::GreaterOrEqual => self.at_least(graph, value),
            Relation::Greater => self.at_least(graph, value + 1),
            Relation::Less => {
                let at_least = self.at_least(graph, value);
                graph.not(at_least)
            }
            Relation::LessOrEqual => {
                let more = self.at_least(graph, value + 1);
                graph.not(more)
            }
        }
    }

    /// One more where `enable` holds; the caller sees to it that it does not overflow.
    pub(super) fn increment(&self, graph: &mut Graph, enable: Expression) -> Self {
        let mut carry = enable;
        let mut bits = Vec::with_capacity(self.0.len());
        for &bit in &self.0 {
            bits.push(graph.xor(bit, carry));
            carry = graph.and(carry, bit);
        }
        Self(bits)
    }

    /// One less where `enable` holds; the caller sees to it that it does not underflow.
    pub(super) fn decrement(&self, graph: &mut Graph, enable: Expression) -> Self {
        let mut borrow = enable;
        let mut bits = Vec::with_capacity(self.0.len());
        for &bit in &self.0 {
            bits.push(graph.xor(bit, borrow));
            let low = graph.not(bit);
            borrow = graph.and(borrow, low);
        }
        Self(bits)
    }

    /// The number where `keep` holds, else 0.
    pub(super) fn masked(&self, graph: &mut Graph, keep: Expression) -> Self {
        Self(self.0.iter().map(|&bit| graph.and(keep, bit)).collect())
    }

    /// `value` where `load` holds, else the number.
    pub(super) fn loaded(&self, graph: &mut Graph, load: Expression, value: u64) -> Self {
        let keep = graph.not(load);
        let bits = self.0.iter().enumerate().map(|(place, &bit)| {
            if value >> place & 1 == 1 { graph.or(load, bit) } else { graph.and(keep, bit) }
        });
        Self(bits.collect())
    }
}
