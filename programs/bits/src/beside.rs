//! What is derived of programs beside the programs: both scan the same inputs, and all that both tell is compared.
//!
//! ```text
//! inputs at random ──► register machine                 the outputs and the BOOLs of each program
//!                 └──► terms ──► circuit                the same, scan by scan
//! ```
//!
//! Invariant: what proofs and understudies are made of does in these scans what stations execute. An error of the derivation becomes a
//! [`Disagreement`] and no verdict. The scans are the same in every run, and their number is bounded by the operations that they take.

mod inputs;

use std::collections::{HashMap, HashSet, VecDeque};
use std::fmt;

use understudy_logic::{Circuit, Running};
use understudy_typed::{
    Comparison, Cost, Elementary, Fault, Machine, Operation, Parts, Program, Scratch,
};

use self::inputs::Inputs;
use crate::circuit::boundaries::position;
use crate::circuit::{Derivation, Meaning};
use crate::exact::Shown;
use crate::system::System;
use crate::term::{Node, Term, Terms, Variable};

/// Every comparison has these inputs.
const SEED: u64 = 1;
/// Scans of a comparison.
const SCANS: usize = 100;
/// Operations that the scans take, about, where these are more than [`LEAST`] scans.
const OPERATIONS: usize = 1_000_000;
/// Scans however large a program is.
const LEAST: usize = 8;
/// Operations of the register machine that the value of a term is worth.
const TERM: usize = 8;
/// Scans that a disagreement shows.
const TOLD: usize = 12;

/// A scan in which a program and what was derived of it differ: a defect of Understudy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Disagreement {
    /// The output or the variable.
    pub name: String,
    /// The scan, from 0.
    pub scan: usize,
    /// What the program has in this scan and in those before it.
    pub program: Vec<String>,
    /// What the circuit has in these scans.
    pub circuit: Vec<String>,
    /// The inputs in these scans.
    pub inputs: Vec<(String, Vec<String>)>,
}

impl Disagreement {
    /// Stable code for people.
    pub const CODE: &str = "U0448";
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, scan, program, circuit, inputs } = self;
        let first = (scan + 1).saturating_sub(program.len());
        let [expected, found] = [program, circuit].map(|row| row.last().map_or("", String::as_str));
        write!(
            f,
            "an internal error: in scan {scan} `{name}` is {expected} in the program and {found} in the circuit derived from it, so nothing is proved or written; from scan {first} on:"
        )?;
        let row = |what: &str, row: &[String]| format!("\n  {what}: {}", row.join(" "));
        for (name, values) in inputs {
            f.write_str(&row(name, values))?;
        }
        f.write_str(&row(&format!("{name}, program"), program))?;
        f.write_str(&row(&format!("{name}, circuit"), circuit))
    }
}

impl std::error::Error for Disagreement {}

/// A program of a system, with the terms of what it reads and tells.
#[derive(Debug)]
pub(crate) struct Placed {
    /// One for each input.
    pub(crate) inputs: Vec<Term>,
    /// Whether it makes a scan.
    pub(crate) runs: Term,
    /// Whether it is restarted warm before that.
    pub(crate) restarts: Option<Term>,
    /// What it tells after a scan, by name.
    pub(crate) told: Vec<(String, Told, Term)>,
}

/// Where the register machine has what a program tells.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Told {
    /// An output, by its place.
    Output(usize),
    /// One bit of an output.
    OutputBit(usize, u32),
    /// A value in memory.
    Value(u64, Elementary),
    /// Whether a value in memory compares so with a stored one.
    Compared(u64, Elementary, Comparison, u64),
}

/// What a program tells after a scan: its outputs, and its BOOLs.
pub(crate) fn told(
    prefix: &str,
    program: &Program,
    after: &HashMap<u64, Term>,
    faulted: Term,
) -> Vec<(String, Told, Term)> {
    let named = |name: &str| format!("{prefix}{name}");
    let outputs = program.outputs.iter().enumerate().filter_map(|(place, point)| {
        let value = match point.slot {
            0 => faulted,
            slot => *after.get(&(64 * u64::from(slot)))?,
        };
        Some((named(&point.name), Told::Output(place), value))
    });
    let parts = Parts::new(program);
    let bools = after.iter().filter_map(|(&address, &value)| {
        let part = parts.at(address)?;
        let is_bool = part.of.elementary() == Some(Elementary::Bool);
        let told = Told::Value(address, Elementary::Bool);
        is_bool.then(|| (named(&part.name), told, value))
    });
    let mut told: Vec<(String, Told, Term)> = bools.collect();
    told.sort_by(|one, other| one.0.cmp(&other.0));
    outputs.chain(told).collect()
}

/// A program on the register machine.
struct Runs<'p> {
    program: &'p Program,
    machine: Machine,
    scratch: Scratch,
    state: Vec<u64>,
    given: Vec<u64>,
    driven: Vec<u64>,
}

impl<'p> Runs<'p> {
    fn new(program: &'p Program) -> Self {
        let machine = Machine::new(program);
        Self {
            program,
            scratch: Scratch::default(),
            state: machine.initial().to_vec(),
            given: vec![0; machine.input_count().div_ceil(64)],
            driven: vec![0; machine.output_count().div_ceil(64)],
            machine,
        }
    }

    fn restart(&mut self) {
        self.state = self.program.restarted(&self.state);
    }

    fn scan(&mut self, inputs: impl Iterator<Item = u64>) {
        for (point, value) in self.program.inputs.iter().zip(inputs) {
            point.set(&mut self.given, value);
        }
        let Self { machine, scratch, state, given, driven, .. } = self;
        machine.step(scratch, state, given, driven);
    }

    fn value(&self, told: Told) -> u64 {
        let output = |place: usize| self.program.outputs.iter().nth(place);
        let output = |place| output(place).map_or(0, |point| point.get(&self.driven));
        let stored = |address: u64, of: Elementary| {
            self.state[(address / 64) as usize] >> (address % 64) & of.mask()
        };
        match told {
            Told::Output(place) => output(place),
            Told::OutputBit(place, bit) => output(place) >> bit & 1,
            Told::Value(address, of) => stored(address, of),
            Told::Compared(address, of, comparison, right) => {
                let compare = Operation::Compare(comparison, of);
                compare.apply(&[stored(address, of), right]).unwrap_or(0)
            }
        }
    }
}

/// A value of the program and that of the circuit, where they are compared.
type Both = Option<(u64, u64)>;

/// What was compared so far.
struct Log<'s> {
    system: &'s System,
    /// What is compared, by name.
    names: Vec<(String, Elementary)>,
    /// The last scans: the inputs, and what the program and the circuit tell.
    scans: VecDeque<(Vec<u64>, Vec<Both>)>,
    scan: usize,
}

impl<'s> Log<'s> {
    fn new(system: &'s System, names: Vec<(String, Elementary)>) -> Self {
        Self { system, names, scans: VecDeque::new(), scan: 0 }
    }

    /// Adds a scan; both values of each name, where it is compared in this scan.
    fn add(&mut self, given: &[u64], told: Vec<Both>) -> Result<(), Box<Disagreement>> {
        let mut pairs = told.iter();
        let differs =
            pairs.position(|pair| pair.is_some_and(|(program, circuit)| program != circuit));
        if self.scans.len() == TOLD {
            self.scans.pop_front();
        }
        self.scans.push_back((given.to_vec(), told));
        match differs {
            Some(place) => Err(Box::new(self.disagreement(place))),
            None => {
                self.scan += 1;
                Ok(())
            }
        }
    }

    fn disagreement(&self, place: usize) -> Disagreement {
        let (name, of) = &self.names[place];
        let text = |stored| self.system.text(name, *of, stored);
        let row = |which: fn((u64, u64)) -> u64| {
            let scans = self.scans.iter();
            let values =
                scans.map(|(_, told)| told[place].map_or("-".into(), |it| text(which(it))));
            values.collect()
        };
        let inputs = self.system.inputs.iter().enumerate().map(|(number, input)| {
            let values = self.scans.iter();
            let values =
                values.map(|(given, _)| self.system.text(&input.name, input.of, given[number]));
            (input.name.clone(), values.collect())
        });
        Disagreement {
            name: name.clone(),
            scan: self.scan,
            program: row(|(program, _)| program),
            circuit: row(|(_, circuit)| circuit),
            inputs: inputs.collect(),
        }
    }
}

/// How many scans are compared, by the operations of a scan.
fn scans(operations: usize) -> usize {
    (OPERATIONS / operations.max(1)).clamp(LEAST, SCANS)
}

/// Operations of a scan on the register machine; a bound of loops that depends on values says nothing about their turns.
fn operations(program: &Program) -> usize {
    let Cost { straight, loops, .. } = Cost::new(program);
    usize::try_from(straight.saturating_add(loops.unwrap_or(0))).unwrap_or(usize::MAX)
}

/// Compares the circuit of a program, whose inputs are the bits of the inputs of `system`, with the program.
pub(crate) fn exact(
    system: &System,
    program: &Program,
    circuit: &Circuit,
    shown: &Shown<'_>,
) -> Result<(), Box<Disagreement>> {
    let told: Vec<Option<Told>> =
        circuit.outputs().iter().map(|output| found(program, shown, &output.name)).collect();
    let names = circuit.outputs().iter().map(|output| (output.name.clone(), Elementary::Bool));
    let mut log = Log::new(system, names.collect());
    let mut inputs = Inputs::new(system, SEED);
    let mut runs = Runs::new(program);
    let mut running = Running::new(circuit);
    let has_reset = circuit.inputs().iter().any(|name| name == Program::RESET);
    let mut bits = Vec::new();
    for _ in 0..scans(operations(program) + circuit.graph().operations().len()) {
        let given = inputs.next();
        if system.restarting.iter().any(|&input| given[input as usize] == 1) {
            runs.restart();
        }
        runs.scan(given.iter().copied());
        bits.clear();
        for (input, value) in system.inputs.iter().zip(given) {
            if has_reset || input.name != Program::RESET {
                bits.extend((0..input.of.bits()).map(|bit| value >> bit & 1 == 1));
            }
        }
        let told = told.iter().zip(running.step(&bits));
        let told = told.map(|(told, found)| told.map(|told| (runs.value(told), found.into())));
        log.add(given, told.collect())?;
    }
    Ok(())
}

/// Where the register machine has an output of the circuit of a program.
fn found(program: &Program, shown: &Shown<'_>, name: &str) -> Option<Told> {
    let output = |name: &str| program.outputs.iter().position(|point| point.name == name);
    if let Some(place) = output(name) {
        return Some(Told::Output(place));
    }
    if let Some((point, bit)) = name.rsplit_once('.')
        && let (Some(place), Ok(bit)) = (output(point), bit.parse())
    {
        return Some(Told::OutputBit(place, bit));
    }
    if let Some(compared) = shown.compared.iter().find(|compared| compared.name == name) {
        let part = program.part(&compared.number)?;
        let of = part.of.elementary()?;
        return Some(Told::Compared(part.address, of, compared.comparison, compared.stored));
    }
    let part = program.part(name)?;
    let is_bool = part.of.elementary() == Some(Elementary::Bool);
    is_bool.then_some(Told::Value(part.address, Elementary::Bool))
}

impl Derivation {
    /// Compares it with the programs of its system, in their order, in scans with inputs that are the same in every run.
    ///
    /// # Errors
    /// The first scan in which they differ.
    pub fn beside(&self, system: &System, programs: &[&Program]) -> Result<(), Box<Disagreement>> {
        let size = programs.iter().map(|program| operations(program)).sum::<usize>();
        let size = size + TERM * system.terms.len() + self.circuit.graph().operations().len();
        self.compared(system, programs, (SEED, scans(size))).map(|_| ())
    }

    /// The same with a seed and a number of scans; whether a program fault was among them.
    pub(crate) fn compared(
        &self,
        system: &System,
        programs: &[&Program],
        (seed, scans): (u64, usize),
    ) -> Result<bool, Box<Disagreement>> {
        let mut faulted = false;
        let unknown = unknown(system);
        let mut runs: Vec<Runs<'_>> = programs.iter().map(|program| Runs::new(program)).collect();
        let told = system.programs.iter().flat_map(|placed| &placed.told);
        let told = told.map(|(name, _, term)| (name.clone(), system.terms.of(*term)));
        let observed = system.observed.iter().map(|(name, _)| (name.clone(), Elementary::Bool));
        let mut log = Log::new(system, told.chain(observed).collect());
        let mut inputs = Inputs::new(system, seed);
        let mut running = Running::new(&self.circuit);
        let mut cells: Vec<u64> = system.cells.iter().map(|cell| cell.initial).collect();
        for _ in 0..scans {
            let given = inputs.next();
            let values = system.terms.evaluate(|variable| match variable {
                Variable::Input(number) => given[number as usize],
                Variable::Cell(number) => cells[number as usize],
            });
            let value = |term: Term| values[Terms::index(term)];
            let mut told = Vec::with_capacity(log.names.len());
            for (placed, runs) in system.programs.iter().zip(&mut runs) {
                if placed.restarts.is_some_and(|restarts| value(restarts) == 1) {
                    runs.restart();
                }
                let is_run = value(placed.runs) == 1;
                if is_run {
                    runs.scan(placed.inputs.iter().map(|&term| value(term)));
                    faulted |= Fault::read(&runs.state).is_some();
                }
                told.extend(placed.told.iter().map(|&(_, told, term)| {
                    let is_compared = is_run && !unknown[Terms::index(term)];
                    is_compared.then(|| (runs.value(told), value(term)))
                }));
            }
            let found = running.step(&self.inputs(system, given, &values));
            let observed = system.observed.iter().zip(found);
            told.extend(observed.map(|((_, term), found)| Some((value(*term), found.into()))));
            log.add(given, told)?;
            cells = system.cells.iter().map(|cell| value(cell.next)).collect();
        }
        Ok(faulted)
    }

    /// What the inputs of the circuit are in a scan with these values of terms.
    pub(crate) fn inputs(&self, system: &System, given: &[u64], values: &[u64]) -> Vec<bool> {
        let place = |term: Term| position(system.terms.of(term), values[Terms::index(term)]);
        let inputs = self.meanings.iter().map(|meaning| match *meaning {
            Meaning::Bit(number, bit) => given[number as usize] >> bit & 1 == 1,
            Meaning::Boundary(term, boundary) => place(term).is_some_and(|at| at <= boundary),
            Meaning::NotANumber(term) => place(term).is_none(),
            Meaning::Less(left, right) => {
                place(left).zip(place(right)).is_some_and(|(left, right)| left < right)
            }
            Meaning::Equal(left, right) => {
                place(left).zip(place(right)).is_some_and(|(left, right)| left == right)
            }
            Meaning::Free(term, bit) => {
                let number = system.terms.of(term).signed(values[Terms::index(term)]);
                number.div_euclid(self.unit(term)) >> bit & 1 == 1
            }
        });
        inputs.collect()
    }
}

/// Which terms depend on a value that is not followed.
fn unknown(system: &System) -> Vec<bool> {
    let terms = &system.terms;
    let mut unknown = vec![false; terms.len()];
    let mut cells: HashSet<u32> = HashSet::new();
    loop {
        for place in 0..terms.len() {
            let is = |term: &Term| unknown[Terms::index(*term)];
            unknown[place] = match terms.node(terms.at(place)) {
                Node::Unknown(_) => true,
                Node::Variable(Variable::Cell(cell)) => cells.contains(cell),
                Node::Apply(_, operands) => operands.iter().any(is),
                Node::Choose(parts) => parts.iter().any(is),
                Node::Constant(_) | Node::Variable(Variable::Input(_)) => false,
            };
        }
        let numbered = (0..).zip(&system.cells);
        let found = numbered.filter(|(_, cell)| unknown[Terms::index(cell.next)]);
        let found: HashSet<u32> = found.map(|(number, _)| number).collect();
        if found.len() == cells.len() {
            return unknown;
        }
        cells = found;
    }
}
