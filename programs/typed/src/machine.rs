//! The engine of stations: a program compiled to the instructions of a small register machine.
//!
//! All memory of a scan is one row of slots ([`instruction`]). A routine is compiled once for each instance that is known when the program is
//! read, so that its variables are slots of the row; beyond a bound, and for instances that are found by an index or a reference, it is compiled
//! once for all, and its operands are counted from the instance. The meaning is that of [`crate::Interpreter`], bit for bit.

mod compile;
mod execute;
mod instruction;
mod working;

use std::sync::{Arc, Weak};

use crate::fault::Fault;
use crate::form::{Program, RoutineId};
use crate::machine::execute::Run;
use crate::machine::instruction::{
    Application, Element, Instruction, Loop, Range, TextApplication,
};
use crate::row::{Row, SLOTS};
use crate::scan::{Frame, SCANS};

/// A compiled program; cheap to share, it holds no state.
#[derive(Debug, Clone)]
pub struct Machine(Arc<Compiled>);

#[derive(Debug)]
struct Compiled {
    frame: Frame,
    tables: Tables,
    /// The code with operands of 16 bits, in place of the one in the tables, where there is no larger and no relative operand.
    narrow: Option<Vec<Instruction<u16>>>,
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
    /// The machine whose constants the row has.
    of: Weak<Compiled>,
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
        let narrow = self.0.narrow.as_ref().map(Vec::len);
        narrow.unwrap_or(self.0.tables.code.len())
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
        let compiled = &*self.0;
        if compiled.frame.begin(state, inputs) {
            self.prepare(scratch);
            let state = &mut state[..self.state_words()];
            let (texts, returns) = (&mut scratch.texts, &mut scratch.returns);
            let working = (texts, returns);
            let code = &compiled.tables.code;
            let near = <&mut [u64; SLOTS]>::try_from(&mut *scratch.row);
            let scanned = match (near, &compiled.narrow) {
                (Ok(row), Some(code)) => {
                    compiled.scan::<_, _, false>(code, row, working, state, inputs)
                }
                (Ok(row), None) => compiled.scan::<_, _, true>(code, row, working, state, inputs),
                (Err(_), _) => {
                    compiled.scan::<_, _, true>(code, &mut *scratch.row, working, state, inputs)
                }
            };
            match scanned {
                Ok(()) => {
                    // Packed from slots that were written one by one: a copy of many at once has to wait for them.
                    match <&[u64; SLOTS]>::try_from(&*scratch.row) {
                        Ok(row) => compiled.frame.pack(row, outputs),
                        Err(_) => compiled.frame.pack(&*scratch.row, outputs),
                    }
                    state.copy_from_slice(&scratch.row[..state.len()]);
                    return;
                }
                Err(fault) => fault.write(state),
            }
        }
        compiled.frame.pack_state(state, outputs);
    }

    /// Makes working memory ready for this machine, unless it was used for it before.
    fn prepare(&self, scratch: &mut Scratch) {
        let compiled = &*self.0;
        scratch.returns.clear();
        if scratch.of.as_ptr() == Arc::as_ptr(&self.0) {
            return;
        }
        scratch.of = Arc::downgrade(&self.0);
        let slots = compiled.row.max(SLOTS);
        if scratch.row.len() != slots {
            scratch.row = vec![0; slots];
        }
        let texts = compiled.texts.max(scratch.texts.len());
        scratch.texts.resize(texts, Vec::new());
        let constants = compiled.row - compiled.tables.constants.len();
        scratch.row[constants..compiled.row].copy_from_slice(&compiled.tables.constants);
    }
}

impl Compiled {
    /// The inputs, the tasks and the end of a scan. `OWN` is for code with relative operands, which any code may be executed as.
    fn scan<O: Copy + Into<u32>, R: Row + ?Sized, const OWN: bool>(
        &self,
        code: &[Instruction<O>],
        row: &mut R,
        (texts, returns): (&mut Vec<Vec<u8>>, &mut Vec<u32>),
        state: &[u64],
        inputs: &[u64],
    ) -> Result<(), Fault> {
        row.all()[..state.len()].copy_from_slice(state);
        if state.len() < self.memory {
            row.all()[state.len()..self.memory].fill(0);
        }
        *row.slot(self.memory as u32) = self.frame.elapsed(state);
        self.frame.unpack(inputs, row);
        let scans = row.get(SCANS as u32);
        let mut run =
            Run { code, tables: &self.tables, row, texts, returns, budget: self.tables.budget };
        for (task, &start) in self.frame.tasks().iter().zip(&self.tasks) {
            if task.every <= 1 || scans.is_multiple_of(u64::from(task.every)) {
                let run = run.run::<OWN>(start, 0);
                run.map_err(|stop| self.tables.fault(&stop))?;
            }
        }
        self.frame.end(run.row.all())
    }
}

impl Tables {
    /// Where the statement of an instruction stands.
    fn fault(&self, stop: &execute::Stop) -> Fault {
        let behind = self.lines.partition_point(|&(first, ..)| first as usize <= stop.at);
        let statement = behind.checked_sub(1).map(|index| self.lines[index]);
        Fault {
            cause: stop.cause,
            routine: statement.map(|(_, routine, _)| routine),
            line: statement.map_or(0, |(_, _, line)| line),
        }
    }
}
