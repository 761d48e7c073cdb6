//! Programs on terms: the value of each cell of memory after a scan, over the values before it and the inputs.

use std::ops::RangeInclusive;

use understudy_typed::{Elementary, Point};

use crate::circuit::boundaries::position;
use crate::term::{Term, Terms, Variable};

/// An input of a system.
#[derive(Debug, Clone)]
pub struct Input {
    /// Unique in the system.
    pub name: String,
    /// Its type.
    pub of: Elementary,
    /// Its value in a scan.
    pub term: Term,
    /// Positions between which its values lie; see [`position`].
    pub limits: (i128, i128),
}

/// A number that a scan keeps for the next one.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The name of its variable.
    pub name: String,
    /// Its type.
    pub of: Elementary,
    /// The stored value before the first scan.
    pub initial: u64,
    /// Its value before a scan.
    pub term: Term,
    /// Its value after the scan.
    pub next: Term,
}

/// Programs on terms, one step a cycle.
#[derive(Debug)]
pub struct System {
    pub(crate) name: String,
    /// All values of a scan.
    pub terms: Terms,
    /// In the order of the programs and of their points.
    pub inputs: Vec<Input>,
    /// What scans keep.
    pub cells: Vec<Cell>,
    /// BOOLs that properties can name.
    pub observed: Vec<(String, Term)>,
    /// Values that a run shows beside them.
    pub shown: Vec<(String, Term)>,
}

/// An input of a program in a system.
#[derive(Debug, Clone)]
pub enum Source {
    /// Any value of its type between two stored ones; reals are finite.
    Any(Option<RangeInclusive<u64>>),
    /// An output of a program of the system in the cycle before.
    Signal {
        /// Number of the program, in the order in which they are given.
        program: usize,
        /// Its output.
        output: String,
        /// Stored value while the signal is not valid.
        default: u64,
        /// Cycles for which the newest value is kept.
        stale_after: u32,
    },
    /// Whether the signal that another input takes is valid.
    Valid {
        /// The name of the other input.
        of: String,
    },
}

impl Source {
    /// Every value of the declaration of a point. A scan makes values of the subrange of all others, so no run of the program is missing.
    pub fn declared(point: &Point) -> Self {
        let stored = |end: i128| end as u64 & point.of.mask();
        Self::Any(point.range.map(|(low, high)| stored(low)..=stored(high)))
    }
}

impl System {
    pub(crate) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            terms: Terms::default(),
            inputs: Vec::new(),
            cells: Vec::new(),
            observed: Vec::new(),
            shown: Vec::new(),
        }
    }

    pub(crate) fn input(
        &mut self,
        name: String,
        of: Elementary,
        range: Option<&RangeInclusive<u64>>,
    ) -> Term {
        let number = self.inputs.len() as u32;
        let term = self.terms.variable(of, Variable::Input(number));
        let position = |stored| position(of, stored).unwrap_or(0);
        let limits = match range {
            Some(range) => (position(*range.start()), position(*range.end())),
            None => match of {
                Elementary::Real => {
                    (position(f32::MIN.to_bits().into()), position(f32::MAX.to_bits().into()))
                }
                Elementary::Lreal => (position(f64::MIN.to_bits()), position(f64::MAX.to_bits())),
                _ => of.limits(),
            },
        };
        self.inputs.push(Input { name, of, term, limits });
        term
    }

    /// A cell that keeps its value until [`Cell::next`] is set.
    pub(crate) fn cell(&mut self, name: String, of: Elementary, initial: u64) -> u32 {
        let number = self.cells.len() as u32;
        let term = self.terms.variable(of, Variable::Cell(number));
        self.cells.push(Cell { name, of, initial: initial & of.mask(), term, next: term });
        number
    }

    fn name_of(&self, variable: Variable) -> String {
        match variable {
            Variable::Input(number) => self.inputs[number as usize].name.clone(),
            Variable::Cell(number) => self.cells[number as usize].name.clone(),
        }
    }

    /// The term as a person reads it.
    pub fn describe(&self, term: Term) -> String {
        self.terms.describe(term, &|variable| self.name_of(variable))
    }
}
