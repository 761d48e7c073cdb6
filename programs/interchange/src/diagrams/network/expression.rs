//! Expressions as functions that are connected to each other.

use understudy_diagram::blocks::{Kind, Network};
use understudy_structured_text::syntax::{
    Argument, Class, Expression, ExpressionKind, Operator, Path, Step, UnitKind,
};
use understudy_structured_text::{input_names, print};

use super::{
    Maker, Source, Value, feeds_a_block, function, is_free, of_class, output, pin, print_path,
};
use crate::plcopen::typed::values::unit;

impl Maker<'_> {
    /// What an expression comes from. What no function does is read as it is written.
    pub(super) fn source(&self, value: &Expression, network: &mut Network) -> Value {
        if let Some(from) = self.rung(value, network) {
            return plain(from);
        }
        self.parts(value, network)
    }

    /// The same, where the value itself is not contacts.
    pub(super) fn parts(&self, value: &Expression, network: &mut Network) -> Value {
        match &value.kind {
            ExpressionKind::Not(inner) => {
                let value = self.source(inner, network);
                Value { negated: !value.negated, ..value }
            }
            ExpressionKind::Variable(path) => match self.connected(path, network) {
                Some(from) => {
                    self.taken.borrow_mut().push(from);
                    plain(from)
                }
                None => written(value, network),
            },
            ExpressionKind::Chain(_, rest)
                if rest.iter().any(|(operator, _)| matches!(operator, Operator::Compare(_)))
                    && self.is_narrower(value, None) =>
            {
                written(value, network)
            }
            ExpressionKind::Call(..) if self.is_narrower(value, None) => written(value, network),
            ExpressionKind::Chain(first, rest)
                if rest.iter().all(|(operator, _)| operator.word().is_some()) =>
            {
                self.chain(first, rest, network)
            }
            ExpressionKind::Call(path, arguments) => self
                .function_call(path, arguments, network)
                .unwrap_or_else(|| written(value, network)),
            _ => written(value, network),
        }
    }

    /// The output of a block in this network that a variable is, where nothing is connected to it.
    pub(super) fn connected(&self, path: &Path, network: &Network) -> Option<Source> {
        let (last, before) = path.steps.split_last()?;
        let Step::Field(pin) = last else { return None };
        let instance = Path { steps: before.to_vec(), ..path.clone() };
        let instance = print_path(&instance).to_uppercase();
        let open = self.open.iter().find(|open| open.instance == instance)?;
        let object = network.objects.get(open.object)?;
        // It was taken into this network.
        let is_own = matches!(&object.kind, Kind::Block { instance: Some(own), .. } if own.to_uppercase() == instance);
        let is_own = is_own && open.network == self.networks.len();
        let place = object.outputs.iter().position(|output| pin.is(&output.name))?;
        let from = (open.object, place);
        let is_last = is_own && !feeds_a_block(network, open.object);
        let is_taken = self.taken.borrow().contains(&from);
        (is_last && !is_taken && is_free(network, from)).then_some(from)
    }

    /// Operators of one rank; those of one kind that follow each other are one function where it takes many inputs.
    fn chain(
        &self,
        first: &Expression,
        rest: &[(Operator, Expression)],
        network: &mut Network,
    ) -> Value {
        let mut value = self.source(first, network);
        let mut at = 0;
        while let Some((operator, _)) = rest.get(at) {
            let takes_many = matches!(
                operator,
                Operator::Add | Operator::Multiply | Operator::And | Operator::Or | Operator::Xor
            );
            let same = rest[at..].iter().take_while(|(other, _)| other == operator);
            let count = if takes_many { same.count() } else { 1 };
            let mut values = vec![value];
            for (_, operand) in &rest[at..at + count] {
                values.push(self.source(operand, network));
            }
            let from = function(operator.word().unwrap_or_default(), &values, network);
            value = made(from);
            at += count;
        }
        value
    }

    /// A call of a function, where all that it is given has a name.
    fn function_call(
        &self,
        path: &Path,
        arguments: &[Argument],
        network: &mut Network,
    ) -> Option<Value> {
        let is_enable = |argument: &Argument| match argument {
            Argument::Given(name, _) => name.is("EN"),
            Argument::Taken { from, .. } => from.is("ENO"),
            Argument::Placed(_) => false,
        };
        if !path.steps.is_empty() || arguments.is_empty() || arguments.iter().any(is_enable) {
            return None;
        }
        let own = unit(self.file, path.root.as_str());
        let own = match own {
            Some(found) if found.kind == UnitKind::Function => Some(found),
            Some(_) => return None,
            None => None,
        };
        let mut methods = self.unit.methods.iter();
        if own.is_none() && methods.any(|method| method.name == path.root) {
            return None;
        }
        let takes = |it: &Argument| matches!(it, Argument::Taken { .. });
        if own.is_none() && arguments.iter().any(takes) {
            return None;
        }
        let names: Vec<String> = match own {
            Some(own) => of_class(own, &[Class::Input, Class::InOut])
                .map(|input| input.name.to_string())
                .collect(),
            None => input_names(path.root.as_str(), arguments.len()),
        };
        let mut names = names.into_iter();
        let mut given = Vec::new();
        for argument in arguments {
            match argument {
                Argument::Placed(value) => given.push((names.next()?, value)),
                Argument::Given(name, value) => given.push((name.to_string(), value)),
                Argument::Taken { .. } => {}
            }
        }
        let inputs = given.into_iter().map(|(name, value)| {
            let value = self.source(value, network);
            pin(&name, value)
        });
        let inputs = inputs.collect();
        let mut outputs = vec![output("OUT")];
        if let Some(own) = own {
            outputs.extend(of_class(own, &[Class::Output]).map(|it| output(it.name.as_str())));
        }
        let kind = Kind::Block {
            of: own.map_or(path.root.to_string(), |own| own.name.to_string()),
            instance: None,
        };
        let object = network.add(kind, inputs, outputs);
        for argument in arguments {
            if let Argument::Taken { from, to, negated } = argument {
                let outputs = network.objects[object].outputs.iter().skip(1);
                let place = outputs.into_iter().position(|output| from.is(&output.name));
                let from = (object, place.map_or(0, |place| place + 1));
                let from = match negated {
                    true => function("NOT", &[plain(from)], network),
                    false => from,
                };
                network.target(print_path(to), from);
            }
        }
        Some(made((object, 0)))
    }
}

pub(super) fn plain(from: Source) -> Value {
    Value { from, negated: false, is_function: false }
}

fn made(from: Source) -> Value {
    Value { is_function: true, ..plain(from) }
}

/// An expression as it is written.
pub(super) fn written(value: &Expression, network: &mut Network) -> Value {
    plain((network.value(print::expression(value)), 0))
}
