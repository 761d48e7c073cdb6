//! Values that are BOOL as contacts, where the style is a ladder.

use understudy_diagram::blocks::{Coil, Contacts, Kind, Network};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{
    Expression, ExpressionKind, Literal, Operator, Path, TypeKind,
};

use super::expression::plain;
use super::{Maker, Source, Style, Value, function, output, pin, print_path};

impl Maker<'_> {
    /// Whether a value is one that a ladder shows as power.
    pub(super) fn is_power(&self, value: &Expression) -> bool {
        let is_bool = |of| matches!(of, TypeKind::Named(name) if name.is("BOOL"));
        self.style == Style::Ladder && self.type_of(value).is_some_and(is_bool)
    }

    /// Assigns a value to a coil.
    pub(super) fn coil(&self, path: &Path, value: &Expression, network: &mut Network) {
        let (kind, value) = match &value.kind {
            // A variable that is negated is a contact.
            ExpressionKind::Not(inner) if !matches!(inner.kind, ExpressionKind::Variable(_)) => {
                (Coil::Negated, &**inner)
            }
            _ => (Coil::Plain, value),
        };
        let from = self.power(value, network);
        network.coil(print_path(path), kind, from);
    }

    /// Where the power that a value is comes from.
    pub(super) fn power(&self, value: &Expression, network: &mut Network) -> Source {
        let value = self.source(value, network);
        positive(value, network)
    }

    /// A value as contacts, and what is no contact as what feeds them; nothing where there would be no contact.
    pub(super) fn rung(&self, value: &Expression, network: &mut Network) -> Option<Source> {
        if !self.is_power(value) {
            return None;
        }
        let is_fed = self.begins_elsewhere(value, network);
        if !self.is_rung(value, is_fed, network) || (is_fed && !has_parts(value)) {
            return None;
        }
        let mut inputs = Vec::new();
        let contacts = self.contacts(value, is_fed, &mut inputs, network);
        let inputs = inputs.into_iter().map(|from| pin("", plain(from)));
        let (inputs, outputs) = (inputs.collect(), vec![output("")]);
        Some((network.add(Kind::Contacts(contacts), inputs, outputs), 0))
    }

    /// Whether a value that is the first of a branch comes from a block rather than from the rail.
    fn begins_elsewhere(&self, value: &Expression, network: &Network) -> bool {
        match &value.kind {
            ExpressionKind::Chain(first, rest) if branches(rest) != Branches::None => {
                self.begins_elsewhere(first, network)
            }
            ExpressionKind::Variable(path) => self.connected(path, network).is_some(),
            _ => contact(value).is_none(),
        }
    }

    /// Whether all of a value is contacts, but for what feeds its branches.
    fn is_rung(&self, value: &Expression, is_fed: bool, network: &Network) -> bool {
        match &value.kind {
            ExpressionKind::Chain(first, rest) => {
                let mut rest_of = rest.iter().map(|(_, value)| value);
                match branches(rest) {
                    Branches::Series => {
                        self.is_rung(first, is_fed, network)
                            && rest_of.all(|value| self.is_rung(value, false, network))
                    }
                    Branches::Parallel => {
                        let is_alike = |value: &Expression| {
                            is_fed == (is_fed && self.begins_elsewhere(value, network))
                                && self.is_rung(value, is_fed, network)
                        };
                        is_alike(first) && rest_of.all(is_alike)
                    }
                    Branches::None => is_fed,
                }
            }
            _ => is_fed || contact(value).is_some(),
        }
    }

    /// The contacts of a value for which [`Self::is_rung`] holds.
    fn contacts(
        &self,
        value: &Expression,
        is_fed: bool,
        inputs: &mut Vec<Source>,
        network: &mut Network,
    ) -> Contacts {
        if let ExpressionKind::Chain(first, rest) = &value.kind
            && branches(rest) != Branches::None
        {
            let mut all = vec![self.contacts(first, is_fed, inputs, network)];
            let is_series = branches(rest) == Branches::Series;
            for (_, value) in rest {
                all.push(self.contacts(value, is_fed && !is_series, inputs, network));
            }
            return match is_series {
                true => Contacts::Series(all),
                false => Contacts::Parallel(all),
            };
        }
        if is_fed {
            let value = self.parts(value, network);
            inputs.push(positive(value, network));
            return Contacts::Power(inputs.len() - 1);
        }
        contact(value).unwrap_or(Contacts::Series(Vec::new()))
    }
}

/// How the operands of a chain are beside each other.
#[derive(PartialEq, Eq)]
enum Branches {
    Series,
    Parallel,
    None,
}

fn branches(rest: &[(Operator, Expression)]) -> Branches {
    let all = |wanted: Operator| rest.iter().all(|(operator, _)| *operator == wanted);
    match () {
        () if all(Operator::And) => Branches::Series,
        () if all(Operator::Or) => Branches::Parallel,
        () => Branches::None,
    }
}

fn has_parts(value: &Expression) -> bool {
    matches!(&value.kind, ExpressionKind::Chain(_, rest) if branches(rest) != Branches::None)
}

/// One contact, or the wire that TRUE is.
fn contact(value: &Expression) -> Option<Contacts> {
    let (negated, inner) = match &value.kind {
        ExpressionKind::Not(inner) => (true, &**inner),
        _ => (false, value),
    };
    match &inner.kind {
        ExpressionKind::Variable(_) => {
            Some(Contacts::Contact { name: print::expression(inner), negated, value: None })
        }
        ExpressionKind::Literal(Literal::Boolean(true)) if !negated => {
            Some(Contacts::Series(Vec::new()))
        }
        _ => None,
    }
}

/// A value that is not negated.
fn positive(value: Value, network: &mut Network) -> Source {
    match value.negated {
        true => {
            let value = Value { negated: false, ..value };
            function("NOT", &[value], network)
        }
        false => value.from,
    }
}
