//! libFAUDES' generators: .gen, in its own form of tokens and in that with XML tags.
//!
//! A number without quotes is the index of a state, whatever its name is; a state without an index has the one behind the greatest so far.
//! An event is uncontrollable and observable unless its flags say otherwise (`+C+`, `+o+`); forcible and preemptible events are events
//! like any other. What other types than `Generator` and `System` add to one (clocks, guards, colours, flags of plug-ins) is U0834.

use std::collections::HashSet;

use super::ReadForeign;
use super::draft::{Declared, Draft, Findings, INDEX, Place};
use super::tokens::{Placed, Token, tokens};
use crate::ads::MAXIMUM_STATES;
use crate::alphabet::{Alphabet, Event};
use crate::model::Model;

/// Reads a generator of libFAUDES and finds everything that is wrong with it (U0833 to U0838). Its role is not known: it is the
/// supervisor of the model.
pub fn read_generator(text: &str) -> ReadForeign {
    let end = text.trim_end().len();
    let mut reader = Reader { tokens: tokens(text), end: end..end, ..Reader::default() };
    let model = reader.generator();
    let unobservable = reader.declared.unobservable(&reader.events, &mut reader.findings);
    reader.findings.answer(model, unobservable)
}

#[derive(Default)]
struct Reader<'t> {
    tokens: Vec<Placed<'t>>,
    next: usize,
    end: Place,
    declared: Declared,
    events: Vec<Event>,
    draft: Draft,
    /// The greatest index of a state.
    greatest: u64,
    /// Whether the transitions declare the states, or the events.
    is_open: (bool, bool),
    findings: Findings,
}

impl<'t> Reader<'t> {
    fn peek(&self) -> Option<&Token<'t>> {
        self.tokens.get(self.next).map(|(token, _)| token)
    }

    /// The next token with its place; none at the end of the file.
    fn take(&mut self) -> Option<Placed<'t>> {
        let token = self.tokens.get(self.next).cloned();
        self.next += 1;
        token
    }

    fn generator(&mut self) -> Model {
        let begin = self.tokens.iter().position(|(token, _)| {
            matches!(token, Token::Begin("Generator" | "System" | "vGenerator", _))
        });
        let Some(begin) = begin else {
            let message = "there is no section <Generator>";
            self.findings.error("U0833", message, 0..self.end.end.min(1));
            return Model::default();
        };
        if let Some((_, place)) = self.tokens[..begin].first().cloned() {
            self.outside(place);
        }
        self.next = begin;
        let Some((Token::Begin(section, attributes), place)) = self.take() else {
            return Model::default();
        };
        let named = attributes.iter().find(|(key, _)| *key == "name");
        self.draft.name = named.map_or("Generator", |(_, name)| name).to_owned();
        if let Some(Token::Text(name)) = self.peek() {
            self.draft.name = (*name).to_owned();
            self.next += 1;
        }
        self.sections(section);
        if let Some((_, place)) = self.take() {
            self.outside(place);
        }
        self.events = self.declared.events();
        let mut draft = std::mem::take(&mut self.draft);
        // An event without a transition is forbidden.
        draft.alphabet = (0..self.events.len()).collect();
        // libFAUDES counts states from 1.
        let number = |number: usize| (number + 1).to_string();
        let name = draft.name.clone();
        let made = draft.finish(&self.events, place, &mut self.findings, number);
        Model {
            name,
            alphabet: Alphabet::new(self.events.iter().cloned()),
            supervisors: made.into_iter().collect(),
            ..Model::default()
        }
    }

    /// U0834 for what is not in the section of the generator, such as the controllable events of older files.
    fn outside(&mut self, place: Place) {
        let message = "what stands outside of <Generator> is not read: it may change what the automaton means";
        self.findings.unsupported(message, place);
    }

    fn sections(&mut self, generator: &str) {
        let mut known = HashSet::new();
        loop {
            match self.take() {
                Some((Token::End(end), _)) if end == generator => return,
                Some((Token::Begin(section, _), place)) => {
                    if !known.insert(section) {
                        let message = format!("the section <{section}> is there twice");
                        self.findings.malformed(message, place.clone());
                    }
                    self.section(section, place);
                }
                Some((_, place)) => {
                    self.findings.malformed("expected a section", place);
                }
                None => {
                    self.findings.malformed(format!("expected </{generator}>"), self.end.clone());
                    return;
                }
            }
        }
    }

    fn section(&mut self, section: &'t str, place: Place) {
        match section {
            "Alphabet" | "A" => self.each(section, Self::event),
            "States" | "S" | "StateSet" => self.each(section, Self::state),
            "TransRel" | "T" | "TransitionRelation" => {
                self.is_open.0 = self.draft.state_count() == 0;
                self.is_open.1 = self.declared.is_empty();
                self.each(section, Self::transition);
            }
            "InitStates" | "I" => self.each(section, Self::initial),
            "MarkedStates" | "M" => self.each(section, Self::marked),
            other => {
                let message = format!(
                    "the section <{other}> is not read: it may change what the automaton means"
                );
                self.findings.unsupported(message, place);
                self.skip(other);
            }
        }
    }

    /// Reads what is in a section, one after the other; each takes at least a token.
    fn each(&mut self, section: &str, one: impl Fn(&mut Self, Placed<'t>)) {
        loop {
            match self.take() {
                Some((Token::End(end), _)) if end == section => return,
                Some(token) => one(self, token),
                None => {
                    self.findings.malformed(format!("expected </{section}>"), self.end.clone());
                    return;
                }
            }
        }
    }

    /// Passes by the rest of a section.
    fn skip(&mut self, section: &str) {
        while let Some((token, _)) = self.take() {
            if token == Token::End(section) {
                return;
            }
        }
    }

    /// What cannot begin an entry of a section.
    fn misplaced(&mut self, (token, place): Placed<'t>, expected: &str) {
        match token {
            Token::Begin(section, _) => {
                let message =
                    format!("<{section}> is not read: it may change what the automaton means");
                self.findings.unsupported(message, place);
                self.skip(section);
            }
            Token::Flags(flags) => {
                let message = format!("the flags +{flags}+ are not read here");
                self.findings.unsupported(message, place);
            }
            _ => self.findings.malformed(format!("expected {expected}"), place),
        }
    }

    fn event(&mut self, token: Placed<'t>) {
        let place = token.1.clone();
        let (name, section) = match &token.0 {
            Token::Text(name) => (*name, None),
            Token::Begin("Event", attributes) => match attribute(attributes, "name") {
                Some(name) => (name, Some("Event")),
                None => {
                    self.findings.malformed("<Event> needs `name`", place);
                    self.skip("Event");
                    return;
                }
            },
            _ => return self.misplaced(token, "the name of an event, in quotes if it is a number"),
        };
        let mut flags = Flags { controllable: false, observable: true };
        while let Some(token) = self.peek() {
            match token {
                Token::Flags(letters) => {
                    if !flags.read(letters) {
                        let message = format!(
                            "the flags +{letters}+ of event {name} belong to a plug-in; C, c, O, o, F, f, P and p are read"
                        );
                        self.findings.unsupported(message, place.clone());
                    }
                    self.next += 1;
                }
                Token::Hexadecimal(bits) => {
                    flags.controllable = bits & 1 != 0;
                    flags.observable = bits & 2 != 0;
                    if *bits > 15 {
                        let message = format!(
                            "the flags {bits:#x} of event {name} belong to a plug-in; the bits 0x1 to 0x8 are read"
                        );
                        self.findings.unsupported(message, place.clone());
                    }
                    self.next += 1;
                }
                Token::Begin(word @ ("Controllable" | "Observable"), attributes) => {
                    let is_set = !matches!(attribute(attributes, "value"), Some("0" | "false"));
                    let flag = if *word == "Controllable" {
                        &mut flags.controllable
                    } else {
                        &mut flags.observable
                    };
                    *flag = is_set;
                    let word = *word;
                    self.skip(word);
                }
                Token::Begin(word @ ("Forcible" | "Preemptible"), _) => {
                    let word = *word;
                    self.skip(word);
                }
                _ => break,
            }
        }
        if let Some(section) = section {
            self.each(section, |reader, token| reader.misplaced(token, "</Event>"));
        }
        if !self.declared.declare(name, flags.controllable, flags.observable) {
            self.findings.malformed(format!("event {name} is declared twice"), place);
        }
    }

    /// Adds a state by its index, its name or both.
    fn add_state(&mut self, index: Option<u64>, name: Option<&str>, place: Place) -> Option<usize> {
        if self.draft.state_count() >= MAXIMUM_STATES {
            if self.draft.state_count() == MAXIMUM_STATES {
                let message = format!("more than {MAXIMUM_STATES} states");
                self.findings.unsupported(message, place);
            }
            return None;
        }
        let index = index.unwrap_or_else(|| self.greatest.saturating_add(1));
        self.greatest = self.greatest.max(index);
        let by_index = key(index);
        let number = index.to_string();
        let keys = [by_index.as_str(), name.unwrap_or(&by_index)];
        let name = name.unwrap_or(&number);
        let added = self.draft.add_state(name, &keys);
        if added.is_none() {
            self.findings.malformed(format!("state {name} is there twice"), place);
        }
        added
    }

    fn state(&mut self, token: Placed<'t>) {
        let place = token.1.clone();
        match &token.0 {
            Token::Number(index) => {
                self.add_state(Some(*index), None, place);
            }
            Token::Text(name) => {
                let (name, index) = suffixed(name);
                self.add_state(index, Some(name), place);
            }
            Token::Begin("Consecutive", attributes) => {
                for index in self.consecutive(attributes, place.clone()) {
                    self.add_state(Some(index), None, place.clone());
                }
            }
            Token::Begin("State", attributes) => {
                let index = attribute(attributes, "id").and_then(|id| id.parse().ok());
                let name = attribute(attributes, "name");
                if index.is_none() && name.is_none() {
                    self.findings.malformed("<State> needs `id` or `name`", place);
                    return self.skip("State");
                }
                let state = self.add_state(index, name, place);
                self.each("State", |reader, token| match (&token.0, state) {
                    (Token::Begin("Initial", _), Some(state)) => {
                        reader.draft.begin(state, token.1, &mut reader.findings);
                        reader.skip("Initial");
                    }
                    (Token::Begin("Marked", _), Some(state)) => {
                        reader.draft.mark(state);
                        reader.skip("Marked");
                    }
                    _ => reader.misplaced(token, "</State>"),
                });
            }
            _ => self.misplaced(token, "a state"),
        }
    }

    /// The numbers of a range of states.
    fn consecutive(&mut self, attributes: &[(&str, &str)], place: Place) -> Vec<u64> {
        let number = |key| attribute(attributes, key).and_then(|text| text.parse().ok());
        let mut ends: Vec<u64> = [number("from"), number("to")].into_iter().flatten().collect();
        while let Some(&Token::Number(number)) = self.peek() {
            ends.push(number);
            self.next += 1;
        }
        self.skip("Consecutive");
        match ends.as_slice() {
            &[from, to] if from <= to && to - from < MAXIMUM_STATES as u64 => (from..=to).collect(),
            _ => {
                let message = format!(
                    "expected two ascending numbers, at most {MAXIMUM_STATES} states apart"
                );
                self.findings.malformed(message, place);
                Vec::new()
            }
        }
    }

    /// The states that are meant by an entry of a section, and their place.
    fn states(&mut self, token: Placed<'t>) -> (Vec<usize>, Place) {
        let place = token.1.clone();
        let names = match &token.0 {
            Token::Number(index) => vec![key(*index)],
            Token::Text(name) => vec![suffixed(name).0.to_owned()],
            Token::Begin("Consecutive", attributes) => {
                self.consecutive(attributes, place.clone()).into_iter().map(key).collect()
            }
            _ => {
                self.misplaced(token, "a state");
                Vec::new()
            }
        };
        let states = names
            .iter()
            .filter_map(|name| self.draft.state(name, place.clone(), &mut self.findings));
        (states.collect(), place)
    }

    fn initial(&mut self, token: Placed<'t>) {
        let (states, place) = self.states(token);
        for state in states {
            self.draft.begin(state, place.clone(), &mut self.findings);
        }
    }

    fn marked(&mut self, token: Placed<'t>) {
        for state in self.states(token).0 {
            self.draft.mark(state);
        }
    }

    fn transition(&mut self, token: Placed<'t>) {
        let place = token.1.clone();
        let (source, event, target) = match &token.0 {
            Token::Begin("Transition", attributes) => {
                let of = |name| attribute(attributes, name);
                let state = |name| of(name).map(|text| text.parse().map_or(text.to_owned(), key));
                let (source, event, target) = (state("x1"), of("event"), state("x2"));
                self.each("Transition", |reader, token| reader.misplaced(token, "</Transition>"));
                (source, event, target)
            }
            Token::Number(_) | Token::Text(_) => {
                let event = match self.peek() {
                    Some(Token::Text(name)) => Some(*name),
                    _ => None,
                };
                self.next += usize::from(event.is_some());
                let target = event.and_then(|_| self.peek()).and_then(state_key);
                self.next += usize::from(target.is_some());
                (state_key(&token.0), event, target)
            }
            _ => return self.misplaced(token, "a transition: a state, an event and a state"),
        };
        let (Some(source), Some(event), Some(target)) = (source, event, target) else {
            let message = "expected a transition: a state, an event and a state";
            return self.findings.malformed(message, place);
        };
        let [source, target] = [source, target].map(|name| self.end_of(&name, place.clone()));
        if self.is_open.1 {
            self.declared.declare(event, false, true);
        }
        let event = self.declared.find(event, place.clone(), &mut self.findings);
        if let (Some(source), Some(event), Some(target)) = (source, event, target) {
            self.draft.connect(source, event, target, place);
        }
    }

    /// The state of a transition, a new one where no section has declared states.
    fn end_of(&mut self, name: &str, place: Place) -> Option<usize> {
        match self.draft.known(name) {
            None if self.is_open.0 => {
                let index = name.strip_prefix(INDEX).and_then(|index| index.parse().ok());
                self.add_state(index, index.is_none().then_some(name), place)
            }
            Some(state) => Some(state),
            None => self.draft.state(name, place, &mut self.findings),
        }
    }
}

/// What is read of the flags of an event.
struct Flags {
    controllable: bool,
    observable: bool,
}

impl Flags {
    /// Reads letters; whether all of them are known.
    fn read(&mut self, letters: &str) -> bool {
        let mut are_known = true;
        for letter in letters.chars() {
            match letter {
                'C' => self.controllable = true,
                'c' => self.controllable = false,
                'O' => self.observable = true,
                'o' => self.observable = false,
                'F' | 'f' | 'P' | 'p' => {}
                _ => are_known = false,
            }
        }
        are_known
    }
}

fn attribute<'t>(attributes: &[(&str, &'t str)], key: &str) -> Option<&'t str> {
    attributes.iter().find(|(other, _)| *other == key).map(|(_, value)| *value)
}

/// The key of the state with an index.
fn key(index: u64) -> String {
    format!("{INDEX}{index}")
}

/// The key of a state that a token names.
fn state_key(token: &Token<'_>) -> Option<String> {
    match token {
        Token::Number(index) => Some(key(*index)),
        Token::Text(name) => Some(suffixed(name).0.to_owned()),
        _ => None,
    }
}

/// A name without the index behind its `#`, and that.
fn suffixed(name: &str) -> (&str, Option<u64>) {
    match name.rsplit_once('#') {
        Some((base, index)) if !base.is_empty() && index.parse::<u32>().is_ok() => {
            (base, index.parse().ok())
        }
        _ => (name, None),
    }
}
