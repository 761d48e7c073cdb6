//! Power as elements of a rung.

use understudy_ladder::{
    CoilKind, Comparison, Contact, ContactKind, Element, MAXIMUM_PRESET_VALUE, Name, Relation,
    Series,
};

use super::Drawing;
use super::scope::Binding;
use crate::plcopen::document::Edge;
use crate::plcopen::literal::{boolean, integer};
use crate::plcopen::power::{Power, Read};

impl Drawing<'_> {
    /// Empty where power always passes.
    pub(super) fn series(&mut self, power: &Power) -> Series {
        match power {
            Power::Constant(true) => Vec::new(),
            Power::Constant(false) => vec![self.constant_contact(false)],
            Power::Read(read) => self.read(read, false),
            Power::Not(inner) => self.negated(inner),
            Power::All(parts) => parts.iter().flat_map(|part| self.series(part)).collect(),
            Power::Any(parts) => {
                let branches = parts.iter().map(|part| self.series(part)).collect();
                parallel(branches)
            }
            Power::Output(instance, pin) => self.output(instance, pin, false),
            Power::Kept(object) => self.kept_contact(*object, ContactKind::NormallyOpen),
            Power::Function(name, inputs) => self.function(name, inputs, false),
        }
    }

    fn negated(&mut self, power: &Power) -> Series {
        match power {
            Power::Constant(value) => self.series(&Power::Constant(!value)),
            Power::Not(inner) => self.series(inner),
            Power::Read(read) if read.edge.is_none() => self.read(read, true),
            Power::Read(read) => {
                let span = read.text.span();
                let wanted = format!("{}_edge", read.text);
                let bit = self.kept_in(power, &wanted, &span);
                vec![contact(ContactKind::NormallyClosed, bit)]
            }
            Power::All(parts) => {
                let branches = parts.iter().map(|part| self.negated(part)).collect();
                parallel(branches)
            }
            Power::Any(parts) => parts.iter().flat_map(|part| self.negated(part)).collect(),
            Power::Output(instance, pin) => self.output(instance, pin, true),
            Power::Kept(object) => self.kept_contact(*object, ContactKind::NormallyClosed),
            Power::Function(name, inputs) => self.function(name, inputs, true),
        }
    }

    fn kept_contact(&mut self, object: usize, kind: ContactKind) -> Series {
        match self.kept.get(&object).cloned() {
            Some(name) => vec![contact(kind, name)],
            None => Vec::new(),
        }
    }

    fn read(&mut self, read: &Read, negated: bool) -> Series {
        if let Some(value) = boolean(&read.text) {
            return if value == negated { vec![self.constant_contact(false)] } else { Vec::new() };
        }
        let kind = match (read.edge, negated) {
            (Some(Edge::Rising), _) => ContactKind::Rising,
            (Some(Edge::Falling), _) => ContactKind::Falling,
            (None, false) => ContactKind::NormallyOpen,
            (None, true) => ContactKind::NormallyClosed,
        };
        match self.operand(&read.text) {
            Some(operand) => vec![contact(kind, operand)],
            None => Vec::new(),
        }
    }

    /// The bit or the output of a block that a text names; what else it is, is reported.
    fn operand(&mut self, text: &Name) -> Option<Name> {
        match self.scope.find(text) {
            Some(Binding::Bit(name)) => return Some(Name::at(name, text.span())),
            Some(Binding::Other(kind)) => {
                self.general(format!("`{text}` is {kind}"), text.span());
                return None;
            }
            Some(Binding::Time(_) | Binding::Number(_)) => {
                self.general(format!("`{text}` is a number or a time"), text.span());
                return None;
            }
            Some(Binding::Instance(_)) => {
                let message = format!("`{text}` is a block; its output is `{text}.Q`");
                self.error("U1004", message, text.span());
                return None;
            }
            None => {}
        }
        if let Some((instance, pin)) = text.split_once('.') {
            let name = Name::at(instance, text.span());
            match self.scope.find(&name) {
                Some(Binding::Instance(block)) => {
                    return Some(Name::at(
                        format!("{block}.{}", pin.to_ascii_uppercase()),
                        text.span(),
                    ));
                }
                Some(Binding::Other(kind)) => {
                    self.general(format!("`{instance}` is {kind}"), text.span());
                    return None;
                }
                _ => {}
            }
        }
        let is_name =
            text.chars().all(|letter| letter.is_alphanumeric() || matches!(letter, '_' | '.'));
        if is_name && !text.starts_with(|first: char| first.is_ascii_digit()) {
            self.undefined(text);
        } else {
            self.general(format!("`{text}` is more than a variable"), text.span());
        }
        None
    }

    fn output(&mut self, instance: &Name, pin: &Name, negated: bool) -> Series {
        if let Some(element) = self.take_pending(instance, pin, negated) {
            return element;
        }
        let block = self.scope.find(instance);
        let Some(Binding::Instance(block)) = block else {
            self.general(format!("`{instance}` is a unit of the file"), instance.span());
            return Vec::new();
        };
        let pin_name = pin.to_ascii_uppercase();
        if matches!(pin_name.as_str(), "ET" | "CV") {
            self.general(format!("`{instance}.{pin}` is a number or a time"), pin.span());
            return Vec::new();
        }
        let kind = if negated { ContactKind::NormallyClosed } else { ContactKind::NormallyOpen };
        let operand = Name::at(format!("{block}.{pin_name}"), pin.span());
        vec![contact(kind, operand)]
    }

    fn function(&mut self, name: &Name, inputs: &[(Name, Power)], negated: bool) -> Series {
        let word = name.to_ascii_uppercase();
        if let Some(relation) = relation(&word) {
            return self.comparison(name, relation, inputs, negated);
        }
        match (word.as_str(), inputs) {
            ("XOR", [(_, first), rest @ ..]) if !rest.is_empty() => {
                let mut left = self.single(first, name);
                for (place, (_, right)) in rest.iter().enumerate() {
                    let right = self.single(right, name);
                    let last = place + 1 == rest.len();
                    let (one, other) = (left.clone(), right.clone());
                    let both = if last && negated {
                        [one.clone().and(other.clone()), one.not().and(other.not())]
                    } else {
                        [one.clone().and(other.clone().not()), one.not().and(other)]
                    };
                    left = Power::any(both.to_vec());
                    if !last {
                        left = self.single(&left, name);
                    }
                }
                self.series(&left)
            }
            ("SEL", [(_, gate), (_, zero), (_, one)]) => {
                let gate = self.single(gate, name);
                let branches = [gate.clone().not().and(zero.clone()), gate.and(one.clone())];
                let power = Power::any(branches.to_vec());
                if negated { self.negated(&power) } else { self.series(&power) }
            }
            _ => {
                self.general(format!("the function {name}"), name.span());
                Vec::new()
            }
        }
    }

    /// A power that is one reading, in a bit of its own where it is more.
    fn single(&mut self, power: &Power, place: &Name) -> Power {
        let plain = match power {
            Power::Not(inner) => {
                matches!(**inner, Power::Read(_) | Power::Output(..) | Power::Kept(_))
            }
            Power::Read(read) => read.edge.is_none(),
            Power::Constant(_) | Power::Output(..) | Power::Kept(_) => true,
            _ => false,
        };
        if plain {
            return power.clone();
        }
        let span = place.span();
        let network = self.series(power);
        let bit = self.bit_of(network, CoilKind::Plain, "value", &span);
        self.scope.declare_bit(&bit);
        Power::Read(Read { text: bit, edge: None, object: usize::MAX })
    }

    /// A counter's value and a number.
    fn comparison(
        &mut self,
        name: &Name,
        relation: Relation,
        inputs: &[(Name, Power)],
        negated: bool,
    ) -> Series {
        let relation = if negated { relation.opposite() } else { relation };
        let found = match inputs {
            [(_, left), (_, right)] => match (self.counter(left), self.number(right)) {
                (Some(counter), Some(value)) => Some((counter, relation, value)),
                _ => match (self.counter(right), self.number(left)) {
                    (Some(counter), Some(value)) => Some((counter, relation.mirrored(), value)),
                    _ => None,
                },
            },
            _ => None,
        };
        match found {
            Some((counter, relation, value)) => {
                vec![Element::Comparison(Comparison { counter, relation, value })]
            }
            None => {
                self.general(format!("the function {name}"), name.span());
                Vec::new()
            }
        }
    }

    /// The counter whose CV it is.
    fn counter(&mut self, power: &Power) -> Option<Name> {
        let (instance, pin) = match power {
            Power::Output(instance, pin) => (instance.as_str(), pin.as_str()),
            Power::Read(Read { text, edge: None, .. }) => text.split_once('.')?,
            _ => return None,
        };
        let span = match power {
            Power::Read(read) => read.text.span(),
            Power::Output(_, pin) => pin.span(),
            _ => 0..0,
        };
        match self.scope.find(&Name::from(instance)) {
            Some(Binding::Instance(block)) if pin.eq_ignore_ascii_case("CV") => {
                Some(Name::at(block, span))
            }
            _ => None,
        }
    }

    fn number(&self, power: &Power) -> Option<u16> {
        let Power::Read(Read { text, edge: None, .. }) = power else {
            return None;
        };
        let value = match integer(text) {
            Some(value) => value,
            None => match self.scope.find(text) {
                Some(Binding::Number(value)) if !self.writes(text) => value,
                _ => return None,
            },
        };
        u16::try_from(value).ok().filter(|value| *value <= MAXIMUM_PRESET_VALUE)
    }
}

fn contact(kind: ContactKind, operand: Name) -> Element {
    Element::Contact(Contact { kind, operand })
}

/// Branches; a wire among them lets power pass anyway.
fn parallel(mut branches: Vec<Series>) -> Series {
    if branches.iter().any(Vec::is_empty) {
        return Vec::new();
    }
    if branches.len() == 1 {
        return branches.remove(0);
    }
    vec![Element::Branches(branches)]
}

fn relation(word: &str) -> Option<Relation> {
    Some(match word {
        "EQ" => Relation::Equal,
        "NE" => Relation::NotEqual,
        "LT" => Relation::Less,
        "LE" => Relation::LessOrEqual,
        "GT" => Relation::Greater,
        "GE" => Relation::GreaterOrEqual,
        _ => return None,
    })
}
