//! Calls of function blocks, functions and methods.

use std::rc::Rc;

use understudy_typed::{
    Argument as Given, Branch, Call, Elementary, Expression, ExpressionKind, Place, Root,
    Statement, StatementKind, Type,
};

use crate::syntax::{self, Argument, Class, Name, Path, Span, Step, UnitKind};

use super::Lowering;
use super::blocks::{Key, Parameter, Routine};
use super::fold::{choose, not};
use super::names::{Owner, Symbol, number};
use super::numbers::Operand;
use super::places::{Target, load, place, shown};

/// What is called.
pub(super) enum Callee {
    /// The body of a block on an instance.
    Block(Target, usize),
    /// A method on an instance, which is of this block; none for the one on which the body runs.
    Method(Option<Target>, usize, Owner),
    Function(usize),
    Standard(String),
}

/// The arguments of a call by its parameters.
pub(super) struct Bound<'s> {
    /// In the order of the call.
    pub(super) given: Vec<(usize, &'s syntax::Expression)>,
    /// Outputs, where they go, and whether they are negated.
    pub(super) taken: Vec<(usize, &'s Path, bool)>,
    /// EN
    pub(super) enable: Option<&'s syntax::Expression>,
    /// ENO
    pub(super) enabled: Option<&'s Path>,
}

impl<'a> Lowering<'a> {
    /// What a call calls; `None` where an error is reported.
    pub(super) fn callee(&mut self, path: &Path) -> Option<Callee> {
        match path.steps.as_slice() {
            [] => self.named_callee(&path.root),
            [Step::Follow] if path.root.is("SUPER") || path.root.is("THIS") => {
                let own = self.own_block(&path.root)?;
                let unit = self.scope.unit?;
                let unit = match path.root.is("SUPER") {
                    true => self.base_or_error(unit, &path.root)?,
                    false => unit,
                };
                Some(Callee::Block(own, unit))
            }
            [.., Step::Field(name)] => self.part_callee(path, name),
            _ => self.instance(path),
        }
    }

    fn base_or_error(&mut self, unit: usize, word: &Name) -> Option<usize> {
        let base = self.base_of(unit);
        if base.is_none() {
            let message = format!("`{word}` stands in a block that extends none");
            self.error("U1041", message, word.span());
        }
        base
    }

    fn named_callee(&mut self, name: &Name) -> Option<Callee> {
        let key = name.key();
        let symbol = self.lookup(name);
        let is_result = self.owner().is_some_and(|owner| {
            let unit = self.unit_of(owner);
            unit.result.is_some() && unit.name.is(&key)
        });
        if let (Some(symbol), false) = (&symbol, is_result) {
            return match symbol {
                Symbol::Faulty => None,
                _ => self.instance(&Path {
                    root: name.clone(),
                    steps: Vec::new(),
                    span: name.span(),
                }),
            };
        }
        if let Some(class) = self.scope.class
            && let Some(method) = self.method(class, &key)
        {
            return Some(Callee::Method(None, class, method));
        }
        let unit = self.unit_names.get(&key).copied();
        let is_own = |unit: &usize| !self.units[*unit].is_library;
        if let Some(unit) = unit.filter(is_own) {
            return self.unit_callee(unit, name);
        }
        if super::standard::is_standard(&key) {
            return Some(Callee::Standard(key));
        }
        if let Some(unit) = unit {
            return self.unit_callee(unit, name);
        }
        let units = self.units.iter();
        let known = units.filter(|entry| entry.unit.kind == UnitKind::Function);
        let known = known.map(|entry| entry.unit.name.as_str());
        let known = known.chain(super::standard::NAMES.iter().copied());
        let help = understudy_text::spelling::question(name.as_str(), known).unwrap_or_else(|| {
            "declare it with FUNCTION, or an instance of a block with VAR".into()
        });
        let message = format!("`{name}` is neither a function nor an instance of a block");
        self.error_with("U1041", message, name.span(), help);
        None
    }

    fn unit_callee(&mut self, unit: usize, name: &Name) -> Option<Callee> {
        match self.units[unit].unit.kind {
            UnitKind::Function => Some(Callee::Function(unit)),
            UnitKind::FunctionBlock => {
                let message = format!("`{name}` is a block, and is called through an instance");
                let help = format!(
                    "declare one, such as `VAR my_{0} : {name}; END_VAR`, and call it",
                    name.as_str().to_lowercase()
                );
                self.error_with("U1049", message, name.span(), help);
                None
            }
            _ => {
                let message = format!("the PROGRAM `{name}` cannot be called");
                let help = "write a FUNCTION_BLOCK in its place";
                self.error_with("U1040", message, name.span(), help);
                None
            }
        }
    }

    /// `a.b(…)`: an instance in a structure, or a method.
    fn part_callee(&mut self, path: &Path, name: &Name) -> Option<Callee> {
        let prefix = Path {
            root: path.root.clone(),
            steps: path.steps[..path.steps.len() - 1].to_vec(),
            span: path.span.clone(),
        };
        let is_super =
            prefix.root.is("SUPER") && matches!(prefix.steps.as_slice(), [] | [Step::Follow]);
        if is_super {
            self.own_block(&prefix.root)?;
            let unit = self.scope.unit?;
            let base = self.base_or_error(unit, &prefix.root)?;
            let class = self.scope.class?;
            if let Some(method) = self.method(base, &name.key()) {
                return Some(Callee::Method(None, class, method));
            }
            return self.no_method(base, name);
        }
        let is_global_list = prefix.steps.is_empty()
            && !prefix.root.is("THIS")
            && self.lookup(&prefix.root).is_none();
        if is_global_list {
            if let Some(Symbol::Variable(_)) = self.global(&name.key()) {
                return self.instance(path);
            }
            // A namespace, or a library, may stand in front.
            return self.named_callee(name);
        }
        let target = self.target(&prefix)?;
        if let Type::Structure(id, _) = target.of() {
            let info = self.structures[id.0 as usize].clone();
            if let Some(unit) = info.unit
                && !info.fields.contains_key(&name.key())
            {
                return match self.method(unit, &name.key()) {
                    Some(method) => Some(Callee::Method(Some(target), unit, method)),
                    None => self.no_method(unit, name),
                };
            }
        }
        self.instance(path)
    }

    fn no_method<T>(&mut self, unit: usize, name: &Name) -> Option<T> {
        let found = self.units[unit].unit;
        let methods = found.methods.iter().map(|method| method.name.as_str());
        let help = understudy_text::spelling::suggestion(name.as_str(), methods);
        let message = format!("`{}` has no method `{name}`", found.name);
        self.error_with("U1041", message, name.span(), help);
        None
    }

    /// A method of a block or of one that it extends.
    pub(super) fn method(&self, class: usize, key: &str) -> Option<Owner> {
        let mut unit = class;
        for _ in 0..=self.units.len() {
            let methods = &self.units[unit].unit.methods;
            if let Some(at) = methods.iter().position(|method| method.name.is(key)) {
                return Some(Owner {
                    unit,
                    method: Some(at),
                });
            }
            unit = self.base_of(unit)?;
        }
        None
    }

    fn instance(&mut self, path: &Path) -> Option<Callee> {
        let target = self.target(path)?;
        if let Type::Structure(id, _) = target.of()
            && let Some(unit) = self.structures[id.0 as usize].unit
        {
            return Some(Callee::Block(target, unit));
        }
        let found = self.describe(&target.of());
        let message = format!("`{}` is called, and is {found}", shown(path));
        let help = "call an instance of a function block, or remove the brackets";
        self.error_with("U1049", message, path.span.clone(), help);
        None
    }

    /// Finds the parameter of each argument.
    pub(super) fn bind<'s>(
        &mut self,
        name: &str,
        parameters: &[Parameter],
        arguments: &'s [Argument],
        span: &Span,
    ) -> Option<Bound<'s>> {
        let mut bound = Bound {
            given: Vec::new(),
            taken: Vec::new(),
            enable: None,
            enabled: None,
        };
        let inputs = |class: Class| matches!(class, Class::Input | Class::InOut);
        let indices = 0..parameters.len();
        let mut order: Vec<usize> = indices
            .clone()
            .filter(|at| inputs(parameters[*at].class))
            .collect();
        let places = order.len();
        order.extend(indices.filter(|at| !inputs(parameters[*at].class)));
        let find = |name: &Name| parameters.iter().position(|found| name.is(&found.name));
        let mut placed = 0;
        let mut is_whole = true;
        for argument in arguments {
            match argument {
                Argument::Placed(value) => {
                    let at = order.get(placed).copied();
                    placed += 1;
                    match (at, &value.kind) {
                        (Some(at), _) if placed <= places => bound.given.push((at, value)),
                        (Some(at), syntax::ExpressionKind::Variable(path)) => {
                            bound.taken.push((at, path, false));
                        }
                        _ => {
                            let message = format!(
                                "`{name}` has {places} inputs, and this is the {placed}th value"
                            );
                            self.wrong_call(message, parameters, &value.span);
                            return None;
                        }
                    }
                }
                Argument::Given(input, value) => match find(input) {
                    Some(at) if inputs(parameters[at].class) => bound.given.push((at, value)),
                    Some(_) => {
                        let message = format!("`{input}` is an output of `{name}`");
                        let help = format!("write `{input} => variable`");
                        self.error_with("U1049", message, input.span(), help);
                        is_whole = false;
                    }
                    None if input.is("EN") => bound.enable = Some(value),
                    None => {
                        let message = format!("`{name}` has no input `{input}`");
                        self.wrong_call(message, parameters, &input.span());
                        is_whole = false;
                    }
                },
                Argument::Taken { from, to, negated } => match find(from) {
                    Some(at) => bound.taken.push((at, to, *negated)),
                    None if from.is("ENO") => bound.enabled = Some(to),
                    None => {
                        let message = format!("`{name}` has no output `{from}`");
                        self.wrong_call(message, parameters, &from.span());
                        is_whole = false;
                    }
                },
            }
        }
        let mut seen = vec![false; parameters.len()];
        for (at, value) in &bound.given {
            if std::mem::replace(&mut seen[*at], true) {
                let message = format!("`{}` is given twice", parameters[*at].name);
                self.error("U1049", message, value.span.clone());
                is_whole = false;
            }
        }
        for (at, parameter) in parameters.iter().enumerate() {
            if parameter.class == Class::InOut && !seen[at] && is_whole {
                let message = format!(
                    "`{}` of `{name}` is a VAR_IN_OUT, and is given no variable",
                    parameter.name
                );
                let help = format!("write `{} := variable`", parameter.name);
                self.error_with("U1049", message, span.clone(), help);
                is_whole = false;
            }
        }
        is_whole.then_some(bound)
    }

    fn wrong_call(&mut self, message: String, parameters: &[Parameter], span: &Span) {
        let names: Vec<&str> = parameters.iter().map(|found| found.name.as_str()).collect();
        let help = match names.is_empty() {
            true => "it has no inputs and no outputs".to_owned(),
            false => format!("its inputs and outputs: {}", names.join(", ")),
        };
        self.error_with("U1049", message, span.clone(), help);
    }

    /// Gives a parameter the types that a call has for those of open bounds.
    fn open_types(&mut self, parameters: &[Parameter], bound: &Bound<'_>) -> Option<Vec<Type>> {
        let mut open = Vec::new();
        for (at, parameter) in parameters.iter().enumerate() {
            if !parameter.is_open {
                continue;
            }
            let given = bound.given.iter().find(|(found, _)| *found == at);
            let Some((_, value)) = given else {
                open.push(parameter.of.clone());
                continue;
            };
            self.silent += 1;
            let found = self.typed(value, Some(&parameter.of));
            self.silent -= 1;
            let found = found.map(|value| value.of);
            let fits = match (&found, &parameter.of) {
                (Some(Type::Array(found)), Type::Array(wanted)) => {
                    found.ranges.len() == wanted.ranges.len() && found.element == wanted.element
                }
                (Some(Type::Text(_)), Type::Text(_)) => true,
                (None, _) => true,
                _ => false,
            };
            match found.filter(|_| fits) {
                Some(of) => open.push(of),
                None => open.push(parameter.of.clone()),
            }
        }
        Some(open)
    }

    fn called(&mut self, routine: &Routine, span: &Span) {
        let caller = self.scope.routine as usize;
        if self.scope.symbols.is_some()
            && let Some(calls) = self.calls.get_mut(caller)
            && !calls.iter().any(|(known, _)| *known == routine.id.0)
        {
            calls.push((routine.id.0, span.clone()));
        }
    }

    /// The variable that a VAR_IN_OUT is to stand for.
    fn referenced(&mut self, value: &syntax::Expression, parameter: &Parameter) -> Option<Place> {
        let syntax::ExpressionKind::Variable(path) = &value.kind else {
            let message = format!("`{}` is a VAR_IN_OUT and needs a variable", parameter.name);
            let help = "assign the value to a variable, and give that";
            self.error_with("U1049", message, value.span.clone(), help);
            return None;
        };
        let target = self.target(path)?;
        self.writable(&target, path)?;
        if target.bits.is_some() {
            let message = format!(
                "`{}` is a VAR_IN_OUT, and a bit of a word is no variable",
                parameter.name
            );
            self.error("U1049", message, value.span.clone());
            return None;
        }
        if target.place.of != parameter.of {
            let found = self.describe(&target.place.of);
            let wanted = self.describe(&parameter.of);
            let message = format!(
                "`{}` is a VAR_IN_OUT of {wanted}, and is given {found}",
                parameter.name
            );
            let help = "give a variable of exactly that type";
            self.error_with("U1043", message, value.span.clone(), help);
            return None;
        }
        Some(target.place)
    }

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
                let value = self.settle(value, None);
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
            callee => self
                .routine_call(callee, arguments, span)
                .map(|(call, enable, enabled)| {
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
            kind: StatementKind::If(
                vec![Branch {
                    condition,
                    body: statements,
                }],
                Vec::new(),
            ),
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
            let kind = self.store(target, value);
            body.push(Statement { line, kind });
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
        let block = self.block(unit, span)?;
        let name = self.units[unit].unit.name.as_str();
        let bound = self.bind(name, &block.parameters, arguments, span)?;
        let open = self.open_types(&block.parameters, &bound)?;
        let owner = Owner { unit, method: None };
        let is_own = matches!(instance.place.root, Root::Own(0)) && instance.place.offset == 0;
        let class = match self.scope.class.filter(|_| is_own) {
            Some(class) if self.is_part_of(class, unit) => class,
            _ => unit,
        };
        let key = Key {
            owner,
            class: Some(class),
            open,
        };
        let routine = self.routine(key, span)?;
        self.called(&routine, span);
        for (at, value) in &bound.given {
            let parameter = &routine.parameters[*at];
            let to = instance.part(parameter.slot, &parameter.of);
            let kind = if parameter.class == Class::InOut {
                self.referenced(value, parameter)
                    .map(|from| StatementKind::Bind(to, from))
            } else {
                self.expression(value, &parameter.of)
                    .map(|value| StatementKind::Assign(to, value))
            };
            body.extend(kind.map(|kind| Statement { line, kind }));
        }
        body.push(Statement {
            line,
            kind: StatementKind::Invoke(routine.id, instance.place.clone()),
        });
        for (at, path, negated) in &bound.taken {
            let parameter = &routine.parameters[*at];
            let value = load(instance.part(parameter.slot, &parameter.of));
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

    fn take_output(
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
        Some(self.store(target, value))
    }

    /// A call of a function or method, with its EN and ENO.
    #[expect(clippy::type_complexity, reason = "EN and ENO of the call")]
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
        let plain = Key {
            owner,
            class,
            open: Vec::new(),
        };
        let name = self.unit_of(owner).name.as_str();
        let parameters = self.declared_parameters(&plain, span)?;
        let bound = self.bind(name, &parameters, arguments, span)?;
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
            let to = place(Root::Frame(parameter.slot), parameter.of.clone());
            if parameter.class == Class::InOut {
                let from = self.referenced(value, parameter)?;
                call.arguments.push(Given::Reference(to, from));
            } else {
                let value = self.expression(value, &parameter.of)?;
                call.arguments.push(Given::Value(to, value));
            }
        }
        for (at, path, negated) in &bound.taken {
            let parameter = &routine.parameters[*at];
            let target = self.target(path)?;
            self.writable(&target, path)?;
            let are_texts = matches!(
                (&target.place.of, &parameter.of),
                (Type::Text(_), Type::Text(_))
            );
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
            let from = place(Root::Frame(parameter.slot), parameter.of.clone());
            call.outputs.push((from, target.place));
        }
        Some((call, bound.enable, bound.enabled))
    }

    /// The parameters of a function or method, whose open ones have no bounds yet.
    fn declared_parameters(&mut self, key: &Key, span: &Span) -> Option<Rc<[Parameter]>> {
        if let Some(routine) = self.routines.get(key) {
            return Some(Rc::from(routine.parameters.as_slice()));
        }
        let unit = self.unit_of(key.owner);
        let is_open = |found: &syntax::Declaration| match found.class {
            Class::InOut => matches!(
                found.of.kind,
                syntax::TypeKind::OpenArray(..) | syntax::TypeKind::Text { .. }
            ),
            Class::Input => matches!(found.of.kind, syntax::TypeKind::OpenArray(..)),
            _ => false,
        };
        if !unit.declarations.iter().any(is_open) {
            let routine = self.routine(key.clone(), span)?;
            return Some(Rc::from(routine.parameters.as_slice()));
        }
        let outside = self.leave_unit();
        self.scope.unit = Some(key.owner.unit);
        self.scope.method = key.owner.method;
        let parameters = self.deeper(span, |own| {
            let mut parameters = Vec::new();
            for declaration in &unit.declarations {
                if !matches!(
                    declaration.class,
                    Class::Input | Class::Output | Class::InOut
                ) {
                    continue;
                }
                let (resolved, _) = own.reference_type(&declaration.of)?;
                parameters.push(Parameter {
                    name: declaration.name.as_str().to_owned(),
                    class: declaration.class,
                    of: resolved.of,
                    slot: 0,
                    is_open: is_open(declaration),
                });
            }
            Some(parameters)
        });
        self.scope = outside;
        Some(Rc::from(parameters?))
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
            return self.standard(&key, arguments, hint, span);
        }
        if self.scope.symbols.is_none() {
            let message = "a call of a function is not known when the program is read";
            self.error("U1082", message, span.clone());
            return Operand::Faulty;
        }
        if let Callee::Block(..) = callee {
            let message = format!("`{}` is a block: it has no value of its own", shown(path));
            let help = format!(
                "call it as a statement, and read an output, such as `{}.Q`",
                shown(path)
            );
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
        let value = Expression {
            of: of.clone(),
            kind: ExpressionKind::Call(Box::new(call)),
        };
        self.permitted(value, enable)
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
            self.error(
                "U1040",
                "EN is for results without parts",
                enable.span.clone(),
            );
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
        let statements = assigned.map(|kind| Statement { line, kind });
        self.enabled(
            (enable, enabled),
            statements.into_iter().collect(),
            line,
            body,
        );
    }
}
