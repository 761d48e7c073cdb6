//! CTL by listing every state that can be reached, 64 scans at once: where few of many states can be reached, as with steps of which one is on,
//! this decides what decision diagrams of all states do not.
//!
//! A state is (x, u), numbered x · 2^|u| + u; registers x are numbered as they are found, the first ones first. A set is a bit a state.

mod check;

use std::hash::BuildHasher;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;
use understudy_logic::{Circuit, Scan, Scratch};

use crate::effort::{ALWAYS, GoOn, Work};

/// Inputs past which nothing is listed: every state has 2^|u| ways on.
pub const MAXIMUM_INPUTS: usize = 12;

/// Registers that are listed, whatever the bound: a few hundred bytes each.
const MAXIMUM_COUNT: usize = 1 << 20;

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

/// What is looked at while states are listed: where in the list, and the outputs of 64 scans from there with the inputs 64 · block and on.
pub(crate) struct Seen<'a> {
    pub(crate) from: usize,
    pub(crate) block: usize,
    pub(crate) outputs: &'a [u64],
}

/// Operations, each on 64 scans, before anybody is asked whether to go on: so a small program is listed whole on any machine.
const AT_LEAST: usize = 20_000_000;

/// Operations of a list that takes about half a second, and what finding one state among those that are known is worth.
const FEW: usize = 500_000_000;
const LOOKING_UP: usize = 16;

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
        let (listed, error) = Self::explore(circuit, bound, ALWAYS, &mut |_| {});
        error.map_or(Ok(listed), Err)
    }

    /// So many states, with inputs, that listing them takes about half a second: a large program has fewer.
    pub(crate) fn few(circuit: &Circuit) -> usize {
        let ways = 1 << circuit.inputs().len().min(MAXIMUM_INPUTS);
        let registers = circuit.registers().len().next_multiple_of(64);
        let scan = Scan::new(circuit).instruction_count() + 2 * registers;
        FEW / (blocks(ways) * scan + ways * LOOKING_UP) * ways
    }

    /// Lists states, the nearest first, and shows every scan from them to `see`. With an error the list is not complete.
    pub(crate) fn explore(
        circuit: &Circuit,
        bound: usize,
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
        let work = listed.scan.instruction_count() * blocks(listed.ways);
        let at_least = AT_LEAST / work.max(1);
        let hasher = FxBuildHasher;
        let mut known: HashTable<u32> = HashTable::new();
        let hash = |words: &[u64]| hasher.hash_one(words);
        known.insert_unique(hash(&listed.registers), 0, |_| 0);
        let mut lanes = Lanes::default();
        let mut from = 0;
        while from < listed.origins.len() {
            if (from + 1) * listed.ways > bound || listed.origins.len() > MAXIMUM_COUNT {
                return (listed, Some(ExplicitError::States { bound }));
            }
            if from >= at_least && from.is_multiple_of(64) && !go_on(Work::States(from)) {
                return (listed, Some(ExplicitError::Time { states: from }));
            }
            for block in 0..blocks(listed.ways) {
                lanes.scan(&listed, from, block);
                see(Seen {
                    from,
                    block,
                    outputs: &lanes.outputs,
                });
                for lane in 0..listed.ways.min(64) {
                    let state = &lanes.packed[lane * width..][..width];
                    let code = hash(state);
                    let at = |number: u32| &listed.registers[number as usize * width..][..width];
                    let found = known.find(code, |&number| at(number) == state);
                    let number = match found {
                        Some(&number) => number,
                        None => {
                            let number = listed.origins.len() as u32;
                            listed.registers.extend_from_slice(state);
                            listed.origins.push(Origin {
                                from: from as u32,
                                inputs: (block * 64 + lane) as u32,
                            });
                            let registers = &listed.registers;
                            known.insert_unique(code, number, |&number| {
                                hash(&registers[number as usize * width..][..width])
                            });
                            number
                        }
                    };
                    listed.next.push(number);
                }
            }
            from += 1;
        }
        (listed, None)
    }

    /// How many x can be reached.
    pub fn count(&self) -> usize {
        self.origins.len()
    }

    /// The inputs of the shortest run that ends with a scan that was shown, by its place in the list, block and lane.
    pub(crate) fn run_to_scan(&self, from: usize, block: usize, lane: usize) -> Vec<Vec<bool>> {
        self.run_to(from * self.ways + (block * 64 + lane) % self.ways)
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

    /// The shortest run that ends with the scan of `state`.
    fn run_to(&self, state: usize) -> Vec<Vec<bool>> {
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

/// Scans of 64 ways on at once.
fn blocks(ways: usize) -> usize {
    ways.div_ceil(64)
}

/// 64 scans from one x.
#[derive(Default)]
struct Lanes {
    scratch: Scratch,
    state: Vec<u64>,
    inputs: Vec<u64>,
    outputs: Vec<u64>,
    /// The x that each leads to, one after the other.
    packed: Vec<u64>,
}

impl Lanes {
    /// All scans of the x of this number with the inputs 64 · `block` and on.
    fn scan(&mut self, listed: &Explicit, from: usize, block: usize) {
        let registers = &listed.registers[from * listed.width..][..listed.width];
        let count = listed.scan.register_count();
        self.state.clear();
        self.state.extend(
            (0..count).map(|place| (registers[place / 64] >> (place % 64) & 1).wrapping_neg()),
        );
        self.inputs.clear();
        self.inputs
            .extend((0..listed.scan.input_count()).map(|input| {
                // Lane l of the block has the inputs 64 · block + l.
                match input {
                    0 => 0xaaaa_aaaa_aaaa_aaaa,
                    1 => 0xcccc_cccc_cccc_cccc,
                    2 => 0xf0f0_f0f0_f0f0_f0f0,
                    3 => 0xff00_ff00_ff00_ff00,
                    4 => 0xffff_0000_ffff_0000,
                    5 => 0xffff_ffff_0000_0000,
                    _ => (block as u64 >> (input - 6) & 1).wrapping_neg(),
                }
            }));
        self.outputs.resize(listed.scan.output_count(), 0);
        let scratch = &mut self.scratch;
        listed
            .scan
            .step_lanes(scratch, &mut self.state, &self.inputs, &mut self.outputs);
        self.packed.clear();
        self.packed.resize(64 * listed.width, 0);
        for (word, chunk) in self.state.chunks(64).enumerate() {
            let mut square = [0; 64];
            square[..chunk.len()].copy_from_slice(chunk);
            transpose(&mut square);
            for (lane, row) in square.iter().enumerate() {
                self.packed[lane * listed.width + word] = *row;
            }
        }
    }
}

/// Bit i of word k becomes bit k of word i.
fn transpose(square: &mut [u64; 64]) {
    let mut half = 32;
    let mut mask = 0x0000_0000_ffff_ffff_u64;
    while half != 0 {
        let mut row = 0;
        while row < 64 {
            let swapped = (square[row] >> half ^ square[row + half]) & mask;
            square[row] ^= swapped << half;
            square[row + half] ^= swapped;
            row = (row + half + 1) & !half;
        }
        half >>= 1;
        mask ^= mask << half;
    }
}
