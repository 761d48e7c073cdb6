//! The frame of a scan, which both engines share: inputs, tasks, outputs, and what a fault leaves behind.
//!
//! ```text
//! running   inputs → tasks → outputs are finite → count → outputs        x(t+1), y(t)
//! fault     the state before the scan, with slots 0 to 2 set; the outputs that this state holds
//! faulted   the reset is FALSE: nothing changes; TRUE: the initial state, then as running
//! ```

use crate::fault::{Cause, Fault};
use crate::form::{Program, Task};
use crate::image::Points;
use crate::operation::real::Float;
use crate::types::Elementary;

/// The number of scans since the start.
pub(crate) const SCANS: usize = 3;

/// What an engine needs of a program besides its code.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    inputs: Points,
    outputs: Points,
    initial: Vec<u64>,
    tasks: Vec<Task>,
    period: i64,
}

impl Frame {
    pub(crate) fn new(program: &Program) -> Self {
        Self {
            inputs: program.inputs.clone(),
            outputs: program.outputs.clone(),
            initial: program.initial_state(),
            tasks: program.tasks.clone(),
            period: program.period,
        }
    }

    pub(crate) fn input_count(&self) -> usize {
        self.inputs.width()
    }

    pub(crate) fn output_count(&self) -> usize {
        self.outputs.width()
    }

    pub(crate) fn initial(&self) -> &[u64] {
        &self.initial
    }

    pub(crate) fn tasks(&self) -> &[Task] {
        &self.tasks
    }

    /// Makes a state ready for a scan; FALSE where a fault keeps the program from it.
    pub(crate) fn begin(&self, state: &mut [u64], inputs: &[u64]) -> bool {
        let state = &mut state[..self.initial.len()];
        if state[0] == 0 {
            return true;
        }
        let mut resets = self.inputs.iter().filter(|point| point.slot == 0);
        let is_reset = resets.any(|point| point.get(inputs) != 0);
        if is_reset {
            state.copy_from_slice(&self.initial);
        }
        is_reset
    }

    /// Stores the inputs into the slots of their variables.
    pub(crate) fn unpack(&self, inputs: &[u64], memory: &mut [u64]) {
        for point in &self.inputs {
            if point.slot != 0 {
                memory[point.slot as usize] = point.get(inputs);
            }
        }
    }

    /// TIME from the start to this scan.
    pub(crate) fn elapsed(&self, memory: &[u64]) -> u64 {
        memory[SCANS].wrapping_mul(self.period as u64)
    }

    /// Ends a scan whose tasks ran: counts it.
    ///
    /// # Errors
    /// If an output is not finite.
    pub(crate) fn end(&self, memory: &mut [u64]) -> Result<(), Fault> {
        for (output, point) in self.outputs.iter().enumerate() {
            let value = memory[point.slot as usize];
            let is_finite = match point.of {
                Elementary::Real => f32::unpack(value).is_finite(),
                Elementary::Lreal => f64::unpack(value).is_finite(),
                _ => true,
            };
            if !is_finite {
                return Err(Fault {
                    cause: Cause::OutputNotFinite {
                        output: output as u64,
                        value,
                    },
                    routine: None,
                    line: 0,
                });
            }
        }
        memory[SCANS] = memory[SCANS].wrapping_add(1);
        Ok(())
    }

    /// Packs the outputs that a state holds; bits of no point are 0.
    pub(crate) fn pack(&self, state: &[u64], outputs: &mut [u64]) {
        outputs[..self.outputs.width().div_ceil(64)].fill(0);
        for point in &self.outputs {
            let stored = state[point.slot as usize];
            let value = match point.slot {
                0 => u64::from(stored != 0),
                _ => stored,
            };
            point.set(outputs, value);
        }
    }
}
