//! CTL by listing every state that can be reached, 64 scans at once: where few of many states can be reached, as with steps of which one is on,
//! this decides what decision diagrams of all states do not.
//!
//! A state is (x, u), numbered x · 2^|u| + u; registers x are numbered as they are found, the first ones first. A set is a bit a state.

use std::hash::BuildHasher;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;
use understudy_logic::{Circuit, Scan, Scratch};

use crate::property::{Formula, Path};
use crate::symbolic::{Core, Resolved, Signal};

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
}

/// Where a state was first entered from: registers, and the inputs of the scan.
#[derive(Debug, Clone, Copy)]
struct Origin {
    from: u32,
    inputs: u32,
}

/// Every state that can be reached, and where it leads.
pub struct Explicit<'c> {
    circuit: &'c Circuit,
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

impl<'c> Explicit<'c> {
    /// Lists the states of `circuit`, at most `bound` of them.
    ///
    /// # Errors
    /// There are more, or too many inputs.
    pub fn new(circuit: &'c Circuit, bound: usize) -> Result<Self, ExplicitError> {
        let inputs = circuit.inputs().len();
        if inputs > MAXIMUM_INPUTS {
            return Err(ExplicitError::Inputs { inputs });
        }
        let scan = Scan::new(circuit);
        let width = scan.initial().len().max(1);
        let mut first = scan.initial().to_vec();
        first.resize(width, 0);
        let mut listed = Self {
            circuit,
            ways: 1 << inputs,
            width,
            registers: first,
            origins: vec![Origin { from: 0, inputs: 0 }],
            next: Vec::new(),
            scan,
        };
        let hasher = FxBuildHasher;
        let mut known: HashTable<u32> = HashTable::new();
        let hash = |words: &[u64]| hasher.hash_one(words);
        known.insert_unique(hash(&listed.registers), 0, |_| 0);
        let mut lanes = Lanes::default();
        let mut from = 0;
        while from < listed.origins.len() {
            if (from + 1) * listed.ways > bound || listed.origins.len() > MAXIMUM_COUNT {
                return Err(ExplicitError::States { bound });
            }
            for block in 0..listed.ways.div_ceil(64) {
                lanes.scan(&listed, from, block);
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
        Ok(listed)
    }

    /// How many x can be reached.
    pub fn count(&self) -> usize {
        self.origins.len()
    }

    /// Whether each of `properties` holds from every first scan, and the inputs of a run that shows it: for `AG p` that fails, or `EF p` that holds.
    pub fn check(&self, properties: &[Resolved]) -> Vec<(bool, Option<Vec<Vec<bool>>>)> {
        let mut signals: Vec<Signal> = properties
            .iter()
            .flat_map(|property| property.signals().into_iter().copied())
            .collect();
        signals.sort_unstable();
        signals.dedup();
        let values = self.values(&signals);
        let model = Model {
            listed: self,
            signals,
            values,
        };
        properties
            .iter()
            .map(|property| model.check(property))
            .collect()
    }

    fn states(&self) -> usize {
        self.origins.len() * self.ways
    }

    fn empty(&self) -> Set {
        Set(vec![0; self.states().div_ceil(64)])
    }

    /// For each signal the states in which it is 1.
    fn values(&self, signals: &[Signal]) -> Vec<Set> {
        let mut values = vec![self.empty(); signals.len()];
        let mut lanes = Lanes::default();
        for from in 0..self.origins.len() {
            for block in 0..self.ways.div_ceil(64) {
                lanes.scan(self, from, block);
                for (signal, value) in signals.iter().zip(&mut values) {
                    let word = match signal {
                        Signal::Output(output) => lanes.outputs[*output],
                        Signal::Input(input) => lanes.inputs[*input],
                    };
                    for lane in 0..self.ways.min(64) {
                        if word >> lane & 1 == 1 {
                            value.insert(from * self.ways + block * 64 + lane);
                        }
                    }
                }
            }
        }
        values
    }

    /// u by its number.
    fn inputs(&self, number: usize) -> Vec<bool> {
        let width = self.circuit.inputs().len();
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
    fn scan(&mut self, listed: &Explicit<'_>, from: usize, block: usize) {
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

/// The states with the signals that are asked for.
struct Model<'e, 'c> {
    listed: &'e Explicit<'c>,
    signals: Vec<Signal>,
    values: Vec<Set>,
}

impl Model<'_, '_> {
    fn check(&self, property: &Resolved) -> (bool, Option<Vec<Vec<bool>>>) {
        let ways = self.listed.ways;
        let first_in = |set: &Set, wanted: bool| {
            (0..self.listed.states()).find(|&state| set.contains(state) == wanted)
        };
        match property {
            // All states that are listed can be reached, so this needs no fixed point.
            Formula::Always(Path::All, inner) => {
                let lost = first_in(&self.set(&Core::of(inner)), false);
                (lost.is_none(), lost.map(|state| self.listed.run_to(state)))
            }
            Formula::Eventually(Path::Some, inner) => {
                let holds = self.set(&Core::of(property));
                let holds = (0..ways).all(|state| holds.contains(state));
                let shown = first_in(&self.set(&Core::of(inner)), true);
                let run = shown.filter(|_| holds);
                (holds, run.map(|state| self.listed.run_to(state)))
            }
            _ => {
                let set = self.set(&Core::of(property));
                ((0..ways).all(|state| set.contains(state)), None)
            }
        }
    }

    fn set(&self, formula: &Core) -> Set {
        match formula {
            Core::Constant(value) => Set(vec![
                u64::from(*value).wrapping_neg();
                self.listed.states().div_ceil(64)
            ]),
            Core::Signal(signal) => {
                let place = self.signals.binary_search(signal);
                self.values[place.expect("signals were collected")].clone()
            }
            Core::Not(inner) => {
                let mut set = self.set(inner);
                for word in &mut set.0 {
                    *word = !*word;
                }
                set
            }
            Core::And(left, right) => {
                let mut set = self.set(left);
                for (word, other) in set.0.iter_mut().zip(&self.set(right).0) {
                    *word &= other;
                }
                set
            }
            Core::Next(inner) => self.before(&self.set(inner)),
            Core::Until(hold, end) => self.until(&self.set(hold), self.set(end)),
            Core::Always(inner) => self.always(self.set(inner)),
            Core::Reaches(scans, inner) => {
                let end = self.set(inner);
                self.rounds(*scans, &end, |end, before| end | before)
            }
            Core::Stays(scans, inner) => {
                let kept = self.set(inner);
                self.rounds(*scans, &kept, |kept, before| kept & before)
            }
        }
    }

    /// For each x whether some inputs lead into the set.
    fn some(&self, set: &Set) -> Vec<bool> {
        let ways = self.listed.ways;
        let registers = 0..self.listed.origins.len();
        registers
            .map(|from| (from * ways..(from + 1) * ways).any(|state| set.contains(state)))
            .collect()
    }

    /// EX
    fn before(&self, set: &Set) -> Set {
        let some = self.some(set);
        let mut before = self.listed.empty();
        for (state, &next) in self.listed.next.iter().enumerate() {
            if some[next as usize] {
                before.insert(state);
            }
        }
        before
    }

    /// E[hold U end]. States lead to later numbers and back; so the states are gone through in both directions, until nothing is added.
    fn until(&self, hold: &Set, end: Set) -> Set {
        let mut set = end;
        let mut some = self.some(&set);
        let mut added = true;
        let mut add = |state: usize, set: &mut Set| {
            let adds = !set.contains(state)
                && hold.contains(state)
                && some[self.listed.next[state] as usize];
            if adds {
                set.insert(state);
                some[state / self.listed.ways] = true;
            }
            adds
        };
        while added {
            added = false;
            for state in (0..self.listed.states()).rev() {
                added |= add(state, &mut set);
            }
            for state in 0..self.listed.states() {
                added |= add(state, &mut set);
            }
        }
        set
    }

    /// EG
    fn always(&self, inside: Set) -> Set {
        let mut set = inside;
        loop {
            let some = self.some(&set);
            let mut lost = false;
            for (state, &next) in self.listed.next.iter().enumerate() {
                if set.contains(state) && !some[next as usize] {
                    set.remove(state);
                    lost = true;
                }
            }
            if !lost {
                return set;
            }
        }
    }

    fn rounds(&self, scans: u32, start: &Set, join: impl Fn(u64, u64) -> u64) -> Set {
        let mut set = start.clone();
        for _ in 0..scans {
            let before = self.before(&set);
            let words = start.0.iter().zip(&before.0);
            let next = Set(words.map(|(&start, &before)| join(start, before)).collect());
            if next == set {
                break;
            }
            set = next;
        }
        set
    }
}
