//! What an online change would do, for people: to the variables of a program, to their initial values, and to the settings of remote I/Os.

use std::time::Duration;

use understudy_executable::declared;
use understudy_remote_io::{Fallback, PointPlace};
use understudy_typed::{CarriedPath, Fate, Point, Renamed};
use understudy_wire::ProgramId;

use super::ChangeTexts;
use super::points::{same_point, stays};
use super::settings::{ChangedSetting, changed_settings};
use crate::cluster::{Cluster, RemoteIo};
use crate::code::Code;
use crate::configuration::{fallback_text, input_line};

/// The settings of remote I/Os that an online change replaces, in the words of the cluster file, and those of outputs one by one.
pub fn changed_fallbacks(
    before: &Cluster,
    after: &Cluster,
    texts: &ChangeTexts,
) -> Vec<ChangedSetting> {
    let period = before.agreement().schedule.period();
    let touched = texts.touched();
    let changed = touched.iter().filter_map(|program| {
        let place = program.index();
        let both = [before.remote_ios().get(place)?, after.remote_ios().get(place)?];
        let [old_outputs, new_outputs] = [before, after].map(|cluster| {
            cluster.controllers().get(place).map(|controller| &controller.interface.outputs)
        });
        let name = &both[0].name;
        let [old, new] = both.map(|it| format!("remote io {name}\n{}", fallback_text(&it.fallback)));
        let is_of_outputs = |setting: &ChangedSetting| {
            matches!(setting, ChangedSetting::Key { key, .. } if key == "`fail_safe`" || key == "`ramp`")
        };
        let mut settings = changed_settings(&old, &new);
        settings.retain(|setting| !is_of_outputs(setting));
        let [old, new] = both.map(|remote_io| &remote_io.fallback);
        let new_outputs = new_outputs?;
        for was in old_outputs? {
            let Some(is) = same_point(was, new_outputs) else {
                continue;
            };
            let values = [
                ("fail_safe", [fail_safe_value(was, old), fail_safe_value(is, new)]),
                ("ramp", [ramp_value(was, old, period), ramp_value(is, new, period)]),
            ];
            let values = values.into_iter().filter(|(_, [old, new])| old != new);
            settings.extend(values.map(|(key, values)| ChangedSetting::Key {
                of: format!("remote I/O `{name}`"),
                key: format!("`{key}.{}`", is.name),
                values: Some(values),
            }));
        }
        Some(settings)
    });
    changed.flatten().collect()
}

/// What becomes of a point that an online change adds, removes or changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PointFate {
    /// Only the new program has it: its type, and the fail-safe value of an output.
    New(String, Option<String>),
    /// Only the old program has it: its type, and the fail-safe value that an output is left with.
    Removed(String, Option<String>),
    /// It has another type, and is another point: its value is not kept.
    Retyped([String; 2]),
    /// It has another place in the device; "none" where it has none.
    Moved([String; 2]),
    /// An input that comes from elsewhere, or has other limits.
    Sourced,
}

/// A point that an online change adds, removes or changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedPoint {
    /// Its name.
    pub name: String,
    /// Whether it is an output.
    pub is_output: bool,
    /// What becomes of it.
    pub fate: PointFate,
}

/// The points of a program that change: inputs, then outputs. Where a point is in an image is of no interest to people.
pub fn changed_points(before: &Cluster, after: &Cluster, program: ProgramId) -> Vec<ChangedPoint> {
    let place = program.index();
    let of = |cluster: &'_ Cluster| {
        let interface = cluster.controllers().get(place).map(|it| it.interface.clone());
        interface.zip(cluster.remote_ios().get(place).cloned())
    };
    let (Some((old, old_io)), Some((new, new_io))) = (of(before), of(after)) else {
        return Vec::new();
    };
    let mut changed = Vec::new();
    for (is_output, old, new) in
        [(false, &old.inputs, &new.inputs), (true, &old.outputs, &new.outputs)]
    {
        let fail_safe =
            |point: &Point, of: &RemoteIo| is_output.then(|| fail_safe_value(point, &of.fallback));
        let address = |name: &str, of: &RemoteIo| {
            let field = of.field.as_ref();
            let side = field.map(|it| if is_output { &it.outputs } else { &it.inputs });
            let binding = side.and_then(|side| side.bindings.iter().find(|it| it.name == name));
            binding.map_or("none".to_owned(), |binding| binding.place.to_string())
        };
        let source = |name: &str, of: &RemoteIo| {
            of.inputs.iter().find(|source| source.name == name).map(input_line)
        };
        let mut note = |name: &str, fate| {
            changed.push(ChangedPoint { name: name.to_owned(), is_output, fate });
        };
        for was in declared(old) {
            let name = &was.name;
            let Some(is) = new.find(name) else {
                let of = was.declared().to_string();
                note(name, PointFate::Removed(of, fail_safe(was, &old_io)));
                continue;
            };
            if !stays(was, is) {
                note(name, PointFate::Retyped([was, is].map(|it| it.declared().to_string())));
            }
            let places = [address(name, &old_io), address(name, &new_io)];
            if places[0] != places[1] {
                note(name, PointFate::Moved(places));
            }
            if !is_output && source(name, &old_io) != source(name, &new_io) {
                note(name, PointFate::Sourced);
            }
        }
        for is in declared(new).filter(|is| old.find(&is.name).is_none()) {
            let of = is.declared().to_string();
            note(&is.name, PointFate::New(of, fail_safe(is, &new_io)));
        }
    }
    changed
}

fn fail_safe_value(output: &Point, fallback: &Fallback) -> String {
    let stored = PointPlace::of(output).get(&fallback.fail_safe);
    format!("`{}`", output.declared().text(stored))
}

/// In units a second, as the file has it.
fn ramp_value(output: &Point, fallback: &Fallback, period: Duration) -> String {
    let place = PointPlace::of(output);
    let ramp = fallback.ramps.iter().find(|ramp| ramp.place == place);
    ramp.map_or("none".to_owned(), |ramp| {
        let per_second = ramp.step / period.as_secs_f64();
        format!("`{}`", (per_second * 1e6).round() / 1e6)
    })
}

/// What becomes of each variable of a program in an online change.
pub fn fates(before: &Code, after: &Code) -> Vec<CarriedPath> {
    after.fates(before)
}

/// The pairs of a program that have done their work: the program before has the new name already.
pub fn done_pairs(before: &Code, after: &Code) -> Vec<Renamed> {
    let is_done = |pair: &&Renamed| before.typed().has_path(&pair.1);
    after.source().renamed.iter().filter(is_done).cloned().collect()
}

/// An initial value that differs between two programs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedInitial {
    /// The path.
    pub path: String,
    /// The two values, as they are written; nothing of what has parts.
    pub values: Option<[String; 2]>,
}

/// Which of these paths, that go on with every value, begin with other ones in the program after: those count at its next start only.
pub fn changed_initials(before: &Code, after: &Code, paths: &[CarriedPath]) -> Vec<ChangedInitial> {
    let programs = [before, after].map(|code| code.typed());
    let states = programs.map(|program| program.initial_state());
    let goes_on = |path: &&CarriedPath| matches!(path.fate, Fate::Kept | Fate::Converted);
    let changed = paths.iter().filter(goes_on).filter_map(|path| {
        let was = path.renamed_from.as_ref().unwrap_or(&path.path);
        let [old, new] = [programs[0].part(was), programs[1].part(&path.path)];
        let parts = [old?, new?];
        let values = [0, 1].map(|side: usize| {
            let (_, stored) = parts[side].stored(&states[side])?;
            Some(parts[side].declared()?.text(stored))
        });
        let [slots, others] = [0, 1].map(|side: usize| {
            let first = (parts[side].address / 64) as usize;
            states[side].get(first..first + parts[side].of.slots() as usize)
        });
        let values = match values {
            [Some(one), Some(other)] => Some([one, other]),
            _ => None,
        };
        let is_equal = match &values {
            Some([one, other]) => one == other,
            None => slots == others,
        };
        (!is_equal).then(|| ChangedInitial { path: path.path.clone(), values })
    });
    changed.collect()
}
