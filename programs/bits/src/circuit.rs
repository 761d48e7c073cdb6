//! A system of terms as a circuit, whose runs contain those of the system.
//!
//! ```text
//! BOOL, bit strings, integers, times that are counted    as many bits as their values need; sums and comparisons bit by bit
//! reals, and what takes more than 32 bits                regions between the constants that they are compared with
//! ```
//!
//! A stored number of regions has one register for each boundary; the registers step together, so the regions of a value that is only
//! stored and copied are exact. A number that is computed has free inputs, with the order of its boundaries kept: `t > 90` implies
//! `t > 80`. What holds in the circuit for all runs holds in the system.

mod bits;
pub(super) mod boundaries;
mod monotone;
mod order;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use understudy_logic::{Circuit, CircuitBuilder, Expression, RegisterId};
use understudy_typed::Elementary;

use crate::System;
use crate::execute::Unsupported;
use crate::extent::{Extent, Extents};
use crate::number::Number;
use crate::term::Term;

/// Boundaries of one number.
const BOUNDARIES: usize = 1_000;
/// Widest operands of a product or a quotient of two variables.
const PRODUCT: usize = 16;
/// Most bits of a number of 64 bits that is followed bit by bit where it is stored.
const WIDE: usize = 32;

/// What an input of the circuit stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning {
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
    /// A bit of a number that is not followed, as a multiple of its unit; see [`Derivation::unit`].
    Free(Term, u32),
}

/// The circuit of a system.
pub struct Derivation {
    /// With the BOOLs that can be named as its outputs, in the order of [`System::observed`].
    pub circuit: Circuit,
    /// One for each input of the circuit.
    pub meanings: Vec<Meaning>,
    /// Boundaries of each number that has free inputs, in order.
    pub boundaries: HashMap<Term, BTreeSet<i128>>,
    /// For each register the bit of a cell that it holds, where it holds one.
    pub(crate) held: Vec<Option<Held>>,
    extents: Extents,
}

/// A bit of a cell: the value of the cell has the weight where the bit is set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    pub(crate) cell: u32,
    pub(crate) weight: i128,
}

impl Derivation {
    /// # Errors
    /// Where a number has too many boundaries.
    pub fn new(system: &System) -> Result<Self, Unsupported> {
        Self::of(system, &[], &[])
    }

    /// With bits of numbers as further outputs: each a name, and a number as the bits of its type; and with the registers of cells, whether an
    /// output depends on them or not.
    pub(crate) fn of(
        system: &System,
        points: &[(String, Term)],
        kept: &[u32],
    ) -> Result<Self, Unsupported> {
        // The first pass finds the boundaries of each number, the second one has them in order.
        let mut boundaries: HashMap<Term, BTreeSet<i128>> = HashMap::new();
        let extents = Extents::new(system, kept);
        loop {
            let mut pass = Pass::new(system, &extents, boundaries);
            pass.build(points, kept);
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
                let meanings = pass.meanings;
                let held = pass.held;
                return Ok(Self { circuit, meanings, boundaries: found, held, extents });
            }
            boundaries = found;
        }
    }

    /// Whether a BOOL is FALSE in every run.
    pub(crate) fn is_never(&self, term: Term) -> bool {
        self.extents.get(term).high == 0
    }

    /// Between which numbers a value lies.
    pub(crate) fn extent(&self, term: Term) -> Extent {
        self.extents.get(term)
    }

    /// What a number is a multiple of.
    pub fn unit(&self, term: Term) -> i128 {
        self.extents.get(term).unit.max(1)
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
    extents: &'s Extents,
    builder: CircuitBuilder,
    meanings: Vec<Meaning>,
    known: HashMap<Term, BTreeSet<i128>>,
    found: HashMap<Term, BTreeSet<i128>>,
    is_bits: HashMap<Term, bool>,
    ends: HashMap<Term, bool>,
    numbers: HashMap<Term, Number>,
    lines: HashMap<Term, BTreeMap<i128, Expression>>,
    at_most: HashMap<(Term, i128), Expression>,
    nans: HashMap<Term, Expression>,
    orders: HashMap<(Term, Term), (Expression, Expression)>,
    cells: HashMap<u32, Vec<RegisterId>>,
    cell_lines: HashMap<(u32, i128), (RegisterId, Expression)>,
    cell_nans: HashMap<u32, (RegisterId, Expression)>,
    pending: Vec<Pending>,
    names: HashSet<String>,
    registers: HashSet<String>,
    held: Vec<Option<Held>>,
}

/// The name, with a number behind it where it is taken.
pub(crate) fn unique(taken: &mut HashSet<String>, name: &str) -> String {
    let mut unique = name.to_owned();
    let mut number = 1;
    while !taken.insert(unique.clone()) {
        number += 1;
        unique = format!("{name} #{number}");
    }
    unique
}

impl<'s> Pass<'s> {
    fn new(system: &'s System, extents: &'s Extents, known: HashMap<Term, BTreeSet<i128>>) -> Self {
        let name = system.name.clone();
        Self {
            system,
            extents,
            builder: CircuitBuilder::new(name),
            meanings: Vec::new(),
            found: HashMap::new(),
            known,
            is_bits: HashMap::new(),
            ends: HashMap::new(),
            numbers: HashMap::new(),
            lines: HashMap::new(),
            at_most: HashMap::new(),
            nans: HashMap::new(),
            orders: HashMap::new(),
            cells: HashMap::new(),
            cell_lines: HashMap::new(),
            cell_nans: HashMap::new(),
            pending: Vec::new(),
            names: HashSet::new(),
            registers: HashSet::new(),
            held: Vec::new(),
        }
    }

    fn build(&mut self, points: &[(String, Term)], kept: &[u32]) {
        // Inputs that people name come first, under their own names.
        for number in 0..self.system.inputs.len() as u32 {
            let input = &self.system.inputs[number as usize];
            let term = input.term;
            if input.of == Elementary::Bool || !points.is_empty() && self.is_bits(term) {
                self.number(term);
            }
        }
        // Operands first, so that no long chain of terms is walked at once.
        let named = self.system.observed.iter().chain(points);
        let cells = &self.system.cells;
        let kept = kept.iter().map(|&cell| cells[cell as usize].term);
        let roots = named.map(|(_, term)| *term).chain(kept).collect();
        let reached = self.system.terms.reached(roots, |cell| cells[cell as usize].next);
        for term in reached {
            if self.is_bits(term) {
                self.number(term);
            }
        }
        for (name, term) in self.system.observed.clone() {
            let value = self.truth(term);
            self.builder.output(name, value);
        }
        for (name, term) in points {
            let of = self.system.terms.of(*term);
            let number = self.number(*term);
            let bits = number.scaled(self.builder.graph(), 1, of.bits() as usize);
            for (bit, value) in bits.into_iter().enumerate() {
                self.builder.output(format!("{name}.{bit}"), value);
            }
        }
        while let Some(pending) = self.pending.pop() {
            match pending {
                Pending::Bits(cell) => {
                    let cell_of = &self.system.cells[cell as usize];
                    let coding = self.coding(cell_of.term);
                    let next = self.number(cell_of.next).coded(self.builder.graph(), coding);
                    let registers = self.cells[&cell].clone();
                    for (register, next) in registers.into_iter().zip(next.bits) {
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
        let name = unique(&mut self.names, name);
        self.meanings.push(meaning);
        self.builder.input(name)
    }

    fn register(&mut self, name: &str, initial: bool) -> (RegisterId, Expression) {
        let name = unique(&mut self.registers, name);
        self.held.push(None);
        self.builder.register(name, initial)
    }

    fn constant(&mut self, value: bool) -> Expression {
        self.builder.graph().constant(value)
    }
}
