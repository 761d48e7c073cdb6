//! Values of a scan as expressions over the values before it: a graph of *terms*, each made once.
//!
//! Simplified is only what is free to simplify: constants, equal branches, Boolean identities. So a term of constants is a
//! constant, and a loop with constant bounds unrolls.

use std::collections::HashMap;
use std::fmt::Write as _;

use understudy_typed::{Comparison, Elementary, Operation};

/// A value; refers only to terms before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Term(u32);

/// What a term is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Node {
    /// A stored value.
    Constant(u64),
    /// An input, or the value of a cell before the scan.
    Variable(Variable),
    /// Any value, another one in each scan: what the abstraction does not follow.
    Unknown(u32),
    /// An operation without a fault; where the program has one, its result is not used.
    Apply(Operation, Box<[Term]>),
    /// The second where the first, a BOOL, is TRUE, else the third.
    Choose([Term; 3]),
}

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Variable {
    /// An input, by its number in the system.
    Input(u32),
    /// A cell of memory, by its number in the system.
    Cell(u32),
}

/// The owner of terms.
#[derive(Debug, Default)]
pub struct Terms {
    nodes: Vec<(Elementary, Node)>,
    known: HashMap<(Elementary, Node), Term>,
    unknowns: u32,
    /// Selections inside each other, of each term that is none of bits.
    depths: Vec<u32>,
    depth: u32,
    /// The statement that is executed now.
    pub(crate) statement: Made,
    /// The statement that made each term first.
    made: Vec<Made>,
}

/// A statement: its routine, counted over the programs of a system, and its line; line 0 outside of all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Made {
    pub(crate) routine: u32,
    pub(crate) line: u32,
}

impl Terms {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The term at a place, below [`Terms::len`]; its operands stand before it.
    pub(crate) fn at(&self, place: usize) -> Term {
        Term(place as u32)
    }

    /// What it is.
    pub fn node(&self, term: Term) -> &Node {
        &self.nodes[term.0 as usize].1
    }

    /// Its type.
    pub fn of(&self, term: Term) -> Elementary {
        self.nodes[term.0 as usize].0
    }

    /// Its stored value, of a constant.
    pub fn value(&self, term: Term) -> Option<u64> {
        match self.node(term) {
            Node::Constant(stored) => Some(*stored),
            _ => None,
        }
    }

    fn intern(&mut self, of: Elementary, node: Node) -> Term {
        let next = Term(u32::try_from(self.nodes.len()).expect("fewer than 2^32 terms"));
        let key = (of, node);
        if let Some(&term) = self.known.get(&key) {
            return term;
        }
        let depth = match &key.1 {
            Node::Choose([_, then, otherwise]) => {
                let of = |term: &Term| self.depths[term.0 as usize];
                1 + of(then).max(of(otherwise))
            }
            _ => 0,
        };
        self.made.push(self.statement);
        self.depths.push(depth);
        self.depth = self.depth.max(depth);
        self.nodes.push(key.clone());
        self.known.insert(key, next);
        next
    }

    /// The statement that made a term first; nothing for what none made.
    pub(crate) fn made(&self, term: Term) -> Option<Made> {
        self.made.get(term.0 as usize).copied().filter(|made| made.line > 0)
    }

    /// The most selections inside each other.
    pub(crate) fn depth(&self) -> u32 {
        self.depth
    }

    /// Terms that others depend on, the others included, each after its operands; the terms behind cells are asked for.
    pub fn reached(&self, roots: Vec<Term>, next: impl Fn(u32) -> Term) -> Vec<Term> {
        let mut seen = vec![false; self.nodes.len()];
        let mut pending = roots;
        while let Some(term) = pending.pop() {
            if std::mem::replace(&mut seen[term.0 as usize], true) {
                continue;
            }
            match self.node(term) {
                Node::Variable(Variable::Cell(cell)) => pending.push(next(*cell)),
                Node::Apply(_, operands) => pending.extend(operands.iter()),
                Node::Choose(parts) => pending.extend(parts),
                Node::Constant(_) | Node::Unknown(_) | Node::Variable(Variable::Input(_)) => {}
            }
        }
        let terms = (0..self.nodes.len() as u32).map(Term);
        terms.filter(|term| seen[term.0 as usize]).collect()
    }

    pub(crate) fn constant(&mut self, of: Elementary, stored: u64) -> Term {
        self.intern(of, Node::Constant(stored & of.mask()))
    }

    /// A constant BOOL.
    pub fn boolean(&mut self, value: bool) -> Term {
        self.constant(Elementary::Bool, u64::from(value))
    }

    pub(crate) fn variable(&mut self, of: Elementary, variable: Variable) -> Term {
        self.intern(of, Node::Variable(variable))
    }

    /// A new one at each call.
    pub(crate) fn unknown(&mut self, of: Elementary) -> Term {
        self.unknowns += 1;
        self.intern(of, Node::Unknown(self.unknowns))
    }

    /// Whether it is this truth value, whatever happens.
    pub fn is(&self, term: Term, value: bool) -> bool {
        self.value(term) == Some(u64::from(value))
    }

    /// The negation of a BOOL.
    pub fn not(&mut self, term: Term) -> Term {
        self.apply(Operation::Not(Elementary::Bool), Elementary::Bool, &[term])
    }

    /// Whether both BOOLs are TRUE.
    pub fn and(&mut self, left: Term, right: Term) -> Term {
        let and = Operation::And(Elementary::Bool);
        self.apply(and, Elementary::Bool, &[left, right])
    }

    /// Whether one of two BOOLs is TRUE.
    pub fn or(&mut self, left: Term, right: Term) -> Term {
        let or = Operation::Or(Elementary::Bool);
        self.apply(or, Elementary::Bool, &[left, right])
    }

    pub(crate) fn compare(&mut self, comparison: Comparison, left: Term, right: Term) -> Term {
        let operation = Operation::Compare(comparison, self.of(left));
        self.apply(operation, Elementary::Bool, &[left, right])
    }

    /// Whether `term` is the stored value.
    pub(crate) fn equals(&mut self, term: Term, stored: u64) -> Term {
        let constant = self.constant(self.of(term), stored);
        self.compare(Comparison::Equal, term, constant)
    }

    /// An operation on numbers whose result is of type `of`.
    pub(crate) fn apply(
        &mut self,
        operation: Operation,
        of: Elementary,
        operands: &[Term],
    ) -> Term {
        let values: Option<Vec<u64>> = operands.iter().map(|&term| self.value(term)).collect();
        if let Some(values) = values {
            // What is a fault has no result; the scan ends there.
            let result = operation.apply(&values).unwrap_or(0);
            return self.constant(of, result);
        }
        if let Some(simple) = self.simplified(operation, operands) {
            return simple;
        }
        match operation {
            Operation::Select(_) => self.choose(operands[0], operands[2], operands[1]),
            _ => self.intern(of, Node::Apply(operation, operands.into())),
        }
    }

    /// Identities of Boolean operations.
    fn simplified(&mut self, operation: Operation, operands: &[Term]) -> Option<Term> {
        let is_opposite = |this: &Self, left: Term, right: Term| {
            let negates = |one: Term, other: Term| match this.node(one) {
                Node::Apply(Operation::Not(Elementary::Bool), inner) => inner[0] == other,
                _ => false,
            };
            negates(left, right) || negates(right, left)
        };
        match (operation, operands) {
            (Operation::Not(Elementary::Bool), &[operand]) => match self.node(operand) {
                Node::Apply(Operation::Not(Elementary::Bool), inner) => Some(inner[0]),
                _ => None,
            },
            (Operation::And(Elementary::Bool), &[left, right]) => {
                if self.is(left, true) || left == right {
                    Some(right)
                } else if self.is(right, true) {
                    Some(left)
                } else if self.is(left, false)
                    || self.is(right, false)
                    || is_opposite(self, left, right)
                {
                    Some(self.boolean(false))
                } else {
                    None
                }
            }
            (Operation::Reinterpret(_, to), &[inner]) => match self.node(inner) {
                Node::Apply(Operation::Reinterpret(from, _), known) if *from == to => {
                    Some(known[0])
                }
                _ => None,
            },
            (Operation::Subtract(of), &[left, right]) if !of.is_real() => {
                self.difference(of, left, right)
            }
            (Operation::Or(Elementary::Bool), &[left, right]) => {
                if self.is(left, false) || left == right {
                    Some(right)
                } else if self.is(right, false) {
                    Some(left)
                } else if self.is(left, true)
                    || self.is(right, true)
                    || is_opposite(self, left, right)
                {
                    Some(self.boolean(true))
                } else {
                    None
                }
            }
            _ => None,
        }
    }

    /// left − (left − x) is x, and left − left is 0; so is it behind a selection.
    fn difference(&mut self, of: Elementary, left: Term, right: Term) -> Option<Term> {
        if left == right {
            return Some(self.constant(of, 0));
        }
        let reinterpreted = |this: &Self, term: Term| match this.node(term) {
            Node::Apply(Operation::Reinterpret(from, _), inner) if !from.is_real() => {
                Some((*from, inner[0]))
            }
            _ => None,
        };
        // Times are subtracted as whole numbers.
        if let (Some((from, one)), Some((other_from, other))) =
            (reinterpreted(self, left), reinterpreted(self, right))
            && from == other_from
        {
            let difference = self.apply(Operation::Subtract(from), from, &[one, other]);
            return Some(self.apply(Operation::Reinterpret(from, of), of, &[difference]));
        }
        match *self.node(right) {
            Node::Apply(Operation::Subtract(kind), ref operands)
                if kind == of && operands[0] == left =>
            {
                Some(operands[1])
            }
            Node::Choose([condition, then, otherwise]) => {
                // `TIME()`, or the cell that counts it.
                let is_time = match self.node(left) {
                    Node::Apply(Operation::Elapsed, _) => true,
                    Node::Variable(Variable::Cell(_)) => of == Elementary::Time,
                    _ => false,
                };
                let then = is_time.then(|| self.difference(of, left, then)).flatten()?;
                let otherwise = self.difference(of, left, otherwise)?;
                Some(self.choose(condition, then, otherwise))
            }
            _ => None,
        }
    }

    /// What is stored as one type, read as another of the same width; a part of it, or more than it, is not followed.
    pub(crate) fn as_type(&mut self, term: Term, of: Elementary) -> Term {
        let known = self.of(term);
        if known == of {
            return term;
        }
        match self.value(term) {
            Some(stored) => self.constant(of, stored),
            None if known.bits() == of.bits() => {
                self.apply(Operation::Reinterpret(known, of), of, &[term])
            }
            None => self.unknown(of),
        }
    }

    /// `then` where `condition` is TRUE, else `otherwise`.
    pub fn choose(&mut self, condition: Term, then: Term, otherwise: Term) -> Term {
        match self.value(condition) {
            Some(0) => return otherwise,
            Some(_) => return then,
            None if then == otherwise => return then,
            None => {}
        }
        let of = self.of(then);
        if of == Elementary::Bool {
            let taken = self.and(condition, then);
            let negated = self.not(condition);
            let untaken = self.and(negated, otherwise);
            return self.or(taken, untaken);
        }
        self.intern(of, Node::Choose([condition, then, otherwise]))
    }

    /// Terms with others in place of the variables that they depend on.
    pub(crate) fn replaced(
        &mut self,
        roots: &[Term],
        with: impl Fn(Variable, Term) -> Term,
    ) -> Vec<Term> {
        let Some(&first) = roots.first() else {
            return Vec::new();
        };
        let mut images: Vec<Option<Term>> = vec![None; self.nodes.len()];
        // Of this scan alone; operands stand first, so each has its image.
        for term in self.reached(roots.to_vec(), |_| first) {
            let image = |of: &Term| images[of.0 as usize].unwrap_or(*of);
            let (of, node) = self.nodes[term.0 as usize].clone();
            let made = match &node {
                Node::Constant(_) | Node::Unknown(_) => term,
                Node::Variable(variable) => with(*variable, term),
                Node::Apply(operation, operands) => {
                    let new: Vec<Term> = operands.iter().map(image).collect();
                    if new[..] == **operands { term } else { self.apply(*operation, of, &new) }
                }
                Node::Choose(parts) => {
                    let new = [0, 1, 2].map(|part| image(&parts[part]));
                    if new == *parts { term } else { self.choose(new[0], new[1], new[2]) }
                }
            };
            images[term.0 as usize] = Some(made);
        }
        roots.iter().map(|root| images[root.0 as usize].unwrap_or(*root)).collect()
    }

    /// The values of all terms, for values of the variables. Where an unknown value is reached it is 0.
    pub fn evaluate(&self, variable: impl Fn(Variable) -> u64) -> Vec<u64> {
        let mut values: Vec<u64> = Vec::with_capacity(self.nodes.len());
        let mut given = Vec::new();
        for (of, node) in &self.nodes {
            let of_term = |term: &Term| values[term.0 as usize];
            let value = match node {
                Node::Constant(stored) => *stored,
                Node::Variable(which) => variable(*which) & of.mask(),
                Node::Unknown(_) => 0,
                Node::Apply(operation, operands) => {
                    given.clear();
                    given.extend(operands.iter().map(of_term));
                    operation.apply(&given).unwrap_or(0)
                }
                Node::Choose([condition, then, otherwise]) => {
                    of_term(if of_term(condition) != 0 { then } else { otherwise })
                }
            };
            values.push(value);
        }
        values
    }

    /// Its place in what [`Terms::evaluate`] answers.
    pub fn index(term: Term) -> usize {
        term.0 as usize
    }

    /// The stored values that stand in the programs, each once, with their types.
    pub(crate) fn all_constants(&self) -> impl Iterator<Item = (Elementary, u64)> {
        self.nodes.iter().filter_map(|(of, node)| match node {
            Node::Constant(stored) => Some((*of, *stored)),
            _ => None,
        })
    }

    /// Stored values of a type that stand in the programs, each once.
    pub fn constants(&self, of: Elementary) -> Vec<u64> {
        let all = self.all_constants().filter(|(known, _)| *known == of);
        all.map(|(_, stored)| stored).collect()
    }

    /// The term as a person reads it, cut at a length.
    pub(crate) fn describe(&self, term: Term, name: &dyn Fn(Variable) -> String) -> String {
        let mut text = String::new();
        self.write(term, name, 4, &mut text);
        text
    }

    fn write(&self, term: Term, name: &dyn Fn(Variable) -> String, depth: u32, text: &mut String) {
        let Some(deeper) = depth.checked_sub(1) else {
            text.push('…');
            return;
        };
        match self.node(term) {
            Node::Constant(stored) => text.push_str(&self.of(term).text(*stored)),
            Node::Variable(variable) => text.push_str(&name(*variable)),
            Node::Unknown(_) => text.push_str("an unknown value"),
            Node::Choose(_) => text.push_str("a value by cases"),
            Node::Apply(operation, operands) => {
                let sign = sign(*operation);
                match (sign, &**operands) {
                    (_, &[operand])
                        if matches!(
                            operation,
                            Operation::Convert(..) | Operation::Reinterpret(..)
                        ) =>
                    {
                        self.write(operand, name, depth, text);
                    }
                    (Some(sign), &[left, right]) => {
                        let nested = depth < 4;
                        text.push_str(if nested { "(" } else { "" });
                        self.write(left, name, deeper, text);
                        let _ = write!(text, " {sign} ");
                        self.write(right, name, deeper, text);
                        text.push_str(if nested { ")" } else { "" });
                    }
                    _ if *operation == Operation::Elapsed => text.push_str("TIME()"),
                    _ => {
                        let debug = format!("{operation:?}");
                        let end = debug.find(['(', ' ']).unwrap_or(debug.len());
                        let _ = write!(text, "{}(", debug[..end].to_uppercase());
                        for (place, &operand) in operands.iter().enumerate() {
                            text.push_str(if place > 0 { ", " } else { "" });
                            self.write(operand, name, deeper, text);
                        }
                        text.push(')');
                    }
                }
            }
        }
    }
}

/// The sign of an operation on two operands.
fn sign(operation: Operation) -> Option<&'static str> {
    Some(match operation {
        Operation::Add(_) => "+",
        Operation::Subtract(_) => "-",
        Operation::Multiply(_) => "*",
        Operation::Divide(_) => "/",
        Operation::Modulo(_) => "MOD",
        Operation::And(_) => "AND",
        Operation::Or(_) => "OR",
        Operation::Xor(_) => "XOR",
        Operation::Compare(comparison, _) => comparison.sign(),
        _ => return None,
    })
}
