//! From the program form to instructions.
//!
//! A *unit* is the code of a routine on one known instance, or on whichever. Temporary values of a routine stand apart from those of the routines
//! that it calls: routines have levels, from 0 for those that call none, and each level has slots of its own. How many is known when all is
//! compiled, so a program is compiled twice: the first pass only measures.

mod call;
mod condition;
mod expression;
mod fused;
mod place;
mod statement;
mod text;

use std::collections::HashMap;

use crate::cost::Costs;
use crate::form::{Program, RoutineId};
use crate::machine::instruction::{Code, Instruction};
use crate::machine::{Compiled, Tables};
use crate::scan::Frame;

/// Instructions up to which routines are compiled for each of their instances: what a processor keeps near.
const SPECIAL: usize = 1 << 14;

/// What an instruction is estimated at that a queued unit will have.
const ESTIMATE: usize = 64;

/// Places of what is measured by the first pass.
#[derive(Debug, Clone, Default)]
struct Layout {
    /// First temporary slot and first text of each level.
    levels: Vec<(u32, u32)>,
    /// First constant.
    constants: u32,
    texts: u32,
}

/// Where the variables of the routine that is compiled stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Own {
    /// From this slot on.
    At(u32),
    /// From the instance on which the routine runs.
    Relative,
    /// From the address in this slot.
    Address(u32),
}

/// A place in the code that is not known yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Label(usize);

struct Compiler<'a> {
    program: &'a Program,
    costs: &'a Costs,
    /// Level of each routine.
    levels: &'a [usize],
    layout: Layout,
    tables: Tables,
    constants: HashMap<u64, u32>,
    labels: Vec<u32>,
    /// Jumps, with the label that each goes to.
    jumps: Vec<(usize, Label)>,
    units: HashMap<(RoutineId, Option<u32>), Label>,
    queue: Vec<(RoutineId, Option<u32>)>,
    /// Temporary slots and texts that each level uses.
    used: Vec<(u32, u32)>,

    routine: RoutineId,
    line: u32,
    own: Own,
    level: usize,
    /// Temporary slots and texts in use.
    temporaries: u32,
    texts: u32,
    /// Where CONTINUE and EXIT go, innermost last.
    loops: Vec<(Label, Label)>,
}

/// Compiles a valid program.
pub(super) fn compile(program: &Program) -> Compiled {
    let costs = Costs::new(program);
    let levels = levels(program);
    let count = levels.iter().max().map_or(1, |highest| highest + 1);
    let memory = program.state + program.frames;
    let mut layout = Layout {
        levels: vec![(memory + 1, 0); count],
        constants: 1 << 30,
        texts: 0,
    };
    let (_, _, used) = Compiler::pass(program, &costs, &levels, layout.clone());
    let (mut slot, mut text) = (memory + 1, 0);
    for (level, (slots, texts)) in layout.levels.iter_mut().zip(used) {
        *level = (slot, text);
        slot += slots;
        text += texts;
    }
    layout.constants = slot;
    layout.texts = text;
    let (tables, tasks, _) = Compiler::pass(program, &costs, &levels, layout);
    Compiled {
        frame: Frame::new(program),
        tasks,
        memory: memory as usize,
        row: slot as usize + tables.constants.len(),
        texts: text as usize,
        tables,
    }
}

/// The level of each routine: one above the highest of those that it calls.
fn levels(program: &Program) -> Vec<usize> {
    fn level(program: &Program, index: usize, levels: &mut [Option<usize>]) -> usize {
        if let Some(level) = levels[index] {
            return level;
        }
        // A routine that calls itself, which no valid program has, ends here.
        levels[index] = Some(0);
        let mut called = Vec::new();
        crate::visit::calls(&program.routines[index].body, &mut |routine| {
            called.push(routine.0 as usize);
        });
        let highest = called
            .into_iter()
            .map(|routine| level(program, routine, levels) + 1)
            .max();
        levels[index] = highest;
        highest.unwrap_or_else(|| {
            levels[index] = Some(0);
            0
        })
    }
    let mut levels = vec![None; program.routines.len()];
    (0..levels.len())
        .map(|index| level(program, index, &mut levels))
        .collect()
}

impl<'a> Compiler<'a> {
    fn pass(
        program: &'a Program,
        costs: &'a Costs,
        levels: &'a [usize],
        layout: Layout,
    ) -> (Tables, Vec<u32>, Vec<(u32, u32)>) {
        let mut compiler = Self {
            program,
            costs,
            levels,
            used: vec![(0, 0); layout.levels.len()],
            layout,
            tables: Tables {
                budget: program.budget,
                memory: 64 * (u64::from(program.state) + u64::from(program.frames)),
                ..Tables::default()
            },
            constants: HashMap::new(),
            labels: Vec::new(),
            jumps: Vec::new(),
            units: HashMap::new(),
            queue: Vec::new(),
            routine: RoutineId(0),
            line: 0,
            own: Own::Relative,
            level: 0,
            temporaries: 0,
            texts: 0,
            loops: Vec::new(),
        };
        let mut tasks = Vec::new();
        for task in &program.tasks {
            tasks.push(compiler.tables.code.len() as u32);
            compiler.clear(task.routine);
            let unit = compiler.unit(task.routine, Some(task.own));
            compiler.jump(Code::Call, 0, 0, unit);
            compiler.emit(Code::Return, 0, 0, 0);
        }
        while let Some((routine, own)) = compiler.queue.pop() {
            compiler.compile_unit(routine, own);
        }
        for (jump, Label(label)) in std::mem::take(&mut compiler.jumps) {
            compiler.tables.code[jump].c = compiler.labels[label];
        }
        (compiler.tables, tasks, compiler.used)
    }

    fn compile_unit(&mut self, routine: RoutineId, own: Option<u32>) {
        let label = self.unit(routine, own);
        self.place_label(label);
        self.routine = routine;
        self.own = own.map_or(Own::Relative, Own::At);
        self.level = self.levels[routine.0 as usize];
        (self.temporaries, self.texts) = (0, 0);
        let program = self.program;
        self.statements(&program.routine(routine).body);
        self.emit(Code::Return, 0, 0, 0);
    }

    /// The code of a routine on an instance; it is compiled later.
    fn unit(&mut self, routine: RoutineId, own: Option<u32>) -> Label {
        if let Some(&label) = self.units.get(&(routine, own)) {
            return label;
        }
        let label = self.label();
        self.units.insert((routine, own), label);
        self.queue.push((routine, own));
        label
    }

    /// The same on an instance that is known, while there is room; else `None`.
    fn special_unit(&mut self, routine: RoutineId, own: u32) -> Option<Label> {
        let planned = self.tables.code.len() + self.queue.len() * ESTIMATE;
        let is_there = self.units.contains_key(&(routine, Some(own)));
        (is_there || planned < SPECIAL).then(|| self.unit(routine, Some(own)))
    }

    fn emit(&mut self, code: Code, a: u32, b: u32, c: u32) {
        self.emit_with(code, 0, a, b, c);
    }

    fn emit_with(&mut self, code: Code, extra: u16, a: u32, b: u32, c: u32) {
        let statement = (self.routine, self.line);
        let last = self.tables.lines.last();
        if last.is_none_or(|&(_, routine, line)| (routine, line) != statement) {
            let first = self.tables.code.len() as u32;
            self.tables.lines.push((first, self.routine, self.line));
        }
        self.tables.code.push(Instruction {
            code,
            extra,
            a,
            b,
            c,
        });
    }

    fn jump(&mut self, code: Code, a: u32, b: u32, to: Label) {
        self.jumps.push((self.tables.code.len(), to));
        self.emit(code, a, b, 0);
    }

    fn label(&mut self) -> Label {
        self.labels.push(0);
        Label(self.labels.len() - 1)
    }

    fn place_label(&mut self, Label(label): Label) {
        self.labels[label] = self.tables.code.len() as u32;
    }

    fn constant(&mut self, value: u64) -> u32 {
        let constants = &mut self.tables.constants;
        let index = *self.constants.entry(value).or_insert_with(|| {
            constants.push(value);
            constants.len() as u32 - 1
        });
        self.layout.constants + index
    }

    fn temporary(&mut self) -> u32 {
        self.temporaries_of(1)
    }

    fn temporaries_of(&mut self, count: u32) -> u32 {
        let (first, _) = self.layout.levels[self.level];
        let slot = first + self.temporaries;
        self.temporaries += count;
        let used = &mut self.used[self.level].0;
        *used = self.temporaries.max(*used);
        slot
    }

    fn new_text(&mut self) -> u32 {
        let (_, first) = self.layout.levels[self.level];
        let text = first + self.texts;
        self.texts += 1;
        let used = &mut self.used[self.level].1;
        *used = self.texts.max(*used);
        text
    }

    /// Does something and gives back the temporary slots and texts that it took.
    fn scope<T>(&mut self, inner: impl FnOnce(&mut Self) -> T) -> T {
        let before = (self.temporaries, self.texts);
        let result = inner(self);
        (self.temporaries, self.texts) = before;
        result
    }

    /// The slot of [`crate::Operation::Elapsed`], the first behind the frames.
    fn elapsed(&self) -> u32 {
        self.program.state + self.program.frames
    }

    /// Whether an operand is a variable, which other code may change.
    fn is_variable(&self, operand: u32) -> bool {
        operand & crate::machine::instruction::RELATIVE != 0 || operand < self.elapsed()
    }

    /// An operand that keeps its value whatever is executed.
    fn kept(&mut self, operand: u32) -> u32 {
        if !self.is_variable(operand) {
            return operand;
        }
        let kept = self.temporary();
        self.emit(Code::Move, kept, operand, 0);
        kept
    }

    /// Sets the frame of a routine to its initial content.
    fn clear(&mut self, routine: RoutineId) {
        let state = self.program.state;
        let routine = self.program.routine(routine);
        let (first, count) = routine.frame;
        if count > 0 {
            self.emit(Code::Clear, state + first, count, 0);
        }
        for initial in &routine.initial {
            let value = self.constant(initial.value);
            self.emit(Code::Move, state + initial.slot, value, 0);
        }
    }
}
