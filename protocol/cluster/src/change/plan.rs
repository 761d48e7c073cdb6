//! What an online change would do, for people: to the variables of a program, to their initial values, and to the settings of remote I/Os.

use std::time::Duration;

use understudy_remote_io::{Fallback, PointPlace};
use understudy_typed::{CarriedPath, Fate, Point, Renamed};

use super::ChangeTexts;
use super::common::CommonPoints;
use super::settings::{ChangedSetting, changed_settings};
use crate::cluster::Cluster;
use crate::code::{Code, Way};
use crate::configuration::fallback_text;

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
        let common =
            CommonPoints::of(before.controllers().get(place)?, after.controllers().get(place)?, Way::There);
        let name = &both[0].name;
        let [old, new] = both.map(|it| format!("remote io {name}\n{}", fallback_text(&it.fallback)));
        let is_of_outputs = |setting: &ChangedSetting| {
            matches!(setting, ChangedSetting::Key { key, .. } if key == "`fail_safe`" || key == "`ramp`")
        };
        let mut settings = changed_settings(&old, &new);
        settings.retain(|setting| !is_of_outputs(setting));
        let [old, new] = both.map(|remote_io| &remote_io.fallback);
        for [was, is] in &common.outputs {
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

pub(super) fn fail_safe_value(output: &Point, fallback: &Fallback) -> String {
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
pub fn fates(before: &Code, after: &Code, way: Way) -> Vec<CarriedPath> {
    after.fates(before, way)
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
