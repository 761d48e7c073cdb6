//! The project file: which ladder, which plant or records, which channels may fail, and Λ; `docs/reference/reconfiguration.md` describes it.
//!
//! | code | what is wrong |
//! |---|---|
//! | U1201 | the text is no TOML |
//! | U1202 | a key that the section does not have |
//! | U1203 | a key or a section that is missing |
//! | U1204 | a value of another type than expected |
//! | U1205 | a name that the ladder does not have: an output, an event, a channel |
//! | U1206 | a row or a pattern of states that is none |
//! | U1207 | a number, a time or a word that is not possible |
//! | U1208 | a file that cannot be read, or a ladder that is wrong |
//! | U1251 | warning: a relation that concerns no state |
//! | U1252 | warning: a number whose bits do not all fail at once |

mod numbers;
mod patience;
mod relations;

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use toml::de::DeTable;
use understudy_interchange::read_ladder;
use understudy_ladder::Program;
use understudy_text::spelling::suggestion;
use understudy_text::tables::{Codes, Fields, Placed, Value};
use understudy_text::{Diagnostic, Report, has_errors};

use self::patience::patience;
pub use self::relations::{Pattern, RelationEntry};
use crate::command::Objective;
use crate::diagnosis::Patience;
use crate::mega::Analysis;

/// The longest project file in bytes.
pub const MAXIMUM_TEXT_BYTES: usize = 1 << 20;

const CODES: Codes = Codes {
    no_toml: "U1201",
    unknown_key: "U1202",
    missing_key: "U1203",
    wrong_type: "U1204",
    out_of_bounds: "U1207",
    unknown_word: "U1207",
};

/// Every time of a project.
const TIMES: RangeInclusive<Duration> = Duration::from_micros(1)..=Duration::from_secs(3600);

const WEIGHTS: RangeInclusive<f64> = 0.0..=1e6;

/// What holds where a project does not say.
const PERIOD: Duration = Duration::from_millis(10);
const SIMULTANEOUS: usize = 2;

/// A name that nothing has.
fn unknown(what: &str, name: &str, span: Range<usize>, known: &[&str]) -> Diagnostic {
    let bits = numbers::bits_of(name, known);
    if bits > 0 {
        let message = format!("`{name}` is a number, and each of its {bits} bits is an {what}");
        return Diagnostic::error("U1205", message, span)
            .with_help(format!("name its bits, from `{name}.0` for the lowest one on"));
    }
    Diagnostic::error("U1205", format!("there is no {what} `{name}`"), span)
        .with_help(suggestion(name, known.iter().copied()))
}

/// A project without errors.
#[derive(Debug, Clone)]
pub struct Project {
    /// Module 1.
    pub ladder: Program,
    /// What it is explored against.
    pub plant: Option<Program>,
    /// Recorded scans: the name and the text of each file.
    pub records: Vec<(String, String)>,
    /// From one scan to the next.
    pub period: Duration,
    /// The inputs that may fail, by their places.
    pub channels: Vec<usize>,
    /// How many of them at once.
    pub simultaneous: usize,
    /// What may have been missed before a failure is known.
    pub analysis: Analysis,
    /// Which of several safe commands.
    pub objective: Objective,
    /// Whether commands also prevent what leads to states that only the operator's release leaves.
    pub trim: bool,
    /// Λ, entry by entry.
    pub relation: Vec<RelationEntry>,
    /// How patient a diagnosing ladder is, where one is asked for.
    pub patience: Option<Patience>,
}

impl Project {
    /// Takes other inputs for those that may fail.
    ///
    /// # Errors
    /// Says which of the names is no input.
    pub fn choose(&mut self, names: &[String]) -> Result<(), String> {
        let inputs: Vec<&str> =
            self.ladder.inputs.iter().map(|signal| signal.name.as_str()).collect();
        let mut places = Vec::new();
        for name in names {
            match inputs.iter().position(|input| input == name) {
                Some(place) if places.contains(&place) => {}
                Some(place) => places.push(place),
                None => {
                    let found = unknown("input", name, 0..0, &inputs);
                    return Err(format!("{}; {}", found.message, found.help.unwrap_or_default()));
                }
            }
        }
        self.simultaneous = self.simultaneous.min(places.len());
        self.channels = places;
        Ok(())
    }
}

/// What reading answers.
#[derive(Debug)]
pub struct Loaded {
    /// Nothing where one of the reports has errors.
    pub project: Option<Project>,
    /// Of the project file, then of each ladder.
    pub reports: Vec<Report>,
}

/// Whether this TOML text is meant as a project: it has a table of that name.
pub fn looks_like_a_project(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    table.get_ref().contains_key("project")
}

/// Reads a project; `open` gives the text of a file by the name that stands there, or says why it cannot.
pub fn read(
    name: &str,
    text: &str,
    open: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Loaded {
    let mut reader = Reader { open, diagnostics: Vec::new(), ladders: Vec::new() };
    let project = reader.read(text);
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    let mut reports = vec![Report { name: name.to_owned(), text: text.to_owned(), diagnostics }];
    reports.extend(reader.ladders);
    let wrong = reports.iter().any(Report::has_errors);
    Loaded { project: project.filter(|_| !wrong), reports }
}

struct Reader<'o> {
    open: &'o mut dyn FnMut(&str) -> Result<String, String>,
    diagnostics: Vec<Diagnostic>,
    ladders: Vec<Report>,
}

impl Reader<'_> {
    fn read(&mut self, text: &str) -> Option<Project> {
        if text.len() > MAXIMUM_TEXT_BYTES {
            let message =
                format!("the file has {} bytes; at most {MAXIMUM_TEXT_BYTES}", text.len());
            self.diagnostics.push(Diagnostic::error("U1207", message, 0..0));
            return None;
        }
        let root = understudy_text::tables::parse(text, &CODES, &mut self.diagnostics)?;
        let table = Placed { value: root.get_ref(), span: root.span() };
        let found = &mut self.diagnostics;
        let mut top = Fields::new("the file", table, &CODES);
        top.require(&["project"], found);
        let project = top.table("project", "[project]", found);
        let diagnosis = top.table("diagnosis", "[diagnosis]", found);
        let relations = top.tables("relation", "[[relation]]", found);
        top.finish(found);
        let mut fields = project?;
        fields.require(&["ladder"], found);
        let ladder = fields.text("ladder", found);
        let plant = fields.text("plant", found);
        let records = fields.texts("records", found);
        let period = fields.time("period", TIMES, found).unwrap_or(PERIOD);
        let ladder = ladder.and_then(|name| self.ladder(&name, period));
        let plant = plant.and_then(|name| self.ladder(&name, period));
        let mut read_records = Vec::new();
        for record in &records {
            match (self.open)(record.value) {
                Ok(text) => read_records.push((record.value.to_owned(), text)),
                Err(reason) => self.unreadable(record, &reason),
            }
        }
        if !fields.has("plant") && records.is_empty() {
            let message = "[project] has neither a `plant` nor `records`";
            self.diagnostics.push(
                Diagnostic::error("U1203", message, fields.span())
                    .with_help("a plant is a ladder whose outputs are the inputs of this one; records are files of scans"),
            );
        }
        let found = &mut self.diagnostics;
        let analysis = fields.word("detection", &["late", "prompt"], found);
        let objective = fields.word("objective", &["fewest", "nearest"], found);
        let simultaneous = fields.count("simultaneous", 1..=64, found);
        let simultaneous = simultaneous.map_or(SIMULTANEOUS, |count| count.value as usize);
        let channels = fields.texts("channels", found);
        let weights = fields.get("weights").map(|weights| {
            let wanted = "a table from names of outputs to numbers";
            weights.entries(wanted, found)
        });
        let all_channels = !fields.has("channels");
        let has_plant = fields.has("plant");
        fields.finish(found);
        if let Some(diagnosis) = &diagnosis
            && !has_plant
        {
            let message =
                "[diagnosis] needs a `plant`: records do not say how long a state may last";
            self.diagnostics.push(Diagnostic::error("U1203", message, diagnosis.span()));
        }
        let patience =
            diagnosis.map(|diagnosis| patience(diagnosis, period, &mut self.diagnostics));
        let ladder = ladder?;
        let inputs: Vec<&str> = ladder.inputs.iter().map(|signal| signal.name.as_str()).collect();
        let outputs: Vec<&str> = ladder.outputs.iter().map(|signal| signal.name.as_str()).collect();
        let chosen = if all_channels {
            (0..inputs.len().min(64)).collect()
        } else {
            self.places(channels, &inputs, "input")
        };
        let objective = match weights.map(|weights| self.weights(weights, &outputs)) {
            Some(weights) => Objective::Weights(weights),
            None if objective == 1 => Objective::Nearest,
            None => Objective::Fewest,
        };
        let relation = relations::read(relations, &inputs, &outputs, &mut self.diagnostics);
        Some(Project {
            plant,
            records: read_records,
            period,
            simultaneous: simultaneous.min(chosen.len()),
            channels: chosen,
            analysis: if analysis == 1 { Analysis::Prompt } else { Analysis::Late },
            objective,
            trim: false,
            relation,
            patience,
            ladder,
        })
    }

    fn unreadable(&mut self, name: &Placed<&str>, reason: &str) {
        let message = format!("{} cannot be read: {reason}", name.value);
        self.diagnostics.push(
            Diagnostic::error("U1208", message, name.span.clone())
                .with_help("names of files are relative to the project file"),
        );
    }

    fn ladder(&mut self, name: &Placed<&str>, period: Duration) -> Option<Program> {
        let text = match (self.open)(name.value) {
            Ok(text) => text,
            Err(reason) => {
                self.unreadable(name, &reason);
                return None;
            }
        };
        let read = read_ladder(name.value, &text, Some(period));
        let program = read.program.filter(|_| !has_errors(&read.diagnostics));
        let (name, diagnostics) = (name.value.to_owned(), read.diagnostics);
        self.ladders.push(Report { name, text, diagnostics });
        program
    }

    fn places(&mut self, names: Vec<Placed<&str>>, known: &[&str], what: &str) -> Vec<usize> {
        let mut places = Vec::new();
        for Placed { value: name, span } in names {
            match known.iter().position(|known| *known == name) {
                Some(place) if places.contains(&place) => {}
                Some(place) => places.push(place),
                None => self.diagnostics.push(unknown(what, name, span, known)),
            }
        }
        places.truncate(64);
        places
    }

    /// The weight of each output; 1 where the file does not say.
    fn weights(
        &mut self,
        entries: Vec<(Placed<&str>, Value<'_, '_>)>,
        outputs: &[&str],
    ) -> Vec<f64> {
        let mut weights = vec![1.0; outputs.len()];
        for (Placed { value: name, span }, weight) in entries {
            let Some(place) = outputs.iter().position(|output| *output == name) else {
                self.diagnostics.push(unknown("output", name, span, outputs));
                continue;
            };
            if let Some(weight) = weight.number(WEIGHTS, &mut self.diagnostics) {
                weights[place] = weight.value;
            }
        }
        weights
    }
}
