//! 64 scans of one circuit at once: packed states and inputs become words of which each bit is a run, and come back packed.

use understudy_logic::{Scan, Scratch, transpose};

/// Scans in one pass.
pub(super) const LANES: usize = 64;

/// A circuit and the memory that its passes need.
pub(super) struct Lanes {
    scan: Scan,
    scratch: Scratch,
    inputs: Vec<u64>,
    state: Vec<u64>,
    outputs: Vec<u64>,
}

/// One run, packed: before a pass x(t) and u(t), after it x(t+1) and y(t).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) state: Vec<u64>,
    /// u(t), then y(t).
    pub(super) signals: Vec<u64>,
}

impl Lanes {
    pub(super) fn new(scan: Scan) -> Self {
        Self {
            inputs: vec![0; scan.input_count()],
            state: vec![0; scan.register_count()],
            outputs: vec![0; scan.output_count()],
            scratch: Scratch::default(),
            scan,
        }
    }

    pub(super) fn scan(&self) -> &Scan {
        &self.scan
    }

    /// One scan of each of `runs`, at most [`LANES`].
    pub(super) fn step(&mut self, runs: &mut [Run]) {
        spread(runs, |run| &run.state, &mut self.state);
        spread(runs, |run| &run.signals, &mut self.inputs);
        self.scan.step_lanes(
            &mut self.scratch,
            &mut self.state,
            &self.inputs,
            &mut self.outputs,
        );
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
        for (word, run) in block.iter_mut().zip(runs) {
            *word = image(run)[place];
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
        for (word, run) in block.iter().zip(runs.iter_mut()) {
            image(run)[place] = *word;
        }
    }
}
