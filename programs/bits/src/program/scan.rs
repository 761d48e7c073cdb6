//! One scan of a program, from the cells that hold its state.

use std::collections::{BTreeSet, HashMap};

use understudy_typed::{Elementary, Operation, Parts, Point, Program};

use crate::execute::timers::Timers;
use crate::execute::{Cells, Execution, Unsupported};
use crate::program::moments::Age;
use crate::system::Holds;
use crate::term::{Made, Node, Term, Terms, Variable};
use crate::{Input, System};

/// Cells of one program, made when they are read first.
struct ProgramCells<'s> {
    parts: &'s Parts<'s>,
    prefix: &'s str,
    initial: Vec<u64>,
    cells: &'s mut Vec<crate::system::Cell>,
    numbers: HashMap<u64, u32>,
    /// Whether the program is stopped, where it can be: a restart begins with the initial values.
    stopped: Option<Term>,
    /// The scan's `TIME()`.
    elapsed: Term,
    /// The times since moments, in place of the moments.
    ages: HashMap<u64, Term>,
    /// What is read before it is written.
    read: BTreeSet<u64>,
}

impl ProgramCells<'_> {
    fn number(&mut self, terms: &mut Terms, address: u64, of: Elementary) -> u32 {
        if let Some(&known) = self.numbers.get(&address) {
            return known;
        }
        let number = self.cells.len() as u32;
        let name = match self.parts.at(address) {
            Some(part)
                if of == Elementary::Udint && part.of.elementary() == Some(Elementary::Time) =>
            {
                let timer = part.name.rsplit_once('.').map_or("", |(timer, _)| timer);
                format!("{}{timer}.scans", self.prefix)
            }
            Some(part) => format!("{}{}", self.prefix, part.name),
            None => format!("{}memory {}", self.prefix, address / 64),
        };
        let slot = self.initial.get((address / 64) as usize).copied();
        let term = terms.variable(of, Variable::Cell(number));
        self.cells.push(crate::system::Cell {
            name,
            of,
            initial: slot.unwrap_or(0) >> (address % 64) & of.mask(),
            term,
            next: term,
            holds: Holds::Value(address, of),
        });
        self.numbers.insert(address, number);
        number
    }
}

impl Cells for ProgramCells<'_> {
    fn before(&mut self, terms: &mut Terms, address: u64, of: Elementary) -> Term {
        let number = self.number(terms, address, of);
        self.read.insert(address);
        if let Some(&age) = self.ages.get(&address) {
            let since = Operation::Subtract(Elementary::Time);
            return terms.apply(since, Elementary::Time, &[self.elapsed, age]);
        }
        let cell = &self.cells[number as usize];
        let (term, initial, of) = (cell.term, cell.initial, cell.of);
        match self.stopped {
            Some(stopped) => {
                let initial = terms.constant(of, initial);
                terms.choose(stopped, initial, term)
            }
            None => term,
        }
    }
}

impl System {
    /// `TIME()` of the scan behind this number of scans.
    pub(super) fn time_since_start(&mut self, program: &Program, scans: Term) -> Term {
        let period = self.terms.constant(Elementary::Time, program.period as u64);
        self.terms.apply(Operation::Elapsed, Elementary::Time, &[scans, period])
    }

    /// One scan of a program from its cells on.
    pub(super) fn scan(
        &mut self,
        scan: &Scan<'_>,
        numbers: &mut HashMap<u64, u32>,
        timers: &mut Timers,
    ) -> Result<Scanned, Unsupported> {
        let Scan { prefix, program, inputs, .. } = *scan;
        let ages = scan.ages.iter().map(|(&address, &age)| (address, self.age(age, scan.stopped)));
        let ages = ages.collect();
        let [count, phase] = [scan.scans, scan.phase].map(|since| match scan.stopped {
            Some(stopped) => {
                let zero = self.terms.constant(Elementary::Ulint, 0);
                self.terms.choose(stopped, zero, since)
            }
            None => since,
        });
        let period = self.terms.constant(Elementary::Time, program.period as u64);
        let elapsed = match scan.clock {
            Some(clock) => clock,
            None => self.terms.apply(Operation::Elapsed, Elementary::Time, &[count, period]),
        };
        let parts = Parts::new(program);
        let mut cells = ProgramCells {
            elapsed,
            ages,
            parts: &parts,
            prefix,
            initial: program.initial_state(),
            cells: &mut self.cells,
            numbers: std::mem::take(numbers),
            stopped: scan.stopped,
            read: BTreeSet::new(),
        };
        // What is shown or read by others has a cell, whether the scan reads it or not.
        for point in &program.outputs {
            if point.slot != 0 {
                cells.number(&mut self.terms, 64 * u64::from(point.slot), point.of);
            }
        }
        let kept = |address: &u64| !timers.dropped.contains(address);
        for address in bool_variables(program, &parts).into_iter().filter(kept) {
            cells.number(&mut self.terms, address, Elementary::Bool);
        }
        let wanted = self.wanted.iter().filter_map(|name| program.part(name.strip_prefix(prefix)?));
        for part in wanted {
            if let Some(of) = part.of.elementary() {
                cells.number(&mut self.terms, part.address, of);
            }
        }
        let before = self.routines.len();
        self.routines.extend(program.routines.iter().map(|routine| routine.name.clone()));
        let mut execution =
            Execution::new(program, &mut self.terms, &mut cells, elapsed, timers, before);
        for (point, &input) in program.inputs.iter().zip(inputs) {
            if point.slot != 0 {
                execution.put(point.slot, input);
                if !within_subrange(execution.terms, &self.inputs, point, input) {
                    execution.limit(point.slot, &point.declared());
                }
            }
        }
        for task in &program.tasks {
            let runs = match task.every {
                0 | 1 => execution.terms.boolean(true),
                every => {
                    let every = execution.terms.constant(Elementary::Ulint, every.into());
                    let modulo = Operation::Modulo(Elementary::Ulint);
                    let rest = execution.terms.apply(modulo, Elementary::Ulint, &[phase, every]);
                    execution.terms.equals(rest, 0)
                }
            };
            execution.task(task.routine, task.own, runs)?;
        }
        execution.terms.statement = Made::default();
        for point in &program.outputs {
            execution.finite(point.slot, point.of);
            execution.limit(point.slot, &point.declared());
        }
        let faulted = execution.faulted;
        let memory = execution.written();
        let read = cells.read;
        *numbers = cells.numbers;
        let written = memory.iter();
        let written =
            written.filter_map(|(address, &value)| Some((*numbers.get(address)?, value))).collect();
        Ok(Scanned { memory, faulted, elapsed, written, read })
    }
}

/// Whether every value that an input of the system takes is one of the point's subrange.
fn within_subrange(terms: &Terms, inputs: &[Input], point: &Point, input: Term) -> bool {
    let Node::Variable(Variable::Input(number)) = terms.node(input) else {
        return false;
    };
    let (least, most) = inputs[*number as usize].limits;
    point.range.is_none_or(|(low, high)| low <= least && most <= high)
}

/// How a scan begins.
#[derive(Clone, Copy)]
pub(super) struct Scan<'a> {
    pub(super) prefix: &'a str,
    pub(super) program: &'a Program,
    pub(super) inputs: &'a [Term],
    /// Scans before it.
    pub(super) scans: Term,
    /// The same, from 0 again where all tasks begin together.
    pub(super) phase: Term,
    pub(super) stopped: Option<Term>,
    /// Moments of which the time since them is followed.
    pub(super) ages: &'a HashMap<u64, Age>,
    /// The scan's `TIME()`, where it is counted by a cell of its own.
    pub(super) clock: Option<Term>,
}

/// How it ends, where no fault ends it.
pub(super) struct Scanned {
    pub(super) memory: HashMap<u64, Term>,
    /// Whether a fault ends it.
    pub(super) faulted: Term,
    /// Its `TIME()`.
    pub(super) elapsed: Term,
    /// What it writes into cells.
    pub(super) written: HashMap<u32, Term>,
    /// What it reads before it writes it, by address.
    pub(super) read: BTreeSet<u64>,
}

/// Most BOOL variables that properties can name.
const NAMED: usize = 10_000;

/// Addresses of the BOOLs in the state that people can see.
fn bool_variables(program: &Program, parts: &Parts<'_>) -> Vec<u64> {
    let mut found = Vec::new();
    for variable in &program.variables {
        let first = 64 * u64::from(variable.slot);
        let mut address = first;
        let end = first + 64 * variable.of.slots();
        while address < end && found.len() < NAMED {
            match parts.at(address) {
                Some(part) if part.address == address => match part.of.elementary() {
                    Some(Elementary::Bool) => {
                        found.push(address);
                        let is_element = part.name.ends_with(']');
                        address += if is_element { 1 } else { 64 };
                    }
                    Some(of) if part.name.ends_with(']') => address += u64::from(of.bits()),
                    _ => address += 64 * part.of.slots().max(1),
                },
                _ => address = (address / 64 + 1) * 64,
            }
        }
    }
    found
}
