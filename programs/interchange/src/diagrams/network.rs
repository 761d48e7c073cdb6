//! Straight-line statements as networks of function blocks: each statement is a network, and what only the next statements read of a
//! block is connected to it.
//!
//! The networks say what the statements say: read as a document, they are these statements again.

mod expression;
mod rung;
mod widths;

use std::cell::RefCell;

use understudy_diagram::blocks::{Coil, Input, Kind, Network, Output};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, File, Literal, Operator, Path,
    Statement, StatementKind, Step, TypeKind, TypeName, Unit, UnitKind,
};

use crate::plcopen::typed::make;
use crate::plcopen::typed::values::{Values, unit};

/// Blocks of a network into which another one is taken.
const MAXIMUM_BLOCKS: usize = 24;

/// An output of an object.
type Source = (usize, usize);

/// What statements are drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Function blocks.
    Blocks,
    /// A ladder: BOOLs are contacts and coils, numbers are function blocks.
    Ladder,
}

/// What is drawn of an operator on numbers of fewer than 32 bits, which has more bits than its box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Widths {
    /// The box: it is looked at, not executed.
    Shown,
    /// The expression as it is written, where the box would give another result.
    Exact,
}

/// The networks of a body, in the order in which they are executed.
///
/// # Errors
/// The first statement that no network holds, in words.
pub(crate) fn networks(
    file: &File,
    of: &Unit,
    statements: &[Statement],
    style: Style,
    widths: Widths,
) -> Result<Vec<Network>, String> {
    let mut maker = Maker {
        file,
        unit: of,
        style,
        widths,
        networks: Vec::new(),
        open: Vec::new(),
        taken: RefCell::default(),
    };
    for statement in statements {
        maker.statement(statement)?;
    }
    Ok(maker.networks)
}

/// An instance whose outputs later statements may be connected to.
struct Open {
    network: usize,
    object: usize,
    /// In capitals.
    instance: String,
}

/// What a value comes from.
#[derive(Debug, Clone, Copy)]
struct Value {
    from: Source,
    negated: bool,
    /// A function that was made for it.
    is_function: bool,
}

struct Maker<'a> {
    file: &'a File,
    unit: &'a Unit,
    style: Style,
    widths: Widths,
    networks: Vec<Network>,
    open: Vec<Open>,
    /// Outputs that parts of this statement are connected to.
    taken: RefCell<Vec<Source>>,
}

impl Maker<'_> {
    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        if matches!(statement.kind, StatementKind::Nothing) {
            return Ok(());
        }
        let mut network = Network { comments: statement.comments.clone(), ..Network::default() };
        self.join(statement, &mut network);
        self.taken.borrow_mut().clear();
        let first = network.objects.len();
        let mut source = Some(statement.span.start);
        let instance = match &statement.kind {
            StatementKind::If(_, otherwise) if !otherwise.is_empty() => {
                return Err("IF with ELSE".to_owned());
            }
            StatementKind::If(branches, _) => match branches.as_slice() {
                [(condition, body)] => {
                    if stores(body).is_some() {
                        source = None;
                    } else if let [only] = body.as_slice() {
                        source = Some(only.span.start);
                    }
                    self.guarded(condition, body, &mut network)?
                }
                _ => return Err("IF with ELSIF".to_owned()),
            },
            other => self.simple(other, None, &mut network)?,
        };
        for object in &mut network.objects[first..] {
            object.source = source;
        }
        if let Some((object, instance)) = instance {
            self.open.retain(|open| open.instance != instance);
            self.open.push(Open { network: self.networks.len(), object, instance });
        }
        self.networks.push(network);
        Ok(())
    }

    /// Takes the last networks into this one, where the statement reads the outputs of their blocks.
    fn join(&mut self, statement: &Statement, network: &mut Network) {
        let text = print::statements(std::slice::from_ref(statement)).to_uppercase();
        let networks = &self.networks;
        let reads = |open: &Open| {
            let network = networks.get(open.network);
            let is_last = network.is_some_and(|network| !feeds_a_block(network, open.object));
            is_last && names(&text, &open.instance)
        };
        let first = self.open.iter().filter(|open| reads(open));
        let Some(first) = first.map(|open| open.network).min() else {
            return;
        };
        let all = first..self.networks.len();
        let is_read = |at: usize| {
            let mut open = self.open.iter();
            open.any(|open| open.network == at && reads(open))
        };
        let objects = self.networks[first..].iter();
        let objects: usize = objects.map(|network| network.objects.len()).sum();
        if !all.clone().all(is_read) || objects > MAXIMUM_BLOCKS {
            return;
        }
        let comments = std::mem::take(&mut network.comments);
        for (at, other) in all.zip(self.networks.split_off(first)) {
            let offset = network.objects.len();
            for open in self.open.iter_mut().filter(|open| open.network == at) {
                (open.network, open.object) = (first, open.object + offset);
            }
            network.comments.extend(other.comments);
            for mut object in other.objects {
                for input in &mut object.inputs {
                    input.from = input.from.map(|(from, output)| (from + offset, output));
                }
                network.objects.push(object);
            }
        }
        network.comments.extend(comments);
    }

    /// A statement that is done under a condition.
    fn guarded(
        &mut self,
        condition: &Expression,
        body: &[Statement],
        network: &mut Network,
    ) -> Result<Option<(usize, String)>, String> {
        let [only] = body else {
            return Err("IF with several statements".to_owned());
        };
        network.comments.extend(only.comments.iter().cloned());
        if let Some((path, sets)) = stores(body) {
            if self.is_power(&make::read(path.clone())) {
                let from = self.power(condition, network);
                let kind = if sets { Coil::Set } else { Coil::Reset };
                network.coil(print_path(path), kind, from);
                return Ok(None);
            }
            // Set and reset, in the one form that all tools execute alike.
            let own = make::read(path.clone());
            let (operator, condition) = match sets {
                true => (Operator::Or, condition.clone()),
                false => (Operator::And, make::not(condition.clone())),
            };
            let value = make::chain(vec![own, condition], operator, &only.span);
            let assign = StatementKind::Assign(path.clone(), value);
            return self.simple(&assign, None, network);
        }
        let enable = self.source(condition, network);
        self.simple(&only.kind, Some(enable), network)
    }

    /// A statement; the instance that it calls.
    fn simple(
        &mut self,
        statement: &StatementKind,
        enable: Option<Value>,
        network: &mut Network,
    ) -> Result<Option<(usize, String)>, String> {
        match statement {
            StatementKind::Assign(path, value) => {
                if enable.is_some() && does_more(self.file, value) {
                    return Err("a function of the file under a condition".to_owned());
                }
                if enable.is_none() && self.is_power(&make::read(path.clone())) {
                    self.coil(path, value, network);
                    return Ok(None);
                }
                let of = self.type_of(&make::read(path.clone()));
                let value = self.stored(value, of.as_ref(), network);
                let from = match enable {
                    Some(enable) => enabled(value, enable, network),
                    None if value.negated => {
                        function("NOT", &[Value { negated: false, ..value }], network)
                    }
                    None => value.from,
                };
                network.target(print_path(path), from);
                Ok(None)
            }
            StatementKind::Call(path, arguments) => self.call(path, arguments, enable, network),
            StatementKind::If(..) => Err("IF within IF".to_owned()),
            StatementKind::Case(..) => Err("CASE".to_owned()),
            StatementKind::For(_) | StatementKind::While(..) | StatementKind::Repeat(..) => {
                Err("a loop or a jump".to_owned())
            }
            StatementKind::Exit | StatementKind::Continue | StatementKind::Return => {
                Err("a jump or RETURN".to_owned())
            }
            StatementKind::Code(_) => Err("C code".to_owned()),
            StatementKind::Nothing => Ok(None),
        }
    }

    /// A call of a function block.
    fn call(
        &mut self,
        path: &Path,
        arguments: &[Argument],
        enable: Option<Value>,
        network: &mut Network,
    ) -> Result<Option<(usize, String)>, String> {
        let of = self.type_of(&make::read(path.clone()));
        let called = match &of {
            Some(TypeKind::Named(of)) => unit(self.file, of.as_str()),
            _ => None,
        };
        let name = print_path(path);
        let Some(called) = called.filter(|called| called.kind == UnitKind::FunctionBlock) else {
            return Err(format!("the call `{name}`, which is not of a function block"));
        };
        let pins = self.pins(called, arguments, &name)?;
        let takes = arguments.iter().any(|it| matches!(it, Argument::Taken { .. }));
        if takes && enable.is_some() {
            return Err("a block with `=>` under a condition".to_owned());
        }
        let mut inputs = Vec::new();
        inputs.extend(enable.map(|enable| pin("EN", enable)));
        for (name, value) in pins {
            let mut declared = called.declarations.iter();
            let of = declared.find(|it| it.name.is(name)).map(|it| self.resolved(&it.of));
            let value = self.stored(value, of.as_ref(), network);
            inputs.push(pin(name, value));
        }
        let kind = Kind::Block { of: called.name.to_string(), instance: Some(name.clone()) };
        let mut outputs = Vec::new();
        outputs.extend(enable.map(|_| output("ENO")));
        outputs.extend(
            of_class(called, &[Class::Output, Class::InOut]).map(|it| output(it.name.as_str())),
        );
        let object = network.add(kind, inputs, outputs);
        for argument in arguments {
            if let Argument::Taken { from, to, negated } = argument {
                let outputs = &network.objects[object].outputs;
                let place = outputs.iter().position(|output| from.is(&output.name));
                let Some(place) = place.filter(|place| is_free(network, (object, *place))) else {
                    return Err(format!("the output `{from}` of `{name}`"));
                };
                let value = Value { from: (object, place), negated: false, is_function: false };
                let from = if *negated { function("NOT", &[value], network) } else { value.from };
                network.target(print_path(to), from);
            }
        }
        // With EN, an output is what it was where the block is not executed.
        Ok(Some((object, name.to_uppercase())))
    }

    /// The type of a value, where something in it has one.
    fn type_of(&self, value: &Expression) -> Option<TypeKind> {
        self.values().strong(value).map(|of| of.kind)
    }

    fn values(&self) -> Values<'_> {
        Values { file: self.file, declarations: &self.unit.declarations, made: &[] }
    }

    fn resolved(&self, of: &TypeName) -> TypeKind {
        self.values().resolved(of.clone()).kind
    }

    /// Whether boxes would give another result than a value that is stored as a type, or is used at once.
    fn is_narrower(&self, value: &Expression, stored: Option<&TypeKind>) -> bool {
        self.widths == Widths::Exact && widths::is_narrower(self.file, self.unit, value, stored)
    }

    /// What a value comes from that is stored as a type.
    fn stored(&self, value: &Expression, of: Option<&TypeKind>, network: &mut Network) -> Value {
        let of = of.map(|of| self.resolved(&TypeName { kind: of.clone(), span: 0..0 }));
        match self.is_bool(of.as_ref()) || !self.is_narrower(value, of.as_ref()) {
            true => self.source(value, network),
            false => expression::written(value, network),
        }
    }

    fn is_bool(&self, of: Option<&TypeKind>) -> bool {
        matches!(of, Some(TypeKind::Named(name)) if name.is("BOOL"))
    }

    /// What is given, by the names of the inputs.
    fn pins<'s>(
        &self,
        called: &'s Unit,
        arguments: &'s [Argument],
        name: &str,
    ) -> Result<Vec<(&'s str, &'s Expression)>, String> {
        let mut by_place = of_class(called, &[Class::Input, Class::InOut]);
        let mut pins = Vec::new();
        for argument in arguments {
            match argument {
                Argument::Given(input, _) if input.is("EN") => {
                    return Err(format!("EN of `{name}`"));
                }
                Argument::Given(input, value) => pins.push((input.as_str(), value)),
                Argument::Placed(value) => match by_place.next() {
                    Some(input) => pins.push((input.name.as_str(), value)),
                    None => return Err(format!("an input too many of `{name}`")),
                },
                Argument::Taken { from, .. } if from.is("ENO") => {
                    return Err(format!("ENO of `{name}`"));
                }
                Argument::Taken { .. } => {}
            }
        }
        Ok(pins)
    }
}

/// The variable that a body sets or resets, and nothing more.
fn stores(body: &[Statement]) -> Option<(&Path, bool)> {
    let [only] = body else { return None };
    let StatementKind::Assign(path, value) = &only.kind else {
        return None;
    };
    let ExpressionKind::Literal(Literal::Boolean(sets)) = value.kind else {
        return None;
    };
    let has_index = path.steps.iter().any(|step| matches!(step, Step::Index(_)));
    (!has_index).then_some((path, sets))
}

/// The variables of some classes.
fn of_class<'u>(unit: &'u Unit, classes: &'u [Class]) -> impl Iterator<Item = &'u Declaration> {
    let declarations = unit.declarations.iter();
    declarations.filter(move |declaration| classes.contains(&declaration.class))
}

/// Whether a part of the instance is named in a text in capitals.
fn names(text: &str, instance: &str) -> bool {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == '.';
    text.match_indices(instance).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        text[at + instance.len()..].starts_with('.') && !before.is_some_and(is_part)
    })
}

/// Whether a block is connected to an object.
fn feeds_a_block(network: &Network, object: usize) -> bool {
    let blocks = network.objects.iter();
    let blocks = blocks.filter(|other| matches!(other.kind, Kind::Block { .. }));
    let mut inputs = blocks.flat_map(|other| &other.inputs);
    inputs.any(|input| input.from.is_some_and(|(from, _)| from == object))
}

/// Whether nothing is connected to an output.
fn is_free(network: &Network, output: Source) -> bool {
    let inputs = network.objects.iter().flat_map(|object| &object.inputs);
    inputs.filter_map(|input| input.from).all(|from| from != output)
}

/// Whether an expression calls a function that may do more than answer.
fn does_more(file: &File, value: &Expression) -> bool {
    let within = |value: &Expression| does_more(file, value);
    match &value.kind {
        ExpressionKind::Call(path, arguments) => {
            let own = unit(file, path.root.as_str());
            let given = |argument: &Argument| match argument {
                Argument::Placed(value) | Argument::Given(_, value) => within(value),
                Argument::Taken { .. } => true,
            };
            own.is_some() || !path.steps.is_empty() || arguments.iter().any(given)
        }
        ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => within(inner),
        ExpressionKind::Chain(first, rest) => {
            within(first) || rest.iter().any(|(_, value)| within(value))
        }
        _ => false,
    }
}

fn pin(name: &str, value: Value) -> Input {
    Input { name: name.to_owned(), negated: value.negated, from: Some(value.from) }
}

fn output(name: &str) -> Output {
    Output { name: name.to_owned(), value: None }
}

/// A standard function whose inputs are known by their places.
fn function(name: &str, values: &[Value], network: &mut Network) -> Source {
    let names = understudy_structured_text::input_names(name, values.len());
    let inputs = names.iter().zip(values).map(|(name, value)| pin(name, *value));
    let inputs = inputs.collect();
    let kind = Kind::Block { of: name.to_owned(), instance: None };
    (network.add(kind, inputs, vec![output("OUT")]), 0)
}

/// A value that is taken only with the power at EN of its function.
fn enabled(value: Value, enable: Value, network: &mut Network) -> Source {
    let (object, output_of) = match (value.is_function, value.negated) {
        (true, false) => value.from,
        (_, true) => function("NOT", &[Value { negated: false, ..value }], network),
        (false, false) => function("MOVE", &[value], network),
    };
    let shown = &mut network.objects[object];
    shown.inputs.insert(0, pin("EN", enable));
    shown.outputs.insert(0, output("ENO"));
    (object, output_of + 1)
}

fn print_path(path: &Path) -> String {
    print::expression(&make::read(path.clone()))
}
