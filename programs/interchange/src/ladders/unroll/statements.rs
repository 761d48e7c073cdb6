//! Statements to steps; what comes behind a statement that may leave its list is done where it has not been left.

use std::collections::{HashMap, HashSet};

use understudy_typed::{
    Branch, Case, Elementary, Expression, ExpressionKind, For, Statement, StatementKind,
};

use super::super::facts::{inputs, preset};
use super::super::program::{Action, Number, Role, Step, Truth};
use super::calls::GivenParts;
use super::values::Value;
use super::{Context, Found, Kind, Unrolling};
use understudy_ladder::Relation;

/// What a statement leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Leave {
    Loop,
    Turn,
    Routine,
}

/// How a list was left.
#[derive(Debug, Clone, Default)]
pub(super) struct Left {
    /// In every execution: by one way, or by several, each with its cell.
    is_always: bool,
    /// The way, where there is only one and no cell.
    sure: Option<Leave>,
    /// Cells that say that it was.
    cells: Vec<(Leave, usize)>,
}

/// What one way of a choice does.
pub(super) struct Arm<T> {
    pub(super) steps: Vec<Step>,
    pub(super) known: HashMap<u64, Option<u64>>,
    pub(super) result: T,
}

impl Unrolling<'_> {
    /// Runs something as one way of a choice.
    pub(super) fn arm<T>(&mut self, run: impl FnOnce(&mut Self) -> Found<T>) -> Found<Arm<T>> {
        let around = std::mem::take(&mut self.steps);
        self.known.push(HashMap::new());
        self.depth += 1;
        let result = run(self);
        self.depth -= 1;
        let known = self.known.pop().unwrap_or_default();
        let steps = std::mem::replace(&mut self.steps, around);
        Ok(Arm { steps, known, result: result? })
    }

    /// What is known behind a choice: what all of its ways agree on.
    pub(super) fn merge(&mut self, ways: &[HashMap<u64, Option<u64>>]) {
        let addresses: HashSet<u64> = ways.iter().flat_map(HashMap::keys).copied().collect();
        for address in addresses {
            let before = self.known_before(address);
            let mut values = ways.iter().map(|way| way.get(&address).copied().unwrap_or(before));
            let first = values.next().flatten();
            let agreed = first.filter(|first| values.all(|value| value == Some(*first)));
            self.set_known(address, agreed);
        }
    }

    fn known_before(&self, address: u64) -> Option<u64> {
        // What is written somewhere is not known by its initial value.
        let mut overlays = self.known.iter().rev();
        overlays.find_map(|overlay| overlay.get(&address).copied()).flatten()
    }

    /// The body of a routine.
    pub(super) fn body(&mut self, context: Context) -> Found<()> {
        let is_library = self.around.names.library.get(context.routine.0 as usize);
        let is_library = is_library == Some(&true);
        let (line, floor, entry) = (self.line, self.floor, self.entry);
        (self.floor, self.entry) = (self.depth, self.depth);
        let program = self.program;
        let body = &program.routine(context.routine).body;
        self.list(context, body, is_library)?;
        (self.line, self.floor, self.entry) = (line, floor, entry);
        Ok(())
    }

    fn list(
        &mut self,
        context: Context,
        statements: &[Statement],
        is_library: bool,
    ) -> Found<Left> {
        let mut at = 0;
        while let Some(statement) = statements.get(at) {
            if !is_library && statement.line != 0 {
                self.line = statement.line;
            }
            self.counted()?;
            let (next, mut left) = self.statement(context, statements, at, is_library)?;
            at = next;
            if left.is_always || at >= statements.len() {
                return Ok(left);
            }
            if !left.cells.is_empty() {
                let rest = &statements[at..];
                let stays = stays(&left);
                let inner = self.under(stays, |own| own.list(context, rest, is_library))?;
                left.cells.extend(inner.cells_of(self)?);
                left.is_always = inner.is_always;
                return Ok(left);
            }
        }
        Ok(Left::default())
    }

    /// Steps under a condition.
    fn under(
        &mut self,
        condition: Truth,
        run: impl FnOnce(&mut Self) -> Found<Left>,
    ) -> Found<Left> {
        let arm = self.arm(run)?;
        self.merge(&[arm.known, HashMap::new()]);
        if !arm.steps.is_empty() {
            self.push(Action::If(vec![(condition, arm.steps)], Vec::new()))?;
        }
        Ok(arm.result)
    }

    /// A statement, or a call with the assignments to its inputs before it; answers with the place of the next one.
    fn statement(
        &mut self,
        context: Context,
        statements: &[Statement],
        at: usize,
        is_library: bool,
    ) -> Found<(usize, Left)> {
        let statement = &statements[at];
        let none = Left::default();
        let left = match &statement.kind {
            StatementKind::Assign(place, value) => {
                if let Some(call) = self.call_at(context, statements, at)? {
                    return self.block_call(context, statements, at, call);
                }
                match place.of.elementary() {
                    Some(of) => {
                        let value = self.value(context, value)?;
                        let address = self.address(context, place)?;
                        self.store(address, of, value)?;
                    }
                    None => {
                        let ExpressionKind::Load(from) = &value.kind else {
                            return Err(self.refuse("it uses a value with parts or a STRING"));
                        };
                        let from = self.address(context, from)?;
                        let to = self.address(context, place)?;
                        self.copy(to, from, &place.of)?;
                    }
                }
                none
            }
            StatementKind::Bind(holder, place) => {
                let address = self.address(context, place)?;
                let holder = self.holder(context, holder)?;
                self.next.written.insert(holder);
                self.set_known(holder, Some(address));
                none
            }
            StatementKind::Invoke(routine, place) => {
                self.invoke(context, *routine, place, Vec::new())?;
                none
            }
            StatementKind::Evaluate(expression) => {
                if let ExpressionKind::Call(call) = &expression.kind {
                    self.call(context, call)?;
                } else {
                    self.value(context, expression)?;
                }
                none
            }
            StatementKind::If(branches, otherwise) => {
                self.choice(context, branches, otherwise, is_library)?
            }
            StatementKind::Case(selector, cases, otherwise) => {
                self.case(context, selector, cases, otherwise, is_library)?
            }
            StatementKind::For(each) => self.repeat(context, each, is_library)?,
            StatementKind::While(..) | StatementKind::Repeat(..) => {
                return Err(self.refuse("it has a loop whose turns are not counted"));
            }
            StatementKind::Exit => self.leave(Leave::Loop)?,
            StatementKind::Continue => self.leave(Leave::Turn)?,
            StatementKind::Return => self.leave(Leave::Routine)?,
        };
        Ok((at + 1, left))
    }

    /// The place of the call that the assignment at a place belongs to: only assignments to inputs of the same block stand between.
    fn call_at(
        &mut self,
        context: Context,
        statements: &[Statement],
        at: usize,
    ) -> Found<Option<(usize, u64)>> {
        let mut found = None;
        for (place, statement) in statements.iter().enumerate().skip(at) {
            match &statement.kind {
                StatementKind::Assign(target, _) if target.indices.is_empty() => {
                    let address = self.address(context, target)?;
                    let Some((block, part)) = self.parts.get(&address).copied() else {
                        return Ok(None);
                    };
                    let facts = &self.facts.blocks[&block];
                    let is_input =
                        inputs(facts.word).contains(&part) || preset(facts.word) == Some(part);
                    if !is_input || !facts.is_native() || found.is_some_and(|known| known != block)
                    {
                        return Ok(None);
                    }
                    found = Some(block);
                }
                StatementKind::Invoke(_, instance) if instance.indices.is_empty() => {
                    let address = self.address(context, instance)?;
                    return Ok(found.filter(|block| *block == address).map(|block| (place, block)));
                }
                _ => return Ok(None),
            }
        }
        Ok(None)
    }

    fn block_call(
        &mut self,
        context: Context,
        statements: &[Statement],
        at: usize,
        (call, _): (usize, u64),
    ) -> Found<(usize, Left)> {
        let mut parts = Vec::new();
        let mut expressions = Vec::new();
        for statement in &statements[at..call] {
            if let StatementKind::Assign(target, value) = &statement.kind {
                let address = self.address(context, target)?;
                let Some((_, part)) = self.parts.get(&address).copied() else {
                    return Err(self.refuse("it calls a block in an unusual way"));
                };
                parts.push(part);
                expressions.push(value);
            }
        }
        let values = self.operands(context, expressions.into_iter())?;
        let mut given: GivenParts = Vec::new();
        for (part, value) in parts.into_iter().zip(values) {
            given.retain(|(known, _)| *known != part);
            given.push((part, value));
        }
        if let StatementKind::Invoke(routine, place) = &statements[call].kind {
            self.invoke(context, *routine, place, given)?;
        }
        Ok((call + 1, Left::default()))
    }

    fn leave(&mut self, what: Leave) -> Found<Left> {
        let floor = match what {
            Leave::Routine => self.entry,
            Leave::Loop | Leave::Turn => self.floor,
        };
        if self.depth == floor {
            return Ok(Left { is_always: true, sure: Some(what), cells: Vec::new() });
        }
        let cell = self.fresh("left", Kind::Truth, Role::Passing)?;
        self.push(Action::SetTruth(cell, Truth::Constant(true)))?;
        Ok(Left { is_always: true, sure: None, cells: vec![(what, cell)] })
    }

    fn choice(
        &mut self,
        context: Context,
        branches: &[Branch],
        otherwise: &[Statement],
        is_library: bool,
    ) -> Found<Left> {
        let mut conditions: Vec<Truth> = Vec::new();
        let mut bodies: Vec<&[Statement]> = Vec::new();
        for (at, branch) in branches.iter().enumerate() {
            // What a condition calls is called only where those before do not hold.
            if at > 0 && !conditions.is_empty() && calls(&branch.condition) {
                let rest = &branches[at..];
                return self.ways(conditions, bodies, is_library, context, |own| {
                    own.choice(context, rest, otherwise, is_library)
                });
            }
            let condition = self.value(context, &branch.condition)?;
            match condition.known() {
                Some(0) => continue,
                Some(_) => {
                    let body = &branch.body;
                    return self.ways(conditions, bodies, is_library, context, |own| {
                        own.list(context, body, is_library)
                    });
                }
                None => {}
            }
            conditions.push(self.truth_of(condition)?);
            bodies.push(&branch.body);
        }
        self.ways(conditions, bodies, is_library, context, |own| {
            own.list(context, otherwise, is_library)
        })
    }

    /// A choice with conditions that are not known.
    fn ways(
        &mut self,
        conditions: Vec<Truth>,
        bodies: Vec<&[Statement]>,
        is_library: bool,
        context: Context,
        otherwise: impl FnOnce(&mut Self) -> Found<Left>,
    ) -> Found<Left> {
        if conditions.is_empty() {
            return otherwise(self);
        }
        let line = self.line;
        let comments = self.comments.remove(&line).unwrap_or_default();
        let mut known = Vec::new();
        let mut branches = Vec::new();
        let mut left = Left { is_always: true, ..Left::default() };
        for (condition, body) in conditions.into_iter().zip(bodies) {
            let arm = self.arm(|own| own.list(context, body, is_library))?;
            known.push(arm.known);
            branches.push((condition, arm.steps));
            left.is_always &= arm.result.is_always;
            left.cells.extend(arm.result.cells);
        }
        let last = self.arm(otherwise)?;
        known.push(last.known);
        left.is_always &= last.result.is_always;
        left.cells.extend(last.result.cells);
        self.merge(&known);
        let is_empty = last.steps.is_empty() && branches.iter().all(|(_, body)| body.is_empty());
        self.line = line;
        if !is_empty {
            self.push(Action::If(branches, last.steps))?;
            if let Some(step) = self.steps.last_mut() {
                step.comments = comments;
            }
        }
        Ok(left)
    }

    fn case(
        &mut self,
        context: Context,
        selector: &Expression,
        cases: &[Case],
        otherwise: &[Statement],
        is_library: bool,
    ) -> Found<Left> {
        let value = self.value(context, selector)?;
        if let Some(value) = value.constant() {
            let has = |case: &&Case| {
                let mut ranges = case.ranges.iter();
                ranges.any(|(first, last)| (*first..=*last).contains(&value))
            };
            let body = cases.iter().find(has).map_or(otherwise, |case| &case.body);
            return self.list(context, body, is_library);
        }
        if let Value::Truth(_) = value {
            return Err(self.refuse("it has a CASE over bits"));
        }
        let number = self.number_of(value)?;
        let number = self.hold_number(number)?;
        let compare = |relation, value: i64| {
            let with = Box::new(Number::Constant(value));
            Truth::Compare(relation, Box::new(number.clone()), with)
        };
        let mut conditions = Vec::new();
        for case in cases {
            let ranges = case.ranges.iter().map(|(first, last)| match first == last {
                true => compare(Relation::Equal, *first),
                false => Truth::All(vec![
                    compare(Relation::GreaterOrEqual, *first),
                    compare(Relation::LessOrEqual, *last),
                ]),
            });
            conditions.push(Truth::Any(ranges.collect()));
        }
        let bodies = cases.iter().map(|case| case.body.as_slice()).collect();
        self.ways(conditions, bodies, is_library, context, |own| {
            own.list(context, otherwise, is_library)
        })
    }

    /// A loop is written out.
    fn repeat(&mut self, context: Context, each: &For, is_library: bool) -> Found<Left> {
        let of = each.counter.of.elementary().unwrap_or(Elementary::Lint);
        let counter = self.address(context, &each.counter)?;
        let from = self.value(context, &each.from)?;
        self.store(counter, of, from.clone())?;
        let to = self.value(context, &each.to)?.constant();
        let by = self.value(context, &each.by)?.constant();
        let (Some(mut value), Some(to), Some(by)) = (from.constant(), to, by) else {
            return Err(self.refuse("it has a FOR whose bounds vary"));
        };
        if by == 0 {
            return Err(self.refuse("it has a FOR with a step of 0"));
        }
        let floor = std::mem::replace(&mut self.floor, self.depth);
        let mut left = Left::default();
        let mut is_first = true;
        loop {
            let is_over = if by > 0 { value > to } else { value < to };
            let mut reached = i128::from(value);
            let mut turn = |own: &mut Self| {
                let stored = value as u64 & of.mask();
                if !is_first {
                    own.store(counter, of, Value::Known(of, stored))?;
                }
                if is_over {
                    return Ok(Left::default());
                }
                own.counted()?;
                let found = own.list(context, &each.body, is_library)?;
                match own.known(counter, of) {
                    Some(left_at) => reached = of.signed(left_at),
                    None if found.is_always => {}
                    None => {
                        let what = "it has a FOR whose counter is assigned in the loop";
                        return Err(own.refuse(what));
                    }
                }
                Ok(found)
            };
            let found = match left.cells.is_empty() {
                true => turn(self)?,
                false => {
                    let stays = stays(&left);
                    self.under(stays, turn)?
                }
            };
            is_first = false;
            let ends = found.sure == Some(Leave::Loop) || found.sure == Some(Leave::Routine);
            let only_turn = |(what, _): &(Leave, usize)| *what == Leave::Turn;
            let goes_on = found.sure == Some(Leave::Turn) || found.cells.iter().any(only_turn);
            if found.sure == Some(Leave::Routine) {
                self.floor = floor;
                return Ok(found);
            }
            let all_leave = found.is_always && !goes_on;
            let new = found.cells.into_iter().filter(|(what, _)| *what != Leave::Turn);
            left.cells.extend(new);
            left.combine(self)?;
            if is_over || ends || all_leave {
                break;
            }
            let next = reached + i128::from(by);
            let stored = next as u64 & of.mask();
            if of.signed(stored) != next {
                break;
            }
            value = next as i64;
        }
        self.floor = floor;
        left.cells.retain(|(what, _)| *what == Leave::Routine);
        Ok(left)
    }
}

impl Left {
    fn cells_of(&self, _: &Unrolling<'_>) -> Found<Vec<(Leave, usize)>> {
        Ok(self.cells.clone())
    }

    /// One cell for each way, however many there were.
    fn combine(&mut self, unrolling: &mut Unrolling<'_>) -> Found<()> {
        for what in [Leave::Loop, Leave::Routine] {
            let cells: Vec<usize> =
                self.cells.iter().filter(|(way, _)| *way == what).map(|(_, cell)| *cell).collect();
            if cells.len() < 2 {
                continue;
            }
            let cell = unrolling.fresh("left", Kind::Truth, Role::Passing)?;
            let any = Truth::Any(cells.into_iter().map(Truth::Cell).collect());
            unrolling.push(Action::SetTruth(cell, any))?;
            self.cells.retain(|(way, _)| *way != what);
            self.cells.push((what, cell));
        }
        Ok(())
    }
}

/// That nothing was left.
fn stays(left: &Left) -> Truth {
    let cells = left.cells.iter();
    let not = cells.map(|(_, cell)| Truth::Not(Box::new(Truth::Cell(*cell))));
    Truth::All(not.collect())
}

/// Whether an expression calls something.
fn calls(expression: &Expression) -> bool {
    match &expression.kind {
        ExpressionKind::Call(_) => true,
        ExpressionKind::Apply(_, operands) => operands.iter().any(calls),
        ExpressionKind::Choose(parts) => parts.iter().any(calls),
        ExpressionKind::Load(place) => place.indices.iter().any(|index| calls(&index.value)),
        ExpressionKind::Constant(_) | ExpressionKind::Text(_) => false,
    }
}
