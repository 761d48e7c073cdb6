//! What a change would do to the variables of its programs and to the settings of remote I/Os.

use std::fmt::Write as _;

use serde_json::{Value, json};
use understudy_cluster::{
    ChangeTexts, ChangedInitial, ChangedPoint, ChangedSetting, Cluster, PointFate,
    changed_fallbacks, changed_initials, changed_points, done_pairs, fates,
};
use understudy_typed::{CarriedPath, Fate, Renamed};

use super::difference::Differences;
use crate::answer::{Answer, Status};

pub(super) const NOTHING: &str = "the programs and the fail-safe settings of the two files are equal: there is nothing to change";

/// What would change.
pub(super) struct Plan {
    programs: Vec<PlannedProgram>,
    settings: Vec<ChangedSetting>,
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
}

impl Plan {
    pub(super) fn of(before: &Cluster, after: &Cluster, texts: &ChangeTexts) -> Self {
        let programs = texts.programs.iter().map(|changed| {
            let place = changed.program.index();
            let (old, new) = (&before.controllers()[place], &after.controllers()[place]);
            let paths = fates(&old.code, &new.code);
            let initials = changed_initials(&old.code, &new.code, &paths);
            let points = changed_points(before, after, changed.program);
            let done = done_pairs(&old.code, &new.code);
            PlannedProgram { name: new.name.clone(), paths, initials, points, done }
        });
        Self { programs: programs.collect(), settings: changed_fallbacks(before, after, texts) }
    }

    /// The way back, without the variables that only the new program has.
    pub(super) fn back(before: &Cluster, after: &Cluster, texts: &ChangeTexts) -> Self {
        let mut plan = Self::of(after, before, texts);
        for program in &mut plan.programs {
            program.paths.retain(|path| path.now.is_some());
        }
        plan
    }

    fn drops(&self) -> bool {
        let is_lost = |fate| matches!(fate, Fate::Dropped | Fate::Narrowed);
        self.programs.iter().any(|program| program.paths.iter().any(|path| is_lost(path.fate)))
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
        for PlannedProgram { name, paths, initials, points, done } in &self.programs {
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
                let _ = writeln!(text, "  {}", point_text(point));
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
        if self.settings.is_empty() {
            return String::new();
        }
        let settings: String =
            self.settings.iter().map(|setting| format!("\n  {setting}")).collect();
        format!("From `accept` on, and no sooner:{settings}")
    }

    fn settings_json(&self) -> Value {
        let bare = |text: &str| text.replace('`', "");
        let settings = self.settings.iter().map(|setting| match setting {
            ChangedSetting::Key { of, key, values } => {
                let [before, now] = match values {
                    Some([before, now]) => [Some(bare(before)), Some(bare(now))],
                    None => [None, None],
                };
                json!({ "of": bare(of), "setting": bare(key), "before": before, "now": now })
            }
            ChangedSetting::Section { of, .. } => json!({ "of": bare(of) }),
        });
        settings.collect()
    }

    pub(super) fn json(&self) -> Value {
        let programs =
            self.programs.iter().map(|PlannedProgram { name, paths, initials, points, done }| {
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
                })
            });
        Value::Array(programs.collect())
    }

    pub(super) fn answer(&self, differences: &Differences) -> Answer {
        let parts = [self.text(), self.settings_text(), differences.text()];
        let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        let text = if parts.is_empty() { NOTHING.to_owned() } else { parts.join("\n\n") };
        let result = json!({
            "plan": self.json(),
            "settings": self.settings_json(),
            "differences": differences.json(),
        });
        Answer::done(text, result)
    }
}

/// What becomes of a point, in one word.
fn word(fate: &PointFate) -> &'static str {
    match fate {
        PointFate::New(..) => "new",
        PointFate::Removed(..) => "removed",
        PointFate::Retyped(_) => "retyped",
        PointFate::Moved(_) => "moved",
        PointFate::Sourced => "sourced",
    }
}

fn point_text(ChangedPoint { name, is_output, fate }: &ChangedPoint) -> String {
    let side = if *is_output { "output" } else { "input" };
    let told = match fate {
        PointFate::New(of, None) | PointFate::Removed(of, None) => of.clone(),
        PointFate::New(of, Some(value)) => format!("{of}, fail-safe {value}"),
        PointFate::Removed(of, Some(value)) => format!("{of}, is left with {value}"),
        PointFate::Retyped([before, now]) => format!("{before} to {now}, its value is not kept"),
        PointFate::Moved([before, now]) => format!("{before} to {now}"),
        PointFate::Sourced => format!("`inputs.{name}` of the cluster file changes"),
    };
    format!("{:<9}  {side} {name}  {told}", word(fate))
}

fn point_json(ChangedPoint { name, is_output, fate }: &ChangedPoint) -> Value {
    let [before, now, fail_safe] = match fate.clone() {
        PointFate::New(of, value) => [None, Some(of), value],
        PointFate::Removed(of, value) => [Some(of), None, value],
        PointFate::Retyped([before, now]) | PointFate::Moved([before, now]) => {
            [Some(before), Some(now), None]
        }
        PointFate::Sourced => [None, None, None],
    };
    json!({
        "point": name,
        "side": if *is_output { "output" } else { "input" },
        "fate": word(fate),
        "before": before,
        "now": now,
        "fail_safe": fail_safe.map(|value| value.replace('`', "")),
    })
}
