//! Types: what the standard and the text define, and the pins of the standard blocks.

use std::collections::HashMap;

use understudy_text::Diagnostic;

use super::super::program::Kind;
use super::super::syntax::{TypeDefinition, TypeMeaning, TypeName, UnitKind};
use super::Resolver;

/// Types that the text defines, by name in capitals.
#[derive(Debug, Default)]
pub(super) struct Types {
    pub(super) known: HashMap<String, Type>,
    /// Values of enumerations.
    pub(super) values: HashMap<String, i64>,
}

/// What a type is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Type {
    Elementary(Kind),
    Time,
    /// One of the units.
    Block(usize),
    /// A standard block that can stand in a rung.
    Standard(&'static str),
}

/// The standard blocks of the ladder, timers first.
pub(super) const STANDARD: [&str; 10] = [
    "TON", "TOF", "TP", "CTU", "CTD", "CTUD", "SR", "RS", "R_TRIG", "F_TRIG",
];

/// Whether the block measures time.
pub(super) fn is_timer(word: &str) -> bool {
    matches!(word, "TON" | "TOF" | "TP")
}

/// Inputs of a standard block, the wire's first.
pub(super) fn inputs(word: &str) -> &'static [&'static str] {
    match word {
        "CTU" => &["CU", "R", "PV"],
        "CTD" => &["CD", "LD", "PV"],
        "CTUD" => &["CU", "CD", "R", "LD", "PV"],
        "SR" => &["S1", "R"],
        "RS" => &["S", "R1"],
        "R_TRIG" | "F_TRIG" => &["CLK"],
        _ => &["IN", "PT"],
    }
}

/// Boolean outputs of a standard block.
pub(super) fn outputs(word: &str) -> &'static [&'static str] {
    match word {
        "CTUD" => &["QU", "QD"],
        "SR" | "RS" => &["Q1"],
        _ => &["Q"],
    }
}

/// What the type of whole numbers of that name holds.
pub(super) fn whole_range(word: &str) -> Option<(i64, i64)> {
    Some(match word {
        "SINT" => (-0x80, 0x7f),
        "INT" => (-0x8000, 0x7fff),
        "DINT" => (-0x8000_0000, 0x7fff_ffff),
        "USINT" => (0, 0xff),
        "UINT" => (0, 0xffff),
        "UDINT" => (0, 0xffff_ffff),
        _ => return None,
    })
}

fn whole(low: i64, high: i64) -> Type {
    Type::Elementary(Kind::Number {
        declared: (low, high),
        wide: (low, high),
    })
}

impl Resolver {
    pub(super) fn define_types(&mut self, types: &[TypeDefinition]) {
        for definition in types {
            let defined = match &definition.meaning {
                TypeMeaning::Enumeration(values) => {
                    for (number, value) in values.iter().enumerate() {
                        let number = i64::try_from(number).unwrap_or(i64::MAX);
                        let known = self.types.values.insert(value.to_ascii_uppercase(), number);
                        if known.is_some_and(|known| known != number) {
                            let message = format!(
                                "the value `{value}` belongs to two enumerations at different places"
                            );
                            self.error("U1042", message, value.span());
                        }
                    }
                    let last = i64::try_from(values.len()).unwrap_or(i64::MAX) - 1;
                    Some(whole(0, last.max(0)))
                }
                TypeMeaning::Alias(name) => self.type_of(name),
            };
            let Some(defined) = defined else { continue };
            let key = definition.name.to_ascii_uppercase();
            if self.types.known.insert(key, defined).is_some() {
                let message = format!("the type `{}` is defined twice", definition.name);
                self.error("U1042", message, definition.name.span());
            }
        }
    }

    pub(super) fn enumeration_value(&self, name: &str) -> Option<i64> {
        self.types.values.get(&name.to_ascii_uppercase()).copied()
    }

    pub(super) fn type_of(&mut self, name: &TypeName) -> Option<Type> {
        let key = name.name.to_ascii_uppercase();
        let found = match key.as_str() {
            "BOOL" => Some(Type::Elementary(Kind::Truth)),
            "TIME" => Some(Type::Time),
            word => whole_range(word).map(|(low, high)| whole(low, high)),
        };
        let found = found.or_else(|| self.types.known.get(&key).copied());
        let found = found.or_else(|| {
            let unit = self.by_name.get(&key).copied();
            let user = unit.filter(|unit| *unit < self.first_of_library);
            let user = user.filter(|unit| self.units[*unit].kind == UnitKind::FunctionBlock);
            let standard = STANDARD.into_iter().find(|word| *word == key);
            user.map(Type::Block).or(standard.map(Type::Standard))
        });
        let Some(found) = found else {
            let message = format!("variables of the type `{}` are not supported", name.name);
            let finding = Diagnostic::error("U1040", message, name.name.span());
            self.say(finding.with_help("taken are BOOL, SINT, INT, DINT, USINT, UINT, UDINT, TIME, enumerations, and function blocks"));
            return None;
        };
        match (found, name.range) {
            (_, None) => Some(found),
            (Type::Elementary(Kind::Number { wide, .. }), Some((low, high))) => {
                if low < wide.0 || high > wide.1 {
                    let message = format!("the range {low}..{high} is not within `{}`", name.name);
                    self.error("U1036", message, name.name.span());
                }
                let declared = (low.clamp(wide.0, wide.1), high.clamp(wide.0, wide.1));
                Some(Type::Elementary(Kind::Number { declared, wide }))
            }
            _ => {
                self.error(
                    "U1036",
                    format!("`{}` has no range", name.name),
                    name.name.span(),
                );
                None
            }
        }
    }
}
