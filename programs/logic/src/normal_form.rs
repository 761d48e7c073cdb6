//! Algebraic normal form: a function as the sum over GF(2) of products of variables.
//!
//! Invariant: it is canonical; two functions are equal exactly when their sets of monomials are. Its price is size, up to 2^n
//! monomials for n variables, so making one is bounded.

use std::collections::BTreeSet;
use std::collections::HashMap;

use crate::expression::{Expression, Graph, Operation, Variable};

/// A product of variables, each once; 1 if there are none.
///
/// The order is the one in which they are printed: by degree, then by variables.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Monomial(Vec<Variable>);

impl Monomial {
    /// Its variables, ascending.
    pub fn variables(&self) -> &[Variable] {
        &self.0
    }

    /// v·v = v.
    fn multiply(&self, other: &Self) -> Self {
        let mut product: Vec<Variable> = self.0.iter().chain(&other.0).copied().collect();
        product.sort_unstable();
        product.dedup();
        Self(product)
    }
}

impl Ord for Monomial {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.0.len(), &self.0).cmp(&(other.0.len(), &other.0))
    }
}

impl PartialOrd for Monomial {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// A normal form that would have become too large.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "U0410: the algebraic normal form passes {limit} monomials while it is multiplied out; print the factored form instead"
)]
pub struct TooManyMonomials {
    /// The bound that was set.
    pub limit: usize,
}

impl TooManyMonomials {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0410"
    }
}

/// The sum of a set of monomials; 0 if there are none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NormalForm(BTreeSet<Monomial>);

impl NormalForm {
    /// A bound that a person can still read and a machine makes in milliseconds.
    pub const DEFAULT_LIMIT: usize = 10_000;

    /// 0 or 1.
    pub fn constant(value: bool) -> Self {
        Self(value.then(Monomial::default).into_iter().collect())
    }

    /// A variable.
    pub fn variable(variable: Variable) -> Self {
        Self(BTreeSet::from([Monomial(vec![variable])]))
    }

    /// The normal form of `root`, by (3) and distribution.
    ///
    /// # Errors
    /// A product on the way has more than `limit` terms before equal ones cancel, or a sum more than `limit`.
    pub fn of(graph: &Graph, root: Expression, limit: usize) -> Result<Self, TooManyMonomials> {
        let cone = graph.cone(root, usize::MAX).unwrap_or_default();
        let mut forms: HashMap<Expression, Self> = HashMap::new();
        for expression in cone {
            let of = |operand: Expression| &forms[&operand];
            let form = match graph.operation(expression) {
                Operation::Constant(value) => Self::constant(value),
                Operation::Variable(variable) => Self::variable(variable),
                Operation::Not(operand) => Self::constant(true).add(of(operand), limit)?,
                Operation::And(left, right) => of(left).multiply(of(right), limit)?,
                Operation::Or(left, right) => of(left)
                    .add(of(right), limit)?
                    .add(&of(left).multiply(of(right), limit)?, limit)?,
                Operation::Xor(left, right) => of(left).add(of(right), limit)?,
            };
            forms.insert(expression, form);
        }
        Ok(forms.remove(&root).unwrap_or_default())
    }

    /// Its monomials in the order in which they are printed.
    pub fn monomials(&self) -> impl ExactSizeIterator<Item = &Monomial> {
        self.0.iter()
    }

    /// The value under an assignment.
    pub fn evaluate(&self, assignment: impl Fn(Variable) -> bool) -> bool {
        let ones = self
            .0
            .iter()
            .filter(|monomial| monomial.0.iter().all(|&variable| assignment(variable)));
        ones.count() % 2 == 1
    }

    /// The sum over GF(2).
    ///
    /// # Errors
    /// More than `limit` monomials.
    pub fn add(&self, other: &Self, limit: usize) -> Result<Self, TooManyMonomials> {
        let sum: BTreeSet<Monomial> = self.0.symmetric_difference(&other.0).cloned().collect();
        if sum.len() > limit {
            return Err(TooManyMonomials { limit });
        }
        Ok(Self(sum))
    }

    /// The product over GF(2).
    ///
    /// # Errors
    /// More than `limit` terms before equal ones cancel.
    pub fn multiply(&self, other: &Self, limit: usize) -> Result<Self, TooManyMonomials> {
        if self.0.len().saturating_mul(other.0.len()) > limit {
            return Err(TooManyMonomials { limit });
        }
        let mut product = BTreeSet::new();
        for left in &self.0 {
            for right in &other.0 {
                let term = left.multiply(right);
                if !product.remove(&term) {
                    product.insert(term);
                }
            }
        }
        Ok(Self(product))
    }
}
