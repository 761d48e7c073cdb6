//! Programs on terms: the value of each cell of memory after a scan, over the values before it and the inputs.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::RangeInclusive;

use understudy_typed::{Comparison, Declared, Elementary, Part, Point, Program};

use crate::beside::Placed;
use crate::circuit::boundaries::position;
use crate::execute::timers::Counted;
use crate::program::AnyValue;
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
    /// What it is in the state of a program.
    pub(crate) holds: Holds,
}

/// What a cell is in the state of a program.
#[derive(Debug, Clone)]
pub(crate) enum Holds {
    /// Nothing of a program's own.
    Other,
    /// The value at an address, of a type.
    Value(u64, Elementary),
    /// The scans of a timer.
    Count(Box<Counted>),
    /// The time since the moment at an address.
    Age(u64),
    /// `TIME()`.
    Clock,
    /// The scans since the start.
    Scans,
    /// The same, from 0 again where all tasks begin together.
    Phase,
    /// Nothing any more: the moment at an address, the time since which has no bound.
    Uncounted(u64),
    /// Nothing any more: what is followed in another way.
    Unused,
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
    /// Cells that a scan reads and then writes.
    pub(crate) read: BTreeSet<u32>,
    /// Cells that a scan reads before it writes them, if it writes them, and outputs that it does not write.
    pub(crate) seen: BTreeSet<u32>,
    /// BOOLs that properties can name.
    pub observed: Vec<(String, Term)>,
    /// Values that a run shows beside them.
    pub shown: Vec<(String, Term)>,
    /// The programs, in their order.
    pub(crate) programs: Vec<Placed>,
    /// The subranges that inputs are declared with, by their names here.
    pub(crate) subranges: HashMap<String, (i128, i128)>,
    /// Whether programs with retentive variables are restarted.
    pub(crate) restarts: bool,
    /// The inputs that restart programs, by their numbers.
    pub restarting: Vec<u32>,
    /// Where cells stop that count a time: past it no answer changes.
    pub(crate) most: BTreeMap<u32, i64>,
    /// Times since moments that are counted at least so far, by the prefix of their program and their address.
    pub(crate) least: BTreeMap<(String, u64), i64>,
    /// What variables begin with beside their initial values, of the program that is being added.
    pub(crate) begins: Begins,
    /// Whether the moments themselves are followed too, and not only the times since them up to where they stop.
    pub(crate) keeps_moments: bool,
    /// Values that a new program takes over and that may be any.
    pub(crate) any_values: Vec<AnyValue>,
    /// Names of numbers that properties compare.
    pub(crate) wanted: BTreeSet<String>,
    /// Numbers that properties compare: after the scan, an input in the scan.
    pub numbers: Vec<(String, Term)>,
    /// Declarations of what has an enumeration.
    pub enumerated: HashMap<String, Declared>,
    /// The names of the routines of all programs.
    pub(crate) routines: Vec<String>,
}

/// What variables of a program begin with, by address, where it takes the place of another one: what nothing writes keeps that too.
#[derive(Debug, Clone, Default)]
pub(crate) enum Begins {
    /// Their initial values.
    #[default]
    Initially,
    /// The values of a state.
    In(Vec<u64>),
    /// At most these numbers; any number without one. All others begin with their initial values.
    AtMost(BTreeMap<u64, Option<i64>>),
}

impl Begins {
    /// The greatest number that a variable begins with; nothing where it may be any.
    pub(crate) fn greatest(&self, address: u64, of: Elementary, initial: u64) -> Option<i64> {
        let number = |stored: u64| i64::try_from(of.signed(stored & of.mask())).ok();
        let initial = number(initial)?;
        match self {
            Self::Initially => Some(initial),
            Self::In(state) => {
                let slot = state.get((address / 64) as usize).copied().unwrap_or(0);
                Some(initial.max(number(slot >> (address % 64))?))
            }
            Self::AtMost(numbers) => match numbers.get(&address) {
                Some(most) => Some(initial.max((*most)?)),
                None => Some(initial),
            },
        }
    }
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
            read: BTreeSet::new(),
            seen: BTreeSet::new(),
            observed: Vec::new(),
            shown: Vec::new(),
            programs: Vec::new(),
            subranges: HashMap::new(),
            restarts: false,
            restarting: Vec::new(),
            most: BTreeMap::new(),
            least: BTreeMap::new(),
            begins: Begins::default(),
            keeps_moments: false,
            any_values: Vec::new(),
            wanted: BTreeSet::new(),
            numbers: Vec::new(),
            enumerated: HashMap::new(),
            routines: Vec::new(),
        }
    }

    /// The name of the program, or of the cluster.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A number that properties compare, by its name.
    pub fn number(&self, name: &str) -> Option<Term> {
        self.numbers.iter().find(|(known, _)| known == name).map(|(_, term)| *term)
    }

    /// Adds a comparison with a stored value to the BOOLs that properties can name.
    pub fn compare_with_value(
        &mut self,
        name: &str,
        left: Term,
        comparison: Comparison,
        stored: u64,
    ) {
        let right = self.terms.constant(self.terms.of(left), stored);
        self.compare(name, left, comparison, right);
    }

    /// Adds a comparison of two numbers of one type to the BOOLs that properties can name.
    pub fn compare(&mut self, name: &str, left: Term, comparison: Comparison, right: Term) {
        let holds = self.terms.compare(comparison, left, right);
        self.observed.push((name.to_owned(), holds));
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
        let initial = initial & of.mask();
        self.cells.push(Cell { name, of, initial, term, next: term, holds: Holds::Other });
        number
    }

    /// Finds the numbers of a program that properties compare, and the names of the values of its points.
    pub(crate) fn name_numbers(
        &mut self,
        prefix: &str,
        program: &Program,
        after: &HashMap<u64, Term>,
    ) {
        let points = program.inputs.iter().chain(&program.outputs);
        for point in points.filter(|point| point.values.is_some()) {
            self.enumerated.insert(format!("{prefix}{}", point.name), point.declared());
        }
        for name in self.wanted.clone() {
            let Some(own) = name.strip_prefix(prefix) else { continue };
            let input = self.inputs.iter().find(|input| input.name == name);
            let signal = || self.shown.iter().find(|(known, _)| *known == name);
            let given = input.map(|input| input.term).or_else(|| Some(signal()?.1));
            let part = program.part(own);
            let is_text = |part: &Part| part.of.elementary().is_none();
            if part.as_ref().is_some_and(is_text) {
                continue;
            }
            let kept = || after.get(&part.as_ref()?.address).copied();
            let Some(term) = given.or_else(kept) else { continue };
            let declared = part.and_then(|part| part.declared());
            if let Some(declared) = declared.filter(|declared| declared.values.is_some()) {
                self.enumerated.insert(name.clone(), declared);
            }
            self.numbers.push((name, term));
        }
    }

    /// A stored value of what has this name, as a person reads it.
    pub fn text(&self, name: &str, of: Elementary, stored: u64) -> String {
        let declared = self.enumerated.get(name);
        declared.map_or_else(|| of.text(stored), |declared| declared.text(stored))
    }

    /// Adds to the BOOLs that properties can name whether `holds` has been TRUE in every scan so far.
    pub fn keep_holding(&mut self, name: &str, holds: Term) {
        let cell = self.cell(name.to_owned(), Elementary::Bool, 1) as usize;
        let so_far = self.terms.and(self.cells[cell].term, holds);
        self.cells[cell].next = so_far;
        self.observed.push((name.to_owned(), so_far));
    }

    fn name_of(&self, variable: Variable) -> String {
        match variable {
            Variable::Input(number) => self.inputs[number as usize].name.clone(),
            Variable::Cell(number) => self.cells[number as usize].name.clone(),
        }
    }

    /// The routine and the line of the statement that made a term first.
    pub(crate) fn made_at(&self, term: Term) -> Option<(String, u32)> {
        let made = self.terms.made(term)?;
        Some((self.routines.get(made.routine as usize)?.clone(), made.line))
    }

    /// The term as a person reads it.
    pub fn describe(&self, term: Term) -> String {
        self.terms.describe(term, &|variable| self.name_of(variable))
    }
}
