//! What the new programs of an online change do in another way, by proof.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};
use understudy_bits::{Switch, System};
use understudy_cluster::{
    ChangeTexts, ChangedPoint, Cluster, CommonPoints, Controller, PointFate, Way, changed_points,
    nearest_of, origins, states_at_change,
};
use understudy_typed::Program;
use understudy_verification::numbers::{Answer, Difference, Run};
use understudy_verification::program::Bounds;
use understudy_verification::scan_table;
use understudy_verification::symbolic::Signal;
use understudy_view::{Bounds as Kept, Model};

/// Cycles of a run that are read for the newest state.
const NEWEST: Kept = Kept { cycles: 256, events: 1, changes: 1, timings: 1 };

/// Number of outputs whose runs are printed for each program.
const SHOWN: usize = 5;

/// Number of outputs that a line names.
const MOST_NAMES: usize = 12;

/// The differences of all programs that change.
pub(super) struct Differences(Vec<OfProgram>);

struct OfProgram {
    program: String,
    /// The cycle after whose state the change is; nothing where it is before any scan of the old program.
    after: Option<i64>,
    /// Why the change is not before the newest state of the run that was named.
    no_state: Option<String>,
    outcome: Result<Vec<OfOutput>, String>,
    /// Outputs that the two programs do not have in common.
    lone: Vec<ChangedPoint>,
}

struct OfOutput {
    name: String,
    verdict: Verdict,
}

enum Verdict {
    Equal,
    /// In the last scan of a run.
    Differs(Shown),
    Undecided(String),
}

/// A run that is shown.
struct Shown {
    /// The scan before which the program changes, from 0.
    changed: usize,
    text: String,
    json: Value,
}

/// The newest states in a run.
pub(super) fn newest_states(run: &understudy_view::Run) -> Option<Model> {
    run.read(NEWEST).ok()
}

impl Differences {
    /// Of all programs that change; `live` are the states that they are in. What is not decided within `budget` stays undecided.
    pub(super) fn of(
        (before, after): (&Cluster, &Cluster),
        texts: &ChangeTexts,
        live: Option<&Model>,
        budget: Duration,
    ) -> Self {
        let begin = Instant::now();
        let go_on = |_| begin.elapsed() < budget;
        let bounds = Bounds { go_on: &go_on, ..Bounds::default() };
        let programs = texts.programs.iter().map(|changed| {
            let place = changed.program.index();
            let (old, new) = (&before.controllers()[place], &after.controllers()[place]);
            let state = live.map(|live| live.newest_state(changed.program, old.hash));
            let (state, no_state) = match state {
                Some(Ok(state)) => (Some(state), None),
                Some(Err(error)) => (None, Some(error.to_string())),
                None => (None, None),
            };
            OfProgram {
                program: new.name.clone(),
                after: state.as_ref().map(|(cycle, _)| *cycle),
                no_state,
                outcome: outcome(
                    (old, new),
                    state.as_ref().map(|(_, state)| state.as_slice()),
                    bounds,
                ),
                lone: changed_points(before, after, changed.program, Way::There)
                    .into_iter()
                    .filter(ChangedPoint::is_lone_output)
                    .collect(),
            }
        });
        Self(programs.collect())
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for program in &self.0 {
            let _ = writeln!(text, "{}", program.text().trim_end());
        }
        text.trim_end().to_owned()
    }

    pub(super) fn json(&self) -> Value {
        self.0.iter().map(OfProgram::json).collect()
    }
}

fn outcome(
    controllers: (&Controller, &Controller),
    state: Option<&[u64]>,
    bounds: Bounds<'_>,
) -> Result<Vec<OfOutput>, String> {
    let (old, new) = (&controllers.0.code, &controllers.1.code);
    let same = CommonPoints::of(controllers.0, controllers.1, Way::There).names();
    let (states, taken);
    let switch = match state {
        Some(state) => {
            states = states_at_change(old, new, state);
            let [before, after] = &states;
            Switch::Now { before, after }
        }
        None => {
            if let Some(name) = nearest_of(old, new) {
                return Err(format!(
                    "`{name}` can have a value that the new program does not have"
                ));
            }
            taken = origins(old, new);
            Switch::AnyScan { origins: &taken }
        }
    };
    let difference = Difference::between(old.typed(), new.typed(), switch, &same);
    let difference = difference.map_err(|error| error.to_string())?;
    let any_values = difference.any_values().iter().map(ToString::to_string);
    let any_values: Vec<String> = any_values.collect();
    let inexact = match any_values.is_empty() {
        true => difference.inexact().map(|inexact| inexact.to_string()),
        false => Some(any_values.join("; ")),
    };
    let answers = difference.check(bounds, &mut || {});
    let outputs = difference.outputs().zip(answers).map(|(name, answer)| {
        let verdict = match answer {
            Answer::Holds(_) => Verdict::Equal,
            Answer::Fails(Some(run)) => Verdict::Differs(Shown::of(&difference, &run)),
            Answer::Fails(None) => Verdict::Undecided("they differ in no finite run".to_owned()),
            Answer::Undecided(why) => {
                let why =
                    inexact.as_ref().map_or_else(|| why.clone(), |gaps| format!("{why}; {gaps}"));
                Verdict::Undecided(why)
            }
        };
        OfOutput { name: name.to_owned(), verdict }
    });
    Ok(outputs.collect())
}

impl Shown {
    fn of(difference: &Difference, run: &Run) -> Self {
        let circuit = difference.circuit();
        let signals = run.trace.signals.iter();
        let values = |signal: &Signal| run.trace.values(*signal).collect::<Vec<bool>>();
        let named: Map<String, Value> = signals
            .map(|signal| (signal.name(circuit).to_owned(), json!(values(signal))))
            .collect();
        let change = circuit.inputs().iter().position(|input| input == System::CHANGE);
        let scans = &run.trace.scans;
        let changed = change.and_then(|change| scans.iter().position(|scan| scan.inputs[change]));
        let changed = changed.unwrap_or(0);
        let mut text = scan_table(circuit, &run.trace);
        let mut numbers = Map::new();
        for row in &run.numbers {
            let _ = writeln!(text, "{}: {}", row.name, row.values.join(", "));
            numbers.insert(row.name.clone(), json!(row.values));
        }
        let json = json!({
            "changed_before_scan": changed,
            "differs_in_scan": scans.len().saturating_sub(1),
            "signals": named,
            "numbers": numbers,
        });
        Self { changed, text, json }
    }
}

/// A list of names, of which the first ones are written.
fn some_of(names: &[String]) -> String {
    let told = names.iter().take(MOST_NAMES).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MOST_NAMES) {
        0 => told,
        more => format!("{told} and {more} more"),
    }
}

impl OfProgram {
    fn text(&self) -> String {
        let mut text = String::new();
        let from = match self.after {
            Some(cycle) => format!("from the state after cycle {cycle} on"),
            None => "from every state of the old program on".to_owned(),
        };
        if let Some(why) = &self.no_state {
            let _ = writeln!(text, "{}: the state in the run is not known: {why}", self.program);
        }
        let outputs = match &self.outcome {
            Ok(outputs) => outputs,
            Err(why) => {
                let _ = writeln!(
                    text,
                    "{}: differences are not proved, because {why}; `rehearse` shows what they did in a run",
                    self.program
                );
                return text;
            }
        };
        let of = |wanted: fn(&Verdict) -> bool| {
            let found = outputs.iter().filter(move |output| wanted(&output.verdict));
            found.map(|output| format!("`{}`", output.name)).collect::<Vec<String>>()
        };
        let differs = of(|verdict| matches!(verdict, Verdict::Differs(_)));
        let undecided = of(|verdict| matches!(verdict, Verdict::Undecided(_)));
        let mut equal = of(|verdict| matches!(verdict, Verdict::Equal));
        // Whether a program is stopped by a fault is no output of the plant.
        equal.retain(|name| name.trim_matches('`') != Program::FAULT);
        let but = [differs, undecided].concat();
        let told = match (equal.is_empty(), but.is_empty()) {
            (true, true) if !self.lone.is_empty() => "no output is compared".to_owned(),
            (_, true) if self.lone.is_empty() => "proved equal in all outputs".to_owned(),
            (_, true) => format!("proved equal in {}", some_of(&equal)),
            (false, false) if self.lone.is_empty() => {
                format!("proved equal but for {}", but.join(", "))
            }
            (false, false) => {
                format!("proved equal in {}, not in {}", some_of(&equal), but.join(", "))
            }
            (true, false) => format!("not proved equal in any output: {}", but.join(", ")),
        };
        let _ = writeln!(text, "{}: {told}, {from}", self.program);
        if !self.lone.is_empty() {
            let lone = self.lone.iter().map(|point| {
                let why = match point.fate {
                    PointFate::New(..) => "is new",
                    PointFate::Removed(..) => "is removed",
                    _ => "has another type",
                };
                format!("`{}` {why}", point.name)
            });
            let _ = writeln!(text, "  not compared: {}", some_of(&lone.collect::<Vec<_>>()));
        }
        let mut left = SHOWN;
        for OfOutput { name, verdict } in outputs {
            match verdict {
                Verdict::Equal => {}
                Verdict::Differs(_) if left == 0 => {
                    let _ = writeln!(text, "  `{name}` can differ");
                }
                Verdict::Differs(run) => {
                    left -= 1;
                    let change = match self.after {
                        Some(_) => String::new(),
                        None => format!(", with the change before scan {}", run.changed),
                    };
                    let _ = writeln!(
                        text,
                        "  `{name}` can differ, as in the last scan of this run{change}:"
                    );
                    for line in run.text.lines() {
                        let _ = writeln!(text, "    {line}");
                    }
                }
                Verdict::Undecided(why) => {
                    let _ = writeln!(
                        text,
                        "  `{name}` is undecided: {why}; `rehearse` shows what it did in a run"
                    );
                }
            }
        }
        text
    }

    fn json(&self) -> Value {
        let outputs = self.outcome.iter().flatten().map(|OfOutput { name, verdict }| {
            let (word, run, why) = match verdict {
                Verdict::Equal => ("equal", None, None),
                Verdict::Differs(run) => ("differs", Some(&run.json), None),
                Verdict::Undecided(why) => ("undecided", None, Some(why)),
            };
            json!({ "output": name, "verdict": word, "run": run, "reason": why })
        });
        json!({
            "program": self.program,
            "after_cycle": self.after,
            "state_unknown": self.no_state,
            "outputs": outputs.collect::<Vec<_>>(),
            "not_compared": self.lone.iter().map(|point| &point.name).collect::<Vec<_>>(),
            "reason": self.outcome.as_ref().err(),
        })
    }
}
