//! Statements.

use super::place::{Location, place_calls};
use super::text::capacity;
use super::{Compiler, Label};
use crate::form::{Case, Expression, ExpressionKind, For, Place, Statement, StatementKind};
use crate::machine::instruction::{Code, Loop, Range};
use crate::types::{Elementary, Type};

impl Compiler<'_> {
    pub(super) fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            self.context.line = statement.line;
            self.scope(|compiler| compiler.statement(statement));
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Assign(place, value) => self.assign(place, value),
            StatementKind::Bind(slot, place) => {
                let address = self.address(place);
                let address = if place_calls(slot) { self.kept(address) } else { address };
                let holder = self.location(&slot.holder(), Elementary::Lword);
                self.store(holder, Elementary::Lword, address);
            }
            StatementKind::Invoke(routine, place) => self.invoke(*routine, place),
            StatementKind::Evaluate(expression) => self.evaluate(expression),
            StatementKind::If(branches, otherwise) => {
                if self.assign_if(branches, otherwise).is_some() {
                    return;
                }
                let end = self.label();
                for branch in branches {
                    let next = self.label();
                    self.context.line = statement.line;
                    self.scope(|compiler| compiler.condition(&branch.condition, next, false));
                    self.statements(&branch.body);
                    self.jump(Code::Jump, 0, 0, end);
                    self.place_label(next);
                }
                self.statements(otherwise);
                self.place_label(end);
            }
            StatementKind::Case(selector, cases, otherwise) => {
                self.case(selector, cases, otherwise);
            }
            StatementKind::For(each) => self.repeat_for(statement, each),
            StatementKind::While(condition, body) => {
                let (turn, next, end) = (self.label(), self.label(), self.label());
                self.scope(|compiler| compiler.condition(condition, end, false));
                self.place_label(turn);
                self.charge(&statement.kind);
                self.body(body, next, end);
                self.place_label(next);
                self.context.line = statement.line;
                self.scope(|compiler| compiler.condition(condition, turn, true));
                self.place_label(end);
            }
            StatementKind::Repeat(body, condition) => {
                let (turn, next, end) = (self.label(), self.label(), self.label());
                self.place_label(turn);
                self.charge(&statement.kind);
                self.body(body, next, end);
                self.place_label(next);
                self.context.line = statement.line;
                self.scope(|compiler| compiler.condition(condition, turn, false));
                self.place_label(end);
            }
            StatementKind::Exit => {
                let (_, end) = *self.loops.last().expect("EXIT is in a loop");
                self.jump(Code::Jump, 0, 0, end);
            }
            StatementKind::Continue => {
                let (next, _) = *self.loops.last().expect("CONTINUE is in a loop");
                self.jump(Code::Jump, 0, 0, next);
            }
            StatementKind::Return => match self.context.end {
                Some(end) => self.jump(Code::Jump, 0, 0, end),
                None => self.emit(Code::Return, 0, 0, 0),
            },
        }
    }

    /// The body of a loop.
    fn body(&mut self, body: &[Statement], next: Label, end: Label) {
        self.loops.push((next, end));
        self.statements(body);
        self.loops.pop();
    }

    fn charge(&mut self, statement: &StatementKind) {
        let turn = self.costs.turn(statement).unwrap_or(0);
        let turn = self.constant(turn);
        self.emit(Code::Charge, turn, 0, 0);
    }

    fn assign(&mut self, place: &Place, value: &Expression) {
        match &place.of {
            Type::Elementary(of) | Type::Enumeration(_, of) => {
                let of = *of;
                if place.indices.is_empty()
                    && !place.is_by_reference()
                    && let Location::Slot(slot) = self.location(place, of)
                {
                    self.into(value, slot);
                    return;
                }
                let mut operand = self.operand(value);
                if place_calls(place) {
                    operand = self.kept(operand);
                }
                let location = self.location(place, of);
                self.store(location, of, operand);
            }
            Type::Text(_) => {
                let text = self.text(value);
                let address = self.address(place);
                self.emit(Code::TextStore, text, address, capacity(place));
            }
            of => {
                let slots = of.slots() as u32;
                let mut from = self.aggregate(value);
                if place_calls(place) {
                    let copy = self.temporaries_of(slots);
                    let to = self.constant(64 * u64::from(copy));
                    self.emit(Code::Copy, to, from, slots);
                    from = to;
                }
                let to = self.address(place);
                self.emit(Code::Copy, to, from, slots);
            }
        }
    }

    fn evaluate(&mut self, expression: &Expression) {
        match (&expression.kind, &expression.of) {
            (ExpressionKind::Call(call), _) => {
                self.call(call);
            }
            (_, Type::Elementary(_) | Type::Enumeration(..)) => {
                self.operand(expression);
            }
            (_, Type::Text(_)) => {
                self.text(expression);
            }
            _ => {
                self.aggregate(expression);
            }
        }
    }

    fn case(&mut self, selector: &Expression, cases: &[Case], otherwise: &[Statement]) {
        let of = selector.of.elementary().unwrap_or(Elementary::Lint);
        let selector = self.operand(selector);
        let end = self.label();
        let labels: Vec<Label> = cases.iter().map(|_| self.label()).collect();
        for (case, &label) in cases.iter().zip(&labels) {
            for &(low, high) in &case.ranges {
                let stored = low as u64 & of.mask();
                if low != high {
                    self.tables.ranges.push(Range { of, low, high });
                    let table = self.tables.ranges.len() as u32 - 1;
                    self.jump(Code::JumpInRange, selector, table, label);
                } else if of.signed(stored) == i128::from(low) {
                    let value = self.constant(stored);
                    self.jump(Code::JumpEqual, selector, value, label);
                }
            }
        }
        self.statements(otherwise);
        for (case, &label) in cases.iter().zip(&labels) {
            self.jump(Code::Jump, 0, 0, end);
            self.place_label(label);
            self.statements(&case.body);
        }
        self.place_label(end);
    }

    fn repeat_for(&mut self, statement: &Statement, each: &For) {
        let of = each.counter.of.elementary().unwrap_or(Elementary::Lint);
        let is_plain = each.counter.indices.is_empty() && !each.counter.is_by_reference();
        let counter = match is_plain {
            true => self.location(&each.counter, of),
            _ => Location::Address(self.address(&each.counter)),
        };
        // The counter's own slot, or a copy of what lies elsewhere.
        let slot = match counter {
            Location::Slot(slot) => slot,
            _ => self.temporary(),
        };
        self.scope(|compiler| {
            compiler.into(&each.from, slot);
            compiler.put_back(counter, of, slot);
        });
        let limit = self.operand(&each.to);
        let limit = self.kept(limit);
        let by = self.operand(&each.by);
        let by = self.kept(by);
        let charge = self.costs.turn(&statement.kind).unwrap_or(0);
        self.tables.loops.push(Loop { of, counter: slot, limit, by, turn: charge });
        let table = self.tables.loops.len() as u32 - 1;
        let (turn, next, end) = (self.label(), self.label(), self.label());
        // The value that was assigned, and not what evaluating the bounds may have made of it, is what both engines test.
        self.fetch(counter, of, slot);
        self.jump(Code::Passed, table, 0, end);
        self.charge(&statement.kind);
        self.place_label(turn);
        self.put_back(counter, of, slot);
        self.body(&each.body, next, end);
        self.place_label(next);
        self.context.line = statement.line;
        self.fetch(counter, of, slot);
        match next_by_one(each, of) {
            Some(code) => {
                self.jump(code, slot, limit, turn);
                let charge = self.constant(charge);
                self.emit(Code::Data, charge, 0, 0);
            }
            None => self.jump(Code::Step, table, 0, turn),
        }
        self.put_back(counter, of, slot);
        self.place_label(end);
    }

    /// A counter that has no slot of its own := its copy.
    fn put_back(&mut self, counter: Location, of: Elementary, slot: u32) {
        if !matches!(counter, Location::Slot(_)) {
            self.store(counter, of, slot);
        }
    }

    fn fetch(&mut self, counter: Location, of: Elementary, slot: u32) {
        if !matches!(counter, Location::Slot(_)) {
            self.load(counter, of, slot);
        }
    }
}

/// The instruction for the step of a loop by 1.
fn next_by_one(each: &For, of: Elementary) -> Option<Code> {
    let is_one = matches!(each.by.kind, ExpressionKind::Constant(1));
    match (is_one && of.is_signed(), of.bits()) {
        (true, 16) => Some(Code::Next16),
        (true, 32) => Some(Code::Next32),
        (true, 64) => Some(Code::Next64),
        _ => None,
    }
}
