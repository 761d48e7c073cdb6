//! The project file: which ladder, which plant or records, which channels may fail, and Λ; `docs/reconfiguration.md` describes it.
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

mod fields;
mod patience;
mod relations;

use std::collections::BTreeMap;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_diagnostic::{Diagnostic, Report, has_errors};
use understudy_interchange::parse_program;
use understudy_ladder::Program;

use self::fields::Fields;
use self::patience::patience;
pub use self::relations::{Pattern, RelationEntry};
use crate::command::Objective;
use crate::diagnosis::Patience;
use crate::mega::Analysis;

/// The longest project file in bytes.
pub const MAXIMUM_TEXT_BYTES: usize = 1 << 20;

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
        let inputs: Vec<&str> = self
            .ladder
            .inputs
            .iter()
            .map(|signal| signal.name.as_str())
            .collect();
        let mut places = Vec::new();
        for name in names {
            match inputs.iter().position(|input| input == name) {
                Some(place) if places.contains(&place) => {}
                Some(place) => places.push(place),
                None => {
                    let found = fields::unknown("input", name, 0..0, &inputs);
                    return Err(format!(
                        "{}; {}",
                        found.message,
                        found.help.unwrap_or_default()
                    ));
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
    let mut reader = Reader {
        open,
        diagnostics: Vec::new(),
        ladders: Vec::new(),
    };
    let project = reader.read(text);
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    let mut reports = vec![Report {
        name: name.to_owned(),
        text: text.to_owned(),
        diagnostics,
    }];
    reports.extend(reader.ladders);
    let wrong = reports.iter().any(Report::has_errors);
    Loaded {
        project: project.filter(|_| !wrong),
        reports,
    }
}

struct Reader<'o> {
    open: &'o mut dyn FnMut(&str) -> Result<String, String>,
    diagnostics: Vec<Diagnostic>,
    ladders: Vec<Report>,
}

impl Reader<'_> {
    fn read(&mut self, text: &str) -> Option<Project> {
        if text.len() > MAXIMUM_TEXT_BYTES {
            let message = format!(
                "the file has {} bytes; at most {MAXIMUM_TEXT_BYTES}",
                text.len()
            );
            self.diagnostics
                .push(Diagnostic::error("U1207", message, 0..0));
            return None;
        }
        let (table, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            let span = error.span().unwrap_or(0..0);
            self.diagnostics
                .push(Diagnostic::error("U1201", error.message().to_owned(), span));
        }
        if has_errors(&self.diagnostics) {
            return None;
        }
        let span = table.span();
        let top = Fields::new(
            "the file",
            table.get_ref(),
            span,
            &["project", "relation", "diagnosis"],
            &mut self.diagnostics,
        );
        let section = top.table("project", &mut self.diagnostics);
        let Some((section, span)) = section else {
            top.require(&["project"], &mut self.diagnostics);
            return None;
        };
        const KEYS: [&str; 9] = [
            "ladder",
            "plant",
            "records",
            "period",
            "channels",
            "simultaneous",
            "detection",
            "objective",
            "weights",
        ];
        let fields = Fields::new("[project]", section, span, &KEYS, &mut self.diagnostics);
        fields.require(&["ladder"], &mut self.diagnostics);
        let ladder = fields
            .text("ladder", &mut self.diagnostics)
            .and_then(|name| self.ladder(&name));
        let plant = fields
            .text("plant", &mut self.diagnostics)
            .and_then(|name| self.ladder(&name));
        let records = fields.texts("records", &mut self.diagnostics);
        let mut read_records = Vec::new();
        for record in &records {
            match (self.open)(record.get_ref()) {
                Ok(text) => read_records.push((record.get_ref().clone(), text)),
                Err(reason) => self.unreadable(record, &reason),
            }
        }
        if fields.lacks("plant") && records.is_empty() {
            let message = "[project] has neither a `plant` nor `records`";
            self.diagnostics.push(
                Diagnostic::error("U1203", message, fields.span.clone())
                    .with_help("a plant is a ladder whose outputs are the inputs of this one; records are files of scans"),
            );
        }
        let period = fields.time("period", Duration::from_millis(10), &mut self.diagnostics);
        let analysis = fields.word("detection", &["late", "prompt"], &mut self.diagnostics);
        let objective = fields.word("objective", &["fewest", "nearest"], &mut self.diagnostics);
        let simultaneous = fields.count("simultaneous", 1..=64, &mut self.diagnostics);
        let channels = fields.texts("channels", &mut self.diagnostics);
        let ladder = ladder?;
        let inputs: Vec<&str> = ladder
            .inputs
            .iter()
            .map(|signal| signal.name.as_str())
            .collect();
        let outputs: Vec<&str> = ladder
            .outputs
            .iter()
            .map(|signal| signal.name.as_str())
            .collect();
        let chosen = if fields.lacks("channels") {
            (0..inputs.len().min(64)).collect()
        } else {
            self.places(&channels, &inputs, "input")
        };
        let objective = match self.weights(&fields, &outputs) {
            Some(weights) => Objective::Weights(weights),
            None if objective == 1 => Objective::Nearest,
            None => Objective::Fewest,
        };
        let patience = patience(&top, period, &mut self.diagnostics);
        if let Some(span) = top.place("diagnosis")
            && plant.is_none()
            && fields.lacks("plant")
        {
            let message =
                "[diagnosis] needs a `plant`: records do not say how long a state may last";
            self.diagnostics
                .push(Diagnostic::error("U1203", message, span));
        }
        let relation = relations::read(&top, &inputs, &outputs, &mut self.diagnostics);
        Some(Project {
            plant,
            records: read_records,
            period,
            simultaneous: simultaneous.unwrap_or(2).min(chosen.len()),
            channels: chosen,
            analysis: if analysis == 1 {
                Analysis::Prompt
            } else {
                Analysis::Late
            },
            objective,
            relation,
            patience,
            ladder,
        })
    }

    fn unreadable(&mut self, name: &Spanned<String>, reason: &str) {
        let message = format!("{} cannot be read: {reason}", name.get_ref());
        self.diagnostics.push(
            Diagnostic::error("U1208", message, name.span())
                .with_help("names of files are relative to the project file"),
        );
    }

    fn ladder(&mut self, name: &Spanned<String>) -> Option<Program> {
        let text = match (self.open)(name.get_ref()) {
            Ok(text) => text,
            Err(reason) => {
                self.unreadable(name, &reason);
                return None;
            }
        };
        let parsed = parse_program(name.get_ref(), &text);
        let wrong = has_errors(&parsed.diagnostics);
        self.ladders.push(Report {
            name: name.get_ref().clone(),
            text,
            diagnostics: parsed.diagnostics,
        });
        (!wrong).then_some(parsed.program)
    }

    fn places(&mut self, names: &[Spanned<String>], known: &[&str], what: &str) -> Vec<usize> {
        let mut places = Vec::new();
        for name in names {
            match known.iter().position(|known| *known == name.get_ref()) {
                Some(place) if places.contains(&place) => {}
                Some(place) => places.push(place),
                None => {
                    self.diagnostics
                        .push(fields::unknown(what, name.get_ref(), name.span(), known))
                }
            }
        }
        places.truncate(64);
        places
    }

    fn weights(&mut self, fields: &Fields<'_, '_>, outputs: &[&str]) -> Option<Vec<f64>> {
        let (table, _) = fields.table("weights", &mut self.diagnostics)?;
        let mut weights: BTreeMap<&str, f64> = BTreeMap::new();
        for (name, value) in table.iter() {
            let text = name.get_ref().as_ref();
            let Some(output) = outputs.iter().find(|output| **output == text) else {
                self.diagnostics
                    .push(fields::unknown("output", text, name.span(), outputs));
                continue;
            };
            let number = match value.get_ref() {
                DeValue::Integer(number) => number.as_str().parse::<f64>().ok(),
                DeValue::Float(number) => number.as_str().parse::<f64>().ok(),
                _ => None,
            };
            match number.filter(|number| (0.0..=1e6).contains(number)) {
                Some(number) => {
                    weights.insert(output, number);
                }
                None => {
                    let message = format!("the weight of `{text}` is no number from 0 to 1000000");
                    self.diagnostics
                        .push(Diagnostic::error("U1207", message, value.span()));
                }
            }
        }
        Some(
            outputs
                .iter()
                .map(|output| weights.get(output).copied().unwrap_or(1.0))
                .collect(),
        )
    }
}
