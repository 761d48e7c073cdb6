//! Statements as instructions of Cranelift.
//!
//! Each function does some statements on the frame that it is given. A tree becomes a chain of word operations with the frame's words as operands in
//! memory; negation moves outwards by De Morgan until a store wants it, so that almost none is ever computed.

use std::collections::{HashMap, VecDeque};

use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;
use understudy_logic::{Expression, Graph, Operation};

use crate::plan::{Copy, Literal, Places, Source, Statement};

/// Roots that stay in machine registers for the statements behind theirs.
const KEPT: usize = 6;

/// Statements after which the frame's address is computed anew, to the same. Processors of the Zen family guess from base register and
/// displacement which store a load reads from, and guess wrong in long code with one base: measured 416 ns for 256 rungs, and 147 ns with the base renewed.
const REBASED: usize = 2;

/// A word and whether its negation is meant.
#[derive(Debug, Clone, Copy)]
struct Signed {
    word: Value,
    negated: bool,
}

/// Where the root of a statement lies in the frame, and whether negated.
pub(crate) type Homes = HashMap<Expression, (usize, bool)>;

/// Writes the body of one function.
pub(crate) struct Emitter<'a, 'f> {
    pub(crate) graph: &'a Graph,
    pub(crate) places: &'a Places,
    pub(crate) homes: &'a mut Homes,
    builder: &'a mut FunctionBuilder<'f>,
    frame: Value,
    kept: VecDeque<(Expression, Signed)>,
    statements: usize,
}

impl<'a, 'f> Emitter<'a, 'f> {
    pub(crate) fn new(
        graph: &'a Graph,
        places: &'a Places,
        homes: &'a mut Homes,
        builder: &'a mut FunctionBuilder<'f>,
        frame: Value,
    ) -> Self {
        Self {
            graph,
            places,
            homes,
            builder,
            frame,
            kept: VecDeque::new(),
            statements: 0,
        }
    }

    pub(crate) fn copy(&mut self, copy: &Copy) {
        let from = match copy.from {
            Source::Zero => Signed {
                word: self.builder.ins().iconst(types::I64, 0),
                negated: false,
            },
            Source::Word(place) => self.load(place, false),
            Source::Root(root) => {
                let (place, negated) = self.homes[&root];
                self.load(place, negated)
            }
        };
        self.store(from, copy.negated, copy.to);
    }

    pub(crate) fn statement(&mut self, statement: &Statement) {
        self.statements += 1;
        if self.statements.is_multiple_of(REBASED) {
            self.frame = self.builder.ins().bor(self.frame, self.frame);
        }
        let value = self.operation(statement.root);
        for &(place, negated) in &statement.stores {
            self.store(value, negated, place);
        }
        let home = match (statement.temporary, statement.stores.first()) {
            (Some(place), _) => {
                self.store(value, value.negated, place);
                (place, value.negated)
            }
            (None, Some(&stored)) => stored,
            (None, None) => return,
        };
        self.homes.insert(statement.root, home);
        self.kept.push_back((statement.root, value));
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
    }

    fn load(&mut self, place: usize, negated: bool) -> Signed {
        let flags = MemFlagsData::trusted();
        let ins = self.builder.ins();
        let word = ins.load(types::I64, flags, self.frame, offset(place));
        Signed { word, negated }
    }

    fn store(&mut self, value: Signed, negated: bool, place: usize) {
        let word = if value.negated == negated {
            value.word
        } else {
            self.builder.ins().bnot(value.word)
        };
        let flags = MemFlagsData::trusted();
        let ins = self.builder.ins();
        ins.store(flags, word, self.frame, offset(place));
    }

    fn operand(&mut self, expression: Expression) -> Signed {
        let literal = Literal::of(self.graph, expression);
        let kept = self.kept.iter().find(|kept| kept.0 == literal.expression);
        let value = match (kept, self.graph.operation(literal.expression)) {
            (Some(&(_, value)), _) => value,
            (None, Operation::Variable(variable)) => {
                self.load(self.places.variable(variable), false)
            }
            (None, Operation::Constant(value)) => Signed {
                word: self.builder.ins().iconst(types::I64, 0),
                negated: value,
            },
            (None, _) => match self.homes.get(&literal.expression) {
                Some(&(place, negated)) => self.load(place, negated),
                None => self.operation(literal.expression),
            },
        };
        Signed {
            negated: value.negated ^ literal.negated,
            ..value
        }
    }

    fn operation(&mut self, expression: Expression) -> Signed {
        let operation = self.graph.operation(expression);
        match operation {
            Operation::And(left, right) => {
                let (left, right) = (self.operand(left), self.operand(right));
                self.product(left, right)
            }
            // a ∨ b = ¬(¬a ∧ ¬b)
            Operation::Or(left, right) => {
                let [left, right] = [left, right].map(|operand| {
                    let value = self.operand(operand);
                    Signed {
                        negated: !value.negated,
                        ..value
                    }
                });
                let product = self.product(left, right);
                Signed {
                    negated: !product.negated,
                    ..product
                }
            }
            Operation::Xor(left, right) => {
                let (left, right) = (self.operand(left), self.operand(right));
                Signed {
                    word: self.builder.ins().bxor(left.word, right.word),
                    negated: left.negated ^ right.negated,
                }
            }
            Operation::Constant(_) | Operation::Variable(_) | Operation::Not(_) => {
                self.operand(expression)
            }
        }
    }

    fn product(&mut self, left: Signed, right: Signed) -> Signed {
        let ins = self.builder.ins();
        let (word, negated) = match (left.negated, right.negated) {
            (false, false) => (ins.band(left.word, right.word), false),
            (false, true) => (ins.band_not(left.word, right.word), false),
            (true, false) => (ins.band_not(right.word, left.word), false),
            (true, true) => (ins.bor(left.word, right.word), true),
        };
        Signed { word, negated }
    }
}

/// In bytes; [`crate::Machine::new`] bounds the frame.
fn offset(place: usize) -> i32 {
    i32::try_from(8 * place).expect("the frame is bounded")
}
