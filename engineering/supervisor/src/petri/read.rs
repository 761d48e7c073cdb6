//! A net from TOML.
//!
//! ```toml
//! name = "assembly_cell"
//!
//! [events]                       # those that supervisors know, as in a model
//! pick   = { controllable = true }
//! placed = { controllable = false }
//!
//! [[place]]
//! name = "robot_idle"
//! tokens = 1                     # 0 where not given
//! capacity = 1                   # any number may come where not given
//!
//! [[place]]
//! name = "robot_busy"
//! level = "robot_runs"           # 1 while there is a token; `impulse`: for the scan in which one has come
//!
//! [[transition]]
//! name = "pick"
//! event = "pick"                 # where not given, the event of its name, if there is one
//! takes = "robot_idle"           # or a list; "2 bolts" for an arc of weight 2
//! gives = ["robot_busy"]
//! inhibited_by = ["2 bodies"]    # enabled while there are fewer
//! enabled_by = "power"           # enabled while there are at least as many; they stay
//! when = "body_present /stop"    # contacts and branches as in a ladder
//! after = "300ms"                # it has been enabled, with its condition, for so long
//!
//! [addresses]
//! robot_runs = "%QX0.0"
//! ```

use std::collections::HashMap;

use toml::de::DeTable;
use understudy_ladder::{MAXIMUM_PRESET_VALUE, Name};
use understudy_text::{Diagnostic, has_errors};

use super::condition::parse_condition;
use super::net::{Action, Arc, Net, NetError, NetTransition, Place};
use crate::Alphabet;
use crate::events::Events;
use crate::form::{self, CODES, Form, Word, split, trimmed};
use crate::format;
use crate::ladder::{ILLEGAL_NAME, Located, is_legal, read_addresses};

/// The most tokens that a file gives a place, and the heaviest arc.
const MAXIMUM_TOKENS: u32 = MAXIMUM_PRESET_VALUE as u32;

/// A net with what its file says besides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NetFile {
    /// The net.
    pub net: Net,
    /// The events of its transitions, by their names.
    pub events: Alphabet,
    /// Where signals are in the PLC.
    pub addresses: Vec<Located>,
}

/// What was read from the file of a net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadNet {
    /// The net; none where there are errors.
    pub file: Option<NetFile>,
    /// In the order of their places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a net and finds everything that is wrong with it: U0861 to U0865 its form, U0823 to U0827 its events, U0855, U0856 and U0867
/// its signals, U0888 a condition, U0890 to U0894 the net.
pub fn read_net(text: &str) -> ReadNet {
    let (file, mut diagnostics) = form::read(text, &CODES, read_file);
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    ReadNet { file: file.flatten().filter(|_| !has_errors(&diagnostics)), diagnostics }
}

fn read_file(form: &mut Form<'_>, table: &DeTable) -> Option<NetFile> {
    form.check_keys(table, &format::NET_FILE);
    let end = form.text.trim_end().len();
    let name = form.name(table, "name", "a net", &(end..end));
    let events = Events::read(form, table, &format::EVENT, &Alphabet::default());
    let addresses = read_addresses(form, table);
    let mut names = Vec::new();
    let places = form.list(table, "place", |form, entry, span| {
        names.push(form.name(entry, "name", "a place", span));
        place(form, entry, span)
    });
    let mut numbers = Numbers(HashMap::new());
    for (number, place) in places.iter().enumerate() {
        numbers.0.entry(place.name.clone()).or_insert(number);
    }
    let transitions = form.list(table, "transition", |form, entry, span| {
        let name = form.name(entry, "name", "a transition", span);
        let transition = numbers.transition(form, entry, &name, &events);
        names.push(name);
        transition
    });
    check_directions(form, &places, &transitions);
    match Net::new(name.as_str(), places, transitions) {
        Ok(net) => Some(NetFile { net, events: events.alphabet, addresses }),
        Err(errors) => {
            for error in errors {
                report(form, &error, &names);
            }
            None
        }
    }
}

/// The number of each place.
struct Numbers(HashMap<String, usize>);

impl Numbers {
    fn transition(
        &self,
        form: &mut Form<'_>,
        entry: &DeTable,
        name: &Name,
        events: &Events,
    ) -> NetTransition {
        form.check_keys(entry, &format::TRANSITION);
        let label = match form.optional(entry, "event") {
            Some(event) => events.find(form, &(event.as_str(), event.span())),
            None => events.get(name),
        };
        let when = entry.get("when");
        let when = when.filter(|value| form.string("when", value).is_some());
        NetTransition {
            name: name.to_string(),
            label,
            takes: self.arcs(form, entry, "takes"),
            gives: self.arcs(form, entry, "gives"),
            inhibitors: self.arcs(form, entry, "inhibited_by"),
            enablers: self.arcs(form, entry, "enabled_by"),
            condition: match when {
                Some(value) => {
                    let word = trimmed(form.text, value.span());
                    parse_condition(form, word)
                }
                None => super::net::Condition::Always,
            },
            delay: form.time(entry, "after"),
        }
    }

    /// Arcs as "place" or "2 place".
    fn arcs(&self, form: &mut Form<'_>, entry: &DeTable, key: &str) -> Vec<Arc> {
        let mut arcs = Vec::new();
        for (words, span) in phrases(form, entry, key) {
            let (weight, place) = match words.as_slice() {
                [place] => (1, place),
                [weight, place] => match weight.0.parse() {
                    Ok(weight) if weight <= MAXIMUM_TOKENS => (weight, place),
                    _ => {
                        let message =
                            format!("the weight of an arc is a number from 1 to {MAXIMUM_TOKENS}");
                        form.error("U0865", message, weight.1.clone());
                        continue;
                    }
                },
                _ => {
                    let message = "an arc is a place, or a weight and a place";
                    form.error("U0865", message, span);
                    continue;
                }
            };
            let (name, at) = place;
            match self.0.get(*name) {
                Some(_) if weight == 0 => {
                    let message = format!("an arc of weight 0 to `{name}` says nothing");
                    form.error("U0893", message, span);
                }
                Some(&place) => arcs.push(Arc { place, weight }),
                None => form.error_near(
                    "U0892",
                    format!("there is no place `{name}`"),
                    (name, at.clone()),
                    self.0.keys().map(String::as_str),
                    None,
                ),
            }
        }
        arcs
    }
}

/// U0856: a signal that is read and written.
fn check_directions(form: &mut Form<'_>, places: &[Place], transitions: &[NetTransition]) {
    let mut inputs: HashMap<String, Name> = HashMap::new();
    for transition in transitions {
        transition.condition.visit(&mut |name, _| {
            inputs.entry(name.to_string()).or_insert(name.clone());
        });
    }
    for action in places.iter().flat_map(|place| &place.actions) {
        let (Action::Level(output) | Action::Impulse(output)) = action;
        if let Some(input) = inputs.get(output.as_str()) {
            let message = format!("`{output}` is the signal of a condition and of an action");
            form.diagnostics.push(
                Diagnostic::error("U0856", message, output.span())
                    .with_related(input.span(), "the condition is here"),
            );
        }
    }
}

/// What is wrong with the net as a whole, at the name concerned.
fn report(form: &mut Form<'_>, error: &NetError, names: &[Name]) {
    let named = |name: &String| -> Vec<&Name> {
        let named = names.iter().filter(|known| known.as_str() == name);
        named.collect()
    };
    // Places precede transitions.
    let place = match error {
        // That it has no name was said.
        NetError::Duplicate { name } if name.is_empty() => return,
        NetError::Duplicate { name } => named(name).get(1).copied(),
        NetError::Overfull { place, .. } => named(place).first().copied(),
        NetError::NoSuchPlace { transition, .. }
        | NetError::Weightless { transition, .. }
        | NetError::EdgeWithDelay { transition } => named(transition).last().copied(),
    };
    let span = place.map_or(0..0, Name::span);
    let text = error.to_string();
    let message = text.split_once(": ").map_or(text.as_str(), |(_, rest)| rest);
    form.error(error.code(), message, span);
}

fn place(form: &mut Form<'_>, entry: &DeTable, span: &form::Place) -> Place {
    form.check_keys(entry, &format::PLACE);
    let name = form.optional(entry, "name").unwrap_or_default();
    let mut actions = signals(form, entry, "level", Action::Level);
    actions.extend(signals(form, entry, "impulse", Action::Impulse));
    if name.split_whitespace().count() > 1 {
        form.error("U0865", "the name of a place is one word", span.clone());
    }
    Place {
        name: name.to_string(),
        initial: form.number(entry, "tokens", 0..=MAXIMUM_TOKENS).unwrap_or(0),
        capacity: form.number(entry, "capacity", 1..=MAXIMUM_TOKENS),
        actions,
    }
}

/// The actions on the signals under `key`; U0855 for an illegal name.
fn signals(
    form: &mut Form<'_>,
    entry: &DeTable,
    key: &str,
    action: fn(Name) -> Action,
) -> Vec<Action> {
    let mut actions = Vec::new();
    for (words, span) in phrases(form, entry, key) {
        match words.as_slice() {
            [(signal, at)] if is_legal(signal) => {
                actions.push(action(Name::at(*signal, at.clone())));
            }
            _ => form.diagnostics.push(
                Diagnostic::error("U0855", "this cannot be a name in a ladder", span)
                    .with_help(ILLEGAL_NAME),
            ),
        }
    }
    actions
}

/// The words of the text, or of each text of the list, under `key`.
fn phrases<'t>(
    form: &mut Form<'t>,
    entry: &DeTable,
    key: &str,
) -> Vec<(Vec<Word<'t>>, form::Place)> {
    match entry.get(key) {
        None => Vec::new(),
        Some(value) if value.get_ref().as_str().is_some() => {
            vec![(split(form.text, value.span()), value.span())]
        }
        Some(value) => form.phrases(key, value),
    }
}
