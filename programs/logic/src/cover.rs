//! Short Boolean formulas: an irredundant sum of products of a function, and its factored form.
//!
//! The cover is the one of Minato and Morreale, computed on the diagram; it is irredundant: no product can be left out. The
//! factored form is found by weak division (Brayton), in the shape of (39) and (40).

use std::collections::BTreeMap;

use crate::bdd::{BddError, Diagram, Diagrams};
use crate::expression::{Expression, Graph, Variable};

/// A variable or its negation; positive ones come first, as in (40).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal {
    /// ¬v instead of v.
    pub negated: bool,
    /// v.
    pub variable: Variable,
}

/// Why there is no short formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CoverError {
    /// As a sum of products it is long.
    #[error("U0414: the sum of products has more than {limit} products")]
    TooManyProducts {
        /// The bound that was set.
        limit: usize,
    },
    /// The diagrams on the way are too large.
    #[error(transparent)]
    Diagram(#[from] BddError),
}

impl CoverError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::TooManyProducts { .. } => "U0414",
            Self::Diagram(error) => error.code(),
        }
    }
}

/// A product of literals, ascending.
type Product = Vec<Literal>;

/// A sum of products of literals.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Cover(Vec<Product>);

impl Cover {
    /// Products, at most, of a formula that a person reads.
    pub const DEFAULT_LIMIT: usize = 200;

    /// The irredundant cover of `diagram`, with at most `limit` products.
    ///
    /// # Errors
    /// More products, or too many nodes.
    pub fn of(diagrams: &Diagrams, diagram: &Diagram, limit: usize) -> Result<Self, CoverError> {
        let mut search = Search {
            diagrams,
            limit,
            // A product is found after at most so many steps of which some find none.
            steps: limit.saturating_mul(diagrams.variables().len().max(16)),
        };
        let (mut products, _) = diagrams.deep(|| search.between(diagram, diagram))?;
        products.iter_mut().for_each(|product| product.sort());
        Ok(Self(products))
    }

    /// Its products, each a list of ascending literals; none for 0, an empty one for 1.
    pub fn products(&self) -> &[Vec<Literal>] {
        &self.0
    }

    /// The two-level formula.
    pub fn sum_of_products(&self, graph: &mut Graph) -> Expression {
        let products: Vec<Expression> =
            self.0.iter().map(|product| conjunction(graph, product)).collect();
        graph.any(products)
    }

    /// The factored formula, such as `(u15 ∨ ¬u13 ∨ ¬x31) ∧ x38 ∧ ¬u23 ∨ (u23 ∨ ¬x38) ∧ u13 ∧ x31 ∧ ¬u15`.
    pub fn factored(&self, graph: &mut Graph) -> Expression {
        factor(graph, &self.0)
    }
}

struct Search<'a> {
    diagrams: &'a Diagrams,
    limit: usize,
    steps: usize,
}

impl Search<'_> {
    /// An irredundant cover of some function between `lower` and `upper`, and that function.
    fn between(
        &mut self,
        lower: &Diagram,
        upper: &Diagram,
    ) -> Result<(Vec<Product>, Diagram), CoverError> {
        let diagrams = self.diagrams;
        if lower.is_constant(false) {
            return Ok((Vec::new(), diagrams.constant(false)));
        }
        let tops = [diagrams.top(lower), diagrams.top(upper)];
        let Some(top) = tops.into_iter().flatten().min() else {
            return Ok((vec![Product::new()], diagrams.constant(true)));
        };
        if upper.is_constant(true) {
            return Ok((vec![Product::new()], diagrams.constant(true)));
        }
        let too_many = CoverError::TooManyProducts { limit: self.limit };
        self.steps = self.steps.checked_sub(1).ok_or(too_many)?;
        let (lower_zero, lower_one) = diagrams.cofactors(lower, top);
        let (upper_zero, upper_one) = diagrams.cofactors(upper, top);
        let without = |from: &Diagram, what: &Diagram| diagrams.and(from, &diagrams.not(what)?);
        let (zero, zero_function) =
            self.between(&without(&lower_zero, &upper_one)?, &upper_zero)?;
        let (one, one_function) = self.between(&without(&lower_one, &upper_zero)?, &upper_one)?;
        let rest = diagrams
            .or(&without(&lower_zero, &zero_function)?, &without(&lower_one, &one_function)?)?;
        let (both, both_function) = self.between(&rest, &diagrams.and(&upper_zero, &upper_one)?)?;
        let variable = diagrams.variable_at(top);
        let literal = |negated| Literal { negated, variable };
        let mut products = both;
        for (found, negated) in [(one, false), (zero, true)] {
            products.extend(found.into_iter().map(|mut product| {
                product.push(literal(negated));
                product
            }));
        }
        if products.len() > self.limit {
            return Err(too_many);
        }
        let decision = diagrams.variable(variable)?;
        let when_one = diagrams.and(&decision, &one_function)?;
        let when_zero = without(&zero_function, &decision)?;
        let function = diagrams.or(&diagrams.or(&when_one, &when_zero)?, &both_function)?;
        Ok((products, function))
    }
}

fn conjunction(graph: &mut Graph, literals: &[Literal]) -> Expression {
    let factors: Vec<Expression> = literals
        .iter()
        .map(|literal| {
            let variable = graph.variable(literal.variable);
            if literal.negated { graph.not(variable) } else { variable }
        })
        .collect();
    graph.all(factors)
}

/// Sums before literals in a product, the longer term first in a sum; each step removes at least one literal, and so it ends.
fn factor(graph: &mut Graph, products: &[Product]) -> Expression {
    let mut counts: BTreeMap<Literal, usize> = BTreeMap::new();
    for &literal in products.iter().flatten() {
        *counts.entry(literal).or_default() += 1;
    }
    let most = counts.values().max().copied().unwrap_or(0);
    if most <= 1 || products.len() <= 1 {
        let mut short_first = products.to_vec();
        short_first.sort_by_key(|product| (product.len(), product.clone()));
        return Cover(short_first).sum_of_products(graph);
    }
    let Some((&best, _)) = counts.iter().find(|(_, count)| **count == most) else {
        return graph.constant(false);
    };
    let (with, without): (Vec<Product>, Vec<Product>) =
        products.iter().cloned().partition(|product| product.contains(&best));
    let common: Product = with[0]
        .iter()
        .copied()
        .filter(|literal| with.iter().all(|product| product.contains(literal)))
        .collect();
    let quotient: Vec<Product> = with.iter().map(|product| minus(product, &common)).collect();
    let (others, rest) = divide(&without, &quotient);
    let sum = factor(graph, &quotient);
    let term = if others.is_empty() {
        let literals = conjunction(graph, &common);
        graph.and(sum, literals)
    } else {
        let mut divisors = others;
        divisors.push(common);
        let divisor = factor(graph, &divisors);
        graph.and(divisor, sum)
    };
    let remainder = factor(graph, &rest);
    graph.or(term, remainder)
}

/// Weak division: the products q with q · d among `dividend` for every d of `divisor`, and what is left.
fn divide(dividend: &[Product], divisor: &[Product]) -> (Vec<Product>, Vec<Product>) {
    let mut quotient: Vec<Product> = Vec::new();
    let mut rest = dividend.to_vec();
    let times = |left: &Product, right: &Product| {
        let mut product: Product = left.iter().chain(right).copied().collect();
        product.sort();
        product
    };
    for product in dividend {
        if !divisor[0].iter().all(|literal| product.contains(literal)) {
            continue;
        }
        let candidate = minus(product, &divisor[0]);
        let multiples: Vec<Product> = divisor.iter().map(|d| times(&candidate, d)).collect();
        if multiples.iter().all(|multiple| rest.contains(multiple)) {
            rest.retain(|product| !multiples.contains(product));
            quotient.push(candidate);
        }
    }
    (quotient, rest)
}

fn minus(product: &Product, literals: &[Literal]) -> Product {
    let kept = |literal: &&Literal| !literals.contains(literal);
    product.iter().filter(kept).copied().collect()
}
