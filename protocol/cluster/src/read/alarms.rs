//! Alarms: their declarations, bound to the inputs and outputs of the programs.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use understudy_text::Diagnostic;
use understudy_text::tables::Constant;
use understudy_typed::{Declared, Elementary, Point};

use super::Member;
use super::inputs::value;
use super::names::find_signal;
use crate::alarm::{AlarmCondition, AlarmDeclaration, MAXIMUM_ALARMS, Priority};
use crate::fields::Placed;
use crate::file::AlarmSection;

/// The alarms without errors.
pub(super) fn resolve(
    mut sections: Vec<AlarmSection>,
    members: &[Member],
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<AlarmDeclaration> {
    if let Some(section) = sections.get(MAXIMUM_ALARMS) {
        let message = format!("there are more than {MAXIMUM_ALARMS} alarms");
        diagnostics.push(Diagnostic::error("U0213", message, section.span.clone()));
        sections.truncate(MAXIMUM_ALARMS);
    }
    let mut names: BTreeMap<String, Range<usize>> = BTreeMap::new();
    let mut alarms = Vec::new();
    for section in &sections {
        let name = section.name.as_ref().or(section.signal.as_ref());
        if let Some(Placed { value, span }) = name {
            if let Some(first) = names.get(value) {
                let message = format!("two alarms are named `{value}`");
                diagnostics.push(
                    Diagnostic::error("U0208", message, span.clone())
                        .with_related(first.clone(), "the first is here")
                        .with_help("give one of them another `name`; an alarm without one has the name of its signal"),
                );
            } else {
                names.insert(value.clone(), span.clone());
            }
        }
        alarms.extend(alarm(section, members, period, diagnostics));
    }
    alarms
}

fn alarm(
    section: &AlarmSection,
    members: &[Member],
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<AlarmDeclaration> {
    check_keys(section, diagnostics);
    let signal = section.signal.as_ref()?;
    let (program, point, is_output) = find_signal(signal, members, diagnostics)?;
    let condition = condition(section, point, diagnostics)?;
    let cycles = |delay: Duration| {
        let cycles = delay.as_nanos().div_ceil(period.as_nanos().max(1));
        u32::try_from(cycles).unwrap_or(u32::MAX)
    };
    let name = section.name.as_ref().unwrap_or(signal);
    Some(AlarmDeclaration {
        name: name.value.clone(),
        program,
        point: point.clone(),
        is_output,
        condition,
        on_delay: cycles(section.on_delay),
        off_delay: cycles(section.off_delay),
        priority: Priority::ALL[section.priority],
        text: section.text.clone()?,
        action: section.action.clone(),
    })
}

/// Exactly one condition, and a hysteresis only for a limit.
fn check_keys(section: &AlarmSection, diagnostics: &mut Vec<Diagnostic>) {
    let conditions = [&section.when, &section.above, &section.below];
    let present: Vec<_> = conditions.into_iter().flatten().collect();
    if present.len() != 1 {
        let message = if present.is_empty() {
            "the alarm has no condition"
        } else {
            "the alarm has more than one condition"
        };
        let span = present.get(1).map_or(&section.span, |second| &second.span);
        diagnostics.push(Diagnostic::error("U0226", message, span.clone()).with_help(
            "write one of `when`, `above` and `below`; two limits of a signal are two alarms",
        ));
    }
    if let Some(hysteresis) = &section.hysteresis
        && section.when.is_some()
    {
        let message = "`hysteresis` does not belong to a Boolean condition";
        diagnostics.push(
            Diagnostic::error("U0202", message, hysteresis.span.clone())
                .with_help("it belongs to `above` and `below`; use `on_delay` and `off_delay`"),
        );
    }
}

fn condition(
    section: &AlarmSection,
    point: &Point,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<AlarmCondition> {
    let of = point.of;
    // A subrange bounds no calculation, so a limit may lie outside.
    let declared = &Declared { range: None, ..point.declared() };
    let (limit, is_above) = match (&section.when, &section.above, &section.below) {
        (Some(when), None, None) => {
            if of != Elementary::Bool && point.values.is_none() {
                let message = format!("`when` for the signal `{}`, which is {of}", point.name);
                let help = "a number or a TIME has a limit: `above` or `below`";
                diagnostics.push(misfit(message, when.span.clone(), help));
                return None;
            }
            return value("when", when, declared, diagnostics).map(AlarmCondition::Is);
        }
        (None, Some(above), None) => (above, true),
        (None, None, Some(below)) => (below, false),
        _ => return None,
    };
    let key = if is_above { "above" } else { "below" };
    if of == Elementary::Bool {
        let message = format!("`{key}` for the signal `{}`, which is BOOL", point.name);
        let help = "write `when = true` or `when = false` for a BOOL";
        diagnostics.push(misfit(message, limit.span.clone(), help));
        return None;
    }
    let span = limit.span.clone();
    let limit = value(key, limit, declared, diagnostics);
    let over = match &section.hysteresis {
        None => limit?,
        Some(hysteresis) => {
            if is_negative(&hysteresis.value) {
                let message = "`hysteresis` is negative";
                diagnostics.push(
                    Diagnostic::error("U0205", message, hysteresis.span.clone())
                        .with_help("write the distance from the limit, 0 or more"),
                );
                return None;
            }
            let distance = value("hysteresis", hysteresis, &of.into(), diagnostics)?;
            let over = moved(of, limit?, distance, is_above);
            let Some(over) = over else {
                let message = format!("the limit and the hysteresis leave the range of {of}");
                let help = "the alarm would never be over: write a smaller hysteresis";
                diagnostics.push(Diagnostic::error("U0205", message, span).with_help(help));
                return None;
            };
            over
        }
    };
    let limit = limit?;
    Some(if is_above {
        AlarmCondition::Above { limit, over }
    } else {
        AlarmCondition::Below { limit, over }
    })
}

fn misfit(message: String, span: Range<usize>, help: &str) -> Diagnostic {
    Diagnostic::error("U0226", message, span).with_help(help.to_owned())
}

fn is_negative(value: &Constant) -> bool {
    match value {
        Constant::Whole(number) => *number < 0,
        Constant::Number(number) => *number < 0.0,
        Constant::Flag(_) | Constant::Text(_) => false,
    }
}

/// A stored limit lowered or raised by a distance; nothing where the type has no such value.
fn moved(of: Elementary, limit: u64, distance: u64, is_lowered: bool) -> Option<u64> {
    match of {
        Elementary::Real => {
            let (limit, by) = (f32::from_bits(limit as u32), f32::from_bits(distance as u32));
            let moved = if is_lowered { limit - by } else { limit + by };
            moved.is_finite().then(|| u64::from(moved.to_bits()))
        }
        Elementary::Lreal => {
            let (limit, by) = (f64::from_bits(limit), f64::from_bits(distance));
            let moved = if is_lowered { limit - by } else { limit + by };
            moved.is_finite().then(|| moved.to_bits())
        }
        _ => {
            let (limit, by) = (of.signed(limit), of.signed(distance));
            let moved = if is_lowered { limit - by } else { limit + by };
            let stored = (moved as u64) & of.mask();
            (of.signed(stored) == moved).then_some(stored)
        }
    }
}
