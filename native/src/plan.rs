//! What is computed in which order, and where it is kept.
//!
//! All values of a run stand in one row of words, the frame:
//!
//! ```text
//! ┌────────┬───────────┬─────────┬───────────┐
//! │ inputs │ registers │ outputs │ temporary │
//! └────────┴───────────┴─────────┴───────────┘
//! ```
//!
//! A *statement* computes one tree of operations out of words of the frame, and stores its root. What only one tree uses is part of that tree; what
//! several use is a statement of its own, and read back. In the code of a ladder this is: one statement a rung.
//!
//! Invariant: a statement reads the *old* value of a register, as (1)-(2) demand. So a register is overwritten at once where nothing further
//! down reads its old value, which is so for most registers of a ladder; otherwise its new value waits in a temporary word until the end.

use std::collections::HashMap;

use understudy_logic::{Circuit, Expression, Graph, Operation, Variable};

/// Operations inside each other past which a part becomes a statement: what walks a tree is recursive.
const MAXIMUM_DEPTH: u32 = 32;

/// An operation and whether its negation is meant. Negations are never operations of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Literal {
    pub(crate) expression: Expression,
    pub(crate) negated: bool,
}

impl Literal {
    pub(crate) fn of(graph: &Graph, expression: Expression) -> Self {
        match graph.operation(expression) {
            // The graph has no double negation.
            Operation::Not(operand) => Self {
                expression: operand,
                negated: true,
            },
            _ => Self {
                expression,
                negated: false,
            },
        }
    }
}

/// What a copy reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// 0
    Zero,
    /// A word of the frame.
    Word(usize),
    /// The word in which a statement left its root.
    Root(Expression),
}

/// `to` := `from`, negated or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Copy {
    pub(crate) from: Source,
    pub(crate) negated: bool,
    pub(crate) to: usize,
}

/// One tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Statement {
    pub(crate) root: Expression,
    /// Registers and outputs that become the root, or its negation.
    pub(crate) stores: Vec<(usize, bool)>,
    /// Where the root is kept, as itself or negated, when it has no store and others read it.
    pub(crate) temporary: Option<usize>,
}

/// A whole step.
#[derive(Debug, Clone)]
pub(crate) struct Plan<'c> {
    pub(crate) circuit: &'c Circuit,
    /// Before anything is overwritten.
    pub(crate) first: Vec<Copy>,
    pub(crate) statements: Vec<Statement>,
    /// When nothing reads old registers any more.
    pub(crate) last: Vec<Copy>,
    pub(crate) words: usize,
}

/// Places in the frame.
pub(crate) struct Places {
    pub(crate) registers: usize,
    pub(crate) outputs: usize,
    pub(crate) temporary: usize,
}

impl Places {
    pub(crate) fn of(circuit: &Circuit) -> Self {
        let registers = circuit.inputs().len();
        let outputs = registers + circuit.registers().len();
        Self {
            registers,
            outputs,
            temporary: outputs + circuit.outputs().len(),
        }
    }

    pub(crate) fn variable(&self, variable: Variable) -> usize {
        match variable {
            Variable::Input(input) => input as usize,
            Variable::Register(register) => self.registers + register as usize,
        }
    }
}

fn is_leaf(operation: Operation) -> bool {
    matches!(operation, Operation::Constant(_) | Operation::Variable(_))
}

impl<'c> Plan<'c> {
    /// Linear in the operations that the roots reach.
    pub(crate) fn new(circuit: &'c Circuit) -> Self {
        let graph = circuit.graph();
        let places = Places::of(circuit);
        let statements = statements(circuit);
        let position: HashMap<Expression, usize> = statements
            .iter()
            .enumerate()
            .map(|(position, root)| (*root, position))
            .collect();
        let mut plan = Self {
            circuit,
            first: Vec::new(),
            statements: Vec::with_capacity(statements.len()),
            last: Vec::new(),
            words: places.temporary,
        };
        let mut last_read = vec![0; circuit.registers().len()];
        for (place, &root) in statements.iter().enumerate() {
            plan.statements.push(Statement {
                root,
                stores: Vec::new(),
                temporary: None,
            });
            for_each_leaf(graph, root, &position, &mut |leaf| {
                if let Operation::Variable(Variable::Register(register)) = graph.operation(leaf) {
                    last_read[register as usize] = place;
                }
            });
        }
        for (output, value) in circuit.outputs().iter().enumerate() {
            let to = places.outputs + output;
            let literal = Literal::of(graph, value.value);
            match position.get(&literal.expression) {
                Some(&place) => plan.statements[place].stores.push((to, literal.negated)),
                None => {
                    let copy = plan.leaf(literal, to, &places);
                    plan.first.push(copy);
                }
            }
        }
        for (register, definition) in circuit.registers().iter().enumerate() {
            let to = places.registers + register;
            let literal = Literal::of(graph, definition.next);
            match position.get(&literal.expression) {
                Some(&place) if place >= last_read[register] => {
                    plan.statements[place].stores.push((to, literal.negated));
                }
                Some(_) => plan.last.push(Copy {
                    from: Source::Root(literal.expression),
                    negated: literal.negated,
                    to,
                }),
                None => plan.leaf_register(literal, to, &places),
            }
        }
        for statement in &mut plan.statements {
            if statement.stores.is_empty() {
                statement.temporary = Some(plan.words);
                plan.words += 1;
            }
        }
        plan
    }

    fn leaf(&self, literal: Literal, to: usize, places: &Places) -> Copy {
        match self.circuit.graph().operation(literal.expression) {
            Operation::Variable(variable) => Copy {
                from: Source::Word(places.variable(variable)),
                negated: literal.negated,
                to,
            },
            operation => Copy {
                from: Source::Zero,
                negated: literal.negated ^ (operation == Operation::Constant(true)),
                to,
            },
        }
    }

    /// A register that becomes a constant, an input, or what another register was.
    fn leaf_register(&mut self, literal: Literal, to: usize, places: &Places) {
        let copy = self.leaf(literal, to, places);
        match copy.from {
            Source::Word(from) if from == to && !copy.negated => {}
            Source::Word(from) if from >= places.registers => {
                // The other register may have been overwritten by the end.
                let kept = self.words;
                self.words += 1;
                self.first.push(Copy { to: kept, ..copy });
                self.last.push(Copy {
                    from: Source::Word(kept),
                    negated: false,
                    to,
                });
            }
            _ => self.last.push(copy),
        }
    }
}

/// The roots of the trees, each after what it reads.
fn statements(circuit: &Circuit) -> Vec<Expression> {
    let graph = circuit.graph();
    let operations = graph.operations();
    let roots = circuit.roots();
    let reached = graph.reached(&roots);
    let mut uses = vec![0_u32; operations.len()];
    let mut expressions = vec![None; operations.len()];
    for &root in &roots {
        let base = Literal::of(graph, root).expression;
        expressions[base.index()] = Some(base);
        // A root is stored, so it is a statement.
        uses[base.index()] += 2;
    }
    for (index, operation) in operations.iter().enumerate() {
        if !reached[index] || matches!(operation, Operation::Not(_)) {
            continue;
        }
        for operand in operation.operands() {
            let base = Literal::of(graph, operand).expression;
            expressions[base.index()] = Some(base);
            uses[base.index()] += 1;
        }
    }
    let mut depths = vec![0_u32; operations.len()];
    let mut statements = Vec::new();
    for (index, operation) in operations.iter().enumerate() {
        let Some(expression) = expressions[index].filter(|_| reached[index]) else {
            continue;
        };
        if is_leaf(*operation) {
            continue;
        }
        let below = operation.operands().map(|operand| {
            let base = Literal::of(graph, operand).expression;
            depths[base.index()]
        });
        let depth = 1 + below.max().unwrap_or(0);
        if uses[index] > 1 || depth >= MAXIMUM_DEPTH {
            statements.push(expression);
        } else {
            depths[index] = depth;
        }
    }
    statements
}

/// Calls `see` with every variable, constant and other statement that the tree of `root` reads.
fn for_each_leaf(
    graph: &Graph,
    root: Expression,
    statements: &HashMap<Expression, usize>,
    see: &mut impl FnMut(Expression),
) {
    let mut pending: Vec<Expression> = graph.operation(root).operands().collect();
    while let Some(operand) = pending.pop() {
        let base = Literal::of(graph, operand).expression;
        if is_leaf(graph.operation(base)) || statements.contains_key(&base) {
            see(base);
        } else {
            pending.extend(graph.operation(base).operands());
        }
    }
}
