//! Calls of the standard blocks.

use std::time::Duration;

use understudy_ladder::{
    Block, BlockKind, CoilKind, Element, Feed, MAXIMUM_PRESET_TIME, MAXIMUM_PRESET_VALUE, Name,
    Series,
};
use understudy_structured_text::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, Initializer, Literal, Path,
};

use super::network::Power;
use super::signals::Known;
use super::{Found, Writer, coil, contact, refused};

impl<'f> Writer<'f> {
    /// `pause(IN := a, PT := T#3s, Q => y);`
    pub(super) fn call(&mut self, path: &Path, arguments: &'f [Argument]) -> Found<()> {
        let span = &path.span;
        let (Known::Block { name, kind, .. }, []) = (self.known(path)?, path.steps.as_slice())
        else {
            return refused(format!("it calls `{}`, which is no standard block", path.root), span);
        };
        if !self.called.insert(name.clone()) {
            return refused(format!("it calls `{}` twice", path.root), span);
        }
        let mut wire: Option<Series> = None;
        let mut pins = Vec::new();
        let mut kind = kind;
        let mut has_preset = kind.preset_time().is_none() && kind.preset_value().is_none();
        let mut taken = Vec::new();
        let mut place = 0;
        for argument in arguments {
            let (pin, value) = match argument {
                Argument::Given(pin, value) => (pin.key(), value),
                Argument::Placed(value) => {
                    let Some(pin) = kind.inputs().nth(place) else {
                        return refused("it gives a block more than it has inputs", span);
                    };
                    place += 1;
                    (pin.to_owned(), value)
                }
                Argument::Taken { from, to, negated } => {
                    let Some(from) = kind.outputs().iter().find(|output| from.is(output)) else {
                        return refused(format!("it takes `{}.{from}`", path.root), span);
                    };
                    taken.push((format!("{name}.{from}"), self.target(to)?, *negated));
                    continue;
                }
            };
            if matches!(pin.as_str(), "PT" | "PV") {
                kind = self.preset(kind, value)?;
                has_preset = true;
                continue;
            }
            let is_input = |pin: &str| {
                pin == kind.wire_input() || kind.side_inputs().iter().any(|(side, _)| *side == pin)
            };
            if !is_input(&pin) {
                return refused(format!("it gives `{}` an input `{pin}`", path.root), span);
            }
            let power = self.power(value, false, 0)?;
            if pin == kind.wire_input() {
                wire = Some(match power {
                    Power::On => Vec::new(),
                    Power::Through(series) => series,
                    Power::Off => vec![contact(&self.memory("never"), false)],
                });
                continue;
            }
            match power {
                Power::Off => {}
                Power::On => pins.push((pin, Vec::new())),
                Power::Through(network) => pins.push((pin, network)),
            }
        }
        if !has_preset {
            let Some(value) = self.declared_preset(path) else {
                return refused(format!("the call of `{}` gives no preset", path.root), span);
            };
            kind = self.preset(kind, value)?;
        }
        let Some(mut network) = wire else {
            let pin = kind.wire_input();
            return refused(format!("the call of `{}` does not give `{pin}`", path.root), span);
        };
        let mut side = kind.side_inputs().iter();
        if let Some((pin, _)) = side.find(|(pin, must)| *must && pins.iter().all(|it| it.0 != *pin))
        {
            return refused(format!("the call of `{}` does not give `{pin}`", path.root), span);
        }
        let pins = pins.into_iter();
        let pins = pins.map(|(pin, network)| Feed { pin: Name::from(pin), network }).collect();
        let block = Block { name: Name::from(name.as_str()), kind, pins };
        network.push(Element::Block(block));
        self.push(network, Vec::new());
        for (output, target, negated) in taken {
            self.push(vec![contact(&output, negated)], vec![coil(CoilKind::Plain, &target)]);
        }
        Ok(())
    }

    /// The block with its preset.
    fn preset(&self, kind: BlockKind, value: &Expression) -> Found<BlockKind> {
        let literal = match &value.kind {
            ExpressionKind::Literal(literal) => Some(literal),
            ExpressionKind::Variable(path) if path.steps.is_empty() => self.constant(path),
            _ => None,
        };
        let time = match literal {
            Some(Literal::Time { nanoseconds, .. }) => u64::try_from(*nanoseconds).ok(),
            _ => None,
        };
        let time = time.map(Duration::from_nanos).filter(|time| *time <= MAXIMUM_PRESET_TIME);
        let number = match literal {
            Some(Literal::Integer { value, .. }) => u16::try_from(*value).ok(),
            _ => None,
        };
        let number = number.filter(|number| *number <= MAXIMUM_PRESET_VALUE);
        let found = match (kind.preset_time(), kind.preset_value()) {
            (Some(_), _) => time.map(|time| kind.with_time(time)),
            (_, Some(_)) => number.map(|number| kind.with_value(number)),
            (None, None) => Some(kind),
        };
        found.map_or_else(|| refused("a preset is no constant that a block takes", &value.span), Ok)
    }

    /// `pause : TON := (PT := T#3s);`
    fn declared_preset(&self, path: &Path) -> Option<&'f Expression> {
        let mut all = self.unit.declarations.iter().chain(&self.file.globals);
        let Some(Initializer::Structure(parts, _)) = &all.find(|it| it.name == path.root)?.initial
        else {
            return None;
        };
        parts.iter().find_map(|(name, initial)| match initial {
            Initializer::Value(value) if name.is("PT") || name.is("PV") => Some(value),
            _ => None,
        })
    }

    /// The literal that a constant stands for, or a variable that nothing writes.
    pub(super) fn constant(&self, path: &Path) -> Option<&'f Literal> {
        let mut all = self.unit.declarations.iter().chain(&self.file.globals);
        let found = all.find(|found| found.name == path.root)?;
        match found.initial.as_ref()? {
            Initializer::Value(Expression { kind: ExpressionKind::Literal(literal), .. })
                if found.constant || self.is_never_written(found) =>
            {
                Some(literal)
            }
            _ => None,
        }
    }

    fn is_never_written(&self, declaration: &Declaration) -> bool {
        let key = declaration.name.key();
        let is_own = matches!(declaration.class, Class::Local | Class::Global);
        is_own && declaration.address.is_none() && !self.uses.writes(&key)
    }
}
