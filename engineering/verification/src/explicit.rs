//! CTL by listing every state that can be reached, 64 scans at once: where few of many states can be reached, as with steps of which one is on,
//! this decides what decision diagrams of all states do not.
//!
//! A state is (x, u), numbered x · 2^|u| + u; registers x are numbered as they are found, the first ones first. A set is a bit a state.

mod check;
mod extent;
mod lanes;

use std::hash::BuildHasher;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;
use understudy_logic::{Circuit, Scan};

use crate::effort::{ALWAYS, GoOn, Work};
use extent::Depths;
pub(crate) use extent::Extent;
pub(crate) use lanes::Seen;
use lanes::{LANES, Lanes};

/// Inputs past which nothing is listed: every state has 2^|u| ways on.
pub const MAXIMUM_INPUTS: usize = 12;

/// Registers that are listed, whatever the bound: a few hundred bytes each.
const MAXIMUM_COUNT: usize = 1 << 20;
/// Bytes of those that are listed where the states are steady, and bytes that each takes next to its bits.
const MAXIMUM_BYTES: usize = 1 << 28;
const BYTES: usize = 24;

/// Why there is no list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ExplicitError {
    /// Too many inputs.
    #[error("the program has {inputs} inputs, and states are listed for at most {MAXIMUM_INPUTS}")]
    Inputs {
        /// How many.
        inputs: usize,
    },
    /// Too many states.
    #[error("more than {bound} states can be reached")]
    States {
        /// The bound that was given, in pairs of registers and inputs.
        bound: usize,
    },
    /// Nobody waited until the end.
    #[error("the time was over after {states} states")]
    Time {
        /// So many were listed.
        states: usize,
    },
}

/// Operations, each on 64 scans, before anybody is asked whether to go on: so a small program is listed whole on any machine.
const AT_LEAST: usize = 20_000_000;

/// Nanoseconds of a list of few states, and what it takes about: an instruction for as many states as are scanned at once, 64 registers of them and
/// 64 of the next, and one of the next states to be looked up.
const FEW: usize = 500_000_000;
const INSTRUCTION: usize = 3;
const REGISTERS: usize = 5_000;
const STATE: usize = 20;

/// Where a state was first entered from: registers, and the inputs of the scan.
#[derive(Debug, Clone, Copy)]
struct Origin {
    from: u32,
    inputs: u32,
}

/// Every state that can be reached, and where it leads.
#[derive(Debug)]
pub struct Explicit {
    scan: Scan,
    /// 2^|u|
    ways: usize,
    /// Words of one x.
    width: usize,
    /// All x, packed, one after the other.
    registers: Vec<u64>,
    origins: Vec<Origin>,
    /// For each state the number of the x that its scan leads to.
    next: Vec<u32>,
}

/// A set of states.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Set(Vec<u64>);

impl Set {
    fn contains(&self, state: usize) -> bool {
        self.0[state / 64] >> (state % 64) & 1 == 1
    }

    /// The first state below `end` that is in it, or is not.
    fn first(&self, wanted: bool, end: usize) -> Option<usize> {
        let flip = u64::from(wanted).wrapping_sub(1);
        let mut words = self.0.iter().map(|word| word ^ flip).enumerate();
        let (place, word) = words.find(|&(_, word)| word != 0)?;
        Some(64 * place + word.trailing_zeros() as usize).filter(|&state| state < end)
    }

    fn insert(&mut self, state: usize) {
        self.0[state / 64] |= 1 << (state % 64);
    }

    fn remove(&mut self, state: usize) {
        self.0[state / 64] &= !(1 << (state % 64));
    }
}

impl Explicit {
    /// Lists the states of `circuit`, at most `bound` of them.
    ///
    /// # Errors
    /// There are more, or too many inputs.
    pub fn new(circuit: &Circuit, bound: usize) -> Result<Self, ExplicitError> {
        let (listed, error) = Self::explore(circuit, Extent::of(bound), ALWAYS, &mut |_| {});
        error.map_or(Ok(listed), Err)
    }

    /// So many states, with inputs, that listing them takes about half a second: a large program has fewer.
    pub(crate) fn few(circuit: &Circuit) -> usize {
        let instructions = Scan::new(circuit).instruction_count();
        let registers = circuit.registers().len().div_ceil(64);
        FEW / (INSTRUCTION * instructions + REGISTERS * registers + STATE * LANES) * LANES
    }

    /// Lists states, the nearest first, and shows every scan from them to `see`. With an error the list is not complete.
    pub(crate) fn explore(
        circuit: &Circuit,
        extent: Extent,
        go_on: GoOn<'_>,
        see: &mut dyn FnMut(Seen<'_>),
    ) -> (Self, Option<ExplicitError>) {
        let inputs = circuit.inputs().len();
        let scan = Scan::new(circuit);
        let width = scan.initial().len().max(1);
        let mut first = scan.initial().to_vec();
        first.resize(width, 0);
        let mut listed = Self {
            ways: 1 << inputs.min(MAXIMUM_INPUTS),
            width,
            registers: first,
            origins: vec![Origin { from: 0, inputs: 0 }],
            next: Vec::new(),
            scan,
        };
        if inputs > MAXIMUM_INPUTS {
            return (listed, Some(ExplicitError::Inputs { inputs }));
        }
        let at_least = AT_LEAST / listed.scan.instruction_count().max(1) * 64;
        let hasher = FxBuildHasher;
        let mut known_registers: HashTable<u32> = HashTable::new();
        let hash = |words: &[u64]| hasher.hash_one(words);
        known_registers.insert_unique(hash(&listed.registers), 0, |_| 0);
        let mut lanes = Lanes::default();
        let mut depths = Depths::default();
        let mut first = 0;
        while first < listed.states() {
            depths.note(first / listed.ways, listed.count());
            let bound = extent.bound(listed.states(), &depths);
            let known = listed.states().min(bound / listed.ways * listed.ways);
            let many = if depths.are_steady() { MAXIMUM_BYTES / (8 * width + BYTES) } else { 0 };
            if known <= first || listed.count() > many.max(MAXIMUM_COUNT) {
                return (listed, Some(ExplicitError::States { bound }));
            }
            let from = first / listed.ways;
            if first >= at_least && !go_on(Work::States(from)) {
                return (listed, Some(ExplicitError::Time { states: from }));
            }
            let states = first..known.min(first + LANES);
            lanes.scan(&listed, states.clone());
            see(lanes.seen());
            for (state, next) in states.clone().zip(lanes.next(width)) {
                let code = hash(next);
                let at = |number: u32| &listed.registers[number as usize * width..][..width];
                let found = known_registers.find(code, |&number| at(number) == next);
                let number = match found {
                    Some(&number) => number,
                    None => {
                        let number = listed.origins.len() as u32;
                        listed.registers.extend_from_slice(next);
                        listed.origins.push(Origin {
                            from: (state / listed.ways) as u32,
                            inputs: (state % listed.ways) as u32,
                        });
                        let registers = &listed.registers;
                        known_registers.insert_unique(code, number, |&number| {
                            hash(&registers[number as usize * width..][..width])
                        });
                        number
                    }
                };
                listed.next.push(number);
            }
            first = states.end;
        }
        // The list is complete: the answer is not needed.
        let _ = go_on(Work::States(listed.origins.len()));
        (listed, None)
    }

    /// How many x can be reached.
    pub fn count(&self) -> usize {
        self.origins.len()
    }

    /// How many pairs (x, u).
    fn states(&self) -> usize {
        self.origins.len() * self.ways
    }

    /// u by its number.
    fn inputs(&self, number: usize) -> Vec<bool> {
        let width = self.scan.input_count();
        (0..width).map(|input| number >> input & 1 == 1).collect()
    }

    /// The inputs of the shortest run that ends with the scan of `state`.
    pub(crate) fn run_to(&self, state: usize) -> Vec<Vec<bool>> {
        let mut run = vec![self.inputs(state % self.ways)];
        let mut registers = state / self.ways;
        while registers != 0 {
            let origin = self.origins[registers];
            run.push(self.inputs(origin.inputs as usize));
            registers = origin.from as usize;
        }
        run.reverse();
        run
    }
}
