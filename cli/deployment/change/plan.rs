//! What a change would do to the variables of its programs and to the settings of remote I/Os.

use std::fmt::Write as _;

use serde_json::{Value, json};
use understudy_cluster::{
    ChangeTexts, ChangedInitial, ChangedPoint, ChangedSetting, Cluster, CommonPoints, PointFate,
    Way, changed_fallbacks, changed_initials, changed_points, done_pairs, fates, later_settings,
};
use understudy_typed::{CarriedPath, Fate, Renamed};

use super::difference::Differences;
use crate::answer::{Answer, Status};

const NOTHING: &str = "the programs and the fail-safe settings of the two files are equal: there is nothing to change";

/// What would change.
pub(super) struct Plan {
    programs: Vec<PlannedProgram>,
    settings: Vec<ChangedSetting>,
    /// What differs and is not changed.
    later: Vec<ChangedSetting>,
}

/// What would become of the variables of one program.
struct PlannedProgram {
    name: String,
    paths: Vec<CarriedPath>,
    initials: Vec<ChangedInitial>,
    /// Inputs and outputs that change.
    points: Vec<ChangedPoint>,
    /// Pairs that rename nothing any more.
    done: Vec<Renamed>,
    /// Alarms of the cluster before whose points are gone.
    ended_alarms: Vec<String>,
}

impl Plan {
    pub(super) fn of(before: &Cluster, after: &Cluster, texts: &ChangeTexts, way: Way) -> Self {
        let programs = texts.programs.iter().map(|changed| {
            let place = changed.program.index();
            let (old, new) = (&before.controllers()[place], &after.controllers()[place]);
            let paths = fates(&old.code, &new.code, way);
            let initials = changed_initials(&old.code, &new.code, &paths);
            let points = changed_points(before, after, changed.program, way);
            let done = done_pairs(&old.code, &new.code);
            let common = CommonPoints::of(old, new, way);
            let ended_alarms = before.alarms().iter().filter(|alarm| {
                let stay = if alarm.is_output { &common.outputs } else { &common.inputs };
                alarm.program == changed.program
                    && stay.iter().all(|[was, _]| was.name != alarm.point.name)
            });
            let ended_alarms = ended_alarms.map(|alarm| alarm.name.clone()).collect();
            let name = new.name.clone();
            PlannedProgram { name, paths, initials, points, done, ended_alarms }
        });
        Self {
            programs: programs.collect(),
            settings: changed_fallbacks(before, after, texts),
            later: later_settings(before, after),
        }
    }

    /// That nothing changes while the cluster runs, with what differs all the same.
    pub(super) fn nothing(&self) -> String {
        parts([NOTHING.to_owned(), self.later_text()])
    }

    /// The way back, without the variables that only the new program has.
    pub(super) fn back(before: &Cluster, after: &Cluster, texts: &ChangeTexts) -> Self {
        let mut plan = Self::of(after, before, texts, Way::Back);
        for program in &mut plan.programs {
            program.paths.retain(|path| path.now.is_some());
        }
        plan
    }

    fn drops(&self) -> bool {
        let is_lost = |fate| matches!(fate, Fate::Dropped | Fate::Narrowed);
        let is_unkept = |point: &ChangedPoint| matches!(point.fate, PointFate::Unkept(_));
        self.programs.iter().any(|program| {
            program.paths.iter().any(|path| is_lost(path.fate))
                || program.points.iter().any(is_unkept)
        })
    }

    /// Refuses a change that drops values, unless the engineer says that it may; `what` says which values, and what becomes of them.
    pub(super) fn permit(&self, may_drop: bool, what: &str) -> Result<(), Answer> {
        if may_drop || !self.drops() {
            return Ok(());
        }
        let message = format!("{what}; with --drop it continues\n{}", self.text());
        Err(Answer::failed(Status::BadInput, "U0635", message))
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for PlannedProgram { name, paths, initials, points, done, ended_alarms } in &self.programs {
            let count = |fate| paths.iter().filter(|path| path.fate == fate).count();
            let _ = writeln!(
                text,
                "{name}: {} variables kept, {} converted, {} narrowed, {} new, {} dropped",
                count(Fate::Kept),
                count(Fate::Converted),
                count(Fate::Narrowed),
                count(Fate::New),
                count(Fate::Dropped)
            );
            let is_told =
                |path: &&CarriedPath| path.fate != Fate::Kept || path.renamed_from.is_some();
            for path in paths.iter().filter(is_told) {
                let types = match (&path.before, &path.now) {
                    (Some(before), Some(now)) if before != now => format!("{before} to {now}"),
                    (Some(of), _) | (None, Some(of)) => of.clone(),
                    (None, None) => String::new(),
                };
                let was = path.renamed_from.as_ref();
                let was = was.map(|name| format!(", renamed from `{name}`")).unwrap_or_default();
                let _ = writeln!(text, "  {:<9}  {}  {types}{was}", path.fate.name(), path.path);
            }
            for initial in initials {
                let values = initial.values.as_ref();
                let values = values.map(|[one, other]| format!(" from {one} to {other}"));
                let values = values.unwrap_or_default();
                let _ = writeln!(
                    text,
                    "  {}: the initial value changes{values}, which counts at the next start only",
                    initial.path
                );
            }
            for point in points {
                let _ = writeln!(text, "  {:<9}  {point}", point.fate.word());
            }
            if !points.is_empty() {
                let _ = writeln!(text, "  all forces of {name} end with the switch");
            }
            for alarm in ended_alarms {
                let _ = writeln!(
                    text,
                    "  alarm {alarm}: its point is gone with the switch, so it is over until a change brings the point back"
                );
            }
            for (before, now) in done {
                let _ = writeln!(
                    text,
                    "  `{before}` is not renamed to `{now}`: the program before has `{now}`, which keeps its value"
                );
            }
        }
        text.trim_end().to_owned()
    }

    fn settings_text(&self) -> String {
        listed("From `accept` on, and no sooner:", &self.settings)
    }

    fn later_text(&self) -> String {
        let title = "Not changed now; from the next start of a member or a view with the new file on, and no sooner:";
        listed(title, &self.later)
    }

    pub(super) fn json(&self) -> Value {
        let programs = self.programs.iter().map(|planned| {
            let PlannedProgram { name, paths, initials, points, done, ended_alarms } = planned;
            let paths = paths.iter().map(|path| {
                json!({
                    "path": path.path,
                    "fate": path.fate.name(),
                    "renamed_from": path.renamed_from,
                    "before": path.before,
                    "now": path.now,
                })
            });
            let initials = initials.iter().map(|initial| {
                let [before, now] = match &initial.values {
                    Some([one, other]) => [Some(one), Some(other)],
                    None => [None, None],
                };
                json!({ "path": initial.path, "before": before, "now": now })
            });
            json!({
                "program": name,
                "paths": paths.collect::<Vec<_>>(),
                "points": points.iter().map(point_json).collect::<Vec<_>>(),
                "initial_values": initials.collect::<Vec<_>>(),
                "renamed_before": done.iter().map(|(_, now)| now).collect::<Vec<_>>(),
                "ended_alarms": ended_alarms,
            })
        });
        Value::Array(programs.collect())
    }

    pub(super) fn answer(&self, differences: &Differences) -> Answer {
        let changes = [self.text(), self.settings_text()];
        let text = match changes.iter().all(String::is_empty) {
            true => self.nothing(),
            false => {
                let [programs, settings] = changes;
                parts([programs, settings, self.later_text(), differences.text()])
            }
        };
        let result = json!({
            "plan": self.json(),
            "settings": settings_json(&self.settings),
            "later": settings_json(&self.later),
            "differences": differences.json(),
        });
        Answer::done(text, result)
    }
}

/// Parts of a text, without those that say nothing.
fn parts<const N: usize>(parts: [String; N]) -> String {
    let parts = parts.into_iter().filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join("\n\n")
}

fn listed(title: &str, settings: &[ChangedSetting]) -> String {
    if settings.is_empty() {
        return String::new();
    }
    let settings: String = settings.iter().map(|setting| format!("\n  {setting}")).collect();
    format!("{title}{settings}")
}

fn settings_json(settings: &[ChangedSetting]) -> Value {
    let bare = |text: &str| text.replace('`', "");
    let settings = settings.iter().map(|setting| match setting {
        ChangedSetting::Key { of, key, values } => {
            let [before, now] = match values {
                Some([before, now]) => [Some(bare(before)), Some(bare(now))],
                None => [None, None],
            };
            json!({ "of": bare(of), "setting": bare(key), "before": before, "now": now })
        }
        ChangedSetting::Section { of, is_new } => json!({ "of": bare(of), "is_new": is_new }),
    });
    settings.collect()
}

fn point_json(ChangedPoint { name, is_output, fate }: &ChangedPoint) -> Value {
    let [before, now, fail_safe] = match fate.clone() {
        PointFate::New(of, value) => [None, Some(of), value],
        PointFate::Removed(of, value) => [Some(of), None, value],
        PointFate::Renamed(name) => [Some(name), None, None],
        PointFate::Retyped([before, now], value) => [Some(before), Some(now), value],
        PointFate::Redeclared([before, now])
        | PointFate::Moved([before, now])
        | PointFate::Sourced([before, now])
        | PointFate::Unkept([before, now]) => [Some(before), Some(now), None],
    };
    json!({
        "point": name,
        "side": if *is_output { "output" } else { "input" },
        "fate": fate.word(),
        "before": before,
        "now": now,
        "fail_safe": fail_safe.map(|value| value.replace('`', "")),
    })
}
