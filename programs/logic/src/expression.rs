//! Boolean expressions with sharing.
//!
//! A [`Graph`] owns operations; an [`Expression`] is a reference into one graph. Invariant: an operation refers only to
//! operations before it, and no two operations of a graph are equal (hash-consing), so equal references mean equal
//! expressions, and walking the operations in order meets every operand before its use. Both hold from construction on.

use std::collections::{HashMap, HashSet};

/// What an expression depends on: an input or a register of a circuit, by its 0-based index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Variable {
    /// u(k+1).
    Input(u32),
    /// x(k+1).
    Register(u32),
}

/// A reference to an operation of one [`Graph`]; meaningless in another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Expression(u32);

impl Expression {
    /// Its place in [`Graph::operations`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One node of a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Operation {
    /// 0 or 1.
    Constant(bool),
    /// An input or a register.
    Variable(Variable),
    /// Negation.
    Not(Expression),
    /// Logical product.
    And(Expression, Expression),
    /// Logical sum.
    Or(Expression, Expression),
    /// Exclusive or, the sum of GF(2).
    Xor(Expression, Expression),
}

impl Operation {
    /// The expressions that it uses, none, one or two.
    pub fn operands(self) -> impl Iterator<Item = Expression> {
        let (first, second) = match self {
            Self::Constant(_) | Self::Variable(_) => (None, None),
            Self::Not(operand) => (Some(operand), None),
            Self::And(left, right) | Self::Or(left, right) | Self::Xor(left, right) => {
                (Some(left), Some(right))
            }
        };
        first.into_iter().chain(second)
    }
}

/// The owner of expressions.
///
/// The constructors simplify what is free to simplify: constants, double negation, an operand that occurs twice or next to
/// its own negation. They keep the order of operands, because a person reads the result.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    operations: Vec<Operation>,
    places: HashMap<Operation, Expression>,
}

impl Graph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// All operations; an operation refers only to those before it.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// The operation that `expression` refers to.
    pub fn operation(&self, expression: Expression) -> Operation {
        self.operations[expression.index()]
    }

    /// 0 or 1.
    pub fn constant(&mut self, value: bool) -> Expression {
        self.intern(Operation::Constant(value))
    }

    /// An input or a register.
    pub fn variable(&mut self, variable: Variable) -> Expression {
        self.intern(Operation::Variable(variable))
    }

    /// Negation.
    pub fn not(&mut self, operand: Expression) -> Expression {
        match self.operation(operand) {
            Operation::Constant(value) => self.constant(!value),
            Operation::Not(inner) => inner,
            _ => self.intern(Operation::Not(operand)),
        }
    }

    /// Logical product.
    pub fn and(&mut self, left: Expression, right: Expression) -> Expression {
        match (self.known(left), self.known(right)) {
            (Some(false), _) | (_, Some(false)) => self.constant(false),
            (Some(true), _) => right,
            (_, Some(true)) => left,
            _ if left == right => left,
            _ if self.opposite(left, right) => self.constant(false),
            _ => self.intern(Operation::And(left, right)),
        }
    }

    /// Logical sum.
    pub fn or(&mut self, left: Expression, right: Expression) -> Expression {
        match (self.known(left), self.known(right)) {
            (Some(true), _) | (_, Some(true)) => self.constant(true),
            (Some(false), _) => right,
            (_, Some(false)) => left,
            _ if left == right => left,
            _ if self.opposite(left, right) => self.constant(true),
            _ => self.intern(Operation::Or(left, right)),
        }
    }

    /// Exclusive or.
    pub fn xor(&mut self, left: Expression, right: Expression) -> Expression {
        match (self.known(left), self.known(right)) {
            (Some(false), _) => right,
            (_, Some(false)) => left,
            (Some(true), _) => self.not(right),
            (_, Some(true)) => self.not(left),
            _ if left == right => self.constant(false),
            _ if self.opposite(left, right) => self.constant(true),
            _ => self.intern(Operation::Xor(left, right)),
        }
    }

    /// `condition ∧ then ∨ ¬condition ∧ otherwise`.
    pub fn if_then_else(
        &mut self,
        condition: Expression,
        then: Expression,
        otherwise: Expression,
    ) -> Expression {
        if then == otherwise {
            return then;
        }
        let taken = self.and(condition, then);
        let negated = self.not(condition);
        let untaken = self.and(negated, otherwise);
        self.or(taken, untaken)
    }

    /// Logical product of any number; 1 for none.
    pub fn all(&mut self, operands: impl IntoIterator<Item = Expression>) -> Expression {
        let one = self.constant(true);
        operands.into_iter().fold(one, |left, right| self.and(left, right))
    }

    /// Logical sum of any number; 0 for none.
    pub fn any(&mut self, operands: impl IntoIterator<Item = Expression>) -> Expression {
        let zero = self.constant(false);
        operands.into_iter().fold(zero, |left, right| self.or(left, right))
    }

    /// Sum over GF(2) of any number; 0 for none.
    pub fn sum(&mut self, operands: impl IntoIterator<Item = Expression>) -> Expression {
        let zero = self.constant(false);
        operands.into_iter().fold(zero, |left, right| self.xor(left, right))
    }

    /// Copies `roots` of `other` into this graph, with each variable replaced by what `place` gives for it.
    ///
    /// Answers with the copies in the order of `roots`. Linear in the operations of `other` that the roots reach.
    pub fn import(
        &mut self,
        other: &Graph,
        roots: &[Expression],
        mut place: impl FnMut(&mut Self, Variable) -> Expression,
    ) -> Vec<Expression> {
        let reached = other.reached(roots);
        let mut copies: Vec<Option<Expression>> = vec![None; other.operations.len()];
        for (index, &operation) in other.operations.iter().enumerate() {
            if !reached[index] {
                continue;
            }
            let copy_of = |operand: Expression| {
                copies[operand.index()].expect("operands come before their use")
            };
            copies[index] = Some(match operation {
                Operation::Constant(value) => self.constant(value),
                Operation::Variable(variable) => place(self, variable),
                Operation::Not(operand) => self.not(copy_of(operand)),
                Operation::And(left, right) => self.and(copy_of(left), copy_of(right)),
                Operation::Or(left, right) => self.or(copy_of(left), copy_of(right)),
                Operation::Xor(left, right) => self.xor(copy_of(left), copy_of(right)),
            });
        }
        roots.iter().map(|root| copies[root.index()].expect("roots are reached")).collect()
    }

    /// For each operation, whether one of `roots` depends on it.
    pub fn reached(&self, roots: &[Expression]) -> Vec<bool> {
        let mut reached = vec![false; self.operations.len()];
        for root in roots {
            reached[root.index()] = true;
        }
        for index in (0..self.operations.len()).rev() {
            if reached[index] {
                for operand in self.operations[index].operands() {
                    reached[operand.index()] = true;
                }
            }
        }
        reached
    }

    /// The expressions that `root` depends on, itself included, operands before their use; `None` past `limit` of them.
    ///
    /// Its cost is that of the cone, however large the graph is.
    pub fn cone(&self, root: Expression, limit: usize) -> Option<Vec<Expression>> {
        let mut seen = HashSet::from([root]);
        let mut pending = vec![root];
        while let Some(expression) = pending.pop() {
            if seen.len() > limit {
                return None;
            }
            let operands = self.operation(expression).operands();
            pending.extend(operands.filter(|&operand| seen.insert(operand)));
        }
        let mut cone: Vec<Expression> = seen.into_iter().collect();
        cone.sort_unstable();
        (cone.len() <= limit).then_some(cone)
    }

    /// The value of `root` under an assignment: the naive reference for everything faster.
    pub fn evaluate(&self, root: Expression, assignment: impl Fn(Variable) -> bool) -> bool {
        let mut values = Vec::with_capacity(root.index() + 1);
        for operation in &self.operations[..=root.index()] {
            let value = |operand: Expression| -> bool { values[operand.index()] };
            values.push(match *operation {
                Operation::Constant(constant) => constant,
                Operation::Variable(variable) => assignment(variable),
                Operation::Not(operand) => !value(operand),
                Operation::And(left, right) => value(left) & value(right),
                Operation::Or(left, right) => value(left) | value(right),
                Operation::Xor(left, right) => value(left) ^ value(right),
            });
        }
        values[root.index()]
    }

    fn intern(&mut self, operation: Operation) -> Expression {
        *self.places.entry(operation).or_insert_with(|| {
            let place = u32::try_from(self.operations.len()).expect("fewer than 2^32 operations");
            self.operations.push(operation);
            Expression(place)
        })
    }

    fn known(&self, expression: Expression) -> Option<bool> {
        match self.operation(expression) {
            Operation::Constant(value) => Some(value),
            _ => None,
        }
    }

    fn opposite(&self, left: Expression, right: Expression) -> bool {
        self.operation(left) == Operation::Not(right)
            || self.operation(right) == Operation::Not(left)
    }
}
