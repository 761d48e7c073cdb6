//! The arguments of a call, and the parameters that they are for.

use std::rc::Rc;

use understudy_typed::{Place, Type};

use crate::syntax::{self, Argument, Class, Name, Path, Span};

use super::Lowering;
use super::blocks::{Key, Parameter, Routine};
use super::places::load;

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

impl Lowering<'_> {
    /// Finds the parameter of each argument. Nothing is said of a call whose parameters are not all known, which is reported where they are
    /// declared.
    pub(super) fn bind<'s>(
        &mut self,
        name: &str,
        declarations: &[syntax::Declaration],
        parameters: &[Parameter],
        arguments: &'s [Argument],
        span: &Span,
    ) -> Option<Bound<'s>> {
        let is_unknown = |found: &syntax::Declaration| {
            let is_parameter = matches!(found.class, Class::Input | Class::Output | Class::InOut);
            is_parameter && !parameters.iter().any(|known| found.name.is(&known.name))
        };
        if declarations.iter().any(is_unknown) && self.follows_an_error() {
            return None;
        }
        let mut bound = Bound { given: Vec::new(), taken: Vec::new(), enable: None, enabled: None };
        let inputs = |class: Class| matches!(class, Class::Input | Class::InOut);
        let indices = 0..parameters.len();
        let mut order: Vec<usize> =
            indices.clone().filter(|at| inputs(parameters[*at].class)).collect();
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
                    Some(at) if inputs(parameters[at].class) => {
                        // A value behind it is for the input at its own place in the call.
                        placed += 1;
                        bound.given.push((at, value));
                    }
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
    pub(super) fn open_types(
        &mut self,
        parameters: &[Parameter],
        bound: &Bound<'_>,
    ) -> Option<Vec<Type>> {
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
            let found = self.typed(addressed(value), Some(&parameter.of));
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

    pub(super) fn called(&mut self, routine: &Routine, span: &Span) {
        self.facts.forget();
        let caller = self.scope.routine as usize;
        if self.scope.symbols.is_some()
            && let Some(calls) = self.calls.get_mut(caller)
            && !calls.iter().any(|(known, _)| *known == routine.id.0)
        {
            calls.push((routine.id.0, span.clone()));
        }
    }

    /// The variable that a VAR_IN_OUT is to stand for.
    pub(super) fn referenced(
        &mut self,
        value: &syntax::Expression,
        parameter: &Parameter,
    ) -> Option<Place> {
        let syntax::ExpressionKind::Variable(path) = &addressed(value).kind else {
            let message = format!("`{}` is a VAR_IN_OUT and needs a variable", parameter.name);
            let help = "assign the value to a variable, and give that";
            self.error_with("U1049", message, value.span.clone(), help);
            return None;
        };
        let target = self.target(path)?;
        self.writable(&target, path)?;
        if target.bits.is_some() {
            let message =
                format!("`{}` is a VAR_IN_OUT, and a bit of a word is no variable", parameter.name);
            self.error("U1049", message, value.span.clone());
            return None;
        }
        if target.place.of != parameter.of {
            let found = self.describe(&target.place.of);
            let wanted = self.describe(&parameter.of);
            let message =
                format!("`{}` is a VAR_IN_OUT of {wanted}, and is given {found}", parameter.name);
            let help = "give a variable of exactly that type";
            self.error_with("U1043", message, value.span.clone(), help);
            return None;
        }
        let own = parameter.place(target.place.root);
        self.within(&load(own.clone()), &target.place, &value.span)?;
        self.within(&load(target.place.clone()), &own, &value.span)?;
        Some(target.place)
    }

    /// The parameters of a function or method, whose open ones have no bounds yet.
    pub(super) fn declared_parameters(
        &mut self,
        key: &Key,
        span: &Span,
    ) -> Option<Rc<[Parameter]>> {
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
                if !matches!(declaration.class, Class::Input | Class::Output | Class::InOut) {
                    continue;
                }
                let (resolved, _) = own.reference_type(&declaration.of)?;
                parameters.push(Parameter {
                    name: declaration.name.as_str().to_owned(),
                    class: declaration.class,
                    of: resolved.of,
                    range: resolved.range,
                    slot: 0,
                    is_open: is_open(declaration),
                });
            }
            Some(parameters)
        });
        self.scope = outside;
        Some(Rc::from(parameters?))
    }
}

/// The variable whose address is given: a pointer that is only followed is a VAR_IN_OUT.
fn addressed(value: &syntax::Expression) -> &syntax::Expression {
    match &value.kind {
        syntax::ExpressionKind::Call(path, arguments)
            if path.steps.is_empty() && (path.root.is("ADR") || path.root.is("REF")) =>
        {
            match arguments.as_slice() {
                [Argument::Placed(inner)] => inner,
                _ => value,
            }
        }
        _ => value,
    }
}
