use std::collections::HashMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};
use understudy_diagnostic::{Diagnostic, Report, has_errors};

use super::{Model, Signal};
use crate::ads::{MAXIMUM_LABEL, read_ads};
use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::{Automaton, State, Transition};

/// What was read from a model file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadModel {
    /// The model; none where there are errors in it or in a file that it names.
    pub model: Option<Model>,
    /// What is wrong with it, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
    /// The .ADS files that it names, with what is wrong with them.
    pub files: Vec<Report>,
}

/// Reads a model and finds everything that is wrong with it (U0820 to U0829); `load` gives the text of a file by the name that stands in
/// the model, or says why it cannot.
pub fn read_model(text: &str, mut load: impl FnMut(&str) -> Result<String, String>) -> ReadModel {
    let (table, errors) = DeTable::parse_recoverable(text);
    let mut reader = Reader {
        text,
        diagnostics: Vec::new(),
        files: Vec::new(),
    };
    for error in &errors {
        let place = error.span().unwrap_or(text.len()..text.len());
        reader.error(
            "U0820",
            format!("this is no TOML: {}", error.message().trim_end()),
            place,
        );
    }
    // What the recovery made of a broken text would only bring errors that follow from the first ones.
    let model = errors
        .is_empty()
        .then(|| reader.model(table.get_ref(), &mut load));
    let Reader {
        mut diagnostics,
        files,
        ..
    } = reader;
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    let right = !has_errors(&diagnostics) && !files.iter().any(Report::has_errors);
    ReadModel {
        model: model.filter(|_| right),
        diagnostics,
        files,
    }
}

/// A word with its place.
type Word<'t> = (&'t str, Range<usize>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Plant,
    Specification,
    Supervisor,
}

const ROLES: [(&str, Role); 3] = [
    ("plant", Role::Plant),
    ("specification", Role::Specification),
    ("supervisor", Role::Supervisor),
];

const WHEN: [&str; 5] = ["rising", "falling", "high", "low", "pulse"];

struct Reader<'t> {
    text: &'t str,
    diagnostics: Vec<Diagnostic>,
    files: Vec<Report>,
}

struct Events {
    alphabet: Alphabet,
    labels: HashMap<String, Label>,
    signals: Vec<Signal>,
}

impl<'t> Reader<'t> {
    fn error(&mut self, code: &'static str, message: impl Into<String>, place: Range<usize>) {
        self.diagnostics
            .push(Diagnostic::error(code, message, place));
    }

    fn model(
        &mut self,
        table: &DeTable<'_>,
        load: &mut impl FnMut(&str) -> Result<String, String>,
    ) -> Model {
        let known = ["name", "events", "plant", "specification", "supervisor"];
        self.check_keys(table, &known, "a model");
        let name = table
            .get("name")
            .and_then(|name| self.word(name))
            .unwrap_or_default();
        let events = match table.get("events") {
            None => DeTable::new(),
            Some(value) => self.table(value).cloned().unwrap_or_default(),
        };
        let mut events = self.events(&events);
        let mut of_role: [Vec<Automaton>; 3] = Default::default();
        for (place, (key, _)) in ROLES.iter().enumerate() {
            let Some(value) = table.get(*key) else {
                continue;
            };
            for item in self.array(value).into_iter().flatten() {
                let component = self.table(item).cloned();
                let component = component
                    .and_then(|component| self.component(&component, item.span(), &events, load));
                of_role[place].extend(component);
            }
        }
        if ROLES.iter().all(|(key, _)| !table.contains_key(*key)) {
            let end = self.text.trim_end().len();
            self.error(
                "U0822",
                "the model has no [[plant]], [[specification]] or [[supervisor]]",
                end..end,
            );
        }
        let alphabets = of_role.iter().flatten().map(Automaton::alphabet);
        events.alphabet = events.alphabet.union(alphabets);
        let names = events.alphabet;
        let of_role = of_role.map(|automata| {
            automata
                .into_iter()
                .map(|one| one.with_event_names(&names))
                .collect::<Vec<_>>()
        });
        let [plants, specifications, supervisors] = of_role;
        Model {
            name,
            alphabet: names,
            signals: events.signals,
            plants,
            specifications,
            supervisors,
        }
    }

    fn events(&mut self, table: &DeTable<'_>) -> Events {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut taken: HashMap<u32, Range<usize>> = HashMap::new();
        let mut open = Vec::new();
        let mut labels = HashMap::new();
        let mut signals = Vec::new();
        let mut events = Vec::new();
        for (key, value) in entries {
            let name = key.get_ref().to_string();
            if name.split_whitespace().count() != 1 {
                self.error("U0825", "the name of an event is one word", key.span());
            }
            let Some(entry) = self.table(value).cloned() else {
                continue;
            };
            self.check_keys(
                &entry,
                &["controllable", "label", "signal", "when"],
                "an event",
            );
            let label = entry.get("label").and_then(|label| self.label(label));
            let controllable = match entry.get("controllable") {
                Some(value) => self.boolean(value),
                None => label.as_ref().map(|(label, _)| label % 2 == 1),
            };
            let Some(controllable) = controllable else {
                if entry.get("controllable").is_none() && entry.get("label").is_none() {
                    self.missing("controllable", "an event", key.span());
                }
                continue;
            };
            if let Some((number, place)) = &label {
                if (number % 2 == 1) != controllable {
                    let message =
                        format!("label {number}: odd labels are controllable, even ones are not");
                    self.error("U0827", message, place.clone());
                } else if let Some(first) = taken.insert(*number, place.clone()) {
                    let message = format!("label {number} stands for two events");
                    let diagnostic = Diagnostic::error("U0827", message, place.clone());
                    self.diagnostics
                        .push(diagnostic.with_related(first, "the other one"));
                }
            }
            let signal = entry.get("signal").and_then(|signal| self.word(signal));
            let when = entry.get("when").and_then(|when| self.when(when));
            open.push((
                name,
                label.map(|(label, _)| label),
                controllable,
                signal,
                when,
            ));
        }
        let mut next = [0, 1];
        for (name, label, controllable, signal, when) in open {
            let label = label.unwrap_or_else(|| {
                let next = &mut next[usize::from(controllable)];
                while taken.contains_key(next) {
                    *next += 2;
                }
                *next += 2;
                *next - 2
            });
            let label = Label::new(label);
            signals.extend(signal.map(|signal| Signal {
                label,
                signal,
                when,
            }));
            labels.insert(name.clone(), label);
            events.push(Event { label, name });
        }
        Events {
            alphabet: Alphabet::new(events),
            labels,
            signals,
        }
    }

    fn component(
        &mut self,
        table: &DeTable<'_>,
        place: Range<usize>,
        events: &Events,
        load: &mut impl FnMut(&str) -> Result<String, String>,
    ) -> Option<Automaton> {
        let known = [
            "name",
            "file",
            "events",
            "initial",
            "marked",
            "states",
            "transitions",
        ];
        self.check_keys(table, &known, "an automaton");
        let name = table.get("name").and_then(|name| self.word(name));
        if let Some(file) = table.get("file") {
            return self.read_file(file, name, load);
        }
        let Some(name) = name else {
            self.missing("name", "an automaton", place);
            return None;
        };
        let mut states = States::default();
        if let Some(list) = table.get("states") {
            for word in self.words(list) {
                states.number(word);
            }
        }
        let initial = table.get("initial").and_then(|initial| {
            let text = self.text;
            let name = self.word(initial)?;
            let (word, place) = trimmed(text, initial.span());
            Some((
                if word == name {
                    word
                } else {
                    text.get(place.clone())?
                },
                place,
            ))
        });
        let transitions = match table.get("transitions") {
            Some(list) => self.transitions(list, events, &mut states),
            None => Vec::new(),
        };
        if let Some(word) = &initial {
            states.known(self, word, "the initial state");
        }
        let marked = match table.get("marked") {
            Some(all) if all.get_ref().as_str() == Some("all") => {
                vec![true; states.names.len().max(1)]
            }
            Some(list) => {
                let words = self.words(list);
                let mut marked = vec![false; states.names.len().max(1)];
                for word in &words {
                    if let Some(state) = states.known(self, word, "a marked state") {
                        marked[state as usize] = true;
                    }
                }
                marked
            }
            None => {
                self.missing("marked", "an automaton", place.clone());
                return None;
            }
        };
        if states.names.is_empty() {
            states.names.push(("0", place));
        }
        let own = table
            .get("events")
            .map(|list| self.words(list))
            .unwrap_or_default();
        let own: Vec<Event> = own
            .iter()
            .filter_map(|word| self.event(word, events))
            .map(|label| Event {
                label,
                name: events.alphabet.name(label),
            })
            .collect();
        let initial = initial
            .and_then(|(word, _)| states.numbers.get(word).copied())
            .unwrap_or(0);
        self.build(name, own, states, marked, transitions, initial)
    }

    fn build(
        &mut self,
        name: String,
        own: Vec<Event>,
        states: States<'_>,
        mut marked: Vec<bool>,
        mut transitions: Vec<Transition>,
        initial: u32,
    ) -> Option<Automaton> {
        // State 0 is the initial one.
        let swap = |state: State| match state.number() {
            0 => State::new(initial),
            number if number == initial => State::INITIAL,
            _ => state,
        };
        for transition in &mut transitions {
            transition.source = swap(transition.source);
            transition.target = swap(transition.target);
        }
        let mut names = states.names;
        names.swap(0, initial as usize);
        marked.swap(0, initial as usize);
        let texts = names.iter().map(|(name, _)| (*name).to_owned()).collect();
        match Automaton::new(name, own, marked, transitions) {
            Ok(automaton) => {
                self.warn_of_unreached(&automaton, &names);
                Some(automaton.named_states(texts))
            }
            Err(error) => {
                let place = names[0].1.clone();
                self.error(error.code(), error.to_string(), place);
                None
            }
        }
    }

    fn warn_of_unreached(&mut self, automaton: &Automaton, names: &[Word<'_>]) {
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
            let others = names
                .iter()
                .map(|(other, _)| *other)
                .filter(|other| other != name);
            if let Some(near) = nearest(name, others) {
                diagnostic = diagnostic.with_help(format!("perhaps \"{near}\" is meant"));
            }
            self.diagnostics.push(diagnostic);
        }
    }

    fn read_file(
        &mut self,
        file: &Spanned<DeValue<'_>>,
        name: Option<String>,
        load: &mut impl FnMut(&str) -> Result<String, String>,
    ) -> Option<Automaton> {
        let path = self.word(file)?;
        let text = match load(&path) {
            Ok(text) => text,
            Err(error) => {
                self.error(
                    "U0829",
                    format!("{path} cannot be read: {error}"),
                    file.span(),
                );
                return None;
            }
        };
        let read = read_ads(&text);
        self.files.push(Report {
            name: path,
            text,
            diagnostics: read.diagnostics,
        });
        let automaton = read.automaton?;
        Some(match name {
            Some(name) => automaton.with_name(name),
            None => automaton,
        })
    }

    fn transitions<'s>(
        &mut self,
        list: &Spanned<DeValue<'_>>,
        events: &Events,
        states: &mut States<'s>,
    ) -> Vec<Transition>
    where
        't: 's,
    {
        let mut transitions = Vec::new();
        let mut known: HashMap<(u32, Label), (u32, Range<usize>)> = HashMap::new();
        let Some(list) = self.array(list).cloned() else {
            return transitions;
        };
        for item in &list {
            if self.word(item).is_none() {
                continue;
            }
            let words = split(self.text, item.span());
            let [source, event, target] = words.as_slice() else {
                let message = "a transition is three words: a state, an event, and the state to which it leads";
                self.error("U0825", message, item.span());
                continue;
            };
            let (source_name, target_name) = (source.0, target.0);
            let (source, target) = (states.number(source.clone()), states.number(target.clone()));
            let Some(label) = self.event(event, events) else {
                continue;
            };
            match known.get(&(source, label)) {
                Some((first, place)) if *first != target => {
                    let first = states.names[*first as usize].0;
                    let message = format!(
                        "from state {source_name} event {} leads to state {first} and to state {target_name}; an automaton must be deterministic",
                        event.0
                    );
                    let diagnostic = Diagnostic::error("U0826", message, item.span());
                    self.diagnostics
                        .push(diagnostic.with_related(place.clone(), "the other one"));
                }
                _ => {
                    known.insert((source, label), (target, item.span()));
                    let (source, target) = (State::new(source), State::new(target));
                    transitions.push(Transition {
                        source,
                        label,
                        target,
                    });
                }
            }
        }
        transitions
    }

    fn event(&mut self, (name, place): &Word<'_>, events: &Events) -> Option<Label> {
        if let Some(&label) = events.labels.get(*name) {
            return Some(label);
        }
        let message = format!("there is no event {name}");
        let mut diagnostic = Diagnostic::error("U0824", message, place.clone());
        let known = events.labels.keys().map(String::as_str);
        diagnostic = diagnostic.with_help(match nearest(name, known) {
            Some(near) => format!("perhaps \"{near}\" is meant"),
            None => "declare it under [events]".to_owned(),
        });
        self.diagnostics.push(diagnostic);
        None
    }

    fn label(&mut self, value: &Spanned<DeValue<'_>>) -> Option<(u32, Range<usize>)> {
        let number = value.get_ref().as_integer();
        let number =
            number.and_then(|number| u32::from_str_radix(number.as_str(), number.radix()).ok());
        if let Some(number) = number.filter(|&number| number <= MAXIMUM_LABEL) {
            return Some((number, value.span()));
        }
        self.error(
            "U0823",
            format!("a label is a number from 0 to {MAXIMUM_LABEL}"),
            value.span(),
        );
        None
    }

    fn when(&mut self, value: &Spanned<DeValue<'_>>) -> Option<String> {
        let word = self.word(value)?;
        if WHEN.contains(&word.as_str()) {
            return Some(word);
        }
        let message = format!("\"{word}\" is none of {}", WHEN.join(", "));
        let mut diagnostic = Diagnostic::error("U0823", message, value.span());
        if let Some(near) = nearest(&word, WHEN) {
            diagnostic = diagnostic.with_help(format!("perhaps \"{near}\" is meant"));
        }
        self.diagnostics.push(diagnostic);
        None
    }

    fn check_keys(&mut self, table: &DeTable<'_>, known: &[&str], what: &str) {
        for key in table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
        {
            let message = format!("{what} has no \"{}\"", key.get_ref());
            let mut diagnostic = Diagnostic::error("U0821", message, key.span());
            diagnostic =
                diagnostic.with_help(match nearest(key.get_ref(), known.iter().copied()) {
                    Some(near) => format!("perhaps \"{near}\" is meant"),
                    None => format!("it has {}", known.join(", ")),
                });
            self.diagnostics.push(diagnostic);
        }
    }

    fn missing(&mut self, key: &str, what: &str, place: Range<usize>) {
        self.error("U0822", format!("{what} needs \"{key}\""), place);
    }

    fn wrong_type(&mut self, value: &Spanned<DeValue<'_>>, wanted: &str) {
        let found = value.get_ref().type_str();
        self.error(
            "U0823",
            format!("{wanted} is wanted, not {found}"),
            value.span(),
        );
    }

    fn table<'v, 'w>(&mut self, value: &'v Spanned<DeValue<'w>>) -> Option<&'v DeTable<'w>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong_type(value, "a table");
        }
        table
    }

    fn array<'v, 'w>(&mut self, value: &'v Spanned<DeValue<'w>>) -> Option<&'v DeArray<'w>> {
        let array = value.get_ref().as_array();
        if array.is_none() {
            self.wrong_type(value, "a list");
        }
        array
    }

    fn boolean(&mut self, value: &Spanned<DeValue<'_>>) -> Option<bool> {
        let boolean = value.get_ref().as_bool();
        if boolean.is_none() {
            self.wrong_type(value, "true or false");
        }
        boolean
    }

    fn word(&mut self, value: &Spanned<DeValue<'_>>) -> Option<String> {
        let word = value.get_ref().as_str();
        if word.is_none() {
            self.wrong_type(value, "a text");
        }
        word.map(str::to_owned)
    }

    fn words(&mut self, list: &Spanned<DeValue<'_>>) -> Vec<Word<'t>> {
        let Some(list) = self.array(list).cloned() else {
            return Vec::new();
        };
        let mut words = Vec::new();
        for item in &list {
            if self.word(item).is_none() {
                continue;
            }
            match split(self.text, item.span()).as_slice() {
                [word] => words.push(word.clone()),
                _ => self.error("U0825", "a name is one word", item.span()),
            }
        }
        words
    }
}

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

    fn known(&self, reader: &mut Reader<'_>, (name, place): &Word<'_>, what: &str) -> Option<u32> {
        let number = self.numbers.get(name).copied();
        if number.is_none() {
            let message = format!("{what} is {name}, and no transition knows it");
            let mut diagnostic = Diagnostic::error("U0828", message, place.clone());
            if let Some(near) = nearest(name, self.names.iter().map(|(known, _)| *known)) {
                diagnostic = diagnostic.with_help(format!("perhaps \"{near}\" is meant"));
            }
            reader.diagnostics.push(diagnostic);
        }
        number
    }
}

/// The inside of a quoted text as it stands in the file, and its place.
fn trimmed(text: &str, span: Range<usize>) -> Word<'_> {
    let raw = text.get(span.clone()).unwrap_or_default();
    let start = span.start + (raw.len() - raw.trim_start_matches(['"', '\'']).len());
    let inside = raw.trim_matches(['"', '\'']);
    (inside, start..start + inside.len())
}

fn split(text: &str, span: Range<usize>) -> Vec<Word<'_>> {
    let (inside, place) = trimmed(text, span);
    let words = inside.split_whitespace().map(|word| {
        let start = place.start + (word.as_ptr() as usize - inside.as_ptr() as usize);
        (word, start..start + word.len())
    });
    words.collect()
}

fn nearest<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let distance = |other: &str| strsim::damerau_levenshtein(name, other);
    let near = known
        .into_iter()
        .min_by_key(|other| (distance(other), other.to_owned()))?;
    (distance(near) <= 1 + name.len() / 4).then_some(near)
}
