//! Statements to steps.

use std::ops::Range;

use super::super::program::{Action, Kind, Number, Role, Truth};
use super::super::syntax::{Expression, Label, Loop, Path, Statement, StatementKind};
use super::expression::Value;
use super::leave::{Leaves, leaves, leaves_of};
use super::{Entity, MAXIMUM_STEPS, Resolver};
use understudy_ladder::Relation;
use understudy_text::Diagnostic;

impl Resolver {
    /// The steps of one execution of an instance.
    pub(super) fn execute(&mut self, instance: usize) {
        let unit = self.instances[instance].unit;
        let content = self.units[unit].clone();
        let blame = self.blame.clone();
        if !content.foreign {
            self.blame = None;
        }
        self.begin_temporaries(instance, &content);
        let around = self.enter_unit(instance, &content);
        self.statements(instance, &content.body);
        self.leave_unit(around);
        self.blame = blame;
    }

    /// What does not outlast an execution begins anew.
    fn begin_temporaries(&mut self, instance: usize, content: &super::super::syntax::Unit) {
        let is_function = content.kind == super::super::syntax::UnitKind::Function;
        let temporaries = content.declarations.iter().filter(|declaration| {
            let local = declaration.class != super::super::syntax::Class::Input;
            declaration.temporary || is_function && local
        });
        let names: Vec<_> = temporaries
            .map(|declaration| declaration.name.clone())
            .collect();
        let result = content.result.is_some().then(|| content.name.clone());
        for name in names.into_iter().chain(result) {
            if let Some(Entity::Cell(cell)) = self.entity(instance, &name).cloned() {
                let initial = self.program.cells[cell].initial;
                let action = match self.program.cells[cell].kind {
                    Kind::Truth => Action::SetTruth(cell, Truth::Constant(initial == 1)),
                    Kind::Number { .. } => Action::SetNumber(cell, Number::Constant(initial)),
                };
                self.push(action, name.span(), Vec::new());
            }
        }
    }

    /// The steps of a list; what comes behind a statement that may leave it is done where it has not been left.
    pub(super) fn statements(&mut self, instance: usize, statements: &[Statement]) {
        let mut left = Leaves::default();
        let mut rest = statements;
        while !rest.is_empty() {
            let place = rest.iter().position(|statement| leaves_of(statement).any());
            let (now, later) = rest.split_at(place.map_or(rest.len(), |place| place + 1));
            if left.any() {
                let condition = self.still_here(left);
                let span = now[0].span.start..now[now.len() - 1].span.end;
                self.under(condition, &span, |own| own.all(instance, now));
            } else {
                self.all(instance, now);
            }
            left = left.and(leaves(now));
            rest = later;
        }
    }

    fn all(&mut self, instance: usize, statements: &[Statement]) {
        for statement in statements {
            if self.is_full {
                return;
            }
            let first = self.steps.len();
            self.statement(instance, statement);
            if let Some(step) = self.steps.get_mut(first) {
                step.comments
                    .splice(0..0, statement.comments.iter().cloned());
            }
        }
    }

    fn statement(&mut self, instance: usize, statement: &Statement) {
        let span = statement.span.clone();
        match &statement.kind {
            StatementKind::Assign(target, value) => self.assign(instance, target, value, span),
            StatementKind::Call(path, arguments) => self.call(instance, path, arguments, span),
            StatementKind::If(branches, otherwise) => {
                let conditions: Vec<Truth> = branches
                    .iter()
                    .map(|(condition, _)| self.truth(instance, condition))
                    .collect();
                let bodies: Vec<&[Statement]> =
                    branches.iter().map(|(_, body)| body.as_slice()).collect();
                self.choice(instance, conditions, &bodies, otherwise, span);
            }
            StatementKind::Case(selector, branches, otherwise) => {
                let number = self.number(instance, selector);
                let number = self.hold(number, &selector.span);
                let conditions: Vec<Truth> = branches
                    .iter()
                    .map(|(labels, _)| {
                        let labels = labels
                            .iter()
                            .map(|label| self.label(instance, label, &number));
                        Truth::Any(labels.collect())
                    })
                    .collect();
                let bodies: Vec<&[Statement]> =
                    branches.iter().map(|(_, body)| body.as_slice()).collect();
                self.choice(instance, conditions, &bodies, otherwise, span);
            }
            StatementKind::For(content) => self.repeat(instance, content, &span),
            StatementKind::Leave(what) => self.leave(*what, span),
            StatementKind::Refused(what) => {
                let message = format!("{what} not supported");
                let finding = Diagnostic::error("U1040", message, span);
                self.say(finding.with_help(
                    "a scan has a fixed number of steps; FOR with constant bounds and EXIT in it are supported",
                ));
            }
            StatementKind::Nothing => {}
        }
    }

    fn choice(
        &mut self,
        instance: usize,
        conditions: Vec<Truth>,
        bodies: &[&[Statement]],
        otherwise: &[Statement],
        span: Range<usize>,
    ) {
        let around = std::mem::take(&mut self.steps);
        let mut branches = Vec::with_capacity(conditions.len());
        for (condition, body) in conditions.into_iter().zip(bodies) {
            self.statements(instance, body);
            branches.push((condition, std::mem::take(&mut self.steps)));
        }
        self.statements(instance, otherwise);
        let otherwise = std::mem::replace(&mut self.steps, around);
        self.push(Action::If(branches, otherwise), span, Vec::new());
    }

    fn label(&mut self, instance: usize, label: &Label, number: &Number) -> Truth {
        let mut value = |expression: &Expression| {
            let value = self.constant(instance, expression);
            if value.is_none() {
                self.error(
                    "U1043",
                    "a value of a CASE is a constant number",
                    expression.span.clone(),
                );
            }
            value.unwrap_or(0)
        };
        let first = value(&label.first);
        let compare = |relation, value| {
            Truth::Compare(
                relation,
                Box::new(number.clone()),
                Box::new(Number::Constant(value)),
            )
        };
        match &label.last {
            None => compare(Relation::Equal, first),
            Some(last) => {
                let last = value(last);
                Truth::All(vec![
                    compare(Relation::GreaterOrEqual, first),
                    compare(Relation::LessOrEqual, last),
                ])
            }
        }
    }

    /// A loop is written out.
    fn repeat(&mut self, instance: usize, content: &Loop, span: &Range<usize>) {
        let path = Path {
            parts: vec![content.counter.clone()],
            span: content.counter.span(),
        };
        let Some(Entity::Cell(counter)) = self.look_up(instance, &path) else {
            let message = format!("`{}` cannot count", content.counter);
            self.error("U1043", message, content.counter.span());
            return;
        };
        if matches!(self.program.cells[counter].kind, Kind::Truth) {
            let message = format!("`{}` cannot count: it is a Boolean", content.counter);
            self.error("U1043", message, content.counter.span());
            return;
        }
        let mut bound = |expression: &Expression| {
            let found = match self.expression(instance, expression) {
                Value::Number(number) => number.constant(),
                Value::Error => return None,
                _ => None,
            };
            if found.is_none() {
                let message = "the bounds of a loop must be constant numbers";
                self.error("U1040", message, expression.span.clone());
            }
            found
        };
        let from = bound(&content.from);
        let to = bound(&content.to);
        let by = content.by.as_ref().map_or(Some(1), bound);
        let (Some(mut value), Some(to), Some(by)) = (from, to, by) else {
            return;
        };
        if by == 0 {
            self.error(
                "U1040",
                "a loop with a step of 0 does not end",
                span.clone(),
            );
            return;
        }
        let ends = Self::ends_loop(&content.body);
        self.enter_loop(instance, &content.body, span);
        let mut turns = 0_usize;
        loop {
            let is_last = if by > 0 { value > to } else { value < to };
            turns += 1;
            if self.is_full || turns > MAXIMUM_STEPS {
                self.give_up(
                    format!("a loop has more than {MAXIMUM_STEPS} turns"),
                    span.clone(),
                );
                break;
            }
            let turn = |own: &mut Self| {
                let count = Action::SetNumber(counter, Number::Constant(value));
                own.push(count, span.clone(), Vec::new());
                if !is_last {
                    own.begin_turn(span);
                    own.statements(instance, &content.body);
                }
            };
            if ends.any() && turns > 1 {
                let condition = self.still_here(ends);
                self.under(condition, span, turn);
            } else {
                turn(self);
            }
            if is_last {
                break;
            }
            value = value.saturating_add(by);
        }
        self.leave_loop();
    }

    fn assign(&mut self, instance: usize, target: &Path, value: &Expression, span: Range<usize>) {
        let found = self.look_up(instance, target);
        let value_span = value.span.clone();
        let value = self.expression(instance, value);
        if let Some(found) = found {
            self.store(
                &found,
                &target.text(),
                &target.span,
                value,
                value_span,
                span,
            );
        }
    }

    /// Assigns a value to the variable of a name.
    pub(super) fn store(
        &mut self,
        target: &Entity,
        name: &str,
        name_span: &Range<usize>,
        value: Value,
        value_span: Range<usize>,
        span: Range<usize>,
    ) {
        let message = match target {
            Entity::Cell(cell) => {
                let (cell, role, kind) = (
                    *cell,
                    self.program.cells[*cell].role,
                    self.program.cells[*cell].kind,
                );
                match role {
                    Role::Input => format!("`{name}` is an input, and cannot be assigned"),
                    Role::Pin | Role::Held => {
                        format!("`{name}` is an output of a block, and cannot be assigned")
                    }
                    Role::Output | Role::Memory | Role::Passing => {
                        self.store_cell(cell, kind, value, value_span, span);
                        return;
                    }
                }
            }
            Entity::Broken => return,
            Entity::Time(_) => {
                let finding = Diagnostic::error(
                    "U1045",
                    format!("the time `{name}` cannot be assigned"),
                    name_span.clone(),
                );
                self.say(finding.with_help(
                    "a time is given where it is declared, or in the one call of its block",
                ));
                return;
            }
            Entity::Truth(_) | Entity::Number(_) => {
                format!("`{name}` is a constant, and cannot be assigned")
            }
            Entity::Instance(_) | Entity::Counter(_) => format!("`{name}` cannot be assigned"),
        };
        self.error("U1044", message, name_span.clone());
    }

    fn store_cell(
        &mut self,
        cell: usize,
        kind: Kind,
        value: Value,
        value_span: Range<usize>,
        span: Range<usize>,
    ) {
        let action = match (kind, value) {
            (_, Value::Error) => return,
            (Kind::Truth, Value::Truth(truth)) => Action::SetTruth(cell, truth),
            (Kind::Truth, Value::Number(Number::Constant(value @ (0 | 1)))) => {
                Action::SetTruth(cell, Truth::Constant(value == 1))
            }
            (Kind::Number { .. }, Value::Number(number)) => Action::SetNumber(cell, number),
            (kind, _) => {
                let wanted = if kind == Kind::Truth {
                    "a Boolean"
                } else {
                    "a number"
                };
                let message = format!("{wanted} is expected, and this is something else");
                self.error("U1043", message, value_span);
                return;
            }
        };
        self.push(action, span, Vec::new());
    }
}
