//! The inputs of standard functions, by place and by name.

use understudy_typed::Comparison;

use super::{operator, pointed_inputs};
use crate::lower::Lowering;
use crate::syntax::{self, Argument, Span};

/// The values of a call by the names of its inputs.
pub(super) struct Values<'s> {
    pub(super) of: Vec<&'s syntax::Expression>,
    pub(super) enable: Option<&'s syntax::Expression>,
}

impl Lowering<'_> {
    /// The arguments in the order of the function's inputs.
    pub(super) fn values<'s>(
        &mut self,
        key: &str,
        arguments: &'s [Argument],
        span: &Span,
    ) -> Option<Values<'s>> {
        let (names, least, extensible) = inputs(key);
        let mut found: Vec<Option<&'s syntax::Expression>> = Vec::new();
        let mut enable = None;
        let mut placed = 0;
        for argument in arguments {
            let (at, value) = match argument {
                Argument::Placed(value) => {
                    placed += 1;
                    (placed - 1, value)
                }
                Argument::Given(name, value) if name.is("EN") => {
                    enable = Some(value);
                    continue;
                }
                Argument::Given(name, value) => match input(&name.key(), names, extensible) {
                    Some(at) => {
                        placed += 1;
                        (at, value)
                    }
                    None => {
                        let message = format!("{key} has no input `{name}`");
                        let help = format!("its inputs: {}", names.join(", "));
                        self.error_with("U1049", message, name.span(), help);
                        return None;
                    }
                },
                Argument::Taken { from, .. } => {
                    let message = format!("{key} has no output `{from}`");
                    let help = "assign its result with `:=`; ENO is for calls that stand alone";
                    self.error_with("U1049", message, from.span(), help);
                    return None;
                }
            };
            if at >= found.len() && at < 1_000 {
                found.resize(at + 1, None);
            }
            match found.get_mut(at) {
                Some(place @ None) => *place = Some(value),
                _ => {
                    let message = format!("{key} is given one input twice, or too many");
                    self.error("U1049", message, value.span.clone());
                    return None;
                }
            }
        }
        let most = if extensible { 1_000 } else { names.len() };
        if found.len() < least || found.len() > most || found.iter().any(Option::is_none) {
            let wanted = match (extensible, least == most) {
                (true, _) => format!("at least {least}"),
                (false, true) => format!("{least}"),
                _ => format!("{least} to {most}"),
            };
            let message = format!("{key} needs {wanted} inputs, and {} are given", found.len());
            let help = format!("its inputs: {}", names.join(", "));
            self.error_with("U1049", message, span.clone(), help);
            return None;
        }
        Some(Values { of: found.into_iter().flatten().collect(), enable })
    }
}

/// The names of the inputs of a standard function that is given `count` of them by their places.
pub fn input_names(function: &str, count: usize) -> Vec<String> {
    let (names, _, extensible) = inputs(&function.to_ascii_uppercase());
    let name = |at: usize| match names.get(at) {
        Some(name) => (*name).to_owned(),
        None if extensible && names.first() == Some(&"K") => format!("IN{}", at - 1),
        None => format!("IN{}", at + 1),
    };
    (0..count).map(name).collect()
}

/// The names of a function's inputs, how many it needs, and whether it takes more.
fn inputs(key: &str) -> (&'static [&'static str], usize, bool) {
    if let Some(typed) = super::typed::of(key) {
        return inputs(typed.function);
    }
    match key {
        _ if operator(key).is_some_and(|(_, extensible)| extensible) => (&["IN1", "IN2"], 1, true),
        _ if operator(key).is_some() => (&["IN1", "IN2"], 2, false),
        "NE" => (&["IN1", "IN2"], 2, false),
        _ if Comparison::of_word(key).is_some() => (&["IN1", "IN2"], 2, true),
        "MAX" | "MIN" => (&["IN1", "IN2"], 1, true),
        "CONCAT" => (&["IN1", "IN2"], 1, true),
        "SHL" | "SHR" | "ROL" | "ROR" => (&["IN", "N"], 2, false),
        "SEL" => (&["G", "IN0", "IN1"], 3, false),
        "LIMIT" => (&["MN", "IN", "MX"], 3, false),
        "MUX" => (&["K", "IN0", "IN1"], 2, true),
        "LEFT" | "RIGHT" => (&["IN", "L"], 2, false),
        "MID" | "DELETE" => (&["IN", "L", "P"], 3, false),
        "INSERT" => (&["IN1", "IN2", "P"], 3, false),
        "REPLACE" => (&["IN1", "IN2", "L", "P"], 4, false),
        "FIND" => (&["IN1", "IN2"], 2, false),
        "ATAN2" => (&["Y", "X"], 2, false),
        "UPPER_BOUND" | "LOWER_BOUND" => (&["ARR", "DIM"], 2, false),
        "CONCAT_DATE_TOD" | "CONCAT_DATE_LTOD" => (&["IN1", "IN2"], 2, false),
        "TIME" | "LTIME" => (&[], 0, false),
        _ if pointed_inputs(key) == Some(3) => (&["IN", "AT", "OF"], 3, false),
        _ if pointed_inputs(key) == Some(4) => (&["IN", "AT", "OF", "BY"], 4, false),
        _ => (&["IN"], 1, false),
    }
}

/// The place of an input by its name.
fn input(name: &str, names: &[&str], extensible: bool) -> Option<usize> {
    // TwinCAT and CODESYS have names of their own.
    let codesys = |known: &str| match (names.len(), known) {
        (1..=3, "IN") => name == "STR",
        (2.., "IN1") => name == "STR1",
        (2.., "IN2") => name == "STR2",
        (2, "L") => name == "SIZE",
        (3, "L") => name == "LEN",
        (3.., "P") => name == "POS",
        _ => false,
    };
    let is_it = |known: &&str| **known == *name || codesys(known);
    if let Some(at) = names.iter().position(is_it) {
        return Some(at);
    }
    if names == ["IN"] {
        return (name == "IN1").then_some(0);
    }
    let number: usize = name.strip_prefix("IN")?.parse().ok()?;
    match names.first() {
        _ if !extensible => None,
        Some(&"K") => number.checked_add(1),
        _ => number.checked_sub(1),
    }
}
