//! From automata to rungs.

mod queue;
mod several;
mod single;

use std::collections::{BTreeMap, BTreeSet};

use understudy_ladder::{Block, BlockKind, Coil, Element, Name, Program, Signal};
use understudy_text::Diagnostic;

use super::addresses::locate;
use super::map::{Agent, InputOutputMap, Mode, OneEvent, When};
use super::names::Names;
use super::omega::{Row, omega};
use super::order::{Group, groups, single_groups};
use super::partition::{Meaning, Modules, Partition};
use super::rung::{closed, open, reset, rising, rung, set, write};
use crate::{Automaton, Label, State};

/// Letters of a state's name past which its bit bears its number, and the name is a comment.
const LONGEST_STATE: usize = 24;

/// Meaning of the bits of a program in the model, for the proof.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Correspondence {
    /// The bit of each state of each automaton, supervisors first.
    pub states: Vec<Vec<Name>>,
    /// x^σ of each command that waits for a request in some state.
    pub requests: BTreeMap<Label, Name>,
    /// The bit that is on while an event waits for its turn.
    pub waiting: BTreeMap<Label, Name>,
}

/// A ladder and where it comes from.
#[derive(Debug, Clone)]
pub struct Conversion {
    /// The program.
    pub program: Program,
    /// Ω of each automaton, supervisors first.
    pub rows: Vec<Vec<Row>>,
    /// Events whose bits are reset by the rungs that use them (AEEM), ascending.
    pub consumed: Vec<Label>,
    /// Meaning of the bits.
    pub correspondence: Correspondence,
}

/// Makes the ladder of `modules`.
///
/// # Errors
/// What [`Partition::new`] reports; U0866 the address of a signal that the ladder does not have, U0867 one of the wrong area or
/// of two signals.
pub fn convert(
    modules: &Modules,
    map: &InputOutputMap,
    mode: Mode,
) -> Result<Conversion, Vec<Diagnostic>> {
    let partition = Partition::new(map, modules)?;
    let rows = modules.all().map(|automaton| omega(automaton, map, &partition, mode)).collect();
    let converter = Converter::new(modules, map, &partition, mode);
    let mut conversion = converter.finish(rows);
    locate(&mut conversion.program, &map.addresses)?;
    Ok(conversion)
}

struct Converter<'a> {
    map: &'a InputOutputMap,
    partition: &'a Partition,
    mode: Mode,
    automata: Vec<&'a Automaton>,
    modules: Modules<'a>,
    groups: Vec<Group>,
    names: Names,
    program: Program,
    states: Vec<Vec<Name>>,
    requests: BTreeMap<Label, Name>,
    /// On when an event has occurred in this scan.
    bits: BTreeMap<Label, Name>,
    consumed: BTreeSet<Label>,
    /// Bits of events that are reset at the end of the scan where no rung has used them: AEEM, step 3.
    left: Vec<Name>,
    /// Whether the names of an automaton's states are short enough to be names of bits.
    are_named: Vec<bool>,
    /// On once the program has started; only where the operator starts it.
    started: Option<Name>,
    /// On when this scan has generated a command.
    commanded: Option<Name>,
    /// The bit of each event that waits for its turn.
    waiting: BTreeMap<Label, Name>,
    /// On while an event waits for its turn.
    queued: Option<Name>,
}

impl<'a> Converter<'a> {
    fn new(
        modules: &Modules<'a>,
        map: &'a InputOutputMap,
        partition: &'a Partition,
        mode: Mode,
    ) -> Self {
        let mut converter = Self {
            map,
            partition,
            mode,
            automata: modules.all().collect(),
            modules: *modules,
            groups: match map.one_event {
                Some(_) => single_groups(modules),
                None => groups(modules),
            },
            names: Names::default(),
            program: Program { name: map.program.clone(), ..Program::default() },
            states: Vec::new(),
            requests: BTreeMap::new(),
            bits: BTreeMap::new(),
            consumed: BTreeSet::new(),
            left: Vec::new(),
            are_named: Vec::new(),
            started: None,
            commanded: None,
            waiting: BTreeMap::new(),
            queued: None,
        };
        converter.declare_signals();
        converter.declare_states();
        converter
    }

    fn finish(mut self, rows: Vec<Vec<Row>>) -> Conversion {
        self.describe();
        self.begin_scan();
        self.start();
        self.timers();
        self.queue();
        match rows.as_slice() {
            [rows] => self.single(rows),
            _ => self.several(),
        }
        if self.map.one_event.is_some() {
            for bit in std::mem::take(&mut self.left) {
                let title = format!("reset {bit}, which no state has used");
                self.push(&title, Vec::new(), vec![reset(&bit)]);
            }
        }
        if !self.left.is_empty() {
            let coils = self.left.iter().map(reset).collect();
            self.push("reset events that no state has used", Vec::new(), coils);
        }
        Conversion {
            program: self.program,
            rows,
            consumed: self.consumed.into_iter().collect(),
            correspondence: Correspondence {
                states: self.states,
                requests: self.requests,
                waiting: self.waiting,
            },
        }
    }

    fn describe(&mut self) {
        let names: Vec<String> = self
            .automata
            .iter()
            .map(|automaton| {
                let (states, transitions) = (automaton.state_count(), automaton.transition_count());
                format!("{} ({states} states, {transitions} transitions)", automaton.name())
            })
            .collect();
        let scan = match &self.map.one_event {
            None => {
                "Each scan evaluates the events, then generates at most one command.".to_owned()
            }
            Some(OneEvent::Assumed) => {
                "Right only where at most one event occurs in a scan.".to_owned()
            }
            Some(OneEvent::Queued(_)) => {
                let order = self.partition.queue().iter().map(|&label| self.event_name(label));
                format!(
                    "Each scan processes one event, the first possible one of {}; then it generates at most one command, if no event waits. None is lost if none of them comes twice within {} scans.",
                    order.collect::<Vec<_>>().join(", "),
                    self.partition.queue().len()
                )
            }
        };
        self.program.comments = vec![
            format!("Generated from {}.", names.join(", ")),
            format!("One bit for each state; exactly one of them is on. {scan}"),
        ];
    }

    fn declare_signals(&mut self) {
        let described = |name: &Name, description: String| Signal {
            description: Some(description),
            ..Signal::new(name.clone())
        };
        let kept = |name: &Name, description: String| Signal {
            initial: Some(false),
            ..described(name, description)
        };
        let map = self.map;
        let mut inputs = Vec::new();
        if let Some(start) = &map.start {
            inputs.push(described(start, "start of the program".into()));
        }
        for input in &map.inputs {
            let by = match input.by {
                Agent::Plant => "plant",
                Agent::Operator => "operator",
            };
            let when = match input.when {
                When::Pulse => "for one scan",
                When::Rising => "becomes 1",
                When::Falling => "becomes 0",
                When::High => "is 1",
                When::Low => "is 0",
            };
            let text = format!("{by}: {} when it {when}", input.event);
            match inputs.iter_mut().find(|known: &&mut Signal| known.name == input.signal) {
                Some(known) => {
                    let description = known.description.get_or_insert_default();
                    description.push_str(&format!("; {} when it {when}", input.event));
                }
                None => inputs.push(described(&input.signal, text.replace("when it for", "for"))),
            }
        }
        self.program.inputs = inputs;
        for switch in &map.switches {
            for position in &switch.positions {
                if switch.memory {
                    let signal = kept(&position.signal, format!("on since {}", position.event));
                    self.program.memory.push(signal);
                } else {
                    let signal =
                        described(&position.signal, format!("on since {}", position.event));
                    self.program.outputs.push(signal);
                }
            }
        }
        for pulse in &map.pulses {
            let text = format!("on for one scan at {}", pulse.event);
            if pulse.memory {
                self.program.memory.push(kept(&pulse.signal, text));
            } else {
                self.program.outputs.push(described(&pulse.signal, text));
            }
        }
        let signals = self.program.inputs.iter().chain(self.program.writable());
        let signals: Vec<Name> = signals.map(|signal| signal.name.clone()).collect();
        for signal in signals.iter().chain(map.timers.iter().map(|timer| &timer.name)) {
            self.names.take(signal);
        }
    }

    fn declare_states(&mut self) {
        if self.map.start.is_some() {
            let started = self.memory(&["started"], "program started");
            self.started = Some(started);
        }
        let alone = self.automata.len() == 1;
        for automaton in self.automata.clone() {
            let mut bits = Vec::with_capacity(automaton.state_count());
            let names = automaton.state_names();
            let named = names.filter(|names| names.iter().all(|name| name.len() <= LONGEST_STATE));
            self.are_named.push(named.is_some() || names.is_none());
            for state in automaton.states() {
                let wanted = match named {
                    Some(names) => names[state.index()].clone(),
                    None => format!("q{state}"),
                };
                let owner = if alone { "" } else { automaton.name() };
                let name = self.names.fresh(&[owner, &wanted]);
                let described = names.filter(|_| named.is_none());
                self.program.memory.push(Signal {
                    description: described.map(|names| names[state.index()].clone()),
                    initial: Some(self.started.is_none() && Some(state) == automaton.initial()),
                    ..Signal::new(name.clone())
                });
                bits.push(name);
            }
            self.states.push(bits);
        }
    }

    /// A memory bit that is 0 at first.
    fn memory(&mut self, parts: &[&str], description: &str) -> Name {
        let name = self.names.fresh(parts);
        self.program.memory.push(Signal {
            initial: Some(false),
            description: (!description.is_empty()).then(|| description.to_owned()),
            ..Signal::new(name.clone())
        });
        name
    }

    /// The input that asks for `label`, declared at its first use.
    fn ask(&mut self, label: Label, wanted: &Name) -> Name {
        if let Some(known) = self.requests.get(&label) {
            return known.clone();
        }
        let name = match self.partition.request(label) {
            Some(given) => {
                self.names.take(given);
                given.clone()
            }
            None => self.names.fresh(&[wanted]),
        };
        self.program.inputs.push(Signal {
            description: Some(format!("operator: request for {}", self.event_name(label))),
            ..Signal::new(name.clone())
        });
        self.requests.insert(label, name.clone());
        name
    }

    fn event_name(&self, label: Label) -> String {
        let mut alphabets = self.automata.iter().map(|automaton| automaton.alphabet());
        let known = alphabets.find(|alphabet| alphabet.contains(label));
        known.map_or_else(|| label.to_string(), |alphabet| alphabet.name(label))
    }

    /// Needed where a command brings an automaton to a state with another command, so that the plant sees one at a time.
    fn begin_scan(&mut self) {
        let controllable = |automaton: &Automaton, state| {
            let mut labels = automaton.edges(state).iter().map(|edge| automaton.label(*edge));
            labels.any(Label::is_controllable)
        };
        let chains = self.automata.len() > 1
            || self.automata.iter().any(|automaton| {
                automaton.transitions().any(|transition| {
                    transition.label.is_controllable()
                        && (controllable(automaton, transition.target))
                })
            });
        let mut coils = Vec::new();
        if chains {
            let commanded = self.memory(&["commanded"], "command generated in this scan");
            coils.push(reset(&commanded));
            self.commanded = Some(commanded);
        }
        coils.extend(self.map.pulses.iter().map(|pulse| reset(&pulse.signal)));
        if !coils.is_empty() {
            self.push("no command at the start of the scan", Vec::new(), coils);
        }
    }

    fn start(&mut self) {
        if let (Some(start), Some(started)) = (&self.map.start, self.started.clone()) {
            let mut coils: Vec<_> = self.states.iter().map(|bits| set(&bits[0])).collect();
            coils.push(set(&started));
            let title = if self.automata.len() == 1 { "1: start" } else { "start" };
            self.push(title, vec![open(start), closed(&started)], coils);
        }
    }

    fn timers(&mut self) {
        for timer in &self.map.timers {
            let block = Element::Block(Block {
                name: timer.name.clone(),
                kind: BlockKind::Ton(timer.preset),
                pins: Vec::new(),
            });
            let title = format!("delay of {}", timer.event);
            self.push(&title, vec![open(&timer.runs_while), block], Vec::new());
        }
    }

    fn push(&mut self, title: &str, network: Vec<Element>, coils: Vec<Coil>) {
        self.program.rungs.push(rung(title, network, coils));
    }

    /// What passes power in the scan in which an uncontrollable event occurs, for use in one rung. A falling edge needs the
    /// last value, which is brought up to date by [`Self::remember`] behind that rung.
    fn occurrence(&mut self, label: Label) -> Vec<Element> {
        match self.partition.meaning(label) {
            Some(Meaning::Input(place)) => {
                let input = &self.map.inputs[place];
                let signal = &input.signal;
                match input.when {
                    When::Pulse | When::High => vec![open(signal)],
                    When::Low => vec![closed(signal)],
                    When::Rising => vec![rising(signal)],
                    When::Falling => {
                        let last = self.memory(&[signal, "last"], "value in the previous scan");
                        vec![open(&last), closed(signal)]
                    }
                }
            }
            Some(Meaning::Timer(place)) => {
                let timer = &self.map.timers[place].name;
                vec![rising(&Name::from(format!("{timer}.Q")))]
            }
            Some(Meaning::Switch { .. } | Meaning::Pulse(_)) | None => Vec::new(),
        }
    }

    /// Whether the result of [`Self::occurrence`] may be used in several rungs.
    fn is_level(&self, label: Label) -> bool {
        let Some(Meaning::Input(place)) = self.partition.meaning(label) else {
            return false;
        };
        !matches!(self.map.inputs[place].when, When::Rising | When::Falling)
    }

    /// What a title calls a state.
    fn shown(&self, automaton: usize, state: State) -> String {
        if self.are_named[automaton] {
            self.automata[automaton].state_name(state).into_owned()
        } else {
            self.states[automaton][state.index()].to_string()
        }
    }

    /// A coil that switches the bit of an event on for this scan: a plain one, or, where rungs reset it (AEEM, step 1), one
    /// that sets it.
    fn announce(&mut self, bit: &Name, is_consumed: bool) -> Coil {
        if !is_consumed {
            return write(bit);
        }
        if !self.left.contains(bit) {
            self.left.push(bit.clone());
        }
        set(bit)
    }

    /// The rung that sets the bit of an event for this scan.
    fn detect(&mut self, label: Label, is_consumed: bool) -> Name {
        let event = self.event_name(label);
        let bit = self.memory(&[&event], "");
        let network = self.occurrence(label);
        let last = match network.as_slice() {
            [Element::Contact(last), Element::Contact(signal)] => {
                Some((last.operand.clone(), signal.operand.clone()))
            }
            _ => None,
        };
        let coil = self.announce(&bit, is_consumed);
        self.push(&format!("{event} occurs"), network, vec![coil]);
        if let Some((last, signal)) = last {
            let title = format!("{signal}: value for the next scan");
            self.push(&title, vec![open(&signal)], vec![write(&last)]);
        }
        bit
    }
}

/// Whether one occurrence of `label` could go through two transitions of `automaton`.
fn repeats(automaton: &Automaton, label: Label) -> bool {
    let Some(event) = automaton.alphabet().place(label) else {
        return false;
    };
    automaton.states().any(|source| {
        let middle = automaton.successor(source, event).filter(|&target| target != source);
        middle.is_some_and(|middle| {
            automaton.successor(middle, event).is_some_and(|target| target != middle)
        })
    })
}
