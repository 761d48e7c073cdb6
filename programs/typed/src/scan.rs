//! The frame of a scan, which both engines share: inputs, tasks, outputs, and what a fault leaves behind.
//!
//! ```text
//! running   inputs within their subranges → tasks → outputs are finite and within theirs → count → outputs        x(t+1), y(t)
//! fault     the state before the scan, with slots 0 to 2 set; the outputs that this state holds
//! faulted   the reset is FALSE: nothing changes; TRUE: the initial state, then as running
//! ```

use crate::fault::{Cause, Fault};
use crate::form::{Program, Task};
use crate::image::{Declared, Point, Points};
use crate::operation::real::Float;
use crate::row::Row;
use crate::types::Elementary;

/// The number of scans since the start.
pub(crate) const SCANS: usize = 3;

/// What an engine needs of a program besides its code.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    inputs: Points,
    outputs: Points,
    /// The inputs, but for the reset.
    given: Vec<Wire>,
    /// The outputs of each word of their image, but for the fault.
    taken: Vec<Vec<Wire>>,
    /// The bits of the output image that are the fault.
    faults: Vec<Wire>,
    /// Outputs that may be no finite number: their places in the image, slots and types.
    reals: Vec<(u64, u32, Elementary)>,
    /// Inputs with a subrange: their slots and declarations.
    limited_inputs: Vec<(u32, Declared)>,
    /// Outputs with a subrange: the same.
    limited_outputs: Vec<(u32, Declared)>,
    initial: Vec<u64>,
    tasks: Vec<Task>,
    period: i64,
}

/// A point of an image: bits of a word, and the slot of its variable.
#[derive(Debug, Clone, Copy)]
struct Wire {
    word: u32,
    shift: u32,
    mask: u64,
    slot: u32,
}

impl Wire {
    fn new(point: &Point) -> Self {
        Self {
            word: point.bit / 64,
            shift: point.bit % 64,
            mask: point.of.mask(),
            slot: point.slot,
        }
    }
}

/// Slots and declarations of the points with a subrange.
fn limited(points: &Points) -> Vec<(u32, Declared)> {
    let points = points.iter().filter(|point| point.range.is_some());
    points.map(|point| (point.slot, point.declared())).collect()
}

/// The points of each word of an image that are variables.
fn words(points: &Points) -> Vec<Vec<Wire>> {
    let mut words = vec![Vec::new(); points.width().div_ceil(64)];
    for point in points.iter().filter(|point| point.slot != 0) {
        words[point.bit as usize / 64].push(Wire::new(point));
    }
    words
}

impl Frame {
    pub(crate) fn new(program: &Program) -> Self {
        let stored = program.inputs.iter().filter(|point| point.slot != 0);
        let faults = program.outputs.iter().filter(|point| point.slot == 0);
        let outputs = program.outputs.iter().zip(0..);
        let reals = outputs.filter(|(point, _)| point.of.is_real());
        Self {
            given: stored.map(Wire::new).collect(),
            taken: words(&program.outputs),
            faults: faults.map(Wire::new).collect(),
            reals: reals.map(|(point, output)| (output, point.slot, point.of)).collect(),
            limited_inputs: limited(&program.inputs),
            limited_outputs: limited(&program.outputs),
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
    #[inline]
    pub(crate) fn begin(&self, state: &mut [u64], inputs: &[u64]) -> bool {
        let state = &mut state[..self.initial.len()];
        if state[0] == 0 {
            return true;
        }
        self.begin_again(state, inputs)
    }

    #[cold]
    fn begin_again(&self, state: &mut [u64], inputs: &[u64]) -> bool {
        let mut resets = self.inputs.iter().filter(|point| point.slot == 0);
        let is_reset = resets.any(|point| point.get(inputs) != 0);
        if is_reset {
            state.copy_from_slice(&self.initial);
        }
        is_reset
    }

    /// Stores the inputs into the slots of their variables; one beyond its subrange becomes the end of it.
    #[inline]
    pub(crate) fn unpack<R: Row + ?Sized>(&self, inputs: &[u64], memory: &mut R) {
        for wire in &self.given {
            *memory.slot(wire.slot) = inputs[wire.word as usize] >> wire.shift & wire.mask;
        }
        for (slot, declared) in &self.limited_inputs {
            let value = memory.slot(*slot);
            *value = declared.limited(*value);
        }
    }

    /// TIME from the start to this scan.
    pub(crate) fn elapsed(&self, memory: &[u64]) -> u64 {
        memory[SCANS].wrapping_mul(self.period as u64)
    }

    /// Ends a scan whose tasks ran: an output beyond its subrange becomes its end, and the scan is counted.
    ///
    /// # Errors
    /// If an output is not finite.
    pub(crate) fn end(&self, memory: &mut [u64]) -> Result<(), Fault> {
        for &(output, slot, of) in &self.reals {
            let value = memory[slot as usize];
            let is_finite = match of {
                Elementary::Real => f32::unpack(value).is_finite(),
                _ => f64::unpack(value).is_finite(),
            };
            if !is_finite {
                return Err(Fault {
                    cause: Cause::OutputNotFinite { output, value },
                    routine: None,
                    line: 0,
                });
            }
        }
        for (slot, declared) in &self.limited_outputs {
            let value = &mut memory[*slot as usize];
            *value = declared.limited(*value);
        }
        memory[SCANS] = memory[SCANS].wrapping_add(1);
        Ok(())
    }

    /// Packs the outputs of a scan without a fault; bits of no point are 0.
    #[inline]
    pub(crate) fn pack<R: Row + ?Sized>(&self, memory: &R, outputs: &mut [u64]) {
        let outputs = &mut outputs[..self.taken.len()];
        for (output, wires) in outputs.iter_mut().zip(&self.taken) {
            *output = wires
                .iter()
                .fold(0, |word, wire| word | (memory.get(wire.slot) & wire.mask) << wire.shift);
        }
    }

    /// Packs the outputs that a state holds, whether it is one of a fault or not.
    pub(crate) fn pack_state(&self, state: &[u64], outputs: &mut [u64]) {
        self.pack(state, outputs);
        if state[0] != 0 {
            for wire in &self.faults {
                outputs[wire.word as usize] |= 1 << wire.shift;
            }
        }
    }
}
