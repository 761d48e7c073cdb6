//! The reference: walks the statements of a program and does what they say. Naive on purpose.

mod evaluate;
mod memory;
mod trace;

use crate::cost::Costs;
use crate::fault::{Cause, Fault};
use crate::form::{For, Program, RoutineId, Statement, StatementKind};
use crate::interpreter::memory::{Address, Memory};
use crate::scan::Frame;
use crate::types::Elementary;

pub use self::trace::{Done, Effect, Made, Read, Trace};

/// The reference engine. It gives a program its meaning; [`crate::Machine`] is proved equal to it and is the one to use.
#[derive(Debug, Clone)]
pub struct Interpreter {
    program: Program,
    costs: Costs,
    frame: Frame,
}

/// How a statement ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flow {
    Next,
    Exit,
    Continue,
    Return,
}

/// A scan that runs.
struct Run<'a> {
    program: &'a Program,
    costs: &'a Costs,
    memory: Memory,
    budget: u64,
    elapsed: u64,
    /// What is recorded of the scan; nothing unless it is asked for.
    trace: Option<trace::Recorder>,
}

/// The routine that runs and the slot of its instance.
#[derive(Debug, Clone, Copy)]
struct Context {
    routine: RoutineId,
    own: u64,
}

impl Interpreter {
    /// Takes a valid program.
    pub fn new(program: &Program) -> Self {
        Self { program: program.clone(), costs: Costs::new(program), frame: Frame::new(program) }
    }

    /// Width of u in bits.
    pub fn input_count(&self) -> usize {
        self.frame.input_count()
    }

    /// Width of y in bits.
    pub fn output_count(&self) -> usize {
        self.frame.output_count()
    }

    /// Words of x.
    pub fn state_words(&self) -> usize {
        self.initial().len()
    }

    /// x(0).
    pub fn initial(&self) -> &[u64] {
        self.frame.initial()
    }

    /// One scan: reads u, replaces x(t) by x(t+1), writes y(t).
    ///
    /// # Panics
    /// If a slice is shorter than its image; widths are the caller's promise. If the program is not valid.
    pub fn step(&self, state: &mut [u64], inputs: &[u64], outputs: &mut [u64]) {
        if self.frame.begin(state, inputs) {
            let words = self.state_words();
            match self.scan(&state[..words], inputs) {
                Ok(memory) => state[..words].copy_from_slice(&memory.slots()[..words]),
                Err(fault) => fault.write(state),
            }
        }
        self.frame.pack_state(state, outputs);
    }

    fn scan(&self, state: &[u64], inputs: &[u64]) -> Result<Memory, Fault> {
        let mut run = self.prepared(state, inputs);
        self.execute(&mut run)?;
        Ok(run.memory)
    }

    /// A scan with its inputs, before its first statement.
    fn prepared(&self, state: &[u64], inputs: &[u64]) -> Run<'_> {
        let mut memory = Memory::new(state, self.program.frames);
        self.frame.unpack(inputs, memory.slots_mut());
        Run {
            program: &self.program,
            costs: &self.costs,
            budget: self.program.budget,
            elapsed: self.frame.elapsed(memory.slots()),
            memory,
            trace: None,
        }
    }

    fn execute(&self, run: &mut Run<'_>) -> Result<(), Fault> {
        let scans = run.memory.slots()[crate::scan::SCANS];
        for task in self.frame.tasks() {
            if scans.is_multiple_of(u64::from(task.every.max(1))) {
                let context = Context { routine: task.routine, own: u64::from(task.own) };
                run.clear_frame(task.routine);
                run.body(context)?;
            }
        }
        self.frame.end(run.memory.slots_mut())
    }
}

impl Run<'_> {
    /// Sets the frame of a routine to its initial content.
    fn clear_frame(&mut self, routine: RoutineId) {
        let routine = self.program.routine(routine);
        let frames = self.program.state as usize;
        let (first, count) = (routine.frame.0 as usize, routine.frame.1 as usize);
        self.memory.slots_mut()[frames + first..][..count].fill(0);
        for initial in &routine.initial {
            self.memory.slots_mut()[frames + initial.slot as usize] = initial.value;
        }
        self.forget(frames + first, count);
    }

    fn body(&mut self, context: Context) -> Result<(), Fault> {
        let program = self.program;
        self.statements(context, &program.routine(context.routine).body)?;
        Ok(())
    }

    fn statements(&mut self, context: Context, statements: &[Statement]) -> Result<Flow, Fault> {
        for statement in statements {
            let flow = self.statement(context, statement)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn statement(&mut self, context: Context, statement: &Statement) -> Result<Flow, Fault> {
        let line = statement.line;
        let fault = |cause| Fault { cause, routine: Some(context.routine), line };
        match &statement.kind {
            StatementKind::Assign(place, value) => {
                let reads = self.mark();
                let value = self.value(context, line, value)?;
                let address = self.address(context, line, place)?;
                let stored = self.memory.store(address, &place.of, value);
                stored.map_err(fault)?;
                self.assigned(context, line, address, &place.of, reads);
            }
            StatementKind::Bind(slot, place) => {
                let Address(address) = self.address(context, line, place)?;
                let slot = self.address(context, line, &slot.holder())?;
                self.memory.set_word(slot, address);
            }
            StatementKind::Invoke(routine, place) => {
                let Address(address) = self.address(context, line, place)?;
                self.clear_frame(*routine);
                self.body(Context { routine: *routine, own: address / 64 })?;
            }
            StatementKind::Evaluate(expression) => {
                self.value(context, line, expression)?;
            }
            StatementKind::If(branches, otherwise) => {
                let mut chosen = otherwise;
                let reads = self.mark();
                for branch in branches {
                    if self.number(context, line, &branch.condition)? != 0 {
                        chosen = &branch.body;
                        break;
                    }
                }
                return self.guarded(context, line, reads, chosen);
            }
            StatementKind::Case(selector, cases, otherwise) => {
                let of = selector.of.elementary().unwrap_or(Elementary::Lint);
                let reads = self.mark();
                let value = of.signed(self.number(context, line, selector)?);
                let has = |case: &&crate::form::Case| {
                    let mut ranges = case.ranges.iter();
                    ranges.any(|&(low, high)| i128::from(low) <= value && value <= i128::from(high))
                };
                let case = cases.iter().find(has);
                let chosen = case.map_or(otherwise, |case| &case.body);
                return self.guarded(context, line, reads, chosen);
            }
            StatementKind::For(each) => return self.repeat_for(context, statement, each),
            StatementKind::While(condition, body) => {
                while self.number(context, line, condition)? != 0 {
                    self.charge(statement).map_err(fault)?;
                    match self.statements(context, body)? {
                        Flow::Next | Flow::Continue => {}
                        Flow::Exit => break,
                        Flow::Return => return Ok(Flow::Return),
                    }
                }
            }
            StatementKind::Repeat(body, condition) => loop {
                self.charge(statement).map_err(fault)?;
                match self.statements(context, body)? {
                    Flow::Next | Flow::Continue => {}
                    Flow::Exit => break,
                    Flow::Return => return Ok(Flow::Return),
                }
                if self.number(context, line, condition)? != 0 {
                    break;
                }
            },
            StatementKind::Exit => return Ok(Flow::Exit),
            StatementKind::Continue => return Ok(Flow::Continue),
            StatementKind::Return => return Ok(Flow::Return),
        }
        Ok(Flow::Next)
    }

    fn repeat_for(
        &mut self,
        context: Context,
        statement: &Statement,
        each: &For,
    ) -> Result<Flow, Fault> {
        let line = statement.line;
        let of = each.counter.of.elementary().unwrap_or(Elementary::Lint);
        let counter = self.address(context, line, &each.counter)?;
        let reads = self.mark();
        let from = self.number(context, line, &each.from)?;
        self.memory.set(counter, of, from);
        self.assigned(context, line, counter, &each.counter.of, reads);
        let to = of.signed(self.number(context, line, &each.to)?);
        let by = of.signed(self.number(context, line, &each.by)?);
        loop {
            let value = of.signed(self.memory.get(counter, of));
            if by >= 0 && value > to || by < 0 && value < to {
                return Ok(Flow::Next);
            }
            self.charge(statement).map_err(|cause| Fault {
                cause,
                routine: Some(context.routine),
                line,
            })?;
            match self.statements(context, &each.body)? {
                Flow::Next | Flow::Continue => {}
                Flow::Exit => return Ok(Flow::Next),
                Flow::Return => return Ok(Flow::Return),
            }
            let next = of.signed(self.memory.get(counter, of)) + by;
            let stored = next as u64 & of.mask();
            if of.signed(stored) != next {
                return Ok(Flow::Next);
            }
            self.memory.set(counter, of, stored);
            let none = self.mark();
            self.assigned(context, line, counter, &each.counter.of, none);
        }
    }

    /// Charges a turn of a loop.
    fn charge(&mut self, statement: &Statement) -> Result<(), Cause> {
        let turn = self.costs.turn(&statement.kind).unwrap_or(0);
        let rest = self.budget.checked_sub(turn);
        self.budget = rest.ok_or(Cause::BudgetExceeded { budget: self.program.budget })?;
        Ok(())
    }
}
