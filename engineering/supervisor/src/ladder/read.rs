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
//!
//! [addresses]         # where a signal is in the PLC
//! x_a = "%IX0.0"
//! ```

use toml::de::DeTable;
use understudy_ladder::Name;
use understudy_text::{Diagnostic, has_errors};

use super::addresses::read_addresses;
use super::map::{
    Agent, EventName, InputEvent, InputOutputMap, Position, Pulse, Request, Switch, Timer, When,
};
use crate::Label;
use crate::form::{self, CODES, Form};
use crate::format;

/// What a text says, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadMap {
    /// The map; `None` where there are errors.
    pub map: Option<InputOutputMap>,
    /// In the order of their places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a map and finds everything that is wrong with its form: U0861 no TOML, U0862 an unknown key, U0863 a missing one,
/// U0864 a value of a wrong type, U0865 a word or time that is none of those possible, U0867 an address that is none. Whether
/// the names mean something is the business of [`Partition::new`](super::Partition::new).
pub fn read_map(text: &str) -> ReadMap {
    let (map, diagnostics) = form::read(text, &CODES, map);
    ReadMap { map: map.filter(|_| !has_errors(&diagnostics)), diagnostics }
}

fn map(form: &mut Form<'_>, table: &DeTable) -> InputOutputMap {
    form.check_keys(table, &format::MAP);
    let end = form.text.trim_end().len();
    InputOutputMap {
        program: form.name(table, "program", "a map", &(end..end)),
        start: form.optional(table, "start"),
        events: event_names(form, table),
        inputs: form.list(table, "input", |form, entry, place| {
            form.check_keys(entry, &format::INPUT);
            InputEvent {
                event: form.name(entry, "event", "an input", place),
                signal: form.name(entry, "signal", "an input", place),
                when: form.choice(entry, "when", &When::WORDS).unwrap_or_default(),
                by: form.choice(entry, "by", &Agent::WORDS).unwrap_or_default(),
            }
        }),
        switches: form.list(table, "switch", |form, entry, place| {
            form.check_keys(entry, &format::SWITCH);
            if !entry.contains_key("positions") {
                form.missing("positions", "a switch", place.clone());
            }
            Switch {
                off: form.optional(entry, "off"),
                positions: form.list(entry, "positions", |form, entry, place| {
                    form.check_keys(entry, &format::POSITION);
                    Position {
                        event: form.name(entry, "event", "a position", place),
                        signal: form.name(entry, "signal", "a position", place),
                    }
                }),
                memory: form.flag(entry, "memory").unwrap_or(false),
            }
        }),
        pulses: form.list(table, "pulse", |form, entry, place| {
            form.check_keys(entry, &format::PULSE);
            Pulse {
                event: form.name(entry, "event", "a pulse", place),
                signal: form.name(entry, "signal", "a pulse", place),
                memory: form.flag(entry, "memory").unwrap_or(false),
            }
        }),
        timers: form.list(table, "timer", |form, entry, place| {
            form.check_keys(entry, &format::TIMER);
            if !entry.contains_key("preset") {
                form.missing("preset", "a timer", place.clone());
            }
            Timer {
                event: form.name(entry, "event", "a timer", place),
                name: form.name(entry, "name", "a timer", place),
                runs_while: form.name(entry, "runs_while", "a timer", place),
                preset: form.time(entry, "preset").unwrap_or_default(),
            }
        }),
        requests: form.list(table, "request", |form, entry, place| {
            form.check_keys(entry, &format::REQUEST);
            Request {
                event: form.name(entry, "event", "a request", place),
                signal: form.name(entry, "signal", "a request", place),
            }
        }),
        addresses: read_addresses(form, table),
        one_event: None,
    }
}

fn event_names(form: &mut Form<'_>, table: &DeTable) -> Vec<EventName> {
    let entries = table.get("events").and_then(|value| form.table("events", value));
    let mut events = Vec::new();
    for (name, value) in entries.into_iter().flatten() {
        let number = value.get_ref().as_integer();
        let number = number.and_then(|number| number.as_str().parse().ok());
        if let Some(number) = form.expect(name.get_ref(), value, number, "the number of an event") {
            events.push(EventName {
                name: Name::at(name.get_ref().as_ref(), name.span()),
                label: Label::new(number),
            });
        }
    }
    events
}
