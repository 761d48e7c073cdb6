//! One scan of a typed program on terms.
//!
//! Statements run on both sides of each selection, and what they change is chosen by its condition. A loop unrolls as long as
//! its condition is known, or for at most [`UNKNOWN_TURNS`] turns. A fault ends the scan: its condition is collected, and what would follow has
//! no effect.

use std::collections::HashMap;

use understudy_typed::{
    Argument, Call, Case, Comparison, Cost, Elementary, Expression, ExpressionKind, For, Operation,
    Place, Program, Root, RoutineId, Statement, StatementKind, TextOperation, Type,
};

use super::term::{Term, Terms};

/// Turns of a loop whose condition depends on values.
const UNKNOWN_TURNS: u32 = 64;
/// Turns of all loops in a scan.
const ALL_TURNS: u32 = 20_000;
/// Terms of a system.
const ALL_TERMS: usize = 2_000_000;
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
    turns: u32,
    line: u32,
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
    For {
        counter: (u64, Elementary),
        to: Term,
        by: Term,
    },
}

type Result<T> = std::result::Result<T, Unsupported>;

impl<'a> Execution<'a> {
    pub(super) fn new(
        program: &'a Program,
        terms: &'a mut Terms,
        cells: &'a mut dyn Cells,
        elapsed: Term,
    ) -> Self {
        let (path, faulted) = (terms.boolean(true), terms.boolean(false));
        let routines = program.routines.iter();
        let initial = routines.flat_map(|routine| &routine.initial);
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
            turns: 0,
            line: 0,
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
        let context = Context {
            routine,
            own: u64::from(own),
        };
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

    fn unsupported<T>(&self, context: Context, what: impl Into<String>) -> Result<T> {
        Err(Unsupported {
            routine: self.program.routine(context.routine).name.clone(),
            line: self.line,
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
        for address in addresses {
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
        Left {
            exit: none,
            next: none,
            back: none,
        }
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
            if self.terms.len() > ALL_TERMS || self.terms.depth() > ALL_CASES {
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

    fn statement(&mut self, context: Context, statement: &Statement) -> Result<Left> {
        self.line = statement.line;
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
            StatementKind::Invoke(routine, place) => {
                for (condition, address) in self.places(context, place)? {
                    let (changes, ()) = self.within(condition, |this| {
                        this.clear_frame(*routine);
                        this.body(Context {
                            routine: *routine,
                            own: address / 64,
                        })
                    })?;
                    self.merge(condition, changes, HashMap::new());
                }
            }
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
        self.line = statement.line;
        Ok(left)
    }

    fn branches(
        &mut self,
        context: Context,
        branches: &[understudy_typed::Branch],
        otherwise: &[Statement],
    ) -> Result<Left> {
        let Some((first, rest)) = branches.split_first() else {
            return self.statements(context, otherwise);
        };
        let condition = self.number(context, &first.condition)?;
        let left = self.either(
            condition,
            |this| this.statements(context, &first.body),
            |this| this.branches(context, rest, otherwise),
        )?;
        Ok(self.one_of(condition, left))
    }

    fn cases(
        &mut self,
        context: Context,
        selector: Term,
        cases: &[Case],
        otherwise: &[Statement],
    ) -> Result<Left> {
        let mut left = self.staying();
        let mut open = self.terms.boolean(true);
        let mut sides = Vec::new();
        for case in cases {
            let mut inside = self.terms.boolean(false);
            for &(low, high) in &case.ranges {
                let here = self.between(selector, low.into(), high.into());
                inside = self.terms.or(inside, here);
            }
            sides.push((self.terms.and(open, inside), &case.body[..]));
            let outside = self.terms.not(inside);
            open = self.terms.and(open, outside);
        }
        sides.push((open, otherwise));
        let mut all = Vec::new();
        for (condition, body) in sides {
            if self.terms.is(condition, false) {
                continue;
            }
            let (changes, away) = self.within(condition, |this| this.statements(context, body))?;
            left.exit = self.terms.choose(condition, away.exit, left.exit);
            left.next = self.terms.choose(condition, away.next, left.next);
            left.back = self.terms.choose(condition, away.back, left.back);
            all.push((condition, changes));
        }
        // One condition at most holds.
        for (condition, changes) in all {
            self.merge(condition, changes, HashMap::new());
        }
        Ok(left)
    }

    /// Whether an integer lies between two numbers, which may lie outside its type.
    fn between(&mut self, value: Term, low: i128, high: i128) -> Term {
        let of = self.terms.of(value);
        let (least, greatest) = range(of);
        if low > greatest || high < least || low > high {
            return self.terms.boolean(false);
        }
        let mut side = |comparison, bound: i128| {
            let bound = self.terms.constant(of, bound as u64);
            self.terms.compare(comparison, value, bound)
        };
        if low == high {
            return side(Comparison::Equal, low);
        }
        let above = (low > least).then(|| side(Comparison::GreaterOrEqual, low));
        let below = (high < greatest).then(|| side(Comparison::LessOrEqual, high));
        match (above, below) {
            (Some(above), Some(below)) => self.terms.and(above, below),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => self.terms.boolean(true),
        }
    }

    fn repeat_for(&mut self, context: Context, each: &For) -> Result<Term> {
        let of = each.counter.of.elementary().unwrap_or(Elementary::Lint);
        let counter = self.address(context, &each.counter)?;
        let from = self.number(context, &each.from)?;
        self.set(counter, from);
        let to = self.number(context, &each.to)?;
        let by = self.number(context, &each.by)?;
        if self.terms.value(by).is_none() {
            return self.unsupported(context, "a FOR whose BY is not constant");
        }
        let test = Test::For {
            counter: (counter, of),
            to,
            by,
        };
        let body = &each.body;
        self.turns(context, &Loop { body, test }, 0)
    }

    /// Whether a turn begins.
    fn begins(&mut self, context: Context, each: &Loop<'_>) -> Result<Term> {
        match &each.test {
            Test::While(condition) => self.number(context, condition),
            Test::Repeat(_) => Ok(self.terms.boolean(true)),
            Test::For { counter, to, by } => {
                let (address, of) = *counter;
                let value = self.get(address, of);
                let is_upward = self.terms.value(*by).is_some_and(|by| of.signed(by) >= 0);
                let comparison = match is_upward {
                    true => Comparison::LessOrEqual,
                    false => Comparison::GreaterOrEqual,
                };
                Ok(self.terms.compare(comparison, value, *to))
            }
        }
    }

    /// What is done behind a turn; answers whether another one may begin.
    fn advances(&mut self, context: Context, each: &Loop<'_>) -> Result<Term> {
        match &each.test {
            Test::While(_) => Ok(self.terms.boolean(true)),
            Test::Repeat(condition) => {
                let ended = self.number(context, condition)?;
                Ok(self.terms.not(ended))
            }
            Test::For { counter, by, .. } => {
                let (address, of) = *counter;
                let value = self.get(address, of);
                let step = self.terms.value(*by).map_or(0, |by| of.signed(by));
                let (least, greatest) = range(of);
                let fits = match step >= 0 {
                    true => self.between(value, least, greatest - step),
                    false => self.between(value, least - step, greatest),
                };
                let sum = self.terms.apply(Operation::Add(of), of, &[value, *by]);
                let next = self.terms.choose(fits, sum, value);
                self.set(address, next);
                Ok(fits)
            }
        }
    }

    /// Turns of a loop; answers under which condition the routine is left.
    fn turns(&mut self, context: Context, each: &Loop<'_>, unknown: u32) -> Result<Term> {
        let line = self.line;
        loop {
            self.line = line;
            let begins = self.begins(context, each)?;
            if self.terms.is(begins, false) {
                return Ok(begins);
            }
            self.turns += 1;
            if unknown > UNKNOWN_TURNS || self.turns > ALL_TURNS {
                return self.unsupported(
                    context,
                    "a loop whose number of turns depends on values, or is too large to follow",
                );
            }
            if !self.terms.is(begins, true) {
                let (changes, back) = self.within(begins, |this| {
                    let left = this.statements(context, each.body)?;
                    this.after(context, each, left, unknown + 1)
                })?;
                self.merge(begins, changes, HashMap::new());
                return Ok(self.terms.and(begins, back));
            }
            let left = self.statements(context, each.body)?;
            let leaves = self.terms.or(left.exit, left.back);
            if !self.terms.is(leaves, false) {
                return self.after(context, each, left, unknown + 1);
            }
            let more = self.advances(context, each)?;
            if self.terms.is(more, false) {
                return Ok(more);
            }
            if !self.terms.is(more, true) {
                let (changes, back) =
                    self.within(more, |this| this.turns(context, each, unknown + 1))?;
                self.merge(more, changes, HashMap::new());
                return Ok(self.terms.and(more, back));
            }
        }
    }

    /// What follows a turn that may have left the loop.
    fn after(
        &mut self,
        context: Context,
        each: &Loop<'_>,
        left: Left,
        unknown: u32,
    ) -> Result<Term> {
        let leaves = self.terms.or(left.exit, left.back);
        let stays = self.terms.not(leaves);
        if self.terms.is(stays, false) {
            return Ok(left.back);
        }
        let (changes, back) = self.within(stays, |this| {
            let more = this.advances(context, each)?;
            if this.terms.is(more, false) {
                return Ok(more);
            }
            let (changes, back) = this.within(more, |this| this.turns(context, each, unknown))?;
            this.merge(more, changes, HashMap::new());
            Ok(this.terms.and(more, back))
        })?;
        self.merge(stays, changes, HashMap::new());
        let later = self.terms.and(stays, back);
        Ok(self.terms.or(left.back, later))
    }

    /// The only address of a place.
    fn address(&mut self, context: Context, place: &Place) -> Result<u64> {
        match self.places(context, place)?.as_slice() {
            &[(_, address)] => Ok(address),
            _ => self.unsupported(context, "a reference to an element with a computed index"),
        }
    }

    /// The addresses that a place may mean, each with its condition; an index out of range is a fault.
    fn places(&mut self, context: Context, place: &Place) -> Result<Vec<(Term, u64)>> {
        let frames = u64::from(self.program.state);
        let root = match place.root {
            Root::Global(slot) => 64 * u64::from(slot),
            Root::Own(slot) => 64 * (context.own + u64::from(slot)),
            Root::Frame(slot) => 64 * (frames + u64::from(slot)),
            Root::OwnReference(slot) => self.reference(context, context.own + u64::from(slot))?,
            Root::FrameReference(slot) => self.reference(context, frames + u64::from(slot))?,
        };
        let first = root + 64 * u64::from(place.offset) + u64::from(place.bit);
        let yes = self.terms.boolean(true);
        let mut places = vec![(yes, first)];
        for index in &place.indices {
            let value = self.number(context, &index.value)?;
            let inside = self.between(value, index.low.into(), index.high.into());
            let outside = self.terms.not(inside);
            let (low, high) = (index.low, index.high);
            self.fault(outside);
            if let Some(known) = self.terms.value(value) {
                // A known index outside is a fault: any place serves.
                let known = (known as i64).clamp(low, high);
                for place in &mut places {
                    place.1 += known.abs_diff(low) * index.stride;
                }
                continue;
            }
            let count = usize::try_from(high.abs_diff(low)).map_or(usize::MAX, |last| last + 1);
            if count.saturating_mul(places.len()) > ALTERNATIVES {
                return self.unsupported(context, "an array too large for a computed index");
            }
            let mut further = Vec::with_capacity(count * places.len());
            for &(condition, address) in &places {
                for element in low..=high {
                    let here = self.terms.equals(value, element as u64);
                    let condition = self.terms.and(condition, here);
                    further.push((condition, address + element.abs_diff(low) * index.stride));
                }
            }
            places = further;
        }
        Ok(places)
    }

    fn reference(&mut self, context: Context, slot: u64) -> Result<u64> {
        let address = self.get(64 * slot, Elementary::Lword);
        match self.terms.value(address) {
            Some(0) => {
                let yes = self.terms.boolean(true);
                self.fault(yes);
                Ok(64 * u64::from(Program::HEADER))
            }
            Some(address) => Ok(address),
            None => self.unsupported(context, "a VAR_IN_OUT variable that changes"),
        }
    }

    fn store(&mut self, context: Context, place: &Place, value: Value) -> Result<()> {
        let places = self.places(context, place)?;
        if matches!(value, Value::Text) {
            if matches!(place.of, Type::Text(_)) {
                let long = self.terms.unknown(Elementary::Bool);
                self.fault(long);
            }
            return Ok(());
        }
        let single = places.len() == 1;
        for (condition, address) in places {
            let parts = match &value {
                Value::Number(number) => vec![(0, *number)],
                Value::Parts(parts) => parts.clone(),
                Value::Text => Vec::new(),
            };
            for (offset, value) in parts {
                let of = self.terms.of(value);
                let value = if single {
                    value
                } else {
                    let before = self.get(address + offset, of);
                    self.terms.choose(condition, value, before)
                };
                self.set(address + offset, value);
            }
        }
        Ok(())
    }

    /// What is stored at an address.
    fn load(&mut self, address: u64, of: &Type) -> Value {
        if let Some(of) = of.elementary() {
            return Value::Number(self.typed(address, of));
        }
        if matches!(of, Type::Text(_)) {
            return Value::Text;
        }
        let mut parts = Vec::new();
        self.leaves(0, of, &mut parts);
        let parts = parts.into_iter();
        Value::Parts(
            parts
                .map(|(offset, of)| (offset, self.typed(address + offset, of)))
                .collect(),
        )
    }

    /// The number at an address as one of type `of`, which has the width of what was stored there.
    fn typed(&mut self, address: u64, of: Elementary) -> Term {
        let stored = self.get(address, of);
        self.terms.as_type(stored, of)
    }

    /// The parts of a type that are numbers, counted in bits from its start.
    fn leaves(&self, first: u64, of: &Type, parts: &mut Vec<(u64, Elementary)>) {
        match of {
            Type::Elementary(of) | Type::Enumeration(_, of) => parts.push((first, *of)),
            Type::Text(_) => {}
            Type::Array(array) => {
                for element in 0..array.length() {
                    self.leaves(first + element * array.stride(), &array.element, parts);
                }
            }
            Type::Structure(id, _) => {
                for field in &self.program.structures[id.0 as usize].fields {
                    let first = first + 64 * u64::from(field.slot);
                    if field.is_reference {
                        parts.push((first, Elementary::Lword));
                    } else {
                        self.leaves(first, &field.of, parts);
                    }
                }
            }
        }
    }

    fn number(&mut self, context: Context, expression: &Expression) -> Result<Term> {
        match self.value(context, expression)? {
            Value::Number(number) => Ok(number),
            _ => self.unsupported(context, "a number was expected"),
        }
    }

    fn value(&mut self, context: Context, expression: &Expression) -> Result<Value> {
        let of = expression.of.elementary();
        match (&expression.kind, of) {
            (ExpressionKind::Constant(stored), Some(of)) => {
                Ok(Value::Number(self.terms.constant(of, *stored)))
            }
            (ExpressionKind::Constant(_) | ExpressionKind::Text(_), _) => Ok(Value::Text),
            (ExpressionKind::Load(place), _) => {
                let places = self.places(context, place)?;
                let mut loaded: Option<Value> = None;
                for (condition, address) in places.into_iter().rev() {
                    let value = self.load(address, &place.of);
                    loaded = Some(match (loaded, value) {
                        (None, value) => value,
                        (Some(other), value) => self.chosen(condition, value, other),
                    });
                }
                Ok(loaded.unwrap_or(Value::Text))
            }
            (ExpressionKind::Apply(operation, operands), of) => {
                self.apply(context, *operation, operands, of)
            }
            (ExpressionKind::Choose(parts), _) => {
                let [condition, first, second] = &**parts;
                let condition = self.number(context, condition)?;
                let value = self.either(
                    condition,
                    |this| this.value(context, first),
                    |this| this.value(context, second),
                )?;
                Ok(match value {
                    Either::Only(value) => value,
                    Either::Both(one, other) => self.chosen(condition, one, other),
                })
            }
            (ExpressionKind::Call(call), _) => self.call(context, call),
        }
    }

    fn chosen(&mut self, condition: Term, then: Value, otherwise: Value) -> Value {
        match (then, otherwise) {
            (Value::Number(then), Value::Number(otherwise)) => {
                Value::Number(self.terms.choose(condition, then, otherwise))
            }
            (Value::Parts(then), Value::Parts(otherwise)) => {
                let pairs = then.into_iter().zip(otherwise);
                Value::Parts(
                    pairs
                        .map(|((offset, one), (_, other))| {
                            (offset, self.terms.choose(condition, one, other))
                        })
                        .collect(),
                )
            }
            _ => Value::Text,
        }
    }

    fn apply(
        &mut self,
        context: Context,
        operation: Operation,
        operands: &[Expression],
        of: Option<Elementary>,
    ) -> Result<Value> {
        let mut values = Vec::with_capacity(operands.len());
        for operand in operands {
            values.push(self.value(context, operand)?);
        }
        let Some(of) = of else {
            return Ok(Value::Text);
        };
        if let Operation::Text(text) = operation {
            let of = match text {
                TextOperation::Compare(_) => Elementary::Bool,
                _ => of,
            };
            return Ok(Value::Number(self.terms.unknown(of)));
        }
        if operation == Operation::Elapsed {
            return Ok(Value::Number(self.elapsed));
        }
        let mut numbers = Vec::with_capacity(values.len());
        for value in values {
            match value {
                Value::Number(number) => numbers.push(number),
                _ => return self.unsupported(context, "a number was expected"),
            }
        }
        match operation {
            Operation::Divide(kind) | Operation::Modulo(kind) if !kind.is_real() => {
                let zero = self.terms.equals(numbers[1], 0);
                self.fault(zero);
            }
            Operation::Multiplex(_) => {
                let last = numbers.len() as i128 - 2;
                let inside = self.between(numbers[0], 0, last);
                let outside = self.terms.not(inside);
                self.fault(outside);
                let mut chosen = numbers[numbers.len() - 1];
                for (place, &operand) in numbers[1..].iter().enumerate().rev().skip(1) {
                    let here = self.terms.equals(numbers[0], place as u64);
                    chosen = self.terms.choose(here, operand, chosen);
                }
                return Ok(Value::Number(chosen));
            }
            _ => {}
        }
        Ok(Value::Number(self.terms.apply(operation, of, &numbers)))
    }

    fn call(&mut self, context: Context, call: &Call) -> Result<Value> {
        let own = match &call.own {
            Some(place) => self.address(context, place)? / 64,
            None => 0,
        };
        let inner = Context {
            routine: call.routine,
            own,
        };
        let mut given = Vec::with_capacity(call.arguments.len());
        for argument in &call.arguments {
            given.push(match argument {
                Argument::Value(_, value) => self.value(context, value)?,
                Argument::Reference(_, place) => {
                    let address = self.address(context, place)?;
                    Value::Number(self.terms.constant(Elementary::Lword, address))
                }
            });
        }
        let mut taken = Vec::with_capacity(call.outputs.len());
        for (_, to) in &call.outputs {
            taken.push(self.address(context, to)?);
        }
        let line = self.line;
        self.clear_frame(call.routine);
        for (argument, value) in call.arguments.iter().zip(given) {
            match (argument, value) {
                (Argument::Reference(slot, _), Value::Number(address)) => {
                    let mut holder = slot.clone();
                    holder.of = Type::Elementary(Elementary::Lword);
                    let slot = self.address(inner, &holder)?;
                    self.set(slot, address);
                }
                (Argument::Value(place, _) | Argument::Reference(place, _), value) => {
                    self.store(inner, place, value)?;
                }
            }
        }
        self.body(inner)?;
        self.line = line;
        for ((from, to), address) in call.outputs.iter().zip(taken) {
            let source = self.address(inner, from)?;
            match self.load(source, &from.of) {
                Value::Number(number) => self.set(address, number),
                Value::Parts(parts) => {
                    for (offset, value) in parts {
                        self.set(address + offset, value);
                    }
                }
                Value::Text => {
                    if matches!(to.of, Type::Text(_)) {
                        let long = self.terms.unknown(Elementary::Bool);
                        self.fault(long);
                    }
                }
            }
        }
        match &call.result {
            Some(place) => {
                let address = self.address(inner, place)?;
                Ok(self.load(address, &place.of))
            }
            None => Ok(Value::Number(self.terms.boolean(false))),
        }
    }
}

/// One side of a selection that is known, or both.
enum Either<T> {
    Only(T),
    Both(T, T),
}

/// The least and the greatest number of an integer type.
pub(super) fn range(of: Elementary) -> (i128, i128) {
    let mask = i128::from(of.mask());
    match of.is_signed() {
        true => (-(mask >> 1) - 1, mask >> 1),
        false => (0, mask),
    }
}
