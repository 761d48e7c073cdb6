//! What becomes of each input and output in an online change, for people.

use std::fmt;

use understudy_cycle::{OperatorInput, OperatorInputKind};
use understudy_executable::declared;
use understudy_typed::{Declared, Point, Points};
use understudy_wire::{ProgramId, Role};

use super::common::{named_after, stays};
use super::plan::fail_safe_value;
use crate::cluster::{Cluster, Controller, RemoteIo};
use crate::code::Way;
use crate::place::Place;
use crate::source::{InputSource, InputSourceKind, OperatorDeclaration};

/// What becomes of a point that an online change adds, removes or changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PointFate {
    /// Only the new program has it: its type, and the fail-safe value of an output.
    New(String, Option<String>),
    /// Only the old program has it: its type, and the fail-safe value that an output is left with.
    Removed(String, Option<String>),
    /// The old program has it by another name, which the new file pairs with this one: its value goes on.
    Renamed(String),
    /// It has another type, and is another point: its value is not kept; and the new fail-safe value of an output.
    Retyped([String; 2], Option<String>),
    /// It has another subrange or more names of values: its value goes on.
    Redeclared([String; 2]),
    /// It has another place in the device, or another scale there; "none" where it has none.
    Moved([String; 2]),
    /// An input that comes from elsewhere, or has other limits.
    Sourced([String; 2]),
    /// What an operator has written is lost, or some of the values that he may have written are: the values that continue, and the one that counts in
    /// the place of any other one.
    Unkept([String; 2]),
}

/// A point that an online change adds, removes or changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedPoint {
    /// Its name; of one that both programs have, in the new one.
    pub name: String,
    /// Whether it is an output.
    pub is_output: bool,
    /// What becomes of it.
    pub fate: PointFate,
}

impl PointFate {
    /// In one word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::New(..) => "new",
            Self::Removed(..) => "removed",
            Self::Renamed(_) => "renamed",
            Self::Retyped(..) => "retyped",
            Self::Redeclared(_) => "redeclared",
            Self::Moved(_) => "moved",
            Self::Sourced(_) => "sourced",
            Self::Unkept(_) => "narrowed",
        }
    }
}

impl ChangedPoint {
    /// Whether the two programs do not have the output in common.
    pub fn is_lone_output(&self) -> bool {
        let is_lone = matches!(
            self.fate,
            PointFate::New(..) | PointFate::Removed(..) | PointFate::Retyped(..)
        );
        self.is_output && is_lone
    }

    fn side(&self) -> &'static str {
        if self.is_output { "output" } else { "input" }
    }
}

impl fmt::Display for ChangedPoint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}  ", self.side(), self.name)?;
        match &self.fate {
            PointFate::New(of, None) | PointFate::Removed(of, None) => formatter.write_str(of),
            PointFate::New(of, Some(value)) => write!(formatter, "{of}, fail-safe {value}"),
            PointFate::Removed(of, Some(value)) => write!(formatter, "{of}, is left with {value}"),
            PointFate::Renamed(name) => write!(formatter, "from {name}"),
            PointFate::Retyped([before, now], value) => {
                write!(formatter, "{before} to {now}, its value is not kept")?;
                value.iter().try_for_each(|value| write!(formatter, ", fail-safe {value}"))
            }
            PointFate::Redeclared([before, now]) | PointFate::Moved([before, now]) => {
                write!(formatter, "{before} to {now}")
            }
            PointFate::Sourced([before, now]) => write!(formatter, "from: {before}; now: {now}"),
            PointFate::Unkept([kept, now]) => {
                write!(
                    formatter,
                    "{kept} is kept of what was written, and anything else becomes {now}"
                )
            }
        }
    }
}

/// A program with its remote I/O, in one of the two files.
struct Side<'a> {
    cluster: &'a Cluster,
    controller: &'a Controller,
    remote_io: &'a RemoteIo,
}

impl<'a> Side<'a> {
    fn of(cluster: &'a Cluster, program: ProgramId) -> Option<Self> {
        let controller = cluster.controllers().get(program.index())?;
        Some(Self { cluster, controller, remote_io: cluster.remote_ios().get(program.index())? })
    }

    fn points(&self, is_output: bool) -> &'a Points {
        let interface = &self.controller.interface;
        if is_output { &interface.outputs } else { &interface.inputs }
    }

    fn fail_safe(&self, point: &Point, is_output: bool) -> Option<String> {
        is_output.then(|| fail_safe_value(point, &self.remote_io.fallback))
    }

    /// Where a point is in the device.
    fn place(&self, point: &Point, is_output: bool) -> String {
        let field = self.remote_io.field.as_ref();
        let side = field.map(|it| if is_output { &it.outputs } else { &it.inputs });
        let mut bindings = side.into_iter().flat_map(|side| &side.bindings);
        let binding = bindings.find(|it| it.name == point.name);
        binding.map_or("none".to_owned(), |binding| place_text(&binding.place))
    }

    /// What an input comes from, where that is not the field.
    fn source(&self, point: &Point) -> String {
        let mut sources = self.remote_io.inputs.iter();
        let source = sources.find(|source| source.name == point.name);
        source.map_or("the field".to_owned(), |source| self.source_text(source, &point.declared()))
    }

    /// What operators write to an input.
    fn operator_input(&self, point: &Point) -> Option<&OperatorInput> {
        let source = self.remote_io.inputs.iter().find(|source| source.name == point.name)?;
        Some(&source.operator()?.input)
    }

    fn source_text(&self, source: &InputSource, declared: &Declared) -> String {
        let operator = match &source.kind {
            InputSourceKind::Operator(operator) => operator,
            InputSourceKind::Signal(signal) => {
                let from = self.cluster.controllers().get(signal.input.from.index());
                let from = from.map_or("", |from| from.name.as_str());
                return format!(
                    "{from}.{}, default {}, stale_after {}",
                    signal.output,
                    declared.text(signal.input.default),
                    signal.input.stale_after
                );
            }
        };
        let OperatorDeclaration { input, declared: _, title, unit, confirm, group } = operator;
        let initial = declared.text(input.initial);
        let mut text = match (input.kind, group) {
            (OperatorInputKind::Level, _) => format!("level, initial {initial}"),
            (OperatorInputKind::Pulse(samples), _) => format!("pulse of {samples} samples"),
            (OperatorInputKind::Setpoint { low, high }, _) => {
                let [low, high] = [low, high].map(|limit| declared.text(limit));
                format!("setpoint from {low} to {high}, initial {initial}")
            }
            (OperatorInputKind::Group { stale_after, .. }, group) => {
                let from = group.as_ref().map(|it| (&it.group, &it.controller, &it.output));
                let from =
                    from.map(|(of, controller, output)| format!("{of}/{controller}.{output}"));
                let from = from.unwrap_or_default();
                format!("{from}, default {initial}, stale after {stale_after} samples")
            }
        };
        if input.role == Role::Engineer {
            text += ", by engineers";
        }
        if input.retains {
            text += ", retained";
        }
        if *confirm {
            text += ", confirmed";
        }
        for (key, value) in [("title", title), ("unit", unit)] {
            text.extend(value.iter().map(|value| format!(", {key} `{value}`")));
        }
        text
    }
}

fn place_text(place: &Place) -> String {
    match place {
        Place::Number(registers) if registers.is_scaled() => {
            format!("{place}, scale {}, offset {}", registers.scale, registers.offset)
        }
        place => place.to_string(),
    }
}

/// Two declarations, with the names of values where these tell them apart.
fn declarations(was: &Point, is: &Point) -> [String; 2] {
    let declared = [was, is].map(Point::declared);
    let short = declared.each_ref().map(ToString::to_string);
    if short[0] != short[1] {
        return short;
    }
    declared.map(|declared| {
        let values = declared.values.iter().flat_map(|known| &known.values);
        let values: Vec<String> = values.map(|(name, value)| format!("{name} {value}")).collect();
        format!("{declared} ({})", values.join(", "))
    })
}

/// What of a written value of an input is lost; nothing where every value continues.
fn unkept(
    was: &Point,
    written: &OperatorInput,
    (is, now): (&Point, Option<&OperatorInput>),
) -> Option<PointFate> {
    let lasts = |input: &OperatorInput| {
        matches!(input.kind, OperatorInputKind::Level | OperatorInputKind::Setpoint { .. })
    };
    let declared = is.declared();
    // What comes from elsewhere now has another value anyhow.
    let now = now.filter(|_| lasts(written))?;
    let initial = declared.text(now.initial);
    let nothing = || Some(PointFate::Unkept(["nothing".to_owned(), initial.clone()]));
    if !stays(was, is) || !now.is_of_kind(written) {
        return nothing();
    }
    let (
        OperatorInputKind::Setpoint { low, high },
        OperatorInputKind::Setpoint { low: least, high: most },
    ) = (written.kind, now.kind)
    else {
        return None;
    };
    if now.admits(low) && now.admits(high) {
        return None;
    }
    let [least, most] = [least, most].map(|limit| declared.text(limit));
    Some(PointFate::Unkept([format!("a value from {least} to {most}"), initial]))
}

/// The points of a program that change: inputs, then outputs. Where a point is in an image is of no interest to people.
pub fn changed_points(
    before: &Cluster,
    after: &Cluster,
    program: ProgramId,
    way: Way,
) -> Vec<ChangedPoint> {
    let (Some(old), Some(new)) = (Side::of(before, program), Side::of(after, program)) else {
        return Vec::new();
    };
    let pairs = new.controller.code.renamed(&old.controller.code, way);
    let mut changed = Vec::new();
    for is_output in [false, true] {
        let points = (old.points(is_output), new.points(is_output));
        let mut note = |name: &str, fate| {
            changed.push(ChangedPoint { name: name.to_owned(), is_output, fate });
        };
        let mut found: Vec<&str> = Vec::new();
        for was in declared(points.0) {
            let Some(is) = named_after(was, points, &pairs) else {
                let of = was.declared().to_string();
                note(&was.name, PointFate::Removed(of, old.fail_safe(was, is_output)));
                continue;
            };
            let name = &is.name;
            found.push(name);
            if *name != was.name {
                note(name, PointFate::Renamed(was.name.clone()));
            }
            if !stays(was, is) {
                let fail_safe = new.fail_safe(is, is_output);
                note(name, PointFate::Retyped(declarations(was, is), fail_safe));
            } else if was.declared() != is.declared() {
                note(name, PointFate::Redeclared(declarations(was, is)));
            }
            let places = [old.place(was, is_output), new.place(is, is_output)];
            if places[0] != places[1] {
                note(name, PointFate::Moved(places));
            }
            let sources = [old.source(was), new.source(is)];
            if !is_output && sources[0] != sources[1] {
                note(name, PointFate::Sourced(sources));
            }
            if !is_output
                && let Some(written) = old.operator_input(was)
                && let Some(unkept) = unkept(was, written, (is, new.operator_input(is)))
            {
                note(name, unkept);
            }
        }
        for is in declared(points.1).filter(|is| !found.contains(&is.name.as_str())) {
            let of = is.declared().to_string();
            note(&is.name, PointFate::New(of, new.fail_safe(is, is_output)));
        }
    }
    changed
}
