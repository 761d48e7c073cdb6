//! What each event of the automata means to the PLC, checked: every event has one meaning, and it is the right one.

use std::collections::{BTreeMap, HashMap};

use understudy_ladder::Name;
use understudy_text::Diagnostic;
use understudy_text::spelling;

use super::map::{InputOutputMap, OneEvent, When};
use super::names::{ILLEGAL_NAME, is_legal};
use super::order::moving;
use crate::{Alphabet, Automaton, Event, Label};

/// The most positions that a switch has, besides off.
pub(crate) const MAXIMUM_POSITIONS: usize = 63;

/// The automata that become one ladder.
#[derive(Debug, Clone, Copy)]
pub struct Modules<'a> {
    /// They decide which commands are enabled: an event of several alphabets needs all of them.
    pub supervisors: &'a [Automaton],
    /// They follow the plant, for supervisors that do not know its state by themselves, as reduced ones: what they do not
    /// allow is no command, and what they cannot generate is no event. None for a supervisor from supcon.
    pub plants: &'a [Automaton],
}

impl<'a> Modules<'a> {
    /// One supervisor alone.
    pub fn supervisor(supervisor: &'a Automaton) -> Self {
        Self { supervisors: std::slice::from_ref(supervisor), plants: &[] }
    }

    /// All automata, supervisors first.
    pub fn all(&self) -> impl Iterator<Item = &'a Automaton> + use<'a> {
        self.supervisors.iter().chain(self.plants)
    }

    /// How many automata.
    pub fn len(&self) -> usize {
        self.supervisors.len() + self.plants.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The places of those that say whether the uncontrollable event `label` can happen: the plants that know it, or the
    /// supervisors where no plant does. A supervisor that is controllable never says no where its plant says yes.
    pub(crate) fn witnesses(&self, label: Label) -> Vec<usize> {
        let knows = |automaton: &Automaton| automaton.alphabet().contains(label);
        let first_plant = self.supervisors.len();
        if self.plants.iter().any(knows) {
            let plants = (first_plant..).zip(self.plants);
            plants.filter(|(_, plant)| knows(plant)).map(|(place, _)| place).collect()
        } else {
            let supervisors = (0..).zip(self.supervisors);
            supervisors.filter(|(_, automaton)| knows(automaton)).map(|(place, _)| place).collect()
        }
    }

    /// The events of all.
    pub fn alphabet(&self) -> Alphabet {
        Alphabet::new([]).union(self.all().map(Automaton::alphabet))
    }
}

/// By what an event is seen or made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning {
    /// An entry of [`InputOutputMap::inputs`].
    Input(usize),
    /// An entry of [`InputOutputMap::timers`].
    Timer(usize),
    /// A position of an entry of [`InputOutputMap::switches`]; 0 is off.
    Switch {
        /// Which switch.
        switch: usize,
        /// Which position.
        position: usize,
    },
    /// An entry of [`InputOutputMap::pulses`].
    Pulse(usize),
}

/// The meaning of every event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    meanings: BTreeMap<Label, Meaning>,
    requests: BTreeMap<Label, Name>,
    queue: Vec<Label>,
}

impl Partition {
    /// Resolves the names of `map` against the events of `modules`.
    ///
    /// # Errors
    /// All that is wrong: U0851 an unknown event, U0852 an event with two meanings, U0853 one without, U0854 a command that is
    /// uncontrollable or an input that is controllable, U0855 an illegal name, U0856 a signal with two meanings, U0857 a timer
    /// on a signal that no switch has, U0858 an automaton without states, U0859 too many positions, or none, U0868 an event by
    /// level where a scan has at most one event.
    pub fn new(map: &InputOutputMap, modules: &Modules) -> Result<Self, Vec<Diagnostic>> {
        let alphabet = modules.alphabet();
        let given = map
            .events
            .iter()
            .map(|event| Event { label: event.label, name: event.name.to_string() });
        let known = alphabet.labels().collect::<Vec<_>>();
        let given = given.filter(|event| known.contains(&event.label));
        let alphabet = Alphabet::new(given).union([&alphabet]);
        let mut resolver = Resolver {
            alphabet: &alphabet,
            meanings: BTreeMap::new(),
            signals: HashMap::new(),
            diagnostics: Vec::new(),
        };
        for automaton in modules.all().filter(|automaton| automaton.is_empty()) {
            let message = format!(
                "the automaton `{}` has no state: there is no supervisor that keeps the specification",
                automaton.name()
            );
            resolver.diagnostics.push(Diagnostic::error("U0858", message, 0..0));
        }
        resolver.name(&map.program);
        if let Some(start) = &map.start {
            resolver.signal(start, "a start");
        }
        resolver.inputs(map);
        resolver.commands(map);
        let requests = resolver.requests(map);
        let queue = resolver.queue(map, modules);
        resolver.missing();
        if resolver.diagnostics.is_empty() {
            Ok(Self {
                meanings: resolver
                    .meanings
                    .into_iter()
                    .map(|(label, (meaning, _))| (label, meaning))
                    .collect(),
                requests,
                queue,
            })
        } else {
            Err(resolver.diagnostics)
        }
    }

    /// What `label` means; `None` where it is no event of the automata.
    pub fn meaning(&self, label: Label) -> Option<Meaning> {
        self.meanings.get(&label).copied()
    }

    /// All events, ascending.
    pub fn labels(&self) -> impl Iterator<Item = Label> + '_ {
        self.meanings.keys().copied()
    }

    /// The events that wait for their turn, the first the one that is processed first; empty where none waits.
    pub fn queue(&self) -> &[Label] {
        &self.queue
    }

    /// x^σ of a command, where the map names one.
    pub fn request(&self, label: Label) -> Option<&Name> {
        self.requests.get(&label)
    }
}

struct Resolver<'a> {
    alphabet: &'a Alphabet,
    meanings: BTreeMap<Label, (Meaning, Name)>,
    /// What each signal is for, and where that was said.
    signals: HashMap<String, (String, Name)>,
    diagnostics: Vec<Diagnostic>,
}

impl Resolver<'_> {
    fn inputs(&mut self, map: &InputOutputMap) {
        // One signal may bring an event when it rises and another one when it falls.
        let mut seen: HashMap<&str, Vec<usize>> = HashMap::new();
        for (place, input) in map.inputs.iter().enumerate() {
            self.give(&input.event, Meaning::Input(place), false);
            let others = seen.entry(&input.signal).or_default();
            let clash = others.iter().find(|&&other| map.inputs[other].when == input.when);
            if let Some(&other) = clash {
                let message = format!("`{}` brings two events in the same way", input.signal);
                let first = &map.inputs[other].signal;
                self.diagnostics.push(
                    Diagnostic::error("U0856", message, input.signal.span())
                        .with_related(first.span(), "the first is here")
                        .with_help("one event for `rising` and one for `falling` are possible"),
                );
            }
            if others.is_empty() {
                self.signal(&input.signal, "an input");
            }
            others.push(place);
        }
        for (place, timer) in map.timers.iter().enumerate() {
            self.give(&timer.event, Meaning::Timer(place), false);
            self.signal(&timer.name, "a timer");
            let positions = map.switches.iter().flat_map(|switch| &switch.positions);
            let signals = positions.map(|position| position.signal.as_str());
            if !signals.clone().any(|signal| signal == timer.runs_while.as_str()) {
                let message = format!("no switch has the signal `{}`", timer.runs_while);
                let help = spelling::question(&timer.runs_while, signals).unwrap_or_else(|| {
                    "a timer runs while the signal of a switch's position is on".into()
                });
                self.diagnostics.push(
                    Diagnostic::error("U0857", message, timer.runs_while.span()).with_help(help),
                );
            }
        }
    }

    fn commands(&mut self, map: &InputOutputMap) {
        for (switch, content) in map.switches.iter().enumerate() {
            if let Some(off) = &content.off {
                let position = 0;
                self.give(off, Meaning::Switch { switch, position }, true);
            }
            for (place, position) in content.positions.iter().enumerate() {
                let meaning = Meaning::Switch { switch, position: place + 1 };
                self.give(&position.event, meaning, true);
                self.signal(&position.signal, "a position of a switch");
            }
            if let (true, Some(off)) = (content.positions.is_empty(), &content.off) {
                let message = format!("`{off}` turns off a switch that has no other position");
                self.diagnostics.push(
                    Diagnostic::error("U0859", message, off.span()).with_help(
                        "give the switch its positions, or make a [[pulse]] of the event",
                    ),
                );
            }
            if content.positions.len() > MAXIMUM_POSITIONS {
                let message = format!(
                    "a switch of {} positions; at most {MAXIMUM_POSITIONS} are possible",
                    content.positions.len()
                );
                let span = content.positions[MAXIMUM_POSITIONS].event.span();
                self.diagnostics.push(Diagnostic::error("U0859", message, span));
            }
        }
        for (place, pulse) in map.pulses.iter().enumerate() {
            self.give(&pulse.event, Meaning::Pulse(place), true);
            self.signal(&pulse.signal, "a pulse");
        }
    }

    fn requests(&mut self, map: &InputOutputMap) -> BTreeMap<Label, Name> {
        let mut requests = BTreeMap::new();
        for request in &map.requests {
            let Some(label) = self.label(&request.event) else {
                continue;
            };
            self.direction(&request.event, label, true);
            self.signal(&request.signal, "a request");
            if requests.insert(label, request.signal.clone()).is_some() {
                let message = format!("`{}` has two requests", request.event);
                self.diagnostics.push(Diagnostic::error("U0852", message, request.event.span()));
            }
        }
        requests
    }

    /// The order of the events that wait for their turn.
    fn queue(&mut self, map: &InputOutputMap, modules: &Modules) -> Vec<Label> {
        let Some(one_event) = &map.one_event else {
            return Vec::new();
        };
        for input in map.inputs.iter().filter(|input| matches!(input.when, When::High | When::Low))
        {
            let message = format!(
                "the event `{}` is the level of `{}`, so it occurs in every scan; with one event in a scan no other one would be processed",
                input.event, input.signal
            );
            self.diagnostics.push(
                Diagnostic::error("U0868", message, input.event.span())
                    .with_help("make it a change: when = \"rising\", \"falling\" or \"pulse\""),
            );
        }
        let OneEvent::Queued(first) = one_event else {
            return Vec::new();
        };
        let moving = moving(modules);
        let mut queue = Vec::new();
        for event in first {
            if let Some(label) = self.label(event) {
                self.direction(event, label, false);
                if moving.contains(&label) && !queue.contains(&label) {
                    queue.push(label);
                }
            }
        }
        let rest: Vec<Label> = moving.into_iter().filter(|label| !queue.contains(label)).collect();
        queue.extend(rest);
        queue
    }

    fn missing(&mut self) {
        for event in self.alphabet.events() {
            if self.meanings.contains_key(&event.label) {
                continue;
            }
            let (kind, help) = if event.label.is_controllable() {
                ("controllable", "give it a [[switch]] or a [[pulse]]")
            } else {
                ("uncontrollable", "give it an [[input]] or a [[timer]]")
            };
            let message = format!("the {kind} event `{}` has no signal", event.name);
            self.diagnostics.push(Diagnostic::error("U0853", message, 0..0).with_help(help));
        }
    }

    fn give(&mut self, event: &Name, meaning: Meaning, controllable: bool) {
        let Some(label) = self.label(event) else {
            return;
        };
        self.direction(event, label, controllable);
        if let Some((_, first)) = self.meanings.get(&label) {
            let message = format!("the event `{event}` has two meanings");
            self.diagnostics.push(
                Diagnostic::error("U0852", message, event.span())
                    .with_related(first.span(), "the first is here"),
            );
        } else {
            self.meanings.insert(label, (meaning, event.clone()));
        }
    }

    fn direction(&mut self, event: &Name, label: Label, controllable: bool) {
        if label.is_controllable() == controllable {
            return;
        }
        let message = if controllable {
            format!("`{event}` is uncontrollable ({label}, an even label): no PLC can command it")
        } else {
            format!("`{event}` is controllable ({label}, an odd label): the PLC generates it")
        };
        self.diagnostics.push(Diagnostic::error("U0854", message, event.span()));
    }

    fn label(&mut self, event: &Name) -> Option<Label> {
        let found = find_event(self.alphabet, event);
        if found.is_none() {
            let message = format!("there is no event `{event}`");
            let known = self.alphabet.events().iter();
            let near = spelling::question(event, known.map(|event| event.name.as_str()));
            let mut diagnostic = Diagnostic::error("U0851", message, event.span());
            diagnostic.help = near;
            self.diagnostics.push(diagnostic);
        }
        found
    }

    fn name(&mut self, name: &Name) {
        if !is_legal(name) {
            let message = format!("{:?} cannot be a name in a ladder", name.as_str());
            self.diagnostics
                .push(Diagnostic::error("U0855", message, name.span()).with_help(ILLEGAL_NAME));
        }
    }

    fn signal(&mut self, signal: &Name, what: &str) {
        self.name(signal);
        if let Some((other, first)) = self.signals.get(signal.as_str()) {
            let message = format!("`{signal}` is the signal of {what} and of {other}");
            self.diagnostics.push(
                Diagnostic::error("U0856", message, signal.span())
                    .with_related(first.span(), "the first is here"),
            );
        } else {
            self.signals.insert(signal.to_string(), (what.to_owned(), signal.clone()));
        }
    }
}

/// The event that a map calls `name`: by its name, or by its number.
pub(crate) fn find_event(alphabet: &Alphabet, name: &str) -> Option<Label> {
    let events = alphabet.events();
    let number = name.parse().ok().map(Label::new);
    let found = events.iter().find(|known| known.name == name);
    let found = found.or_else(|| events.iter().find(|known| Some(known.label) == number));
    found.map(|event| event.label)
}
