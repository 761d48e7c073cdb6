//! An [`InputOutputMap`] from TOML.
//!
//! ```toml
//! program = "motivating_example"
//! start = "x0"
//!
//! [events]              # names for the numbers of TCT; none where the automaton has names
//! a = 0
//! c_hi = 1
//!
//! [[input]]
//! event = "a"
//! signal = "x_a"
//! when = "pulse"      # or rising (where not given), falling, high, low
//! by = "operator"     # or plant (where not given)
//!
//! [[switch]]
//! off = "c_cl"
//! positions = [{ event = "c_hi", signal = "x_c_hi" }, { event = "c_lo", signal = "x_c_lo" }]
//!
//! [[pulse]]
//! event = "e11"
//! signal = "start_machine_1"
//!
//! [[timer]]
//! event = "timeout"
//! name = "purge_time"
//! runs_while = "purging"
//! preset = "15s"
//! ```

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_diagnostic::{Diagnostic, has_errors};
use understudy_ladder::{MAXIMUM_PRESET_TIME, Name};

use super::map::{
    Agent, EventName, InputEvent, InputOutputMap, Position, Pulse, Request, Switch, Timer, When,
};
use super::partition::nearest;
use crate::Label;

/// What a text says, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadMap {
    /// The map; `None` where there are errors.
    pub map: Option<InputOutputMap>,
    /// In the order of their places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a map and finds everything that is wrong with its form: U0861 no TOML, U0862 an unknown key, U0863 a missing one,
/// U0864 a value of a wrong type, U0865 a word or time that is none of those possible. Whether the names mean something is
/// the business of [`Partition::new`](super::Partition::new).
pub fn read_map(text: &str) -> ReadMap {
    let mut reader = Reader {
        diagnostics: Vec::new(),
    };
    let (table, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let place = error.span().unwrap_or(text.len()..text.len());
        let message = format!("this is no TOML: {}", error.message().trim_end());
        reader
            .diagnostics
            .push(Diagnostic::error("U0861", message, place));
    }
    // What the recovery made of a broken text would only bring errors that follow from the first ones.
    let map = errors.is_empty().then(|| reader.map(table.get_ref()));
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    ReadMap {
        map: map.filter(|_| !has_errors(&diagnostics)),
        diagnostics,
    }
}

struct Reader {
    diagnostics: Vec<Diagnostic>,
}

type Place = Range<usize>;

impl Reader {
    fn map(&mut self, table: &DeTable) -> InputOutputMap {
        let keys = [
            "program", "start", "events", "input", "switch", "pulse", "timer", "request",
        ];
        self.known(table, &keys);
        let place = 0..0;
        InputOutputMap {
            program: self.text(table, "program", &place),
            start: self.optional(table, "start"),
            events: self.events(table),
            inputs: self.list(table, "input", |reader, entry, place| {
                reader.known(entry, &["event", "signal", "when", "by"]);
                InputEvent {
                    event: reader.text(entry, "event", place),
                    signal: reader.text(entry, "signal", place),
                    when: reader.word(entry, "when", &When::WORDS),
                    by: reader.word(entry, "by", &Agent::WORDS),
                }
            }),
            switches: self.list(table, "switch", |reader, entry, place| {
                reader.known(entry, &["off", "positions", "memory"]);
                reader.required(entry, "positions", place);
                Switch {
                    off: reader.optional(entry, "off"),
                    positions: reader.list(entry, "positions", |reader, entry, place| {
                        reader.known(entry, &["event", "signal"]);
                        Position {
                            event: reader.text(entry, "event", place),
                            signal: reader.text(entry, "signal", place),
                        }
                    }),
                    memory: reader.flag(entry, "memory"),
                }
            }),
            pulses: self.list(table, "pulse", |reader, entry, place| {
                reader.known(entry, &["event", "signal", "memory"]);
                Pulse {
                    event: reader.text(entry, "event", place),
                    signal: reader.text(entry, "signal", place),
                    memory: reader.flag(entry, "memory"),
                }
            }),
            timers: self.list(table, "timer", |reader, entry, place| {
                reader.known(entry, &["event", "name", "runs_while", "preset"]);
                Timer {
                    event: reader.text(entry, "event", place),
                    name: reader.text(entry, "name", place),
                    runs_while: reader.text(entry, "runs_while", place),
                    preset: reader.time(entry, "preset", place),
                }
            }),
            requests: self.list(table, "request", |reader, entry, place| {
                reader.known(entry, &["event", "signal"]);
                Request {
                    event: reader.text(entry, "event", place),
                    signal: reader.text(entry, "signal", place),
                }
            }),
        }
    }

    fn events(&mut self, table: &DeTable) -> Vec<EventName> {
        let Some(value) = table.get("events") else {
            return Vec::new();
        };
        let Some(entries) = value.get_ref().as_table() else {
            self.wrong_type("events", value, "a table from names to numbers");
            return Vec::new();
        };
        let mut events = Vec::new();
        for (name, value) in entries {
            let number = value.get_ref().as_integer();
            let number = number.and_then(|number| number.as_str().parse().ok());
            match number {
                Some(number) => events.push(EventName {
                    name: Name::at(name.get_ref().as_ref(), name.span()),
                    label: Label::new(number),
                }),
                None => self.wrong_type(name.get_ref(), value, "a number of an event"),
            }
        }
        events
    }

    fn known(&mut self, table: &DeTable, keys: &[&str]) {
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if !keys.contains(&name) {
                let message = format!("`{name}` is no key of this table");
                let help = nearest(name, &mut keys.iter().copied());
                let help = help.unwrap_or_else(|| format!("the keys are {}", keys.join(", ")));
                self.diagnostics
                    .push(Diagnostic::error("U0862", message, key.span()).with_help(help));
            }
        }
    }

    fn required(&mut self, table: &DeTable, key: &str, place: &Place) {
        if !table.contains_key(key) {
            let message = format!("`{key}` is missing");
            self.diagnostics
                .push(Diagnostic::error("U0863", message, place.clone()));
        }
    }

    fn wrong_type(&mut self, key: &str, value: &Spanned<DeValue>, expected: &str) {
        let message = format!("`{key}` is of type {}", value.get_ref().type_str());
        self.diagnostics.push(
            Diagnostic::error("U0864", message, value.span())
                .with_label(format!("expected {expected}")),
        );
    }

    fn optional(&mut self, table: &DeTable, key: &str) -> Option<Name> {
        let value = table.get(key)?;
        match value.get_ref().as_str() {
            Some(text) => Some(Name::at(text, value.span())),
            None => {
                self.wrong_type(key, value, "a name in quotes");
                None
            }
        }
    }

    fn text(&mut self, table: &DeTable, key: &str, place: &Place) -> Name {
        self.required(table, key, place);
        self.optional(table, key).unwrap_or_default()
    }

    fn flag(&mut self, table: &DeTable, key: &str) -> bool {
        let Some(value) = table.get(key) else {
            return false;
        };
        value.get_ref().as_bool().unwrap_or_else(|| {
            self.wrong_type(key, value, "true or false");
            false
        })
    }

    fn word<T: Copy + Default>(&mut self, table: &DeTable, key: &str, words: &[(&str, T)]) -> T {
        let Some(text) = self.optional(table, key) else {
            return T::default();
        };
        if let Some((_, value)) = words.iter().find(|(word, _)| *word == text.as_str()) {
            return *value;
        }
        let listed: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        let message = format!("{:?} is none of {}", text.as_str(), listed.join(", "));
        let mut diagnostic = Diagnostic::error("U0865", message, text.span());
        if let Some(help) = nearest(&text, &mut listed.into_iter()) {
            diagnostic = diagnostic.with_help(help);
        }
        self.diagnostics.push(diagnostic);
        T::default()
    }

    fn time(&mut self, table: &DeTable, key: &str, place: &Place) -> Duration {
        let text = self.text(table, key, place);
        if text.is_empty() {
            return Duration::ZERO;
        }
        parse_time(&text).unwrap_or_else(|| {
            let message = format!("{:?} is no time", text.as_str());
            self.diagnostics.push(
                Diagnostic::error("U0865", message, text.span())
                    .with_label("expected a number and its unit, at most 100 days")
                    .with_help("such as \"15s\", \"1500ms\" or \"2m\""),
            );
            Duration::ZERO
        })
    }

    fn list<T>(
        &mut self,
        table: &DeTable,
        key: &str,
        mut read: impl FnMut(&mut Self, &DeTable, &Place) -> T,
    ) -> Vec<T> {
        let Some(value) = table.get(key) else {
            return Vec::new();
        };
        let Some(entries) = value.get_ref().as_array() else {
            self.wrong_type(key, value, "a list of tables");
            return Vec::new();
        };
        let mut list = Vec::new();
        for entry in entries.iter() {
            match entry.get_ref().as_table() {
                Some(table) => list.push(read(self, table, &entry.span())),
                None => self.wrong_type(key, entry, "a table"),
            }
        }
        list
    }
}

/// A whole number and `us`, `ms`, `s`, `m`, `h` or `d`.
pub(crate) fn parse_time(text: &str) -> Option<Duration> {
    let unit_at = text.find(|character: char| !character.is_ascii_digit())?;
    let number: u64 = text[..unit_at].parse().ok()?;
    let microseconds = match &text[unit_at..] {
        "us" => 1,
        "ms" => 1_000,
        "s" => 1_000_000,
        "m" => 60_000_000,
        "h" => 3_600_000_000,
        "d" => 86_400_000_000,
        _ => return None,
    };
    let time = Duration::from_micros(number.checked_mul(microseconds)?);
    (time <= MAXIMUM_PRESET_TIME).then_some(time)
}
