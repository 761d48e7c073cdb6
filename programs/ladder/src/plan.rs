//! A circuit as assignments one after the other, as a ladder and Structured Text need it.
//!
//! Invariant: every expression is read from the old state x(t). What is shared comes first, then the outputs, then the
//! registers; a register is written at once where its old value is not read again, and otherwise its new value is
//! held until all have been computed. So the sequence of assignments equals the synchronous equations (1)-(2).

mod named;

use std::collections::BTreeSet;

use understudy_logic::{Circuit, Expression, Operation, Variable};

pub(crate) use named::Named;

/// Contacts or operands of one assignment past which a part gets an assignment of its own.
const MAXIMUM_OPERANDS: usize = 24;

/// What an assignment writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// The k-th shared expression.
    Shared(usize),
    /// The k-th output.
    Output(usize),
    /// The k-th register.
    Register(usize),
    /// The new value of the k-th register, to be taken over by [`Target::Takeover`].
    Next(usize),
    /// The k-th register from its held new value.
    Takeover(usize),
}

/// One assignment; the expression of a takeover is the register's next-state function, already held.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Assignment {
    pub(crate) target: Target,
    pub(crate) expression: Expression,
}

/// What an expression looks like to a writer of assignments.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Operand {
    Variable(Variable),
    Shared(usize),
    Operation(Operation),
}

/// All assignments of a circuit, in order.
pub(crate) struct Plan<'a> {
    circuit: &'a Circuit,
    pub(crate) assignments: Vec<Assignment>,
    pub(crate) shared_count: usize,
    /// For each operation, its number among the shared expressions.
    shared: Vec<Option<usize>>,
}

impl<'a> Plan<'a> {
    /// `twofold_xor` where the writer has no exclusive or and writes each of its operands twice.
    pub(crate) fn new(circuit: &'a Circuit, twofold_xor: bool) -> Self {
        let mut plan = Self {
            circuit,
            assignments: Vec::new(),
            shared_count: 0,
            shared: vec![None; circuit.graph().operations().len()],
        };
        plan.share(twofold_xor);
        for (index, output) in circuit.outputs().iter().enumerate() {
            plan.assign(Target::Output(index), output.value);
        }
        plan.registers();
        plan
    }

    fn assign(&mut self, target: Target, expression: Expression) {
        self.assignments.push(Assignment { target, expression });
    }

    /// How an expression is written where it is used. The top of an assignment is looked at with [`Plan::operation`].
    pub(crate) fn operand(&self, expression: Expression) -> Operand {
        match (self.shared[expression.index()], self.operation(expression)) {
            (Some(number), _) => Operand::Shared(number),
            (None, Operation::Variable(variable)) => Operand::Variable(variable),
            (None, operation) => Operand::Operation(operation),
        }
    }

    pub(crate) fn operation(&self, expression: Expression) -> Operation {
        self.circuit.graph().operation(expression)
    }

    /// Finds what is used more than once, or is too large, or must be a single operand.
    fn share(&mut self, twofold_xor: bool) {
        let operations = self.circuit.graph().operations();
        let roots = self.circuit.roots();
        let reached = self.circuit.graph().reached(&roots);
        let mut uses = vec![0_usize; operations.len()];
        let mut inner = vec![false; operations.len()];
        let mut single = vec![false; operations.len()];
        for root in roots {
            uses[root.index()] += 1;
        }
        for (index, operation) in operations.iter().enumerate().rev() {
            if !reached[index] {
                continue;
            }
            for operand in operation.operands() {
                let operand = operand.index();
                if matches!(operation, Operation::Not(_)) {
                    // A negation is written with its operand.
                    uses[operand] += uses[index];
                    inner[operand] |= inner[index];
                    single[operand] |= single[index];
                } else {
                    uses[operand] += 1;
                    inner[operand] = true;
                    single[operand] |= twofold_xor && matches!(operation, Operation::Xor(_, _));
                }
            }
        }
        let mut sizes = vec![1_usize; operations.len()];
        for (index, operation) in operations.iter().enumerate() {
            if !reached[index] {
                continue;
            }
            let (left, right) = match *operation {
                Operation::Constant(_) | Operation::Variable(_) => continue,
                Operation::Not(operand) => {
                    sizes[index] = sizes[operand.index()];
                    continue;
                }
                Operation::And(left, right)
                | Operation::Or(left, right)
                | Operation::Xor(left, right) => (left, right),
            };
            let twofold = twofold_xor && matches!(operation, Operation::Xor(_, _));
            let size = sizes[left.index()] + sizes[right.index()];
            let size = if twofold { 2 * size } else { size };
            let stands_alone = size > MAXIMUM_OPERANDS || single[index];
            if uses[index] > 1 || inner[index] && stands_alone {
                self.shared[index] = Some(self.shared_count);
                self.shared_count += 1;
            } else {
                sizes[index] = size;
            }
        }
        // Operands have lower numbers than what uses them, so this order computes before it reads.
        let mut shared: Vec<(usize, Expression)> = Vec::with_capacity(self.shared_count);
        let expressions = self.expressions();
        for (index, number) in self.shared.iter().enumerate() {
            if let (Some(number), Some(expression)) = (*number, expressions[index]) {
                shared.push((number, expression));
            }
        }
        for (number, expression) in shared {
            self.assign(Target::Shared(number), expression);
        }
    }

    /// The reference to each operation that a root or another operation refers to.
    fn expressions(&self) -> Vec<Option<Expression>> {
        let operations = self.circuit.graph().operations();
        let mut expressions = vec![None; operations.len()];
        let used = operations.iter().flat_map(|operation| operation.operands());
        for expression in used.chain(self.circuit.roots()) {
            expressions[expression.index()] = Some(expression);
        }
        expressions
    }

    fn registers(&mut self) {
        let registers = self.circuit.registers();
        let reads: Vec<BTreeSet<usize>> = (0..registers.len())
            .map(|index| {
                let mut read = BTreeSet::new();
                self.reads(registers[index].next, &mut read);
                read.remove(&index);
                read
            })
            .collect();
        let mut readers = vec![0_usize; registers.len()];
        for &read in reads.iter().flatten() {
            readers[read] += 1;
        }
        let mut free: BTreeSet<usize> =
            (0..registers.len()).filter(|&index| readers[index] == 0).collect();
        let mut waiting: BTreeSet<usize> = (0..registers.len()).collect();
        let mut held = Vec::new();
        while let Some(&first) = waiting.first() {
            let (index, target) = match free.pop_first() {
                Some(index) => (index, Target::Register(index)),
                None => (first, Target::Next(first)),
            };
            waiting.remove(&index);
            self.assign(target, registers[index].next);
            if target == Target::Next(index) {
                held.push(index);
            }
            for &read in &reads[index] {
                readers[read] -= 1;
                if readers[read] == 0 && waiting.contains(&read) {
                    free.insert(read);
                }
            }
        }
        held.sort_unstable();
        for index in held {
            self.assign(Target::Takeover(index), registers[index].next);
        }
    }

    /// The registers that the assignment of `expression` reads itself, not through what is shared.
    fn reads(&self, expression: Expression, read: &mut BTreeSet<usize>) {
        match self.operand(expression) {
            Operand::Shared(_) => {}
            Operand::Variable(Variable::Register(index)) => {
                read.insert(index as usize);
            }
            Operand::Variable(Variable::Input(_)) => {}
            Operand::Operation(operation) => {
                for operand in operation.operands() {
                    self.reads(operand, read);
                }
            }
        }
    }
}
