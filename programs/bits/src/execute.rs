//! One scan of a typed program on terms.
//!
//! Statements run on both sides of each selection, and what they change is chosen by its condition. A loop unrolls as long as
//! its condition is known, or for at most [`UNKNOWN_TURNS`] turns. A fault ends the scan: its condition is collected, and what would follow has
//! no effect.

mod expressions;
mod loops;
mod memory;
mod selections;
pub(crate) mod timers;

use std::collections::HashMap;

use understudy_typed::{
    Comparison, Cost, Declared, Elementary, Expression, Place, Program, RoutineId, Statement,
    StatementKind,
};

use self::timers::Timers;
use crate::term::{Made, Term, Terms};

/// Turns of a loop whose condition depends on values.
const UNKNOWN_TURNS: u32 = 64;
/// Turns of all loops in a scan.
const ALL_TURNS: u32 = 20_000;
/// Terms of a system.
const ALL_TERMS: usize = 2_000_000;
/// Statements of a scan: what is called again and again need not make terms.
const ALL_STATEMENTS: usize = 1_000_000;
/// Selections inside each other that a number can come through.
const ALL_CASES: u32 = 1_000;
/// Places that one computed index, or several together, may mean.
const ALTERNATIVES: usize = 4_096;

/// Why a program cannot be followed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{routine}, line {line}: {what}")]
pub struct Unsupported {
    /// Name of the routine.
    pub routine: String,
    /// Line in its file; 0 where there is none.
    pub line: u32,
    /// Reason.
    pub what: String,
}

/// What of memory is read before it is written: the cells that a scan begins with.
pub(super) trait Cells {
    /// The value at an address of the state before the scan.
    fn before(&mut self, terms: &mut Terms, address: u64, of: Elementary) -> Term;
}

/// A scan.
pub(super) struct Execution<'a> {
    program: &'a Program,
    pub(super) terms: &'a mut Terms,
    cells: &'a mut dyn Cells,
    memory: HashMap<u64, Term>,
    /// What of the frames is not 0 when a routine begins.
    frames: HashMap<u64, u64>,
    /// What was written in each selection that is open, with the values before it.
    open: Vec<HashMap<u64, Option<Term>>>,
    /// Under which condition the statement is reached, but for faults.
    path: Term,
    /// Whether a fault ends the scan.
    pub(super) faulted: Term,
    elapsed: Term,
    timers: &'a mut Timers,
    turns: u32,
    /// Statements that were executed.
    executed: usize,
    /// Routines of the programs that were added before.
    routines: u32,
}

/// The routine that runs and the slot of its instance.
#[derive(Debug, Clone, Copy)]
struct Context {
    routine: RoutineId,
    own: u64,
}

/// Under which conditions statements left their list.
#[derive(Debug, Clone, Copy)]
struct Left {
    exit: Term,
    next: Term,
    back: Term,
}

/// What an expression gives.
#[derive(Debug, Clone)]
enum Value {
    Number(Term),
    /// What is not followed.
    Text,
    /// An array or a structure: its parts, counted from its start.
    Parts(Vec<(u64, Term)>),
}

/// A loop: whether a turn begins, and what is done behind it, which says whether there may be another one.
struct Loop<'l> {
    body: &'l [Statement],
    test: Test<'l>,
}

enum Test<'l> {
    While(&'l Expression),
    Repeat(&'l Expression),
    For { counter: (u64, Elementary), to: Term, by: Term },
}

type Result<T> = std::result::Result<T, Unsupported>;

impl<'a> Execution<'a> {
    pub(super) fn new(
        program: &'a Program,
        terms: &'a mut Terms,
        cells: &'a mut dyn Cells,
        elapsed: Term,
        timers: &'a mut Timers,
        routines: usize,
    ) -> Self {
        let (path, faulted) = (terms.boolean(true), terms.boolean(false));
        let initial = program.routines.iter().flat_map(|routine| &routine.initial);
        let frames = initial.map(|initial| (u64::from(initial.slot), initial.value));
        let frames = frames.collect();
        Self {
            program,
            frames,
            terms,
            cells,
            memory: HashMap::new(),
            open: Vec::new(),
            path,
            faulted,
            elapsed,
            timers,
            turns: 0,
            executed: 0,
            routines: routines as u32,
        }
    }

    /// Stores an input into the slot of its variable.
    pub(super) fn put(&mut self, slot: u32, value: Term) {
        self.set(64 * u64::from(slot), value);
    }

    /// The value of a cell now.
    pub(super) fn get(&mut self, address: u64, of: Elementary) -> Term {
        if let Some(&value) = self.memory.get(&address) {
            return value;
        }
        let state = 64 * u64::from(self.program.state);
        if address < state {
            self.cells.before(self.terms, address, of)
        } else {
            // A frame is cleared before it is used.
            let slot = (address - state) / 64;
            let initial = self.frames.get(&slot).copied().unwrap_or(0);
            self.terms.constant(of, initial >> (address % 64))
        }
    }

    /// What was written, where it differs from what was there before.
    pub(super) fn written(self) -> HashMap<u64, Term> {
        let state = 64 * u64::from(self.program.state);
        let mut memory = self.memory;
        memory.retain(|&address, _| address < state);
        memory
    }

    /// Runs a task.
    ///
    /// # Errors
    /// What cannot be followed.
    pub(super) fn task(&mut self, routine: RoutineId, own: u32, runs: Term) -> Result<()> {
        let context = Context { routine, own: u64::from(own) };
        let changes = self.within(runs, |this| {
            this.clear_frame(routine);
            this.body(context)
        })?;
        self.merge(runs, changes.0, HashMap::new());
        let cost = Cost::new(self.program);
        let turns = u64::from(self.turns).saturating_mul(cost.dearest_turn);
        if cost.is_bounded_by_budget() && turns > cost.budget {
            let exceeded = self.terms.unknown(Elementary::Bool);
            self.fault(exceeded);
        }
        Ok(())
    }

    /// An output that is no finite number is a fault.
    pub(super) fn finite(&mut self, slot: u32, of: Elementary) {
        let largest = match of {
            Elementary::Real => u64::from(f32::MAX.to_bits()),
            Elementary::Lreal => f64::MAX.to_bits(),
            _ => return,
        };
        let least = largest | 1 << (of.bits() - 1);
        let value = self.typed(64 * u64::from(slot), of);
        let largest = self.terms.constant(of, largest);
        let least = self.terms.constant(of, least);
        let below = self.terms.compare(Comparison::LessOrEqual, value, largest);
        let above = self.terms.compare(Comparison::GreaterOrEqual, value, least);
        let inside = self.terms.and(below, above);
        let outside = self.terms.not(inside);
        self.fault(outside);
    }

    /// Gives a point beyond its subrange the end of it, as the begin of a scan does with inputs and its end with outputs.
    pub(super) fn limit(&mut self, slot: u32, declared: &Declared) {
        let &Declared { of, range: Some(range), .. } = declared else {
            return;
        };
        let address = 64 * u64::from(slot);
        let value = self.typed(address, of);
        let ends = [range.0, range.1].map(|end| self.terms.constant(of, end as u64 & of.mask()));
        let below = self.terms.compare(Comparison::Less, value, ends[0]);
        let above = self.terms.compare(Comparison::Greater, value, ends[1]);
        let limited = self.terms.choose(above, ends[1], value);
        let limited = self.terms.choose(below, ends[0], limited);
        self.set(address, limited);
    }

    fn unsupported<T>(&self, context: Context, what: impl Into<String>) -> Result<T> {
        Err(Unsupported {
            routine: self.program.routine(context.routine).name.clone(),
            line: self.terms.statement.line,
            what: what.into(),
        })
    }

    fn fault(&mut self, condition: Term) {
        let reached = self.terms.and(self.path, condition);
        self.faulted = self.terms.or(self.faulted, reached);
    }

    fn set(&mut self, address: u64, value: Term) {
        let before = self.memory.insert(address, value);
        if let Some(open) = self.open.last_mut() {
            open.entry(address).or_insert(before);
        }
    }

    /// Runs `statements` where `condition` holds, and takes back what they wrote; answers with it.
    fn within<T>(
        &mut self,
        condition: Term,
        run: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<(HashMap<u64, Term>, T)> {
        let path = self.path;
        self.path = self.terms.and(path, condition);
        self.open.push(HashMap::new());
        let answer = run(self)?;
        self.path = path;
        let before = self.open.pop().unwrap_or_default();
        let mut changes = HashMap::with_capacity(before.len());
        for (address, before) in before {
            let value = match before {
                Some(before) => self.memory.insert(address, before),
                None => self.memory.remove(&address),
            };
            if let Some(value) = value {
                changes.insert(address, value);
            }
        }
        Ok((changes, answer))
    }

    /// Keeps what was written on either side of a selection.
    fn merge(&mut self, condition: Term, then: HashMap<u64, Term>, otherwise: HashMap<u64, Term>) {
        let mut addresses: Vec<u64> = then.keys().chain(otherwise.keys()).copied().collect();
        addresses.sort_unstable();
        addresses.dedup();
        let is_certain = self.terms.is(condition, true);
        for address in addresses {
            if let (true, Some(&value)) = (is_certain, then.get(&address)) {
                self.set(address, value);
                continue;
            }
            let of = then.get(&address).or_else(|| otherwise.get(&address));
            let Some(of) = of.map(|&value| self.terms.of(value)) else {
                continue;
            };
            let mut side = |side: &HashMap<u64, Term>| match side.get(&address) {
                Some(&value) => value,
                None => self.get(address, of),
            };
            let (one, other) = (side(&then), side(&otherwise));
            let value = self.terms.choose(condition, one, other);
            self.set(address, value);
        }
    }

    /// One of two, by a condition.
    fn either<T>(
        &mut self,
        condition: Term,
        then: impl FnOnce(&mut Self) -> Result<T>,
        otherwise: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<Either<T>> {
        if self.terms.is(condition, true) {
            return Ok(Either::Only(then(self)?));
        }
        if self.terms.is(condition, false) {
            return Ok(Either::Only(otherwise(self)?));
        }
        let (changed, one) = self.within(condition, then)?;
        let negated = self.terms.not(condition);
        let (also_changed, other) = self.within(negated, otherwise)?;
        self.merge(condition, changed, also_changed);
        Ok(Either::Both(one, other))
    }

    fn staying(&mut self) -> Left {
        let none = self.terms.boolean(false);
        Left { exit: none, next: none, back: none }
    }

    fn one_of(&mut self, condition: Term, left: Either<Left>) -> Left {
        match left {
            Either::Only(left) => left,
            Either::Both(one, other) => Left {
                exit: self.terms.choose(condition, one.exit, other.exit),
                next: self.terms.choose(condition, one.next, other.next),
                back: self.terms.choose(condition, one.back, other.back),
            },
        }
    }

    fn any(&mut self, left: Left) -> Term {
        let loops = self.terms.or(left.exit, left.next);
        self.terms.or(loops, left.back)
    }

    fn clear_frame(&mut self, routine: RoutineId) {
        let program = self.program;
        let routine = program.routine(routine);
        let frames = u64::from(program.state);
        let (first, count) = (u64::from(routine.frame.0), u64::from(routine.frame.1));
        if count == 0 {
            return;
        }
        let range = 64 * (frames + first)..64 * (frames + first + count);
        let held: Vec<u64> = self.memory.keys().copied().collect();
        for address in held {
            if range.contains(&address) {
                let before = self.memory.remove(&address);
                if let Some(open) = self.open.last_mut() {
                    open.entry(address).or_insert(before);
                }
            }
        }
    }

    fn body(&mut self, context: Context) -> Result<()> {
        let program = self.program;
        self.statements(context, &program.routine(context.routine).body)?;
        Ok(())
    }

    fn statements(&mut self, context: Context, statements: &[Statement]) -> Result<Left> {
        for (place, statement) in statements.iter().enumerate() {
            self.executed += 1;
            if self.terms.len() > ALL_TERMS
                || self.terms.depth() > ALL_CASES
                || self.executed > ALL_STATEMENTS
            {
                return self.unsupported(context, "the scan has too many values to follow");
            }
            let left = self.statement(context, statement)?;
            let gone = self.any(left);
            if self.terms.is(gone, false) {
                continue;
            }
            if self.terms.is(gone, true) {
                return Ok(left);
            }
            let stays = self.terms.not(gone);
            let rest = &statements[place + 1..];
            let (changes, further) = self.within(stays, |this| this.statements(context, rest))?;
            self.merge(stays, changes, HashMap::new());
            return Ok(Left {
                exit: self.terms.choose(stays, further.exit, left.exit),
                next: self.terms.choose(stays, further.next, left.next),
                back: self.terms.choose(stays, further.back, left.back),
            });
        }
        Ok(self.staying())
    }

    fn invoke(&mut self, context: Context, routine: RoutineId, place: &Place) -> Result<()> {
        let places = self.places(context, place)?;
        let timer = self.timer(routine, place);
        for &(condition, address) in &places {
            if let Some(timer) = &timer {
                if let Some(counted) = self.timers.counted.get(&address).cloned() {
                    self.count(&counted);
                    continue;
                }
                self.watch(timer, address, places.len() == 1);
            }
            self.timers.inside += u32::from(timer.is_some());
            let (changes, ()) = self.within(condition, |this| {
                this.clear_frame(routine);
                this.body(Context { routine, own: address / 64 })
            })?;
            self.timers.inside -= u32::from(timer.is_some());
            self.merge(condition, changes, HashMap::new());
        }
        Ok(())
    }

    fn statement(&mut self, context: Context, statement: &Statement) -> Result<Left> {
        let made = Made { routine: self.routines + context.routine.0, line: statement.line };
        self.terms.statement = made;
        let mut left = self.staying();
        let yes = self.terms.boolean(true);
        match &statement.kind {
            StatementKind::Assign(place, value) => {
                let value = self.value(context, value)?;
                self.store(context, place, value)?;
            }
            StatementKind::Bind(slot, place) => {
                let address = self.address(context, place)?;
                let slot = self.address(context, slot)?;
                let address = self.terms.constant(Elementary::Lword, address);
                self.set(slot, address);
            }
            StatementKind::Invoke(routine, place) => self.invoke(context, *routine, place)?,
            StatementKind::Evaluate(expression) => {
                self.value(context, expression)?;
            }
            StatementKind::If(branches, otherwise) => {
                left = self.branches(context, branches, otherwise)?;
            }
            StatementKind::Case(selector, cases, otherwise) => {
                let selector = self.number(context, selector)?;
                left = self.cases(context, selector, cases, otherwise)?;
            }
            StatementKind::For(each) => left.back = self.repeat_for(context, each)?,
            StatementKind::While(condition, body) => {
                let test = Test::While(condition);
                left.back = self.turns(context, &Loop { body, test }, 0)?;
            }
            StatementKind::Repeat(body, condition) => {
                let test = Test::Repeat(condition);
                left.back = self.turns(context, &Loop { body, test }, 0)?;
            }
            StatementKind::Exit => left.exit = yes,
            StatementKind::Continue => left.next = yes,
            StatementKind::Return => left.back = yes,
        }
        self.terms.statement = made;
        Ok(left)
    }
}

/// One side of a selection that is known, or both.
enum Either<T> {
    Only(T),
    Both(T, T),
}
