//! A system of terms as a circuit, whose runs contain those of the system.
//!
//! ```text
//! BOOL, bit strings, integers of up to 32 bits    their bits; sums and comparisons bit by bit
//! reals, times, integers of 64 bits               regions between the constants that they are compared with
//! ```
//!
//! A stored number of regions has one register for each boundary; the registers step together, so the regions of a value that is only
//! stored and copied are exact. A number that is computed has free inputs, with the order of its boundaries kept: `t > 90` implies
//! `t > 80`. What holds in the circuit for all runs holds in the system.

mod bits;
pub(super) mod boundaries;
mod order;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use understudy_logic::{Circuit, CircuitBuilder, Expression, RegisterId};
use understudy_typed::Elementary;

use super::System;
use super::execute::Unsupported;
use super::term::Term;

/// Boundaries of one number.
const BOUNDARIES: usize = 1_000;
/// Widest operands of a product or a quotient of two variables.
const PRODUCT: usize = 16;

/// What an input of the circuit stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A bit of an input of the system.
    Bit(u32, u32),
    /// Whether a number is at most the boundary: TRUE at its lowest true boundary, and of no meaning behind it.
    Boundary(Term, i128),
    /// Whether a computed real is NaN.
    NotANumber(Term),
    /// Whether one number is less than another.
    Less(Term, Term),
    /// Whether two numbers are equal; of no meaning where one is less.
    Equal(Term, Term),
    /// A bit of a number that is not followed.
    Free(Term, u32),
}

/// The circuit of a system.
pub(super) struct Abstraction {
    pub(super) circuit: Circuit,
    /// One for each input of the circuit.
    pub(super) meanings: Vec<Meaning>,
    /// Boundaries of each number that has free inputs, in order.
    pub(super) boundaries: HashMap<Term, BTreeSet<i128>>,
}

impl Abstraction {
    /// # Errors
    /// Where a number has too many boundaries.
    pub(super) fn new(system: &System) -> Result<Self, Unsupported> {
        // The first pass finds the boundaries of each number, the second one has them in order.
        let mut boundaries: HashMap<Term, BTreeSet<i128>> = HashMap::new();
        loop {
            let mut pass = Pass::new(system, boundaries);
            pass.build();
            let found = pass.found;
            if let Some((&term, _)) = found.iter().find(|(_, all)| all.len() > BOUNDARIES) {
                return Err(Unsupported {
                    routine: system.name.clone(),
                    line: 0,
                    what: format!(
                        "`{}` is compared with more than {BOUNDARIES} constants",
                        system.describe(term)
                    ),
                });
            }
            if found == pass.known {
                let circuit = pass.builder.finish().map_err(|error| Unsupported {
                    routine: system.name.clone(),
                    line: 0,
                    what: error.to_string(),
                })?;
                return Ok(Self { circuit, meanings: pass.meanings, boundaries: found });
            }
            boundaries = found;
        }
    }
}

/// A register whose next value is still to be made.
#[derive(Debug, Clone, Copy)]
enum Pending {
    Bits(u32),
    Boundary(u32, i128),
    NotANumber(u32),
}

struct Pass<'s> {
    system: &'s System,
    builder: CircuitBuilder,
    meanings: Vec<Meaning>,
    known: HashMap<Term, BTreeSet<i128>>,
    found: HashMap<Term, BTreeSet<i128>>,
    is_bits: HashMap<Term, bool>,
    bits: HashMap<Term, Vec<Expression>>,
    lines: HashMap<Term, BTreeMap<i128, Expression>>,
    at_most: HashMap<(Term, i128), Expression>,
    nans: HashMap<Term, Expression>,
    orders: HashMap<(Term, Term), (Expression, Expression)>,
    cells: HashMap<u32, (Vec<RegisterId>, Vec<Expression>)>,
    cell_lines: HashMap<(u32, i128), (RegisterId, Expression)>,
    cell_nans: HashMap<u32, (RegisterId, Expression)>,
    pending: Vec<Pending>,
    names: HashSet<String>,
}

impl<'s> Pass<'s> {
    fn new(system: &'s System, known: HashMap<Term, BTreeSet<i128>>) -> Self {
        let name = system.name.clone();
        Self {
            system,
            builder: CircuitBuilder::new(name),
            meanings: Vec::new(),
            found: HashMap::new(),
            known,
            is_bits: HashMap::new(),
            bits: HashMap::new(),
            lines: HashMap::new(),
            at_most: HashMap::new(),
            nans: HashMap::new(),
            orders: HashMap::new(),
            cells: HashMap::new(),
            cell_lines: HashMap::new(),
            cell_nans: HashMap::new(),
            pending: Vec::new(),
            names: HashSet::new(),
        }
    }

    fn build(&mut self) {
        // Inputs that people name come first, under their own names.
        for number in 0..self.system.inputs.len() as u32 {
            let input = &self.system.inputs[number as usize];
            if input.of == Elementary::Bool {
                let term = input.term;
                self.bits(term);
            }
        }
        // Operands first, so that no long chain of terms is walked at once.
        let roots = self.system.observed.iter().map(|(_, term)| *term).collect();
        let cells = &self.system.cells;
        let reached = self.system.terms.reached(roots, |cell| cells[cell as usize].next);
        for term in reached {
            if self.is_bits(term) {
                self.bits(term);
            }
        }
        for (name, term) in self.system.observed.clone() {
            let value = self.bits(term)[0];
            self.builder.output(name, value);
        }
        while let Some(pending) = self.pending.pop() {
            match pending {
                Pending::Bits(cell) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.bits(next);
                    let registers = self.cells[&cell].0.clone();
                    for (register, next) in registers.into_iter().zip(next) {
                        self.builder.set_next(register, next);
                    }
                }
                Pending::Boundary(cell, boundary) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.at_most(next, boundary);
                    let register = self.cell_lines[&(cell, boundary)].0;
                    self.builder.set_next(register, next);
                }
                Pending::NotANumber(cell) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.nan(next);
                    let register = self.cell_nans[&cell].0;
                    self.builder.set_next(register, next);
                }
            }
        }
    }

    fn input(&mut self, name: &str, meaning: Meaning) -> Expression {
        let mut unique = name.to_owned();
        let mut number = 1;
        while !self.names.insert(unique.clone()) {
            number += 1;
            unique = format!("{name} #{number}");
        }
        self.meanings.push(meaning);
        self.builder.input(unique)
    }

    fn constant(&mut self, value: bool) -> Expression {
        self.builder.graph().constant(value)
    }
}
