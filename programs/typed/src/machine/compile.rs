//! From the program form to instructions.
//!
//! A *unit* is the code of a routine on one known instance, or on whichever. Temporary values of a routine stand apart from those of the routines
//! that it calls: routines have levels, from 0 for those that call none, and each level has slots of its own. How many is known when all is
//! compiled, so a program is compiled twice: the first pass only measures. It also counts the calls of each unit: one that is called once, or is
//! short and calls none, stands in the second pass where it is called.

mod call;
mod choice;
mod condition;
mod expression;
mod fused;
mod jumps;
mod place;
mod statement;
mod text;

use std::collections::HashMap;

use crate::cost::Costs;
use crate::form::{Program, RoutineId};
use crate::machine::instruction::{Code, Instruction};
use crate::machine::{Compiled, Tables};
use crate::row::SLOTS;
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

/// Instructions that all calls of a routine together may have in place of the calls.
const INLINED: usize = 64;

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

/// What is compiled at a place of the code.
#[derive(Debug, Clone, Copy)]
struct Context {
    routine: RoutineId,
    line: u32,
    own: Own,
    level: usize,
    /// Temporary slots and texts in use.
    temporaries: u32,
    texts: u32,
    /// Where RETURN goes in a routine that stands in place of a call.
    end: Option<Label>,
}

/// What the first pass finds of a unit.
#[derive(Debug, Clone, Copy, Default)]
struct Measured {
    calls: usize,
    length: usize,
}

type Units<T> = HashMap<(RoutineId, Option<u32>), T>;

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
    units: Units<Label>,
    /// Of each unit in this pass, and in the one before it.
    measured: Units<Measured>,
    before: Option<Units<Measured>>,
    queue: Vec<(RoutineId, Option<u32>)>,
    /// Temporary slots and texts that each level uses.
    used: Vec<(u32, u32)>,

    context: Context,
    /// Where CONTINUE and EXIT go, innermost last.
    loops: Vec<(Label, Label)>,
}

/// What a pass makes.
struct Passed {
    tables: Tables,
    tasks: Vec<u32>,
    used: Vec<(u32, u32)>,
    measured: Units<Measured>,
}

/// Compiles a valid program.
pub(super) fn compile(program: &Program) -> Compiled {
    let costs = Costs::new(program);
    let levels = levels(program);
    let count = levels.iter().max().map_or(1, |highest| highest + 1);
    let memory = program.state + program.frames;
    let mut layout = Layout { levels: vec![(memory + 1, 0); count], constants: 1 << 30, texts: 0 };
    let first = Compiler::pass(program, &costs, &levels, layout.clone(), None);
    let used = first.used;
    let (mut slot, mut text) = (memory + 1, 0);
    for (level, (slots, texts)) in layout.levels.iter_mut().zip(&used) {
        *level = (slot, text);
        slot += slots;
        text += texts;
    }
    layout.constants = slot;
    layout.texts = text;
    let second = Compiler::pass(program, &costs, &levels, layout, Some(first.measured));
    assert_eq!(used, second.used, "both passes take the same slots");
    let (mut tables, mut tasks) = (second.tables, second.tasks);
    jumps::straighten(&mut tables, &mut tasks);
    let row = slot as usize + tables.constants.len();
    let narrow = tables.code.iter().map(|each| each.narrow());
    let narrow: Option<Vec<_>> = narrow.collect();
    let narrow = narrow.filter(|_| row <= SLOTS);
    if narrow.is_some() {
        tables.code.clear();
    }
    Compiled {
        frame: Frame::new(program),
        tasks,
        memory: memory as usize,
        row,
        texts: text as usize,
        tables,
        narrow,
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
        let highest = called.into_iter().map(|routine| level(program, routine, levels) + 1).max();
        levels[index] = highest;
        highest.unwrap_or_else(|| {
            levels[index] = Some(0);
            0
        })
    }
    let mut levels = vec![None; program.routines.len()];
    (0..levels.len()).map(|index| level(program, index, &mut levels)).collect()
}

impl<'a> Compiler<'a> {
    fn pass(
        program: &'a Program,
        costs: &'a Costs,
        levels: &'a [usize],
        layout: Layout,
        before: Option<Units<Measured>>,
    ) -> Passed {
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
            measured: HashMap::new(),
            before,
            queue: Vec::new(),
            context: Context {
                routine: RoutineId(0),
                line: 0,
                own: Own::Relative,
                level: 0,
                temporaries: 0,
                texts: 0,
                end: None,
            },
            loops: Vec::new(),
        };
        let mut tasks = Vec::new();
        for task in &program.tasks {
            tasks.push(compiler.tables.code.len() as u32);
            compiler.clear(task.routine);
            let unit = compiler.unit(task.routine, Some(task.own));
            compiler.jump(Code::Jump, 0, 0, unit);
        }
        while let Some((routine, own)) = compiler.queue.pop() {
            compiler.compile_unit(routine, own);
        }
        for (jump, Label(label)) in std::mem::take(&mut compiler.jumps) {
            compiler.tables.code[jump].c = compiler.labels[label];
        }
        Passed { tables: compiler.tables, tasks, used: compiler.used, measured: compiler.measured }
    }

    fn compile_unit(&mut self, routine: RoutineId, own: Option<u32>) {
        let label = self.units[&(routine, own)];
        self.place_label(label);
        self.context = Context {
            routine,
            line: 0,
            own: own.map_or(Own::Relative, Own::At),
            level: self.levels[routine.0 as usize],
            temporaries: 0,
            texts: 0,
            end: None,
        };
        let start = self.tables.code.len();
        let program = self.program;
        self.statements(&program.routine(routine).body);
        self.emit(Code::Return, 0, 0, 0);
        let length = self.tables.code.len() - start;
        self.measured.entry((routine, own)).or_default().length = length;
    }

    /// The code of a routine on an instance; it is compiled later.
    fn unit(&mut self, routine: RoutineId, own: Option<u32>) -> Label {
        self.measured.entry((routine, own)).or_default().calls += 1;
        if let Some(&label) = self.units.get(&(routine, own)) {
            return label;
        }
        let label = self.label();
        self.units.insert((routine, own), label);
        self.queue.push((routine, own));
        label
    }

    /// Whether a routine is compiled for an instance that is known: while there is room.
    fn is_special(&self, routine: RoutineId, own: u32) -> bool {
        let unit = (routine, Some(own));
        if let Some(before) = &self.before {
            return before.contains_key(&unit);
        }
        let planned = self.tables.code.len() + self.queue.len() * ESTIMATE;
        self.units.contains_key(&unit) || planned < SPECIAL
    }

    /// Whether the code of a unit stands where it is called.
    fn is_inlined(&self, routine: RoutineId, own: Option<u32>) -> bool {
        let unit = self.before.as_ref().and_then(|it| it.get(&(routine, own)));
        unit.is_some_and(|unit| {
            let is_last = self.levels[routine.0 as usize] == 0;
            unit.calls == 1 || is_last && unit.calls * unit.length <= INLINED
        })
    }

    fn emit(&mut self, code: Code, a: u32, b: u32, c: u32) {
        self.emit_with(code, 0, a, b, c);
    }

    fn emit_with(&mut self, code: Code, extra: u8, a: u32, b: u32, c: u32) {
        let statement = (self.context.routine, self.context.line);
        let last = self.tables.lines.last();
        if last.is_none_or(|&(_, routine, line)| (routine, line) != statement) {
            let first = self.tables.code.len() as u32;
            self.tables.lines.push((first, self.context.routine, self.context.line));
        }
        self.tables.code.push(Instruction { code, extra, a, b, c });
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
        let (first, _) = self.layout.levels[self.context.level];
        let slot = first + self.context.temporaries;
        self.context.temporaries += count;
        let used = &mut self.used[self.context.level].0;
        *used = self.context.temporaries.max(*used);
        slot
    }

    fn new_text(&mut self) -> u32 {
        let (_, first) = self.layout.levels[self.context.level];
        let text = first + self.context.texts;
        self.context.texts += 1;
        let used = &mut self.used[self.context.level].1;
        *used = self.context.texts.max(*used);
        text
    }

    /// Does something and gives back the temporary slots and texts that it took.
    fn scope<T>(&mut self, inner: impl FnOnce(&mut Self) -> T) -> T {
        let before = (self.context.temporaries, self.context.texts);
        let result = inner(self);
        (self.context.temporaries, self.context.texts) = before;
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
