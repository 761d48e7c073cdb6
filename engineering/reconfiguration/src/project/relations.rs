//! `[[relation]]`: the events, the rows of outputs that they need, and the states where that holds.

use std::ops::Range;
use std::sync::Arc;

use understudy_text::Diagnostic;
use understudy_text::tables::Fields;

use super::unknown;
use crate::controller::Controller;
use crate::relation::{Relation, Row};
use crate::signals::{Bits, Event, Signals};

/// A pattern of states: `0100-_----`, inputs and outputs, `-` where either will do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    bits: Vec<Option<bool>>,
}

impl Pattern {
    fn parse(text: &str, inputs: usize, outputs: usize) -> Option<Self> {
        let (left, right) = text.split_once('_')?;
        if left.chars().count() != inputs || right.chars().count() != outputs {
            return None;
        }
        let bit = |character| match character {
            '0' => Some(Some(false)),
            '1' => Some(Some(true)),
            '-' => Some(None),
            _ => None,
        };
        let bits = left.chars().chain(right.chars()).map(bit).collect::<Option<_>>()?;
        Some(Self { bits })
    }

    /// Whether it fits.
    pub fn fits(&self, inputs: &Bits, outputs: &Bits) -> bool {
        let vector = inputs.0.iter().chain(&outputs.0);
        self.bits.iter().zip(vector).all(|(wanted, is)| wanted.is_none_or(|wanted| wanted == *is))
    }
}

/// One `[[relation]]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RelationEntry {
    /// The events.
    pub events: Vec<Event>,
    /// Λ_e.
    pub rows: Arc<[Row]>,
    /// Where it holds; everywhere for none.
    pub states: Vec<Pattern>,
    /// Where it does not.
    pub except: Vec<Pattern>,
    /// Its place in the file.
    pub span: Range<usize>,
}

impl RelationEntry {
    /// Whether it holds in a state.
    fn holds(&self, inputs: &Bits, outputs: &Bits) -> bool {
        let any =
            |patterns: &[Pattern]| patterns.iter().any(|pattern| pattern.fits(inputs, outputs));
        (self.states.is_empty() || any(&self.states)) && !any(&self.except)
    }

    /// Λ of all entries for the states of `controller`; a later entry takes the place of an earlier one. Answers also with the
    /// entries that concern no state.
    pub fn compile(entries: &[Self], controller: &Controller) -> (Relation, Vec<Range<usize>>) {
        let mut relation = Relation::new(controller.states().len());
        let mut idle = Vec::new();
        for entry in entries {
            let mut concerned = false;
            for (place, state) in controller.states().iter().enumerate() {
                if entry.holds(&state.inputs, &state.outputs) {
                    concerned = true;
                    for &event in &entry.events {
                        relation.set(place, event, entry.rows.clone());
                    }
                }
            }
            if !concerned {
                idle.push(entry.span.clone());
            }
        }
        (relation, idle)
    }
}

pub(super) fn read(
    tables: Vec<Fields<'_, '_>>,
    inputs: &[&str],
    outputs: &[&str],
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<RelationEntry> {
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    let signals = Signals { inputs: names(inputs), outputs: names(outputs) };
    let mut entries = Vec::new();
    for mut fields in tables {
        fields.require(&["events", "rows"], diagnostics);
        let mut events = Vec::new();
        for name in fields.texts("events", diagnostics) {
            match signals.event(name.value) {
                Some(event) => events.push(event),
                None => {
                    let known: Vec<String> =
                        signals.events().map(|event| signals.event_name(event)).collect();
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    diagnostics.push(unknown("event", name.value, name.span, &known));
                }
            }
        }
        let mut rows = Vec::new();
        for text in fields.texts("rows", diagnostics) {
            let mut row = vec![None; outputs.len()];
            for word in text.value.split_whitespace() {
                let (name, value) = match word.strip_prefix('/') {
                    Some(name) => (name, false),
                    None => (word, true),
                };
                match outputs.iter().position(|output| *output == name) {
                    Some(place) if row[place] == Some(!value) => {
                        let message =
                            format!("the row {:?} wants `{name}` both on and off", text.value);
                        diagnostics.push(Diagnostic::error("U1206", message, text.span.clone()));
                    }
                    Some(place) => row[place] = Some(value),
                    None => diagnostics.push(unknown("output", name, text.span.clone(), outputs)),
                }
            }
            if row.iter().all(Option::is_none) {
                let message =
                    "a row without an output would always hold; leave the event out instead";
                diagnostics.push(Diagnostic::error("U1206", message, text.span));
            }
            rows.push(Row(row));
        }
        let mut patterns = |key| -> Vec<Pattern> {
            let texts = fields.texts(key, diagnostics);
            let parsed = texts.iter().filter_map(|text| {
                let pattern = Pattern::parse(text.value, inputs.len(), outputs.len());
                if pattern.is_none() {
                    let message = format!("{:?} is no pattern of states", text.value);
                    diagnostics.push(Diagnostic::error("U1206", message, text.span.clone()).with_help(format!(
                        "{} characters for the inputs, `_`, and {} for the outputs, each 0, 1 or -",
                        inputs.len(),
                        outputs.len()
                    )));
                }
                pattern
            });
            parsed.collect()
        };
        let states = patterns("states");
        let except = patterns("except");
        let span = fields.span();
        fields.finish(diagnostics);
        entries.push(RelationEntry { events, rows: rows.into(), states, except, span });
    }
    entries
}
