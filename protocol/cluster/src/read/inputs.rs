//! Inputs that do not come from the field: their declarations, bound to the inputs and outputs of the programs.

use std::collections::BTreeSet;
use std::ops::Range;
use std::time::Duration;

use understudy_executable::{Interface, stored_value};
use understudy_remote_io::{OperatorInput, OperatorInputKind, PointPlace, SignalInput, in_order};
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_text::tables::Constant;
use understudy_typed::{Declared, Elementary, Point};
use understudy_wire::{ProgramId, Role};

use super::Member;
use crate::fields::{MAXIMUM_MISFITS, OperatorText, Placed, SourceEntry, SourceText};
use crate::file::{FieldSection, RemoteIoSection};
use crate::format::OPERATOR_INPUTS;
use crate::source::{
    GroupSignal, InputSource, InputSourceKind, OperatorDeclaration, SignalDeclaration,
};

/// Suffixes of the input that says whether a signal is valid; names in Structured Text have no dot.
const VALID: [&str; 2] = [".valid", "_valid"];

/// Names of the input that says whether the signal `name` is valid.
pub(super) fn names_of_valid(name: &str) -> impl Iterator<Item = String> + '_ {
    VALID.iter().map(move |suffix| format!("{name}{suffix}"))
}

/// The sources of the inputs of `members[index]`, those without errors.
pub(super) fn resolve(
    entries: &[SourceEntry],
    index: usize,
    members: &[Member],
    field: Option<&FieldSection>,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<InputSource> {
    let member = &members[index];
    let Some((_, Interface { inputs, .. })) = &member.code else {
        return Vec::new();
    };
    let mut sources = Vec::new();
    let mut taken = BTreeSet::new();
    for (place, SourceEntry { name, source }) in entries.iter().enumerate() {
        if place == MAXIMUM_MISFITS * 10 {
            break;
        }
        let Some(point) = inputs.find(&name.value) else {
            let message = format!("`{}` has no input `{}`", member.name, name.value);
            diagnostics.push(
                Diagnostic::error("U0209", message, name.span.clone())
                    .with_help(suggestion(&name.value, inputs.names())),
            );
            continue;
        };
        let is_signal = matches!(source, SourceText::Signal { .. });
        let mut names = names_of_valid(&point.name);
        let valid = names.find_map(|name| inputs.find(&name)).filter(|valid| {
            // An input that only looks like it has a source of its own.
            let has_entry = entries.iter().any(|entry| entry.name.value == valid.name);
            let has_place = field.is_some_and(|field| field.inputs.contains_key(&valid.name));
            is_signal && (valid.name.ends_with(VALID[0]) || !has_entry && !has_place)
        });
        for name in [Some(point), valid].into_iter().flatten().map(|point| &point.name) {
            let has_place = field.is_some_and(|field| field.inputs.contains_key(name));
            if !taken.insert(name.clone()) || has_place {
                let message = format!("two sources of the input `{name}` of `{}`", member.name);
                diagnostics.push(
                    Diagnostic::error("U0224", message, entries[place].name.span.clone())
                        .with_help("keep one: a place in the field, an operator or a signal"),
                );
            }
        }
        let kind = match source {
            SourceText::Operator(text) => {
                let keeps =
                    member.code.as_ref().is_some_and(|(code, _)| code.typed().is_retentive());
                if text.retain && !keeps {
                    let message =
                        format!("`{}` has `retain`, and its program starts cold", point.name);
                    let help = "after a power failure a program with a retentive variable starts warm, with the values of such inputs: declare one \
                                (RETAIN), or leave `retain` out";
                    diagnostics.push(misfit(message, text.span.clone(), help));
                }
                operator(text, point, period, diagnostics)
            }
            SourceText::Signal { from, default, stale_after } => {
                let signal = Signal {
                    from: from.as_ref(),
                    default: default.as_ref(),
                    stale_after: *stale_after,
                };
                match from.as_ref().and_then(|from| group_signal(&from.value)) {
                    Some(group) => signal.of_group(group, point, valid, period, diagnostics),
                    None => signal.resolve(point, valid, index, members, diagnostics),
                }
            }
        };
        sources.extend(kind.map(|kind| InputSource { name: point.name.clone(), kind }));
    }
    sources
}

/// The outputs that programs read of each other, as `controller.output`.
pub(super) fn outputs_read(sections: &[RemoteIoSection]) -> BTreeSet<String> {
    let sources = sections.iter().flat_map(|section| &section.inputs);
    let from = sources.filter_map(|entry| match &entry.source {
        SourceText::Signal { from, .. } => from.as_ref(),
        SourceText::Operator(_) => None,
    });
    let from = from.filter(|from| group_signal(&from.value).is_none());
    from.map(|from| from.value.clone()).collect()
}

fn misfit(message: String, span: Range<usize>, help: &str) -> Diagnostic {
    Diagnostic::error("U0225", message, span).with_help(help.to_owned())
}

/// The stored form of a value in the file, of a signal that is declared so.
pub(super) fn value(
    key: &str,
    value: &Placed<Constant>,
    declared: &Declared,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<u64> {
    match stored_value(&value.value, declared) {
        Ok(stored) => Some(stored),
        Err(expected) => {
            let message = format!("`{key}` of {} {declared}: {expected}", declared.article());
            diagnostics.push(Diagnostic::error("U0204", message, value.span.clone()));
            None
        }
    }
}

/// What is done where two enumerations have other numbers for their names.
pub(super) const OTHER_NUMBERS: &str =
    "give each name of the sender the same number in the enumeration of the receiver";

/// The least and the greatest value of an enumeration, as stored.
fn ends(point: &Point) -> Option<(u64, u64)> {
    let numbers = || point.values.iter().flat_map(|known| &known.values).map(|(_, value)| *value);
    let stored = |number: i64| number as u64 & point.of.mask();
    Some((stored(numbers().min()?), stored(numbers().max()?)))
}

fn operator(
    text: &OperatorText,
    point: &Point,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<InputSourceKind> {
    let before = diagnostics.len();
    let word = OPERATOR_INPUTS[text.kind?];
    for key in &text.special {
        let fits = matches!(
            (word, key.value),
            ("pulse", "duration")
                | ("setpoint", "low" | "high" | "unit" | "retain")
                | ("level", "retain")
        );
        if !fits {
            let message = format!("`{}` does not belong to a {word}", key.value);
            diagnostics.push(Diagnostic::error("U0202", message, key.span.clone()).with_help(
                "`duration` belongs to a pulse; `low`, `high` and `unit` belong to a setpoint; `retain` belongs to a level or a setpoint",
            ));
        }
    }
    let is_number = point.of != Elementary::Bool;
    if is_number != (word == "setpoint") {
        let message = format!("a {word} for the input `{}`, which is {}", point.name, point.of);
        let help = "a level and a pulse are for a BOOL, a setpoint is for a number or a TIME";
        diagnostics.push(misfit(message, text.span.clone(), help));
        return None;
    }
    let mut optional = |key: &str, found: Option<&Placed<Constant>>| {
        found.and_then(|found| value(key, found, &point.declared(), diagnostics))
    };
    let (least, most) = ends(point).unzip();
    let low = optional("low", text.low.as_ref()).or(least);
    let high = optional("high", text.high.as_ref()).or(most);
    let initial = optional("initial", text.initial.as_ref());
    let kind = match word {
        "level" => OperatorInputKind::Level,
        "pulse" => {
            let samples = text.duration.as_nanos().div_ceil(period.as_nanos().max(1));
            OperatorInputKind::Pulse(u32::try_from(samples).unwrap_or(u32::MAX).max(1))
        }
        _ => {
            for (key, found) in [("low", &text.low), ("high", &text.high)] {
                if found.is_none() && point.values.is_none() {
                    let message = format!("the setpoint `{}` has no `{key}`", point.name);
                    diagnostics.push(
                        Diagnostic::error("U0203", message, text.span.clone()).with_help(format!(
                            "add `{key} = …`, the limit of what an operator may write"
                        )),
                    );
                }
            }
            let (low, high) = (low?, high?);
            if !in_order(point.of, low, high) {
                let message = format!("`low` of the setpoint `{}` is above `high`", point.name);
                diagnostics.push(Diagnostic::error("U0205", message, text.span.clone()));
            }
            OperatorInputKind::Setpoint { low, high }
        }
    };
    let input = OperatorInput {
        place: PointPlace::of(point),
        kind,
        initial: initial.or(low).unwrap_or(0),
        role: [Role::Operator, Role::Engineer][text.role],
        retains: text.retain,
    };
    if let OperatorInputKind::Setpoint { low, high } = kind
        && in_order(point.of, low, high)
        && !(in_order(point.of, low, input.initial) && in_order(point.of, input.initial, high))
    {
        let message = format!("`initial` of the setpoint `{}` is outside its limits", point.name);
        let span = text.initial.as_ref().map_or(text.span.clone(), |it| it.span.clone());
        diagnostics.push(Diagnostic::error("U0205", message, span));
    }
    (diagnostics.len() == before).then(|| {
        InputSourceKind::Operator(OperatorDeclaration {
            input,
            declared: point.declared(),
            title: text.title.clone(),
            unit: text.unit.clone(),
            confirm: text.confirm,
            group: None,
        })
    })
}

/// The parts of `group/controller.output`.
fn group_signal(from: &str) -> Option<GroupSignal> {
    let (group, signal) = from.split_once('/')?;
    let (controller, output) = signal.split_once('.').unwrap_or((signal, ""));
    Some(GroupSignal {
        group: group.to_owned(),
        controller: controller.to_owned(),
        output: output.to_owned(),
    })
}

/// Shortest time for which a value of another group holds.
const GROUP_STALE_AFTER: Duration = Duration::from_secs(1);

/// The bit of the input that says whether a signal is valid, where there is one; nothing where it is no BOOL.
fn valid_bit(
    valid: Option<&Point>,
    span: &Range<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Option<u16>> {
    if let Some(valid) = valid.filter(|valid| valid.of != Elementary::Bool) {
        let message = format!("`{}` is {}", valid.name, valid.of);
        let help = "the input that says whether a signal is valid is a BOOL";
        diagnostics.push(misfit(message, span.clone(), help));
        return None;
    }
    Some(valid.map(|valid| PointPlace::of(valid).bit))
}

/// A signal as it is declared.
struct Signal<'a> {
    from: Option<&'a Placed<String>>,
    default: Option<&'a Placed<Constant>>,
    stale_after: u32,
}

impl Signal<'_> {
    fn of_group(
        &self,
        group: GroupSignal,
        point: &Point,
        valid: Option<&Point>,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<InputSourceKind> {
        let default = self
            .default
            .and_then(|default| value("default", default, &point.declared(), diagnostics));
        let Placed { value: from, span } = self.from?;
        let is_name = |text: &str| !text.is_empty() && !text.contains(['/', '*', '$', '?', '#']);
        if ![&group.group, &group.controller, &group.output].into_iter().all(|text| is_name(text)) {
            let message = format!("`{from}` names no output of another group");
            let help = "write cluster, controller and output, such as \"line-1/press.done\"";
            diagnostics.push(Diagnostic::error("U0209", message, span.clone()).with_help(help));
            return None;
        }
        let least = GROUP_STALE_AFTER.as_nanos().div_ceil(period.as_nanos().max(1));
        if u128::from(self.stale_after) < least {
            let message =
                format!("`stale_after` of the signal `{from}` is {} cycles", self.stale_after);
            let help = format!(
                "a signal of another group takes at least 1 s: write `stale_after = {least}` or more"
            );
            diagnostics.push(Diagnostic::error("U0225", message, span.clone()).with_help(help));
        }
        let valid = valid_bit(valid, span, diagnostics)?;
        Some(InputSourceKind::Operator(OperatorDeclaration {
            input: OperatorInput {
                place: PointPlace::of(point),
                kind: OperatorInputKind::Group { stale_after: self.stale_after, valid },
                initial: default?,
                role: Role::Operator,
                retains: false,
            },
            declared: point.declared(),
            title: None,
            unit: None,
            confirm: false,
            group: Some(group),
        }))
    }

    fn resolve(
        &self,
        point: &Point,
        valid: Option<&Point>,
        index: usize,
        members: &[Member],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<InputSourceKind> {
        let default = self
            .default
            .and_then(|default| value("default", default, &point.declared(), diagnostics));
        let Placed { value: from, span } = self.from?;
        let unknown = |message: String, help: String| {
            Diagnostic::error("U0209", message, span.clone()).with_help(help)
        };
        let Some((controller, output)) = from.split_once('.') else {
            let message = format!("`{from}` names no output of a controller");
            let help = "write controller and output with a dot between, such as \"press.done\"";
            diagnostics.push(unknown(message, help.to_owned()));
            return None;
        };
        let Some(source) = members.iter().position(|member| member.name == controller) else {
            let known = members.iter().map(|member| member.name.as_str());
            let help = suggestion(controller, known);
            diagnostics.push(unknown(format!("there is no controller `{controller}`"), help));
            return None;
        };
        if source == index {
            let message = format!("`{controller}` reads its own output `{output}`");
            let help =
                "a program knows its own outputs: read the output or a variable in the program";
            diagnostics.push(misfit(message, span.clone(), help));
            return None;
        }
        let (_, Interface { outputs, .. }) = members[source].code.as_ref()?;
        let Some(found) = outputs.find(output) else {
            let help = suggestion(output, outputs.names());
            diagnostics.push(unknown(format!("`{controller}` has no output `{output}`"), help));
            return None;
        };
        let (sent, received) = (found.declared(), point.declared());
        if !received.takes(&sent) {
            let message =
                format!("`{from}` is {sent}, and the input `{}` is {received}", point.name);
            let help = match sent.of == received.of {
                true if sent.values.is_some() => OTHER_NUMBERS,
                true => "declare the output with a range within that of the input",
                false => "declare both with the same type",
            };
            diagnostics.push(misfit(message, span.clone(), help));
            return None;
        }
        let valid = valid_bit(valid, span, diagnostics)?;
        let signal = SignalInput {
            from: ProgramId(source as u8),
            output: PointPlace::of(found).bit,
            place: PointPlace::of(point),
            valid,
            default: default?,
            stale_after: self.stale_after,
        };
        Some(InputSourceKind::Signal(SignalDeclaration {
            input: signal,
            output: found.name.clone(),
        }))
    }
}
