//! 64 scans of one circuit at once: packed images of runs become lanes, words of which each bit is a run, and come back packed.

use crate::packed::pack;
use crate::scan::{Scan, Scratch};

/// Exchanges bit j of word k for bit k of word j: words that are images of runs become words that are elements, with a run in each bit; and the other way
/// round. Halves, then quarters, down to single bits.
pub fn transpose(block: &mut [u64; 64]) {
    let mut width = 32;
    let mut mask = u64::MAX >> 32;
    while width != 0 {
        let mut row = 0;
        while row < 64 {
            let moved = (block[row] >> width ^ block[row | width]) & mask;
            block[row] ^= moved << width;
            block[row | width] ^= moved;
            row = ((row | width) + 1) & !width;
        }
        width >>= 1;
        mask ^= mask << width;
    }
}

/// Scans in one pass.
pub const LANES: usize = 64;

/// A circuit and the memory that its passes need.
pub struct Lanes {
    scan: Scan,
    scratch: Scratch,
    inputs: Vec<u64>,
    state: Vec<u64>,
    outputs: Vec<u64>,
}

/// One run, packed: before a pass x(t) and u(t), after it x(t+1) and y(t).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    /// x(t), then x(t+1).
    pub state: Vec<u64>,
    /// u(t), then y(t).
    pub signals: Vec<u64>,
}

impl Lanes {
    /// The lanes of `scan`.
    pub fn new(scan: Scan) -> Self {
        Self {
            inputs: Vec::new(),
            state: Vec::new(),
            outputs: Vec::new(),
            scratch: Scratch::default(),
            scan,
        }
    }

    /// The compiled circuit.
    pub fn scan(&self) -> &Scan {
        &self.scan
    }

    /// One scan from `state` with each of `inputs`, at most [`LANES`] of them.
    pub fn fan_out(&mut self, state: &[u64], inputs: &[Vec<bool>]) -> Vec<Run> {
        let run = |inputs: &Vec<bool>| Run {
            state: state.to_vec(),
            signals: pack(inputs.iter().copied()),
        };
        let mut runs: Vec<Run> = inputs.iter().map(run).collect();
        self.step(&mut runs);
        runs
    }

    /// One scan of each of `runs`, at most [`LANES`].
    ///
    /// # Panics
    /// Where there are more.
    pub fn step(&mut self, runs: &mut [Run]) {
        assert!(runs.len() <= LANES, "{} runs", runs.len());
        self.state.resize(self.scan.register_count(), 0);
        self.inputs.resize(self.scan.input_count(), 0);
        self.outputs.resize(self.scan.output_count(), 0);
        spread(runs, |run| &run.state, &mut self.state);
        spread(runs, |run| &run.signals, &mut self.inputs);
        self.scan.step_lanes(&mut self.scratch, &mut self.state, &self.inputs, &mut self.outputs);
        for run in runs.iter_mut() {
            run.signals.clear();
            run.signals.resize(self.outputs.len().div_ceil(64), 0);
        }
        gather(&self.state, runs, |run| &mut run.state);
        gather(&self.outputs, runs, |run| &mut run.signals);
    }
}

/// Bit l of word k of `lanes` becomes bit k of the image of run l.
fn spread(runs: &[Run], image: impl Fn(&Run) -> &Vec<u64>, lanes: &mut [u64]) {
    for (place, lanes) in lanes.chunks_mut(64).enumerate() {
        let mut block = [0; 64];
        for (row, run) in block.iter_mut().zip(runs) {
            *row = image(run)[place];
        }
        transpose(&mut block);
        lanes.copy_from_slice(&block[..lanes.len()]);
    }
}

/// The inverse of [`spread`]; bits past the width are 0.
fn gather(lanes: &[u64], runs: &mut [Run], image: impl Fn(&mut Run) -> &mut Vec<u64>) {
    for (place, lanes) in lanes.chunks(64).enumerate() {
        let mut block = [0; 64];
        block[..lanes.len()].copy_from_slice(lanes);
        transpose(&mut block);
        for (row, run) in block.iter().zip(runs.iter_mut()) {
            image(run)[place] = *row;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circuit::CircuitBuilder;

    /// x(t+1) = x + u over 70 bits, y = x: each run is that of one lane.
    #[test]
    fn each_run_is_that_of_one_lane() {
        let mut builder = CircuitBuilder::new("sum");
        for place in 0..70 {
            let input = builder.input(format!("u{place}"));
            let (register, value) = builder.register(format!("x{place}"), false);
            let sum = builder.graph().xor(value, input);
            builder.set_next(register, sum);
            builder.output(format!("y{place}"), value);
        }
        let circuit = builder.finish().expect("names differ");
        let mut lanes = Lanes::new(Scan::new(&circuit));
        for count in [1, 2, 63, LANES] {
            let run = |number: u64| Run {
                state: vec![number * number, number & 63],
                signals: vec![number, 1],
            };
            let mut runs: Vec<Run> = (0..count as u64).map(run).collect();
            lanes.step(&mut runs);
            for (number, stepped) in (0..).zip(&runs) {
                let before = run(number);
                let sum = before.state.iter().zip(&before.signals);
                let sum: Vec<u64> = sum.map(|(state, input)| state ^ input).collect();
                assert_eq!(stepped.state, sum);
                assert_eq!(stepped.signals, before.state);
            }
        }
    }

    #[test]
    fn a_block_is_transposed_bit_by_bit() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            seed ^ seed >> 29
        };
        let block: [u64; 64] = std::array::from_fn(|_| next());
        let mut turned = block;
        transpose(&mut turned);
        for (row, word) in block.iter().enumerate() {
            for (column, other) in turned.iter().enumerate() {
                assert_eq!(word >> column & 1, other >> row & 1);
            }
        }
    }
}
