//! An automaton of a model: its transitions as lines of three words, or a file of TCT.

use std::collections::HashMap;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_text::Diagnostic;
use understudy_text::spelling;

use super::read::Loader;
use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::{Automaton, Named, State, Transition};
use crate::events::Events;
use crate::form::{Form, Place, Word, trimmed};
use crate::format;

pub(super) fn read_component(
    form: &mut Form<'_>,
    table: &DeTable,
    place: &Place,
    events: &Events,
    loader: &mut Loader<'_>,
) -> Option<Automaton> {
    form.check_keys(table, &format::AUTOMATON);
    let name = form.optional(table, "name").map(|name| name.to_string());
    if let Some(file) = table.get("file") {
        return loader.automaton(form, file, name);
    }
    let Some(name) = name else {
        form.missing("name", "an automaton", place.clone());
        return None;
    };
    let mut states = States::default();
    if let Some(list) = table.get("states") {
        for word in words(form, "states", list) {
            states.number(word);
        }
    }
    let initial = table.get("initial").and_then(|initial| {
        form.string("initial", initial)?;
        Some(trimmed(form.text, initial.span()))
    });
    let transitions = match table.get("transitions") {
        Some(list) => transitions(form, list, events, &mut states),
        None => Vec::new(),
    };
    if let Some(word) = &initial {
        states.known(form, word, "the initial state");
    }
    let Some(marked) = table.get("marked") else {
        form.missing("marked", "an automaton", place.clone());
        return None;
    };
    let marked = if marked.get_ref().as_str() == Some("all") {
        vec![true; states.names.len().max(1)]
    } else {
        let mut is_marked = vec![false; states.names.len().max(1)];
        for word in &words(form, "marked", marked) {
            if let Some(state) = states.known(form, word, "a marked state") {
                is_marked[state as usize] = true;
            }
        }
        is_marked
    };
    let own = match table.get("events") {
        Some(list) => words(form, "events", list),
        None => Vec::new(),
    };
    let own = own.iter().filter_map(|word| events.find(form, word));
    let own: Vec<Event> =
        own.map(|label| Event { label, name: events.alphabet.name(label) }).collect();
    if states.names.is_empty() {
        // `states = []` says that there is none: EMPTY.
        if table.contains_key("states") {
            return Some(Automaton::empty(&name, Alphabet::new(own)));
        }
        states.names.push(("0", place.clone()));
    }
    let initial = initial.and_then(|(word, _)| states.numbers.get(word).copied()).unwrap_or(0);
    let names = states.names;
    let parts = Named {
        name,
        events: own,
        states: names.iter().map(|(name, _)| (*name).to_owned()).collect(),
        initial: initial as usize,
        marked,
        transitions,
    };
    build(form, names, parts)
}

/// An automaton of states in the order of a file, of which `initial` is the first one.
fn build(form: &mut Form<'_>, names: Vec<Word<'_>>, parts: Named) -> Option<Automaton> {
    let mut names = names;
    names.swap(0, parts.initial);
    // Numbers are the names of states that have none.
    match parts.automaton(|number| number.to_string()) {
        Ok(automaton) => {
            warn_of_unreached(form, &automaton, &names);
            Some(automaton)
        }
        Err(error) => {
            let place = names[0].1.clone();
            form.error(error.code(), error.to_string(), place);
            None
        }
    }
}

fn warn_of_unreached(form: &mut Form<'_>, automaton: &Automaton, names: &[Word<'_>]) {
    let mut reached = vec![false; automaton.state_count()];
    let mut pending: Vec<State> = automaton.initial().into_iter().collect();
    while let Some(state) = pending.pop() {
        if !std::mem::replace(&mut reached[state.index()], true) {
            pending.extend(automaton.edges(state).iter().map(|edge| edge.target));
        }
    }
    let unreached = names.iter().zip(&reached).filter(|(_, reached)| !**reached);
    for ((name, place), _) in unreached {
        let message = format!("no event leads to state {name} of {}", automaton.name());
        let mut diagnostic = Diagnostic::warning("U0828", message, place.clone());
        let others = names.iter().map(|(other, _)| *other);
        if let Some(help) = spelling::question(name, others.filter(|other| other != name)) {
            diagnostic = diagnostic.with_help(help);
        }
        form.diagnostics.push(diagnostic);
    }
}

fn transitions<'t>(
    form: &mut Form<'t>,
    list: &Spanned<DeValue>,
    events: &Events,
    states: &mut States<'t>,
) -> Vec<Transition> {
    let mut transitions = Vec::new();
    let mut known: HashMap<(u32, Label), (u32, Place)> = HashMap::new();
    for (words, place) in form.phrases("transitions", list) {
        let [source, event, target] = words.as_slice() else {
            let message =
                "a transition is three words: a state, an event, and the state to which it leads";
            form.error("U0825", message, place);
            continue;
        };
        let (source_name, target_name) = (source.0, target.0);
        let (source, target) = (states.number(source.clone()), states.number(target.clone()));
        let Some(label) = events.find(form, event) else {
            continue;
        };
        match known.get(&(source, label)) {
            Some((first, other)) if *first != target => {
                let first = states.names[*first as usize].0;
                let message = format!(
                    "from state {source_name} event {} leads to state {first} and to state {target_name}; an automaton must be deterministic",
                    event.0
                );
                let diagnostic = Diagnostic::error("U0826", message, place);
                form.diagnostics.push(diagnostic.with_related(other.clone(), "the other one"));
            }
            _ => {
                known.insert((source, label), (target, place));
                transitions.push(Transition {
                    source: State::new(source),
                    label,
                    target: State::new(target),
                });
            }
        }
    }
    transitions
}

/// The names of a list.
fn words<'t>(form: &mut Form<'t>, key: &str, list: &Spanned<DeValue>) -> Vec<Word<'t>> {
    let mut words = Vec::new();
    for (phrase, place) in form.phrases(key, list) {
        match phrase.as_slice() {
            [word] => words.push(word.clone()),
            _ => form.error("U0825", "a name is one word", place),
        }
    }
    words
}

/// The states of an automaton, numbered as a reader meets them.
#[derive(Default)]
struct States<'t> {
    names: Vec<Word<'t>>,
    numbers: HashMap<&'t str, u32>,
}

impl<'t> States<'t> {
    fn number(&mut self, word: Word<'t>) -> u32 {
        *self.numbers.entry(word.0).or_insert_with(|| {
            self.names.push(word);
            self.names.len() as u32 - 1
        })
    }

    fn known(&self, form: &mut Form<'_>, (name, place): &Word<'_>, what: &str) -> Option<u32> {
        let number = self.numbers.get(name).copied();
        if number.is_none() {
            form.error_near(
                "U0828",
                format!("{what} is {name}, and no transition knows it"),
                (name, place.clone()),
                self.names.iter().map(|(known, _)| *known),
                None,
            );
        }
        number
    }
}
