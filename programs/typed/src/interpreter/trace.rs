//! What the statements of one scan did: each assignment with the values that it read, and the conditions that led to it.

use std::collections::BTreeMap;

use crate::fault::Fault;
use crate::form::{RoutineId, Statement};
use crate::interpreter::memory::{Address, Value};
use crate::interpreter::{Context, Flow, Interpreter, Run};
use crate::operation::Operation;
use crate::types::{Elementary, Type};

/// Statements that are recorded of one scan.
const MOST: usize = 50_000;

/// A value that a statement read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Read {
    /// Its place in memory: 64 · slot + bit.
    pub address: u64,
    /// Its type.
    pub of: Elementary,
    /// The value, as it is stored.
    pub value: u64,
    /// The statement of this scan that assigned it before, as a place in [`Trace::done`].
    pub by: Option<usize>,
}

/// An array or a structure that a statement read as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Whole {
    address: u64,
    slots: u64,
}

/// What an operation of a statement came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Made {
    /// The operation.
    pub operation: Operation,
    /// The type of the result.
    pub of: Elementary,
    /// The result, as it is stored.
    pub value: u64,
}

/// Where the reads and results of a statement begin.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mark {
    reads: usize,
    wholes: usize,
    results: usize,
}

/// What a statement did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// It assigned a variable; the value, as it is stored, where it has no parts.
    Assigned {
        /// Its place in memory: 64 · slot + bit.
        address: u64,
        /// Its slots.
        slots: u64,
        /// Type and value, of a variable without parts.
        value: Option<(Elementary, u64)>,
    },
    /// It chose what is executed, by a condition or a selector.
    Chose,
}

impl Effect {
    /// Whether it assigned the variable at an address, alone or with the whole that it is a part of.
    fn assigned(self, part: u64) -> bool {
        match self {
            Self::Assigned { address, value: Some(_), .. } => address == part,
            Self::Assigned { address, slots, value: None } => {
                (address..address + 64 * slots).contains(&part)
            }
            Self::Chose => false,
        }
    }
}

/// A statement that was executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Done {
    /// Its routine.
    pub routine: RoutineId,
    /// Its line in the text of its routine; 0 where it has none.
    pub line: u32,
    /// What it did.
    pub effect: Effect,
    /// What it read, in order.
    pub reads: Vec<Read>,
    /// The arrays and structures that it read as wholes, in order.
    wholes: Vec<Whole>,
    /// What its operations came to, in order.
    pub results: Vec<Made>,
    /// The choice that led to it, as a place in [`Trace::done`].
    pub under: Option<usize>,
}

/// One scan.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Its statements, in the order of execution.
    pub done: Vec<Done>,
    /// Whether later statements were left out.
    pub is_cut: bool,
    /// What the statement of a program fault read before it failed.
    pub failed: Vec<Read>,
    /// Memory at its end: x(t+1) and behind it the frames. After a fault as the fault found it.
    pub memory: Vec<u64>,
    /// The program fault that ended it.
    pub fault: Option<Fault>,
}

impl Trace {
    /// The last statement that assigned the variable at an address, alone or with the whole that it is a part of.
    pub fn last_write(&self, address: u64) -> Option<usize> {
        self.last_write_before(self.done.len(), address)
    }

    fn last_write_before(&self, end: usize, address: u64) -> Option<usize> {
        self.done[..end].iter().rposition(|done| done.effect.assigned(address))
    }

    /// Where a part of an array or a structure has its value from that a statement copied as a whole; nothing where it copied none, or chose among several.
    pub fn copied(&self, write: usize, part: u64, (of, value): (Elementary, u64)) -> Option<Read> {
        let done = &self.done[write];
        let Effect::Assigned { address: to, slots, value: None } = done.effect else {
            return None;
        };
        match *done.wholes {
            [from] if from.slots == slots => {
                let address = from.address + part.checked_sub(to)?;
                Some(Read { address, of, value, by: self.last_write_before(write, address) })
            }
            _ => None,
        }
    }
}

/// What is recorded while a scan runs.
#[derive(Debug, Default)]
pub(super) struct Recorder {
    trace: Trace,
    reads: Vec<Read>,
    wholes: Vec<Whole>,
    results: Vec<Made>,
    /// The newest assignment of each variable without parts, by its address.
    writers: BTreeMap<u64, usize>,
    /// That of each array and structure that was assigned as a whole, with its slots.
    whole_writers: BTreeMap<u64, (u64, usize)>,
    under: Option<usize>,
}

impl Recorder {
    fn push(&mut self, context: Context, line: u32, effect: Effect, mark: Mark) -> Option<usize> {
        let reads = self.reads.split_off(mark.reads.min(self.reads.len()));
        let wholes = self.wholes.split_off(mark.wholes.min(self.wholes.len()));
        let results = self.results.split_off(mark.results.min(self.results.len()));
        if self.trace.done.len() == MOST {
            self.trace.is_cut = true;
            return None;
        }
        self.trace.done.push(Done {
            routine: context.routine,
            line,
            effect,
            reads,
            wholes,
            results,
            under: self.under,
        });
        Some(self.trace.done.len() - 1)
    }

    /// The newest assignment of a variable, alone or with the whole that it is a part of.
    fn writer(&self, address: u64) -> Option<usize> {
        let wholes = self.whole_writers.range(..=address);
        let wholes = wholes.filter(|(first, (slots, _))| address < **first + 64 * slots);
        let whole = wholes.map(|(_, (_, place))| *place).max();
        self.writers.get(&address).copied().max(whole)
    }
}

impl Interpreter {
    /// One scan as [`Interpreter::step`] executes it, statement by statement; empty where a fault keeps the program from it.
    ///
    /// # Panics
    /// As [`Interpreter::step`].
    pub fn trace(&self, state: &[u64], inputs: &[u64]) -> Trace {
        let words = self.state_words();
        let mut state = state[..words].to_vec();
        if !self.frame.begin(&mut state, inputs) {
            return Trace { fault: Fault::read(&state), memory: state, ..Trace::default() };
        }
        let mut run = self.prepared(&state, inputs);
        run.trace = Some(Recorder::default());
        let fault = self.execute(&mut run).err();
        let recorder = run.trace.take().unwrap_or_default();
        Trace {
            fault,
            failed: recorder.reads,
            memory: run.memory.slots().to_vec(),
            ..recorder.trace
        }
    }
}

impl Run<'_> {
    /// The place behind the reads so far, where those of a statement begin.
    pub(super) fn mark(&self) -> Mark {
        let recorder = self.trace.as_ref();
        recorder.map_or(Mark::default(), |recorder| Mark {
            reads: recorder.reads.len(),
            wholes: recorder.wholes.len(),
            results: recorder.results.len(),
        })
    }

    /// An operation has come to a value.
    pub(super) fn made(&mut self, operation: Operation, of: &Type, value: &Value) {
        if let (Some(recorder), Some(of), Value::Number(value)) =
            (&mut self.trace, of.elementary(), value)
        {
            let value = *value;
            recorder.results.push(Made { operation, of, value });
        }
    }

    /// A value is read.
    pub(super) fn loaded(&mut self, Address(address): Address, of: &Type) {
        let Some(recorder) = &mut self.trace else {
            return;
        };
        match of.elementary() {
            Some(of) => {
                let value = self.memory.get(Address(address), of);
                let by = recorder.writer(address);
                recorder.reads.push(Read { address, of, value, by });
            }
            None => recorder.wholes.push(Whole { address, slots: of.slots() }),
        }
    }

    /// A variable has its value from what was read since `reads`.
    pub(super) fn assigned(
        &mut self,
        context: Context,
        line: u32,
        Address(address): Address,
        of: &Type,
        reads: Mark,
    ) {
        let Some(recorder) = &mut self.trace else {
            return;
        };
        let value = of.elementary().map(|of| (of, self.memory.get(Address(address), of)));
        let slots = of.slots();
        let effect = Effect::Assigned { address, slots, value };
        let Some(place) = recorder.push(context, line, effect, reads) else {
            return;
        };
        match value {
            Some(_) => recorder.writers.insert(address, place).map(drop),
            None => recorder.whole_writers.insert(address, (slots, place)).map(drop),
        };
    }

    /// Executes the statements that a condition, read since `reads`, has chosen.
    pub(super) fn guarded(
        &mut self,
        context: Context,
        line: u32,
        reads: Mark,
        chosen: &[Statement],
    ) -> Result<Flow, Fault> {
        let mut before = None;
        if let Some(recorder) = &mut self.trace {
            before = recorder.under;
            let place = recorder.push(context, line, Effect::Chose, reads);
            recorder.under = place.or(before);
        }
        let flow = self.statements(context, chosen);
        if let Some(recorder) = &mut self.trace {
            recorder.under = before;
        }
        flow
    }

    /// Slots are set to their initial content, which no statement assigned.
    pub(super) fn forget(&mut self, first: usize, count: usize) {
        if let Some(recorder) = &mut self.trace {
            let (from, to) = (64 * first as u64, 64 * (first + count) as u64);
            recorder.writers.retain(|address, _| !(from..to).contains(address));
            recorder.whole_writers.retain(|address, _| !(from..to).contains(address));
        }
    }
}
