//! Cards of signals: bound to the inputs and outputs of the programs.

use understudy_executable::value_text;
use understudy_remote_io::in_order;
use understudy_text::Diagnostic;
use understudy_typed::{Declared, Point};

use super::Member;
use super::inputs::value;
use super::names::find_signal;
use crate::card::{Card, Cards, Shown};
use crate::cluster::RemoteIo;
use crate::fields::{MAXIMUM_MISFITS, Placed};
use crate::file::SignalSection;

/// Characters of a unit, at most: it stands behind each value.
const LONGEST_UNIT: usize = 16;

/// Characters of the name of a group, at most.
const LONGEST_GROUP: usize = 64;

/// Characters of a description, at most: it is one line of a list.
const LONGEST_DESCRIPTION: usize = 200;

/// The cards of each program, without what has errors.
pub(super) fn resolve(
    sections: Vec<SignalSection>,
    members: &[Member],
    remote_ios: &[RemoteIo],
    diagnostics: &mut Vec<Diagnostic>,
) -> Cards {
    let mut cards: Cards = vec![Default::default(); members.len()];
    let mut misfits = 0;
    for section in sections {
        if misfits == MAXIMUM_MISFITS {
            let message =
                format!("{MAXIMUM_MISFITS} cards have no signal; the rest is not checked");
            diagnostics.push(Diagnostic::error("U0209", message, section.name.span));
            break;
        }
        let before = diagnostics.len();
        let Some((program, point, _)) = find_signal(&section.name, members, diagnostics) else {
            misfits += diagnostics.len() - before;
            continue;
        };
        let place = program.index();
        let mut sources = remote_ios.iter().skip(place).take(1).flat_map(|it| &it.inputs);
        let source = sources.find(|source| source.name == point.name);
        let has_unit = source.and_then(|it| it.operator()?.unit.as_ref()).is_some();
        if let (Some(unit), true) = (&section.unit, has_unit) {
            let message = format!("`{}` has a unit as a setpoint already", section.name.value);
            let help = "leave one of the two out";
            diagnostics
                .push(Diagnostic::error("U0208", message, unit.span.clone()).with_help(help));
        }
        let name = point.name.clone();
        let card = card(section, point, diagnostics);
        cards[place].insert(name, card);
    }
    cards
}

fn card(section: SignalSection, point: &Point, diagnostics: &mut Vec<Diagnostic>) -> Card {
    // A subrange bounds no scale.
    let declared = Declared { range: None, ..point.declared() };
    let shown = Shown::of(&declared);
    let SignalSection { name, unit, decimals, low, high, description, group } = section;
    let mut misfit = |key: &str, span: std::ops::Range<usize>, belongs: &str| {
        let message = format!("`{key}` for the signal `{}`, which is {declared}", name.value);
        let help = format!("`{key}` belongs to {belongs}: leave it out");
        diagnostics.push(Diagnostic::error("U0264", message, span).with_help(help));
    };
    if let Some(unit) = unit.as_ref().filter(|_| !shown.unit) {
        misfit("unit", unit.span.clone(), "a number; a BOOL has none, and a time has its own");
    }
    if let Some(decimals) = decimals.as_ref().filter(|_| !shown.decimals) {
        misfit("decimals", decimals.span.clone(), "a REAL or LREAL");
    }
    for (key, limit) in [("low", &low), ("high", &high)] {
        if let Some(limit) = limit.as_ref().filter(|_| !shown.range) {
            misfit(key, limit.span.clone(), "a number or a TIME");
        }
    }
    let mut limit = |key: &str, limit: &Option<Placed<_>>| {
        let limit = limit.as_ref().filter(|_| shown.range)?;
        value(key, limit, &declared, diagnostics)
    };
    let limits = (limit("low", &low), limit("high", &high));
    let range = range(&name, (&low, &high), limits, &declared, diagnostics);
    let mut text = |key: &str, text: Option<Placed<String>>, most| {
        text.and_then(|text| one_line(key, text, most, diagnostics))
    };
    Card {
        unit: text("unit", unit, LONGEST_UNIT),
        decimals: decimals.map(|decimals| decimals.value),
        range,
        description: text("description", description, LONGEST_DESCRIPTION),
        group: text("group", group, LONGEST_GROUP),
    }
}

/// Both ends of a scale, in order.
fn range<T>(
    name: &Placed<String>,
    written: (&Option<Placed<T>>, &Option<Placed<T>>),
    limits: (Option<u64>, Option<u64>),
    declared: &Declared,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<(u64, u64)> {
    let lacking = match written {
        (Some(_), None) => Some("high"),
        (None, Some(_)) => Some("low"),
        _ => None,
    };
    if let Some(key) = lacking {
        let message = format!("the card of `{}` has no `{key}`", name.value);
        let help = "a scale has both ends, `low` and `high`";
        diagnostics.push(Diagnostic::error("U0203", message, name.span.clone()).with_help(help));
    }
    let (low, high) = (limits.0?, limits.1?);
    if low == high || !in_order(declared.of, low, high) {
        let [least, most] = [low, high].map(|end| value_text(declared, end).replace('"', ""));
        let message =
            format!("`low` of the signal `{}` is {least}, and `high` is {most}", name.value);
        let span = written.0.as_ref().map_or(name.span.clone(), |low| low.span.clone());
        let help = "write a `low` that is below `high`";
        diagnostics.push(Diagnostic::error("U0205", message, span).with_help(help));
        return None;
    }
    Some((low, high))
}

/// A text that fits into a table.
fn one_line(
    key: &str,
    Placed { value, span }: Placed<String>,
    most: usize,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<String> {
    let length = value.chars().count();
    let message = if value.contains(char::is_control) {
        format!("`{key}` has the end of a line, or another control character")
    } else if length > most {
        format!("`{key}` has {length} characters; it may have {most}")
    } else if value.trim().is_empty() {
        format!("`{key}` is empty")
    } else {
        return Some(value.trim().to_owned());
    };
    let help = "write a short text in one line";
    diagnostics.push(Diagnostic::error("U0264", message, span).with_help(help));
    None
}
