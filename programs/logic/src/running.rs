//! A circuit that is stepped with bits, for those who look at single scans: tests, and commands that replay a table.

use crate::circuit::Circuit;
use crate::packed::{pack, unpack};
use crate::scan::{Scan, Scratch};

/// A circuit and its state x(t).
#[derive(Debug, Clone)]
pub struct Running {
    scan: Scan,
    scratch: Scratch,
    /// Packed, as [`Scan`] has it.
    state: Vec<u64>,
    /// Packed, of the last step.
    outputs: Vec<u64>,
}

impl Running {
    /// The circuit in its initial state.
    pub fn new(circuit: &Circuit) -> Self {
        let scan = Scan::new(circuit);
        Self {
            scratch: Scratch::default(),
            state: scan.initial().to_vec(),
            outputs: vec![0; scan.output_count().div_ceil(64)],
            scan,
        }
    }

    /// How many inputs a step takes.
    pub fn input_count(&self) -> usize {
        self.scan.input_count()
    }

    /// y(t) = h(x(t), u(t)); behind it the state is x(t+1). One bit for each input and output, in the circuit's order.
    ///
    /// # Panics
    /// If there are fewer inputs than the circuit has.
    pub fn step(&mut self, inputs: &[bool]) -> Vec<bool> {
        assert!(inputs.len() >= self.scan.input_count(), "inputs are missing");
        let packed = pack(inputs.iter().copied());
        self.scan.step(&mut self.scratch, &mut self.state, &packed, &mut self.outputs);
        unpack(&self.outputs, self.scan.output_count())
    }

    /// x(t), packed.
    pub fn state(&self) -> &[u64] {
        &self.state
    }

    /// Goes on from another state.
    ///
    /// # Panics
    /// If it is not as wide as the circuit's.
    pub fn go_to(&mut self, state: &[u64]) {
        self.state.copy_from_slice(state);
    }
}
