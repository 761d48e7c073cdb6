//! By which signals of the PLC the events are seen and made: the partition of the alphabet, thesis section 3.4.2.

use std::collections::BTreeSet;
use std::fmt;
use std::time::Duration;

use understudy_ladder::Name;

use super::addresses::Located;
use super::names::Names;
use super::partition::find_event;
use crate::model::Signal;
use crate::{Alphabet, Automaton, Event, Label};

/// The partition of a supervisor's events, by name, and their signals; section 3.4.3, "I/O selection".
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputOutputMap {
    /// The name of the ladder program.
    pub program: Name,
    /// Names for labels, for automata whose format has none.
    pub events: Vec<EventName>,
    /// x^0: the operator's input that starts the program; without it, it starts in its initial state by itself.
    pub start: Option<Name>,
    /// Σ_u,i and Σ_u,p: events that operator and plant generate.
    pub inputs: Vec<InputEvent>,
    /// S: output devices that keep their position.
    pub switches: Vec<Switch>,
    /// Commands that last for one scan.
    pub pulses: Vec<Pulse>,
    /// Events that a timer of the PLC generates.
    pub timers: Vec<Timer>,
    /// x^σ: the operator's inputs that ask for a command; `request_` and the event's name where not given.
    pub requests: Vec<Request>,
    /// Where signals are in the PLC.
    pub addresses: Vec<Located>,
    /// How the program keeps to at most one event in a scan; none where it processes all events of a scan.
    pub one_event: Option<OneEvent>,
}

/// How a program keeps to at most one event in a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OneEvent {
    /// The inputs bring at most one event in a scan; no rung checks it.
    Assumed,
    /// Events wait for their turn. These come first, in this order; the others follow by ascending label.
    Queued(Vec<Name>),
}

/// What people call an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EventName {
    /// Its name.
    pub name: Name,
    /// Its number.
    pub label: Label,
}

impl InputOutputMap {
    /// The map to begin with: a signal for every event of `alphabet` that is 1 for one scan, under the name of its event; an
    /// input for an uncontrollable one, an output for a controllable one.
    pub fn direct(program: &str, alphabet: &Alphabet) -> Self {
        Self::of_signals(program, alphabet, &[])
    }

    /// The same, where the events that have one of `signals` are seen and made by that.
    pub fn of_signals(program: &str, alphabet: &Alphabet, signals: &[Signal]) -> Self {
        let mut names = Names::default();
        let program = names.fresh(&[program]);
        for signal in signals {
            names.take(&signal.signal);
        }
        let own = alphabet.events().iter().map(|event| {
            let known = signals.iter().find(|signal| signal.label == event.label);
            known.cloned().unwrap_or_else(|| {
                let word = if event.name == event.label.to_string() {
                    format!("e{}", event.label)
                } else {
                    event.name.clone()
                };
                Signal {
                    label: event.label,
                    signal: names.fresh(&[&word]),
                    when: Some(When::Pulse),
                }
            })
        });
        let own: Vec<Signal> = own.collect();
        let map = Self { program, ..Self::default() };
        map.with_signals(&own, alphabet)
    }

    /// This map, and for the events of `alphabet` that it does not name, the `signals` of a model: an input for an uncontrollable
    /// event, an output that is 1 for one scan for a controllable one.
    #[must_use]
    pub fn with_signals(mut self, signals: &[Signal], alphabet: &Alphabet) -> Self {
        let named: BTreeSet<Label> =
            self.event_names().filter_map(|name| find_event(alphabet, name)).collect();
        for event in alphabet.events() {
            let signal = signals.iter().find(|signal| signal.label == event.label);
            let Some(signal) = signal.filter(|_| !named.contains(&event.label)) else {
                continue;
            };
            let event_name = Name::from(event.name.clone());
            if event.label.is_controllable() {
                self.pulses.push(Pulse {
                    event: event_name,
                    signal: signal.signal.clone(),
                    memory: false,
                });
            } else {
                self.inputs.push(InputEvent {
                    event: event_name,
                    signal: signal.signal.clone(),
                    when: signal.when(),
                    by: Agent::Plant,
                });
            }
        }
        self
    }

    /// This map with the `addresses` of a model, but for signals that it does not have or has located itself.
    #[must_use]
    pub fn with_addresses(mut self, addresses: &[Located]) -> Self {
        let requests = self.requests.iter().map(|request| &request.signal);
        let inputs = self.inputs.iter().map(|input| &input.signal);
        let pulses = self.pulses.iter().map(|pulse| &pulse.signal);
        let positions = self.switches.iter().flat_map(|switch| &switch.positions);
        let positions = positions.map(|position| &position.signal);
        let signals = requests.chain(inputs).chain(pulses).chain(positions);
        let signals: BTreeSet<&str> = signals.chain(&self.start).map(Name::as_str).collect();
        let is_free = |located: &&Located| {
            let known = |own: &Located| own.signal == located.signal;
            signals.contains(located.signal.as_str()) && !self.addresses.iter().any(known)
        };
        let more: Vec<Located> = addresses.iter().filter(is_free).cloned().collect();
        self.addresses.extend(more);
        self
    }

    /// The events to which the map gives a meaning.
    fn event_names(&self) -> impl Iterator<Item = &Name> {
        let inputs = self.inputs.iter().map(|input| &input.event);
        let timers = self.timers.iter().map(|timer| &timer.event);
        let pulses = self.pulses.iter().map(|pulse| &pulse.event);
        let switches = self.switches.iter().flat_map(|switch| {
            let positions = switch.positions.iter().map(|position| &position.event);
            positions.chain(&switch.off)
        });
        inputs.chain(timers).chain(pulses).chain(switches)
    }

    /// `automaton` with the names that the map gives to its events.
    #[must_use]
    pub fn name_events(&self, automaton: Automaton) -> Automaton {
        let named = self
            .events
            .iter()
            .map(|event| Event { label: event.label, name: event.name.to_string() });
        automaton.with_event_names(&Alphabet::new(named))
    }
}

/// An uncontrollable event that an input signal brings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputEvent {
    /// The event.
    pub event: Name,
    /// x_σ, an input of the ladder.
    pub signal: Name,
    /// What of the signal is the event.
    pub when: When,
    /// Who generates it.
    pub by: Agent,
}

/// What of a signal is an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum When {
    /// The signal is 1 for one scan at each event.
    Pulse,
    /// The signal has become 1.
    #[default]
    Rising,
    /// The signal has become 0.
    Falling,
    /// The signal is 1: the event is a condition that holds.
    High,
    /// The signal is 0.
    Low,
}

impl When {
    /// All, with their words in a file.
    pub const WORDS: [(&'static str, Self); 5] = [
        ("pulse", Self::Pulse),
        ("rising", Self::Rising),
        ("falling", Self::Falling),
        ("high", Self::High),
        ("low", Self::Low),
    ];

    /// Whether it is a change of the signal, which holds for one scan.
    pub fn is_edge(self) -> bool {
        matches!(self, Self::Rising | Self::Falling)
    }

    /// Its word in a file.
    pub fn word(self) -> &'static str {
        let found = Self::WORDS.into_iter().find(|(_, when)| *when == self);
        found.map_or("", |(word, _)| word)
    }
}

/// Who generates an uncontrollable event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Agent {
    /// The plant answers: Σ_u,p.
    #[default]
    Plant,
    /// An operator acts: Σ_u,i.
    Operator,
}

impl Agent {
    /// All, with their words in a file.
    pub const WORDS: [(&'static str, Self); 2] =
        [("plant", Self::Plant), ("operator", Self::Operator)];
}

/// An output device as a switch of n+1 states, Figure 3.6: position 0 is off, and one signal is on in each other one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Switch {
    /// σ_0, which turns all signals off; none where nothing does.
    pub off: Option<Name>,
    /// σ_1 to σ_n.
    pub positions: Vec<Position>,
    /// Its signals are memory bits, as for a timer.
    pub memory: bool,
}

/// One position of a switch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Position {
    /// σ_j.
    pub event: Name,
    /// x_σj, which rises when σ_j occurs.
    pub signal: Name,
}

/// A controllable event whose signal is on for one scan when it occurs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pulse {
    /// The event.
    pub event: Name,
    /// Its signal.
    pub signal: Name,
    /// The signal is a memory bit, not visible outside of the PLC.
    pub memory: bool,
}

/// An uncontrollable event that occurs when a bit has been on for some time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Timer {
    /// The event: the time is over.
    pub event: Name,
    /// The name of the on-delay timer.
    pub name: Name,
    /// The signal of a switch's position; the timer runs while it is on.
    pub runs_while: Name,
    /// The time.
    pub preset: Duration,
}

/// An input by which the operator asks for a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// The controllable event.
    pub event: Name,
    /// x^σ.
    pub signal: Name,
}

/// Who chooses among commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// The PLC: it generates each command as soon as it is enabled, of several the one whose rung comes first (Table 3.1).
    #[default]
    Automatic,
    /// The operator where there is a choice; a command that is the only one is generated as in automatic mode (Table 3.2).
    /// With several automata whether there is a choice depends on all of them, and every command waits for its request.
    Manual,
    /// The operator always: every command waits for its request.
    Requested,
}

impl Mode {
    /// All, with their words on the command line.
    pub const WORDS: [(&'static str, Self); 3] =
        [("automatic", Self::Automatic), ("manual", Self::Manual), ("requested", Self::Requested)];
}

impl fmt::Display for Mode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = Self::WORDS.into_iter().find(|(_, mode)| mode == self);
        formatter.write_str(word.map_or("", |(word, _)| word))
    }
}
