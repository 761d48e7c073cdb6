//! Factored polynomials over GF(2), as the paper prints them in (30)-(35):
//!
//! ```text
//! u13(1+u15)((1+u12)x11 + u11u15(1 + x11 + u12x11))
//! ```
//!
//! Made from a Boolean expression by (3), which leaves open in what form a sum of sums is written. The rules:
//!
//! - `a ∨ b` is `b + a(1 + b)`, with `1 + b` multiplied out, where b is short; it is multiplied out altogether where a is a single
//!   variable; and it is `1 + (1 + a)(1 + b)` where neither is short, where one is a negation, or where there are more than two.
//! - A variable that is a factor is 1 in the other factors, since v·v = v.
//!
//! Invariant: no sum directly in a sum, no product in a product, no constants but a leading 1 of a sum, no equal terms or factors.

use std::collections::BTreeSet;

use crate::expression::{Expression, Graph, Operation, Variable};
use crate::normal_form::NormalForm;
use crate::notation::{FormulaTooLarge, chain, check_size};

/// Multiplied out, a short operand of ∨ has at most so many monomials.
const SHORT: usize = 4;

/// A polynomial as a tree.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Polynomial {
    /// 0 or 1.
    Constant(bool),
    /// A variable.
    Variable(Variable),
    /// Two terms or more.
    Sum(Vec<Polynomial>),
    /// Two factors or more.
    Product(Vec<Polynomial>),
}

impl Polynomial {
    /// The transformation (3) of `root`.
    ///
    /// # Errors
    /// It is too large for a person.
    pub fn of(graph: &Graph, root: Expression) -> Result<Self, FormulaTooLarge> {
        check_size(graph, root)?;
        let polynomial = convert(graph, root).assuming(&BTreeSet::new());
        Ok(polynomial)
    }

    /// Its algebraic normal form; `None` past `limit` monomials.
    pub fn normal_form(&self, limit: usize) -> Option<NormalForm> {
        match self {
            Self::Constant(value) => Some(NormalForm::constant(*value)),
            Self::Variable(variable) => Some(NormalForm::variable(*variable)),
            Self::Sum(terms) => terms.iter().try_fold(NormalForm::constant(false), |sum, term| {
                sum.add(&term.normal_form(limit)?, limit).ok()
            }),
            Self::Product(factors) => {
                factors.iter().try_fold(NormalForm::constant(true), |product, factor| {
                    product.multiply(&factor.normal_form(limit)?, limit).ok()
                })
            }
        }
    }

    /// The value under an assignment.
    pub fn evaluate(&self, assignment: &dyn Fn(Variable) -> bool) -> bool {
        match self {
            Self::Constant(value) => *value,
            Self::Variable(variable) => assignment(*variable),
            Self::Sum(terms) => {
                terms.iter().fold(false, |sum, term| sum ^ term.evaluate(assignment))
            }
            Self::Product(factors) => factors.iter().all(|factor| factor.evaluate(assignment)),
        }
    }

    /// The text, with `sign` between factors; symbols such as `u13` need none, names do.
    pub fn print(&self, name: &dyn Fn(Variable) -> String, sign: &str) -> String {
        let mut text = String::new();
        self.write(name, sign, &mut text);
        text
    }

    fn write(&self, name: &dyn Fn(Variable) -> String, sign: &str, text: &mut String) {
        match self {
            Self::Constant(value) => text.push(if *value { '1' } else { '0' }),
            Self::Variable(variable) => text.push_str(&name(*variable)),
            Self::Sum(terms) => {
                let plus = if self.complemented().is_some() { "+" } else { " + " };
                for (place, term) in terms.iter().enumerate() {
                    if place > 0 {
                        text.push_str(plus);
                    }
                    term.write(name, sign, text);
                }
            }
            Self::Product(factors) => {
                for (place, factor) in factors.iter().enumerate() {
                    if place > 0 {
                        text.push_str(sign);
                    }
                    if matches!(factor, Self::Sum(_)) {
                        text.push('(');
                        factor.write(name, sign, text);
                        text.push(')');
                    } else {
                        factor.write(name, sign, text);
                    }
                }
            }
        }
    }

    /// v, if this is 1 + v.
    fn complemented(&self) -> Option<Variable> {
        match self {
            Self::Sum(terms) => match terms.as_slice() {
                [Self::Constant(true), Self::Variable(variable)] => Some(*variable),
                _ => None,
            },
            _ => None,
        }
    }

    /// v, if this is v or 1 + v.
    fn literal(&self) -> Option<Variable> {
        match self {
            Self::Variable(variable) => Some(*variable),
            _ => self.complemented(),
        }
    }

    fn is_product_of_literals(&self) -> bool {
        match self {
            Self::Product(factors) => factors.iter().all(|factor| factor.literal().is_some()),
            _ => self.literal().is_some(),
        }
    }

    /// The same polynomial where all of `ones` are 1, with the factors of each product assumed in each other.
    fn assuming(self, ones: &BTreeSet<Variable>) -> Self {
        match self {
            Self::Constant(_) => self,
            Self::Variable(variable) if ones.contains(&variable) => Self::Constant(true),
            Self::Variable(_) => self,
            Self::Sum(terms) => sum(terms.into_iter().map(|term| term.assuming(ones))),
            Self::Product(factors) => {
                let mut own = ones.clone();
                own.extend(factors.iter().filter_map(|factor| match factor {
                    Self::Variable(variable) => Some(*variable),
                    _ => None,
                }));
                product(factors.into_iter().map(|factor| match factor {
                    Self::Variable(_) => factor.assuming(ones),
                    _ => factor.assuming(&own),
                }))
            }
        }
    }
}

impl From<&NormalForm> for Polynomial {
    fn from(form: &NormalForm) -> Self {
        sum(form.monomials().map(|monomial| {
            product(monomial.variables().iter().map(|&variable| Self::Variable(variable)))
        }))
    }
}

/// Flattened; equal terms cancel; a 1 comes first.
fn sum(terms: impl IntoIterator<Item = Polynomial>) -> Polynomial {
    let mut one = false;
    let mut kept: Vec<Polynomial> = Vec::new();
    let mut add = |term: Polynomial| match term {
        Polynomial::Constant(value) => one ^= value,
        _ => match kept.iter().position(|other| *other == term) {
            Some(place) => {
                kept.remove(place);
            }
            None => kept.push(term),
        },
    };
    for term in terms {
        match term {
            Polynomial::Sum(inner) => inner.into_iter().for_each(&mut add),
            _ => add(term),
        }
    }
    if one {
        kept.insert(0, Polynomial::Constant(true));
    }
    match kept.len() {
        0 => Polynomial::Constant(false),
        1 => kept.remove(0),
        _ => Polynomial::Sum(kept),
    }
}

/// Flattened; equal factors are one; literals come first, by their variables.
fn product(factors: impl IntoIterator<Item = Polynomial>) -> Polynomial {
    let mut kept: Vec<Polynomial> = Vec::new();
    let mut zero = false;
    let mut multiply = |factor: Polynomial| match factor {
        Polynomial::Constant(value) => zero |= !value,
        _ if kept.contains(&factor) => {}
        _ => kept.push(factor),
    };
    for factor in factors {
        match factor {
            Polynomial::Product(inner) => inner.into_iter().for_each(&mut multiply),
            _ => multiply(factor),
        }
    }
    if zero {
        return Polynomial::Constant(false);
    }
    kept.sort_by_key(|factor| {
        let literal = factor.literal();
        (literal.is_none(), literal)
    });
    match kept.len() {
        0 => Polynomial::Constant(true),
        1 => kept.remove(0),
        _ => Polynomial::Product(kept),
    }
}

fn complement(polynomial: Polynomial) -> Polynomial {
    sum([Polynomial::Constant(true), polynomial])
}

/// Chain by chain, so that the recursion is as deep as the formula is nested, which is bounded.
fn convert(graph: &Graph, root: Expression) -> Polynomial {
    let operation = graph.operation(root);
    match operation {
        Operation::Constant(value) => return Polynomial::Constant(value),
        Operation::Variable(variable) => return Polynomial::Variable(variable),
        Operation::Not(operand) => return complement(convert(graph, operand)),
        _ => {}
    }
    let chain = chain(graph, root);
    let is_negation = |&operand: &Expression| matches!(graph.operation(operand), Operation::Not(_));
    let one_is_negated = chain.iter().any(is_negation);
    let mut operands = chain.into_iter().map(|operand| convert(graph, operand));
    match operation {
        Operation::And(..) => product(operands),
        Operation::Xor(..) => sum(operands),
        _ => match (operands.next(), operands.next(), operands.len()) {
            (Some(a), Some(b), 0) if !one_is_negated => either(a, b),
            (a, b, _) => none(a.into_iter().chain(b).chain(operands)),
        },
    }
}

/// ¬(¬a ∧ ¬b ∧ ..) → 1 + (1 + a)(1 + b)..
fn none(operands: impl IntoIterator<Item = Polynomial>) -> Polynomial {
    complement(product(operands.into_iter().map(complement)))
}

/// a ∨ b → a + b + ab.
fn either(a: Polynomial, b: Polynomial) -> Polynomial {
    let short = |side: &Polynomial| side.normal_form(SHORT);
    for (a, b) in [(&a, &b), (&b, &a)] {
        let Some(form) = short(b) else { continue };
        let multiplied = Polynomial::from(&form);
        if let Polynomial::Variable(variable) = *a
            && let Some(all) = multiplied_out(&NormalForm::variable(variable), &form)
        {
            return all;
        }
        let alone = if b.is_product_of_literals() { b.clone() } else { multiplied.clone() };
        return sum([alone, product([a.clone(), complement(multiplied)])]);
    }
    none([a, b])
}

/// a + b + ab.
fn multiplied_out(a: &NormalForm, b: &NormalForm) -> Option<Polynomial> {
    let limit = 2 * SHORT + 1;
    let product = a.multiply(b, limit).ok()?;
    let all = a.add(b, limit).ok()?.add(&product, limit).ok()?;
    Some(Polynomial::from(&all))
}
