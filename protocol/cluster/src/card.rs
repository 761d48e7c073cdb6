//! How a signal is shown to people and to other systems.
//!
//! Invariant: no member computes with a card. It is not in the configuration, so a changed unit needs neither a stop nor an online change.

use std::collections::BTreeMap;

use serde::Serialize;
use understudy_remote_io::in_order;
use understudy_typed::{Declared, Elementary};
use understudy_wire::ProgramId;

use crate::cluster::Cluster;

/// Digits after the decimal point, at most.
pub const MAXIMUM_DECIMALS: u32 = 12;

/// Unit, decimals, range, description and group of a signal.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Card {
    /// Unit of a number, such as `°C`.
    pub unit: Option<String>,
    /// Digits after the decimal point of a REAL or LREAL.
    pub decimals: Option<u8>,
    /// Lowest and highest stored value of a scale, in the order of the type.
    pub range: Option<(u64, u64)>,
    /// What the signal means.
    pub description: Option<String>,
    /// The part of the plant that it belongs to.
    pub group: Option<String>,
}

/// A card for programs that read JSON; what is absent has no key.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CardFacts {
    /// Unit of a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Digits after the decimal point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimals: Option<u8>,
    /// Lowest value of a scale; of a TIME in nanoseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// Highest value of a scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
    /// What the signal means.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The part of the plant that it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

/// What a declaration can have on its card.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shown {
    /// A unit: a number without one of its own.
    pub(crate) unit: bool,
    /// Decimals: a number with a fraction.
    pub(crate) decimals: bool,
    /// A range: everything that has more and less.
    pub(crate) range: bool,
}

impl Shown {
    pub(crate) fn of(declared: &Declared) -> Self {
        let is_number = declared.of != Elementary::Bool && declared.values.is_none();
        let has_unit = is_number && !declared.of.is_time();
        let range = is_number && (has_unit || declared.of == Elementary::Time);
        Self { unit: has_unit, decimals: declared.of.is_real(), range }
    }
}

impl Card {
    /// The card as far as it fits a declaration: an online change may declare the same name with another type.
    fn fitting(mut self, declared: &Declared) -> Self {
        let shown = Shown::of(declared);
        self.unit = self.unit.filter(|_| shown.unit);
        self.decimals = self.decimals.filter(|_| shown.decimals);
        let fits = |(low, high): &(u64, u64)| {
            let inside = [low, high].into_iter().all(|value| value & declared.of.mask() == *value);
            shown.range && inside && in_order(declared.of, *low, *high)
        };
        self.range = self.range.filter(fits);
        self
    }

    /// A number with the decimals of the card; nothing where the card has none, or the value is not finite.
    pub fn rounded(&self, declared: &Declared, stored: u64) -> Option<String> {
        let decimals = usize::from(self.decimals.filter(|_| declared.of.is_real())?);
        let number = declared.of.number(stored);
        let text = format!("{number:.decimals$}");
        // A value that rounds to 0 has no sign.
        let is_zero = !text.contains(|digit| ('1'..='9').contains(&digit));
        let text = if is_zero { text.trim_start_matches('-').to_owned() } else { text };
        number.is_finite().then_some(text)
    }

    /// A text of a value with the unit behind it.
    pub fn with_unit(&self, text: String) -> String {
        match &self.unit {
            Some(unit) => format!("{text} {unit}"),
            None => text,
        }
    }

    /// The card of a signal of this type, in numbers.
    pub fn facts(self, of: Elementary) -> CardFacts {
        let Self { unit, decimals, range, description, group } = self;
        let (low, high) = range.map(|(low, high)| (of.number(low), of.number(high))).unzip();
        CardFacts { unit, decimals, low, high, description, group }
    }
}

/// Cards of the file, by name, of each program.
pub(crate) type Cards = Vec<BTreeMap<String, Card>>;

impl Cluster {
    /// The card of an input or output: what `[signals]` says; where it is silent, unit and limits of a setpoint, and the comment of the declaration.
    pub fn card(&self, program: ProgramId, name: &str) -> Card {
        let place = program.index();
        let card = self.cards.get(place).and_then(|cards| cards.get(name)).cloned();
        let mut card = card.unwrap_or_default();
        let Some(controller) = self.controllers.get(place) else {
            return card;
        };
        let interface = &controller.interface;
        let point = interface.inputs.find(name).or_else(|| interface.outputs.find(name));
        let Some(point) = point else {
            return card;
        };
        let sources = self.remote_ios.get(place).map_or(&[][..], |remote_io| &remote_io.inputs);
        let source = sources.iter().find(|source| source.name == name);
        if let Some(operator) = source.and_then(|source| source.operator()) {
            card.unit = card.unit.or_else(|| operator.unit.clone());
            card.range = card.range.or_else(|| operator.limits());
        }
        let mut variables = controller.code.typed().variables.iter();
        let variable = variables.find(|variable| variable.name == name);
        card.description =
            card.description.or_else(|| variable.and_then(|variable| variable.description.clone()));
        card.fitting(&point.declared())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_rounds_reals_and_nothing_else() {
        let card = Card { decimals: Some(1), unit: Some("°C".to_owned()), ..Card::default() };
        let check = |of: Elementary, stored: u64, expected: Option<&str>| {
            let found = card.rounded(&of.into(), stored);
            assert_eq!(found.as_deref(), expected, "{of} {stored:#x}");
        };
        let real = |value: f32| u64::from(value.to_bits());
        check(Elementary::Real, real(41.27), Some("41.3"));
        check(Elementary::Real, real(-0.01), Some("0.0"));
        check(Elementary::Real, real(f32::NAN), None);
        check(Elementary::Lreal, (1.0f64 / 3.0).to_bits(), Some("0.3"));
        check(Elementary::Int, 7, None);
        assert_eq!(card.with_unit("41.3".to_owned()), "41.3 °C");
    }

    #[test]
    fn a_card_of_another_type_leaves_out_what_does_not_fit() {
        let real = |value: f32| u64::from(value.to_bits());
        let card = Card {
            unit: Some("m".to_owned()),
            decimals: Some(2),
            range: Some((real(0.0), real(2.5))),
            description: Some("level".to_owned()),
            group: None,
        };
        assert_eq!(card.clone().fitting(&Elementary::Real.into()), card);
        let described = Card { description: card.description.clone(), ..Card::default() };
        assert_eq!(card.clone().fitting(&Elementary::Bool.into()), described);
        let int = card.fitting(&Elementary::Int.into());
        assert_eq!((int.unit.as_deref(), int.decimals, int.range), (Some("m"), None, None));
    }
}
