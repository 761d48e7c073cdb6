//! What several tests need.

use std::time::Duration;

use understudy_ladder::{Program, parse};
use understudy_logic::{Circuit, Scan, Scratch};

/// The period of one scan in tests that do not vary it.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// The program that `text` says; it must be without errors.
pub(crate) fn program(text: &str) -> Program {
    match parse(text).into_result() {
        Ok((program, _)) => program,
        Err(diagnostics) => panic!("{diagnostics:#?}\n{text}"),
    }
}

/// A running circuit with bits for images.
pub(crate) struct Running {
    scan: Scan,
    scratch: Scratch,
    state: Vec<u64>,
}

impl Running {
    pub(crate) fn new(circuit: &Circuit) -> Self {
        let scan = Scan::new(circuit);
        Self {
            state: scan.initial().to_vec(),
            scan,
            scratch: Scratch::default(),
        }
    }

    pub(crate) fn step(&mut self, inputs: &[bool]) -> Vec<bool> {
        let mut packed = vec![0; inputs.len().div_ceil(64)];
        for (index, &input) in inputs.iter().enumerate() {
            packed[index / 64] |= u64::from(input) << (index % 64);
        }
        let mut outputs = vec![0; self.scan.output_count().div_ceil(64)];
        self.scan
            .step(&mut self.scratch, &mut self.state, &packed, &mut outputs);
        (0..self.scan.output_count())
            .map(|index| outputs[index / 64] >> (index % 64) & 1 == 1)
            .collect()
    }
}
