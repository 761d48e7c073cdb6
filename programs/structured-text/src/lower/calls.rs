//! Calls of function blocks, functions and methods.

use understudy_typed::{
    Argument as Given, Branch, Call, Elementary, Expression, ExpressionKind, Root, Statement,
    StatementKind, Type,
};

use crate::syntax::{self, Argument, Class, Path, Span};

use super::Lowering;
use super::blocks::Key;
use super::callees::Callee;
use super::fold::{choose, not};
use super::names::{Owner, number};
use super::numbers::Operand;
use super::places::{Target, load, place, shown};

/// A call of a function counts as so many operators around each other.
const CALL: usize = 4;

impl Lowering<'_> {
    /// A call as a statement.
    pub(super) fn call_statement(
        &mut self,
        path: &Path,
        arguments: &[Argument],
        span: &Span,
        line: u32,
        body: &mut Vec<Statement>,
    ) {
        let Some(callee) = self.callee(path) else {
            return;
        };
        let mut statements = Vec::new();
        let control = match callee {
            Callee::Block(instance, unit) => {
                self.invoke(instance, unit, arguments, span, line, &mut statements)
            }
            Callee::Standard(key) => {
                let value = self.standard(&key, arguments, None, span);
                let value = self.settle(value, None, span);
                if value.is_some() {
                    let message = format!("the result of {key} is not used");
                    self.warn(
                        "U1023",
                        message,
                        span.clone(),
                        "assign it to a variable, or remove the call",
                    );
                }
                None
            }
            callee => self.routine_call(callee, arguments, span).map(|(call, enable, enabled)| {
                let of = Type::Elementary(Elementary::Bool);
                let of = call.result.as_ref().map_or(of, |result| result.of.clone());
                let kind = ExpressionKind::Call(Box::new(call));
                statements.push(Statement {
                    line,
                    kind: StatementKind::Evaluate(Expression { of, kind }),
                });
                (enable, enabled)
            }),
        };
        match control {
            Some(control) => self.enabled(control, statements, line, body),
            None => body.extend(statements),
        }
    }

    /// Statements that EN permits, and ENO.
    fn enabled(
        &mut self,
        (enable, enabled): (Option<&syntax::Expression>, Option<&Path>),
        statements: Vec<Statement>,
        line: u32,
        body: &mut Vec<Statement>,
    ) {
        let Some(enable) = enable else {
            body.extend(statements);
            if let Some(path) = enabled {
                self.set_enabled(path, super::fold::boolean(true), line, body);
            }
            return;
        };
        let Some(condition) = self.condition(enable) else {
            return;
        };
        if let Some(path) = enabled {
            self.set_enabled(path, condition.clone(), line, body);
        }
        body.push(Statement {
            line,
            kind: StatementKind::If(vec![Branch { condition, body: statements }], Vec::new()),
        });
    }

    fn set_enabled(
        &mut self,
        path: &Path,
        value: Expression,
        line: u32,
        body: &mut Vec<Statement>,
    ) {
        let Some(target) = self.target(path) else {
            return;
        };
        if self.writable(&target, path).is_none() {
            return;
        }
        let of = target.of();
        if let Some(value) = self.coerce(Operand::Typed(value), &of, &path.span) {
            let kind = self.store(target, value, &path.span);
            body.extend(kind.map(|kind| Statement { line, kind }));
        }
    }

    fn invoke<'s>(
        &mut self,
        instance: Target,
        unit: usize,
        arguments: &'s [Argument],
        span: &Span,
        line: u32,
        body: &mut Vec<Statement>,
    ) -> Option<(Option<&'s syntax::Expression>, Option<&'s Path>)> {
        let before = self.diagnostics.len();
        let found = self.invoked(instance, unit, arguments, span, line, body);
        if let Some(other) = self.counterpart(unit) {
            for found in self.diagnostics.iter_mut().skip(before) {
                if matches!(found.code, "U1043" | "U1049") {
                    let help = found.help.take().map(|help| format!("{help}; "));
                    found.help = Some(help.unwrap_or_default() + &other);
                }
            }
            self.needs_cycle(unit, arguments, span);
        }
        found
    }

    fn invoked<'s>(
        &mut self,
        instance: Target,
        unit: usize,
        arguments: &'s [Argument],
        span: &Span,
        line: u32,
        body: &mut Vec<Statement>,
    ) -> Option<(Option<&'s syntax::Expression>, Option<&'s Path>)> {
        let block = self.block(unit, span)?;
        let called = self.units[unit].unit;
        let bound = self.bind(
            called.name.as_str(),
            &called.declarations,
            &block.parameters,
            arguments,
            span,
        )?;
        let open = self.open_types(&block.parameters, &bound)?;
        let owner = Owner { unit, method: None };
        let is_own = matches!(instance.place.root, Root::Own(0)) && instance.place.offset == 0;
        let class = match self.scope.class.filter(|_| is_own) {
            Some(class) if self.is_part_of(class, unit) => class,
            _ => unit,
        };
        let key = Key { owner, class: Some(class), open };
        let routine = self.routine(key, span)?;
        self.called(&routine, span);
        for (at, value) in &bound.given {
            let parameter = &routine.parameters[*at];
            let to = instance.part(parameter);
            let kind = if parameter.class == Class::InOut {
                self.referenced(value, parameter).map(|from| StatementKind::Bind(to, from))
            } else {
                self.stored_at(value, &to).map(|value| StatementKind::Assign(to, value))
            };
            body.extend(kind.map(|kind| Statement { line, kind }));
        }
        body.push(Statement {
            line,
            kind: StatementKind::Invoke(routine.id, instance.place.clone()),
        });
        for (at, path, negated) in &bound.taken {
            let parameter = &routine.parameters[*at];
            let value = load(instance.part(parameter));
            let kind = self.take_output(value, path, *negated);
            body.extend(kind.map(|kind| Statement { line, kind }));
        }
        Some((bound.enable, bound.enabled))
    }

    /// Whether a block is another or extends it.
    fn is_part_of(&self, class: usize, unit: usize) -> bool {
        let mut at = Some(class);
        let mut most = self.units.len();
        while let Some(found) = at {
            if found == unit {
                return true;
            }
            if most == 0 {
                return false;
            }
            most -= 1;
            at = self.base_of(found);
        }
        false
    }

    pub(super) fn take_output(
        &mut self,
        value: Expression,
        path: &Path,
        negated: bool,
    ) -> Option<StatementKind> {
        let target = self.target(path)?;
        self.writable(&target, path)?;
        let value = if negated {
            let bool = Type::Elementary(Elementary::Bool);
            not(self.coerce(Operand::Typed(value), &bool, &path.span)?)
        } else {
            value
        };
        let of = target.of();
        let value = self.coerce(Operand::Typed(value), &of, &path.span)?;
        self.store(target, value, &path.span)
    }

    /// A call of a function or method, with its EN and ENO.
    fn routine_call<'s>(
        &mut self,
        callee: Callee,
        arguments: &'s [Argument],
        span: &Span,
    ) -> Option<(Call, Option<&'s syntax::Expression>, Option<&'s Path>)> {
        let (owner, class, own) = match callee {
            Callee::Function(unit) => (Owner { unit, method: None }, None, None),
            Callee::Method(target, class, owner) => {
                let own = match target {
                    Some(target) => target.place,
                    None => {
                        let block = self.block(class, span)?;
                        place(Root::Own(0), block.of.clone())
                    }
                };
                (owner, Some(class), Some(own))
            }
            Callee::Block(..) | Callee::Standard(_) => return None,
        };
        let plain = Key { owner, class, open: Vec::new() };
        let called = self.unit_of(owner);
        let parameters = self.declared_parameters(&plain, span)?;
        let bound =
            self.bind(called.name.as_str(), &called.declarations, &parameters, arguments, span)?;
        let open = self.open_types(&parameters, &bound)?;
        let routine = self.routine(Key { open, ..plain }, span)?;
        self.called(&routine, span);
        let mut call = Call {
            routine: routine.id,
            own,
            arguments: Vec::with_capacity(bound.given.len()),
            outputs: Vec::new(),
            result: routine.result.clone(),
        };
        for (at, value) in &bound.given {
            let parameter = &routine.parameters[*at];
            let to = parameter.place(Root::Frame(parameter.slot));
            if parameter.class == Class::InOut {
                let from = self.referenced(value, parameter)?;
                call.arguments.push(Given::Reference(to, from));
            } else {
                let value = self.stored_at(value, &to)?;
                call.arguments.push(Given::Value(to, value));
            }
        }
        for (at, path, negated) in &bound.taken {
            let parameter = &routine.parameters[*at];
            let target = self.target(path)?;
            self.writable(&target, path)?;
            let are_texts =
                matches!((&target.place.of, &parameter.of), (Type::Text(_), Type::Text(_)));
            if *negated || target.bits.is_some() || target.place.of != parameter.of && !are_texts {
                let wanted = self.describe(&parameter.of);
                let message = format!(
                    "the output `{}` of a function goes to a variable of {wanted}",
                    parameter.name
                );
                let help = "take it with a variable of that type, and assign that";
                self.error_with("U1043", message, path.span.clone(), help);
                return None;
            }
            let from = parameter.place(Root::Frame(parameter.slot));
            self.within(&load(from.clone()), &target.place, &path.span)?;
            call.outputs.push((from, target.place));
        }
        Some((call, bound.enable, bound.enabled))
    }

    /// A call in an expression.
    pub(super) fn call(
        &mut self,
        path: &Path,
        arguments: &[Argument],
        hint: Option<&Type>,
        span: &Span,
    ) -> Operand {
        let Some(callee) = self.callee(path) else {
            return Operand::Faulty;
        };
        if let Callee::Standard(key) = callee {
            if !self.has_room(CALL, span) {
                return Operand::Faulty;
            }
            self.length += CALL;
            let found = self.standard(&key, arguments, hint, span);
            self.length -= CALL;
            return found;
        }
        if let Some(key) = self.overloaded(&callee, path, arguments, span) {
            return self.standard(&key, arguments, hint, span);
        }
        if self.scope.symbols.is_none() {
            let message = "a call of a function is not known when the program is read";
            self.error("U1082", message, span.clone());
            return Operand::Faulty;
        }
        if let Callee::Block(..) = callee {
            let message = format!("`{}` is a block: it has no value of its own", shown(path));
            let help =
                format!("call it as a statement, and read an output, such as `{}.Q`", shown(path));
            self.error_with("U1049", message, span.clone(), help);
            return Operand::Faulty;
        }
        let found = self.routine_call(callee, arguments, span);
        let Some((call, enable, enabled)) = found else {
            return Operand::Faulty;
        };
        let Some(result) = &call.result else {
            let message = format!("`{}` has no result", shown(path));
            let help = "call it as a statement";
            self.error_with("U1049", message, span.clone(), help);
            return Operand::Faulty;
        };
        if enabled.is_some() {
            let message = "ENO inside an expression is not supported";
            let help = "assign the call to a variable, so that it stands alone";
            self.error_with("U1040", message, span.clone(), help);
            return Operand::Faulty;
        }
        let of = result.of.clone();
        let value = Expression { of: of.clone(), kind: ExpressionKind::Call(Box::new(call)) };
        self.permitted(value, enable)
    }

    /// The standard function that is meant where a function of the file has its name, and not the given inputs.
    fn overloaded(
        &mut self,
        callee: &Callee,
        path: &Path,
        arguments: &[Argument],
        span: &Span,
    ) -> Option<String> {
        let key = path.root.key();
        let Callee::Function(unit) = callee else {
            return None;
        };
        if !path.steps.is_empty() || !super::standard::is_standard(&key) {
            return None;
        }
        self.silent += 1;
        let fits = self.routine_call(Callee::Function(*unit), arguments, span);
        let is_other = fits.is_none() && {
            let value = self.standard(&key, arguments, None, span);
            !matches!(value, Operand::Faulty)
        };
        self.silent -= 1;
        is_other.then_some(key)
    }

    /// A value where EN permits it, else 0.
    pub(super) fn permitted(
        &mut self,
        value: Expression,
        enable: Option<&syntax::Expression>,
    ) -> Operand {
        let Some(enable) = enable else {
            return Operand::Typed(value);
        };
        let Some(condition) = self.condition(enable) else {
            return Operand::Faulty;
        };
        if value.of.elementary().is_none() {
            self.error("U1040", "EN is for results without parts", enable.span.clone());
            return Operand::Faulty;
        }
        let zero = number(value.of.clone(), 0);
        Operand::Typed(choose(condition, value, zero))
    }

    /// Whether the call of a function has EN or ENO, which are not inputs of its own.
    pub(super) fn has_enable(&mut self, path: &Path, arguments: &[Argument]) -> bool {
        let is_enable = |argument: &Argument| match argument {
            Argument::Given(name, _) => name.is("EN"),
            Argument::Taken { from, .. } => from.is("ENO"),
            Argument::Placed(_) => false,
        };
        if !arguments.iter().any(is_enable) || !path.steps.is_empty() {
            return false;
        }
        let unit = self.unit_names.get(&path.root.key());
        let unit = unit.map(|unit| self.units[*unit].unit);
        let declares = |unit: &syntax::Unit| {
            let mut names = unit.declarations.iter().map(|found| &found.name);
            names.any(|name| name.is("EN") || name.is("ENO"))
        };
        !unit.is_some_and(declares)
    }

    /// `y := f(EN := a, …, ENO => b)`: where EN is FALSE, nothing is assigned.
    pub(super) fn enabled_assignment(
        &mut self,
        path: &Path,
        value: &syntax::Expression,
        line: u32,
        body: &mut Vec<Statement>,
    ) {
        let syntax::ExpressionKind::Call(callee, arguments) = &value.kind else {
            return;
        };
        let mut enable = None;
        let mut enabled = None;
        let mut rest = Vec::new();
        for argument in arguments {
            match argument {
                Argument::Given(name, value) if name.is("EN") => enable = Some(value),
                Argument::Taken { from, to, .. } if from.is("ENO") => enabled = Some(to),
                other => rest.push(other.clone()),
            }
        }
        let value = syntax::Expression {
            kind: syntax::ExpressionKind::Call(callee.clone(), rest),
            span: value.span.clone(),
        };
        let assigned = self.assign(path, &value);
        // It is perhaps left out.
        self.facts.forget();
        let statements = assigned.map(|kind| Statement { line, kind });
        self.enabled((enable, enabled), statements.into_iter().collect(), line, body);
    }
}
