//! Random bodies of routines.

use std::sync::Arc;

use understudy_typed::{
    Argument, Branch, Call, Case, Elementary, Expression, ExpressionKind, For, Operand, Operation,
    Place, Root, Signature, Statement, StatementKind, TextOperation, Type,
};

use super::{Callable, Generator, Known, operations};

/// A body that is written.
pub(super) struct Writer<'a> {
    pub(super) to: &'a mut Generator,
    pub(super) scope: Vec<Known>,
    pub(super) line: u32,
    pub(super) loops: usize,
    /// Indices within indices.
    pub(super) within: usize,
}

pub(crate) fn body(to: &mut Generator, scope: &[Known], statements: usize) -> Vec<Statement> {
    let mut scope = scope.to_vec();
    scope.extend(to.globals.iter().cloned());
    let mut writer = Writer { to, scope, line: 0, loops: 0, within: 0 };
    writer.statements(statements, 3)
}

/// Assignments to the outputs of real types.
pub(crate) fn outputs(to: &mut Generator, scope: &[Known]) -> Vec<Statement> {
    let points: Vec<_> = to.program.outputs.iter().cloned().collect();
    let mut writer = Writer {
        scope: scope.iter().chain(&to.globals).cloned().collect(),
        to,
        line: 1_000,
        loops: 0,
        within: 0,
    };
    let reals = points.into_iter().filter(|point| point.of.is_real());
    reals
        .map(|point| {
            let place = Place::new(Root::Global(point.slot), Type::Elementary(point.of));
            // From −100 to 150, mostly.
            let value = match writer.percent(90) {
                true => {
                    let small = writer.number(Elementary::Sint, 2);
                    Expression {
                        of: Type::Elementary(point.of),
                        kind: ExpressionKind::Apply(
                            Operation::Convert(Elementary::Sint, point.of),
                            vec![small],
                        ),
                    }
                }
                false => writer.number(point.of, 2),
            };
            Statement { line: 1_000, kind: StatementKind::Assign(place, value) }
        })
        .collect()
}

pub(crate) fn constant(of: Elementary, value: u64) -> Expression {
    Expression { of: Type::Elementary(of), kind: ExpressionKind::Constant(value) }
}

impl Writer<'_> {
    pub(super) fn below(&mut self, end: usize) -> usize {
        self.to.random.below(end)
    }

    pub(super) fn percent(&mut self, share: usize) -> bool {
        self.to.random.percent(share)
    }

    fn statements(&mut self, count: usize, depth: usize) -> Vec<Statement> {
        let count = 1 + self.below(count.max(1));
        (0..count).map(|_| self.statement(depth)).collect()
    }

    fn statement(&mut self, depth: usize) -> Statement {
        self.line += 1;
        let line = self.line;
        let choice = match depth {
            0 => self.below(9),
            _ => self.below(18),
        };
        let kind = match choice {
            0..=4 => self.assign(),
            5 => self.bind_and_invoke(),
            6 => match self.percent(30) {
                true => self.invoke(),
                false => self.bind_and_invoke(),
            },
            7 => StatementKind::Evaluate({
                let known = Place::new(Root::Global(0), Type::Elementary(Elementary::Int));
                self.call(None, 2, &known)
            }),
            8 => match self.below(10) {
                0 => StatementKind::Return,
                1..=3 if self.loops > 0 => StatementKind::Exit,
                4..=6 if self.loops > 0 => StatementKind::Continue,
                _ => self.assign(),
            },
            9 => self.guarded(),
            10..=12 => {
                let branches = (0..1 + self.below(2))
                    .map(|_| Branch {
                        condition: self.number(Elementary::Bool, 3),
                        body: self.statements(3, depth - 1),
                    })
                    .collect();
                StatementKind::If(branches, self.statements(2, depth - 1))
            }
            13 => self.case(depth),
            14..=16 => self.counted(depth),
            _ => {
                let condition = self.number(Elementary::Bool, 2);
                self.loops += 1;
                let mut body = self.statements(3, depth - 1);
                self.loops -= 1;
                if self.percent(90) {
                    // Most of these loops end soon.
                    let line = self.line;
                    let exit = Branch {
                        condition: self.number(Elementary::Bool, 2),
                        body: vec![Statement { line, kind: StatementKind::Exit }],
                    };
                    let otherwise = match self.percent(80) {
                        true => exit.body.clone(),
                        false => Vec::new(),
                    };
                    let kind = StatementKind::If(vec![exit], otherwise);
                    body.insert(0, Statement { line, kind });
                }
                match self.percent(50) {
                    true => StatementKind::While(condition, body),
                    false => StatementKind::Repeat(body, condition),
                }
            }
        };
        Statement { line, kind }
    }

    pub(super) fn assign(&mut self) -> StatementKind {
        let of = self.to.random.pick(&self.to.types).clone();
        match self.place(&of, true) {
            Some(place) => {
                let value = self.value(&place.of, 3, &place);
                StatementKind::Assign(place, value)
            }
            None => StatementKind::Evaluate(self.number(Elementary::Int, 2)),
        }
    }

    fn case(&mut self, depth: usize) -> StatementKind {
        let of = *self.to.random.pick(&[
            Elementary::Sint,
            Elementary::Int,
            Elementary::Udint,
            Elementary::Ulint,
        ]);
        let selector = self.number(of, 2);
        let cases = (0..1 + self.below(3))
            .map(|_| {
                let low = self.below(6) as i64 - 2;
                Case {
                    ranges: vec![(low, low + self.below(2) as i64), (100, 100)],
                    body: self.statements(2, depth - 1),
                }
            })
            .collect();
        StatementKind::Case(selector, cases, self.statements(2, depth - 1))
    }

    fn counted(&mut self, depth: usize) -> StatementKind {
        let of = *self.to.random.pick(&[
            Elementary::Sint,
            Elementary::Int,
            Elementary::Dint,
            Elementary::Lint,
            Elementary::Uint,
            Elementary::Ulint,
        ]);
        let Some(counter) = self.place(&Type::Elementary(of), true) else {
            return self.assign();
        };
        let bound = |writer: &mut Self, at: i64| match writer.percent(95) {
            true => constant(of, at as u64 & of.mask()),
            false => writer.number(of, 2),
        };
        let start = match (of.is_signed(), self.percent(90)) {
            (true, true) => self.below(5) as i64 - 2,
            (_, false) => (of.mask() >> u32::from(of.is_signed())) as i64 - 2,
            _ => self.below(5) as i64,
        };
        let length = self.below(7) as i64 - 1;
        let from = bound(self, start);
        let to = bound(self, start.saturating_add(length));
        let by = match (self.below(8), of.is_signed()) {
            (0, _) if self.percent(30) => self.number(of, 1),
            (1 | 2, true) => constant(of, of.mask()),
            (3, _) => constant(of, 2),
            _ => constant(of, 1),
        };
        self.loops += 1;
        let body = self.statements(3, depth - 1);
        self.loops -= 1;
        StatementKind::For(Box::new(For { counter, from, to, by, body }))
    }

    /// A block or method of which an instance can be reached, and that instance.
    fn instance(&mut self, is_method: bool) -> Option<(Callable, Place)> {
        let blocks = self.to.callables.iter();
        let blocks: Vec<Callable> = blocks
            .filter(|callable| callable.structure.is_some() && callable.is_method == is_method)
            .cloned()
            .collect();
        if blocks.is_empty() {
            return None;
        }
        let callable = self.to.random.pick(&blocks).clone();
        let of = callable.structure.clone()?;
        let place = self.place(&of, false)?;
        Some((callable, place))
    }

    fn invoke(&mut self) -> StatementKind {
        match self.instance(false) {
            Some((callable, place)) => StatementKind::Invoke(callable.id, place),
            None => self.assign(),
        }
    }

    /// Binds the reference of an instance and invokes a block on it.
    fn bind_and_invoke(&mut self) -> StatementKind {
        let is_method = self.percent(50);
        let Some((callable, instance)) = self.instance(is_method) else {
            return self.assign();
        };
        let Some((slot, of)) = callable.bound.first().cloned() else {
            return self.invoke();
        };
        let Some(target) = self.place(&of, false) else {
            return self.invoke();
        };
        let holder =
            Place { offset: instance.offset + slot, of: target.of.clone(), ..instance.clone() };
        let bind = StatementKind::Bind(holder, target);
        if is_method {
            return bind;
        }
        let line = self.line;
        let body = [bind, StatementKind::Invoke(callable.id, instance)];
        let branch = Branch {
            condition: constant(Elementary::Bool, 1),
            body: body.map(|kind| Statement { line, kind }).into(),
        };
        StatementKind::If(vec![branch], Vec::new())
    }

    /// A value of any type, of which a place is known.
    fn value(&mut self, of: &Type, depth: usize, known: &Place) -> Expression {
        let kind = match of {
            Type::Elementary(elementary) => return self.number(*elementary, depth),
            Type::Enumeration(_, elementary) => self.number(*elementary, depth).kind,
            Type::Text(_) => return self.text(depth),
            _ => {
                if depth > 0 && self.percent(20) {
                    let condition = self.number(Elementary::Bool, depth - 1);
                    let parts = [
                        condition,
                        self.value(of, depth - 1, known),
                        self.value(of, depth - 1, known),
                    ];
                    ExpressionKind::Choose(Box::new(parts))
                } else if depth > 0 && self.percent(20) {
                    return self.call(Some(of), depth, known);
                } else {
                    let place = self.place(of, false).unwrap_or_else(|| known.clone());
                    ExpressionKind::Load(Box::new(place))
                }
            }
        };
        Expression { of: of.clone(), kind }
    }

    pub(super) fn number(&mut self, of: Elementary, depth: usize) -> Expression {
        let choice = if depth == 0 { 0 } else { self.below(10) };
        let kind = match choice {
            0..=2 => {
                if self.percent(75)
                    && let Some(place) = self.place(&Type::Elementary(of), false)
                {
                    ExpressionKind::Load(Box::new(place))
                } else {
                    ExpressionKind::Constant(self.to.random.value(of))
                }
            }
            3..=7 => {
                let (operation, signature) = operations::with_result(&mut self.to.random, of);
                let operands = self.operands(operation, &signature, depth - 1);
                ExpressionKind::Apply(operation, operands)
            }
            8 => ExpressionKind::Choose(Box::new([
                self.number(Elementary::Bool, depth - 1),
                self.number(of, depth - 1),
                self.number(of, depth - 1),
            ])),
            _ => return self.call_for(Type::Elementary(of), depth),
        };
        Expression { of: Type::Elementary(of), kind }
    }

    fn text(&mut self, depth: usize) -> Expression {
        let words: [&[u8]; 6] = [b"", b"abc", b" 42", b"-1.5E3x", b"T#1s5ms", b"\xc4\x00Z"];
        let choice = if depth == 0 { 0 } else { self.below(6) };
        let kind = match choice {
            0..=2 => match self.percent(60) {
                true => match self.place(&Type::Text(24), false) {
                    Some(place) => ExpressionKind::Load(Box::new(place)),
                    None => ExpressionKind::Text(Arc::from(*self.to.random.pick(&words))),
                },
                false => ExpressionKind::Text(Arc::from(*self.to.random.pick(&words))),
            },
            3 => return self.call_for(Type::Text(24), depth),
            4 => ExpressionKind::Choose(Box::new([
                self.number(Elementary::Bool, depth - 1),
                self.text(depth - 1),
                self.text(depth - 1),
            ])),
            _ => {
                let (operation, signature) = operations::with_text(&mut self.to.random);
                let operands = self.operands(operation, &signature, depth - 1);
                if self.percent(50) {
                    // Cut to what fits.
                    let text = Expression {
                        of: Type::Text(24),
                        kind: ExpressionKind::Apply(operation, operands),
                    };
                    let length = constant(Elementary::Lint, 5);
                    let left = Operation::Text(TextOperation::Left);
                    ExpressionKind::Apply(left, vec![text, length])
                } else {
                    ExpressionKind::Apply(operation, operands)
                }
            }
        };
        Expression { of: Type::Text(24), kind }
    }

    fn operands(
        &mut self,
        operation: Operation,
        signature: &Signature,
        depth: usize,
    ) -> Vec<Expression> {
        let mut operands: Vec<Expression> = signature
            .operands
            .iter()
            .map(|operand| match operand {
                Operand::Number(of) => self.number(*of, depth),
                Operand::Text => self.text(depth),
            })
            .collect();
        // Most divisors and selectors are sound, or few scans would end without a fault.
        match operation {
            Operation::Divide(of) | Operation::Modulo(of) if self.percent(97) => {
                operands[1] = constant(of, 1 + self.below(5) as u64);
            }
            Operation::Multiplex(_) if self.percent(97) => {
                let chosen = self.below(operands.len() - 1) as u64;
                operands[0] = constant(Elementary::Lint, chosen);
            }
            _ => {}
        }
        operands
    }

    fn call_for(&mut self, of: Type, depth: usize) -> Expression {
        let known = Place::new(Root::Global(0), of.clone());
        self.call(Some(&of), depth, &known)
    }

    /// A call with a result of a type, or for what it does.
    fn call(&mut self, result: Option<&Type>, depth: usize, known: &Place) -> Expression {
        let wanted = |callable: &&Callable| {
            let found = callable.result.as_ref().map(|place| &place.of);
            let is_callable = callable.structure.is_none() || callable.is_method;
            is_callable
                && result.is_none_or(|wanted| found.is_some_and(|of| of.is_stored_like(wanted)))
        };
        let callables: Vec<Callable> = self.to.callables.iter().filter(wanted).cloned().collect();
        let made = match callables.is_empty() {
            true => None,
            false => {
                let callable = self.to.random.pick(&callables).clone();
                self.call_of(&callable, result, depth)
            }
        };
        made.unwrap_or_else(|| match result {
            Some(of) => self.value(of, 0, known),
            None => self.number(Elementary::Int, 0),
        })
    }

    fn call_of(
        &mut self,
        callable: &Callable,
        result: Option<&Type>,
        depth: usize,
    ) -> Option<Expression> {
        let depth = depth.saturating_sub(1);
        let own = match &callable.structure {
            Some(of) => Some(self.place(of, false)?),
            None => None,
        };
        let mut arguments = Vec::new();
        for slot in &callable.references {
            let target = self.place(&slot.of, false)?;
            arguments.push(Argument::Reference(slot.clone(), target));
        }
        for place in &callable.values {
            let known = self.place(&place.of, false)?;
            let value = self.value(&place.of, depth, &known);
            arguments.push(Argument::Value(place.clone(), value));
        }
        let mut outputs = Vec::new();
        if let Some(from) = &callable.output
            && let Some(to) = self.place(&from.of, true)
        {
            outputs.push((from.clone(), to));
        }
        let place = callable.result.clone()?;
        let of = result.cloned().unwrap_or_else(|| place.of.clone());
        Some(Expression {
            of,
            kind: ExpressionKind::Call(Box::new(Call {
                routine: callable.id,
                own,
                arguments,
                outputs,
                result: Some(place),
            })),
        })
    }
}
