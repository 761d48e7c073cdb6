//! Scans of many runs at once of which each has few registers on: constants and copies are found first, and not computed.

use super::{Instruction, Operand, SUM, Scan};
use crate::lanes::LANES;
use crate::packed::ones;

/// Words of a signal in a sparse pass. The more runs, the less of the time is that of instructions which no run needs.
const WORDS: usize = 64;

/// Runs in one sparse pass.
pub const SPARSE: usize = LANES * WORDS;

/// A signal in all runs.
type Wide = [u64; WORDS];

/// One run: before a pass x(t) and u(t), after it x(t+1) and y(t).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SparseRun {
    /// The registers that are on, ascending.
    pub on: Vec<u32>,
    /// The inputs, then the outputs, packed.
    pub signals: Vec<u64>,
}

/// A circuit of which few registers are on at once, as the states of an automaton, and the memory that its passes need.
pub struct Sparse {
    scan: Scan,
    /// The value of each place of the scan, as an operand of this pass.
    found: Vec<Operand>,
    /// The values that the operands of this pass name; the first is 0.
    wide: Vec<Wide>,
}

impl Sparse {
    /// The runs of `scan`.
    pub fn new(scan: Scan) -> Self {
        Self { found: Vec::new(), wide: Vec::new(), scan }
    }

    /// The compiled circuit.
    pub fn scan(&self) -> &Scan {
        &self.scan
    }

    /// One scan of each of `runs`, at most [`SPARSE`]. Each instruction is looked at once, and computed only where its result
    /// is neither a constant nor one of its operands.
    ///
    /// # Panics
    /// Where there are more runs, or a run has a register or fewer inputs than the circuit.
    pub fn step(&mut self, runs: &mut [SparseRun]) {
        self.load(runs);
        let Self { scan, found, wide } = self;
        for &instruction in &scan.instructions {
            let instruction = instruction.with(found);
            let operand = match instruction.folded() {
                Some(operand) => operand,
                None => place(wide, instruction.value(wide)),
            };
            found.push(operand);
        }
        for run in runs.iter_mut() {
            run.on.clear();
            run.signals.clear();
            run.signals.resize(scan.outputs.div_ceil(64), 0);
        }
        for (register, next) in (0..).zip(&scan.next) {
            each_one(next.with(found), wide, runs, |run| run.on.push(register));
        }
        for (output, value) in scan.values.iter().enumerate() {
            each_one(value.with(found), wide, runs, |run| {
                run.signals[output / 64] |= 1 << (output % 64);
            });
        }
    }

    /// Inputs, registers, and the constant 0.
    fn load(&mut self, runs: &[SparseRun]) {
        assert!(runs.len() <= SPARSE, "{} runs", runs.len());
        let Self { scan, found, wide } = self;
        wide.clear();
        wide.push([0; WORDS]);
        found.clear();
        for input in 0..scan.inputs {
            let mut value = [0; WORDS];
            for (lane, run) in runs.iter().enumerate() {
                let bit = run.signals[input / 64] >> (input % 64) & 1;
                value[lane / 64] |= bit << (lane % 64);
            }
            found.push(place(wide, value));
        }
        found.resize(scan.inputs + scan.registers + 1, ZERO);
        for (lane, run) in runs.iter().enumerate() {
            for &register in &run.on {
                let found = &mut found[scan.inputs..][..scan.registers][register as usize];
                if *found == ZERO {
                    *found = Operand::new(wide.len());
                    wide.push([0; WORDS]);
                }
                wide[(found.0 >> 1) as usize][lane / 64] |= 1 << (lane % 64);
            }
        }
    }
}

/// The constant 0 of a pass.
const ZERO: Operand = Operand(0);
const ONE: Operand = Operand(1);

/// Where `value` is from now on.
fn place(wide: &mut Vec<Wide>, value: Wide) -> Operand {
    if value.iter().all(|&word| word == 0) {
        return ZERO;
    }
    wide.push(value);
    Operand::new(wide.len() - 1)
}

/// Calls `with` on each run in which `operand` is 1.
fn each_one(
    operand: Operand,
    wide: &[Wide],
    runs: &mut [SparseRun],
    mut with: impl FnMut(&mut SparseRun),
) {
    if operand == ZERO {
        return;
    }
    for (word, runs) in operand.value(wide).into_iter().zip(runs.chunks_mut(LANES)) {
        let count = runs.len();
        for lane in ones(word).take_while(|lane| *lane < count) {
            with(&mut runs[lane]);
        }
    }
}

impl Operand {
    /// The same, of what its place has become.
    fn with(self, found: &[Self]) -> Self {
        Self(found[(self.0 >> 1) as usize].0 ^ self.0 & 1)
    }
}

impl Instruction {
    fn with(self, found: &[Operand]) -> Self {
        Self {
            left: Operand(self.left & !SUM).with(found).0 | self.left & SUM,
            right: self.right.with(found),
        }
    }

    /// The constant or the operand that it is, where it is known to be one.
    fn folded(self) -> Option<Operand> {
        let (a, b) = (Operand(self.left & !SUM), self.right);
        let negated = |operand: Operand, by: Operand| Operand(operand.0 ^ by.0);
        if self.left & SUM == 0 {
            match (a, b) {
                (ZERO, _) | (_, ZERO) => Some(ZERO),
                (ONE, other) | (other, ONE) => Some(other),
                _ if a == b => Some(a),
                _ if a == b.negated() => Some(ZERO),
                _ => None,
            }
        } else {
            match (a, b) {
                (constant @ (ZERO | ONE), other) | (other, constant @ (ZERO | ONE)) => {
                    Some(negated(other, constant))
                }
                _ if a == b => Some(ZERO),
                _ if a == b.negated() => Some(ONE),
                _ => None,
            }
        }
    }
}
