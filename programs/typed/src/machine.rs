//! The engine of stations: a program compiled to the instructions of a small register machine.
//!
//! All memory of a scan is one row of slots ([`instruction`]). A routine is compiled once for each instance that is known when the program is
//! read, so that its variables are slots of the row; beyond a bound, and for instances that are found by an index or a reference, it is compiled
//! once for all, and its operands are counted from the instance. The meaning is that of [`crate::Interpreter`], bit for bit.

mod compile;
mod execute;
mod instruction;
mod working;

use std::sync::Arc;

use crate::fault::Fault;
use crate::form::{Program, RoutineId};
use crate::machine::execute::Run;
use crate::machine::instruction::{
    Application, Element, Instruction, Loop, Range, TextApplication,
};
use crate::scan::{Frame, SCANS};

/// A compiled program; cheap to share, it holds no state.
#[derive(Debug, Clone)]
pub struct Machine(Arc<Compiled>);

#[derive(Debug)]
struct Compiled {
    frame: Frame,
    tables: Tables,
    /// Where the code of each task begins.
    tasks: Vec<u32>,
    /// Slots of state and frames, and of the whole row.
    memory: usize,
    row: usize,
    texts: usize,
}

/// Instructions and what they refer to.
#[derive(Debug, Clone, Default)]
struct Tables {
    code: Vec<Instruction>,
    elements: Vec<Element>,
    loops: Vec<Loop>,
    ranges: Vec<Range>,
    applications: Vec<Application>,
    text_applications: Vec<TextApplication>,
    texts: Vec<Arc<[u8]>>,
    constants: Vec<u64>,
    /// First instruction of each statement, in order, with its routine and line.
    lines: Vec<(u32, RoutineId, u32)>,
    budget: u64,
    /// Bits of state and frames.
    memory: u64,
}

/// Working memory of a [`Machine`], whichever; one for each thread, reused.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    row: Vec<u64>,
    texts: Vec<Vec<u8>>,
    returns: Vec<u32>,
}

impl Machine {
    /// Compiles a valid program.
    ///
    /// # Panics
    /// If the program is not valid.
    pub fn new(program: &Program) -> Self {
        Self(Arc::new(compile::compile(program)))
    }

    /// Width of u in bits.
    pub fn input_count(&self) -> usize {
        self.0.frame.input_count()
    }

    /// Width of y in bits.
    pub fn output_count(&self) -> usize {
        self.0.frame.output_count()
    }

    /// Words of x.
    pub fn state_words(&self) -> usize {
        self.initial().len()
    }

    /// x(0).
    pub fn initial(&self) -> &[u64] {
        self.0.frame.initial()
    }

    /// Instructions of the program.
    pub fn instruction_count(&self) -> usize {
        self.0.tables.code.len()
    }

    /// One scan of one run: reads u, replaces x(t) by x(t+1), writes y(t). Images are packed, unused high bits 0. After a program fault see
    /// [`Fault::read`].
    ///
    /// # Panics
    /// If a slice is shorter than its image; widths are the caller's promise.
    pub fn step(
        &self,
        scratch: &mut Scratch,
        state: &mut [u64],
        inputs: &[u64],
        outputs: &mut [u64],
    ) {
        let frame = &self.0.frame;
        if frame.begin(state, inputs) {
            let words = self.state_words();
            match self.scan(scratch, &state[..words], inputs) {
                Ok(()) => state[..words].copy_from_slice(&scratch.row[..words]),
                Err(fault) => fault.write(state),
            }
        }
        frame.pack(state, outputs);
    }

    fn scan(&self, scratch: &mut Scratch, state: &[u64], inputs: &[u64]) -> Result<(), Fault> {
        let compiled = &*self.0;
        execute::prepare(scratch, compiled.row, compiled.texts);
        let row = &mut scratch.row[..compiled.row];
        row[..state.len()].copy_from_slice(state);
        row[state.len()..compiled.memory].fill(0);
        row[compiled.memory] = compiled.frame.elapsed(state);
        let constants = compiled.row - compiled.tables.constants.len();
        row[constants..].copy_from_slice(&compiled.tables.constants);
        compiled.frame.unpack(inputs, row);
        let scans = row[SCANS];
        let mut run = Run {
            tables: &compiled.tables,
            row,
            texts: &mut scratch.texts,
            returns: &mut scratch.returns,
            budget: compiled.tables.budget,
        };
        for (task, &start) in compiled.frame.tasks().iter().zip(&compiled.tasks) {
            if scans.is_multiple_of(u64::from(task.every.max(1))) {
                let run = run.run::<false>(start, 0);
                run.map_err(|stop| compiled.tables.fault(&stop))?;
            }
        }
        compiled.frame.end(run.row)
    }
}

impl Tables {
    /// Where the statement of an instruction stands.
    fn fault(&self, stop: &execute::Stop) -> Fault {
        let behind = self
            .lines
            .partition_point(|&(first, ..)| first as usize <= stop.at);
        let statement = behind.checked_sub(1).map(|index| self.lines[index]);
        Fault {
            cause: stop.cause,
            routine: statement.map(|(_, routine, _)| routine),
            line: statement.map_or(0, |(_, _, line)| line),
        }
    }
}
