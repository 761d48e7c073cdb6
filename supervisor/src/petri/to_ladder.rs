//! A net as a ladder, and the hybrid controller: a net with supervisors beside it that follow it and inhibit it.
//!
//! Steps 7 to 9 of section 3. The order of the rungs: timers; what begins anew in each scan; edges; then each transition of
//! the net, *with the supervisors' rungs for its event directly below it*; counters; actions. So the supervisors have seen
//! every event before the next transition asks them, and none arrives after its rung was passed (in the print the supervisor
//! stands between the uncontrollable and the controllable transitions, whose events it sees one scan late).
//!
//! Invariants: a transition fires at most once in a scan; a token does not pass two transitions on one edge of a signal, nor
//! a place with an action, in one scan; a delay begins anew after each firing.

use std::collections::{BTreeMap, BTreeSet};

use understudy_diagnostic::{Diagnostic, has_errors};
use understudy_ladder::{Block, BlockKind, Coil, Element, Name, Program, Signal};

use super::explore::ExplorationError;
use super::net::{Action, Condition, Net, NetTransition};
use super::tokens::Tokens;
use crate::Automaton;
use crate::ladder::rung::{any, closed, open, reset, rising, rung, set, write};
use crate::ladder::{Names, When, avalanche_events};

/// Why there is no ladder of a net.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HybridError {
    /// The net has no bounds, or too many markings to know them.
    #[error(transparent)]
    Bounds(#[from] ExplorationError),
    /// A supervisor has no state: nothing keeps the specification.
    #[error("U0897: the supervisor `{name}` has no state")]
    EmptySupervisor {
        /// Its name.
        name: String,
    },
    /// A supervisor knows an event that no transition of the net has.
    #[error(
        "U0898: the supervisor `{supervisor}` knows {event}, and no transition of the net is that event"
    )]
    UnknownEvent {
        /// The supervisor.
        supervisor: String,
        /// The event.
        event: String,
    },
    /// A signal's name cannot stand in a ladder, or is input and output at once.
    #[error("U0899: the ladder of the net has errors: {}", .0.iter().map(|found| found.message.as_str()).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<Diagnostic>),
}

/// The ladder of a net and its supervisors.
#[derive(Debug, Clone)]
pub struct HybridLadder {
    /// The program.
    pub program: Program,
    /// For each place its bits: the k-th is 1 while there are at least k tokens. Empty for a place that is a counter.
    pub places: Vec<Vec<Name>>,
    /// The bit of each state of each supervisor.
    pub states: Vec<Vec<Name>>,
    /// For each transition the bit that is 1 in the scan in which it fires.
    pub fires: Vec<Name>,
}

/// Makes the ladder of `net` beside `supervisors`, which may be none. At most `limit` markings are looked at for its bounds.
///
/// # Errors
/// See [`HybridError`].
pub fn to_ladder(
    net: &Net,
    supervisors: &[Automaton],
    limit: usize,
) -> Result<HybridLadder, HybridError> {
    let bounds = net.explore(limit)?.bounds();
    for supervisor in supervisors {
        let name = supervisor.name().to_owned();
        if supervisor.is_empty() {
            return Err(HybridError::EmptySupervisor { name });
        }
        let known: BTreeSet<_> = net.transitions().iter().filter_map(|t| t.label).collect();
        if let Some(label) = supervisor
            .alphabet()
            .labels()
            .find(|label| !known.contains(label))
        {
            return Err(HybridError::UnknownEvent {
                supervisor: name,
                event: supervisor.alphabet().name(label),
            });
        }
    }
    let ladder = Maker::new(net, supervisors, &bounds).make();
    let mut found = understudy_ladder::check(&ladder.program);
    if has_errors(&found) {
        found.retain(|found| found.severity == understudy_diagnostic::Severity::Error);
        return Err(HybridError::Invalid(found));
    }
    Ok(ladder)
}

struct Maker<'a> {
    net: &'a Net,
    supervisors: &'a [Automaton],
    names: Names,
    program: Program,
    tokens: Vec<Tokens>,
    fires: Vec<Name>,
    states: Vec<Vec<Name>>,
    /// The bit of each edge that a condition asks for.
    edges: BTreeMap<(String, bool), Name>,
    /// For a place through which a token must not pass in one scan, the bit that is 1 in the scan in which one has come.
    fresh: BTreeMap<usize, Name>,
    /// For a transition with a delay: its timer, and the bit that is 1 from its firing until the timer has seen it.
    delays: BTreeMap<usize, (Name, Name)>,
    /// Bits of events that a supervisor in a self-loop leaves on.
    left: Vec<Name>,
}

impl<'a> Maker<'a> {
    fn new(net: &'a Net, supervisors: &'a [Automaton], bounds: &[u32]) -> Self {
        let mut names = Names::default();
        let mut program = Program {
            name: Names::default().fresh(&[net.name()]),
            comments: vec![
                format!(
                    "Generated from the net {} ({} places, {} transitions) by token passing logic.",
                    net.name(),
                    net.places().len(),
                    net.transitions().len()
                ),
                "Below each transition stand the supervisors' rungs for its event.".into(),
            ],
            ..Program::default()
        };
        let mut declare = |signals: &mut Vec<Signal>, name: &Name| {
            if signals.iter().all(|signal| signal.name != *name) {
                names.take(name);
                signals.push(Signal::new(name.clone()));
            }
        };
        for transition in net.transitions() {
            transition
                .condition
                .visit(&mut |name, _| declare(&mut program.inputs, name));
        }
        for place in net.places() {
            for Action::Level(name) | Action::Impulse(name) in &place.actions {
                declare(&mut program.outputs, name);
            }
        }
        let mut maker = Self {
            net,
            supervisors,
            names,
            program,
            tokens: Vec::new(),
            fires: Vec::new(),
            states: Vec::new(),
            edges: BTreeMap::new(),
            fresh: BTreeMap::new(),
            delays: BTreeMap::new(),
            left: Vec::new(),
        };
        maker.declare_tokens(bounds);
        maker.declare_supervisors();
        maker
    }

    fn memory(&mut self, parts: &[&str], initial: bool) -> Name {
        let name = self.names.fresh(parts);
        self.program.memory.push(Signal {
            initial: Some(initial),
            ..Signal::new(name.clone())
        });
        name
    }

    fn declare_tokens(&mut self, bounds: &[u32]) {
        let net = self.net;
        for (index, place) in net.places().iter().enumerate() {
            let bound = bounds[index].max(1);
            let tokens = if Tokens::can_count(index, place, bound, net.transitions()) {
                Tokens::Counter {
                    counter: self.names.fresh(&[&place.name]),
                    bound: u16::try_from(bound).unwrap_or(u16::MAX),
                    comes: self.memory(&[&place.name, "comes"], false),
                    goes: self.memory(&[&place.name, "goes"], false),
                    busy: self.memory(&[&place.name, "busy"], false),
                    first: (place.initial > 0).then(|| self.memory(&[&place.name, "first"], true)),
                }
            } else if bound == 1 {
                Tokens::Flags(vec![self.memory(&[&place.name], place.initial > 0)])
            } else {
                let flags = (1..=bound).map(|count| {
                    self.memory(&[&place.name, &count.to_string()], place.initial >= count)
                });
                Tokens::Flags(flags.collect())
            };
            self.tokens.push(tokens);
        }
        for (number, transition) in net.transitions().iter().enumerate() {
            let fires = self.memory(&[&transition.name], false);
            self.fires.push(fires);
            transition.condition.visit(&mut |name, when| {
                let rises = match when {
                    When::Rising => true,
                    When::Falling => false,
                    When::Pulse | When::High | When::Low => return,
                };
                let key = (name.to_string(), rises);
                if !self.edges.contains_key(&key) {
                    let bit = self.memory(&[name, if rises { "rises" } else { "falls" }], false);
                    self.edges.insert(key, bit);
                }
            });
            if transition.delay.is_some() {
                let timer = self.names.fresh(&[&transition.name, "delay"]);
                let done = self.memory(&[&transition.name, "fired"], false);
                self.delays.insert(number, (timer, done));
            }
        }
        for index in 0..net.places().len() {
            let is_counter = matches!(self.tokens[index], Tokens::Counter { .. });
            let holds = net
                .transitions()
                .iter()
                .any(|taker| self.rests(index, taker));
            if holds && !is_counter {
                let bit = self.memory(&[&net.places()[index].name, "fresh"], false);
                self.fresh.insert(index, bit);
            }
        }
    }

    /// Whether a token that has come to the place in this scan has to wait for the next before `taker` takes it.
    fn rests(&self, place: usize, taker: &NetTransition) -> bool {
        let edges_of = |transition: &NetTransition| {
            let mut edges = BTreeSet::new();
            transition.condition.visit(&mut |name, when| {
                if matches!(when, When::Rising | When::Falling) {
                    edges.insert((name.to_string(), when == When::Rising));
                }
            });
            edges
        };
        let mut givers = self
            .net
            .transitions()
            .iter()
            .filter(|giver| giver.given(place) > 0);
        let edges = edges_of(taker);
        taker.taken(place) > 0
            && givers.any(|giver| {
                !self.net.places()[place].actions.is_empty()
                    || taker.delay.is_some()
                    || !edges.is_disjoint(&edges_of(giver))
                    || std::ptr::eq(giver, taker)
            })
    }

    fn declare_supervisors(&mut self) {
        for supervisor in self.supervisors {
            let mut bits = Vec::new();
            for state in supervisor.states() {
                let wanted = match supervisor.state_names() {
                    Some(names) => names[state.index()].clone(),
                    None => format!("q{state}"),
                };
                let is_initial = Some(state) == supervisor.initial();
                bits.push(self.memory(&[supervisor.name(), &wanted], is_initial));
            }
            self.states.push(bits);
        }
    }

    fn push(&mut self, title: impl Into<String>, network: Vec<Element>, coils: Vec<Coil>) {
        self.program.rungs.push(rung(title, network, coils));
    }

    fn make(mut self) -> HybridLadder {
        self.timers();
        self.begin();
        self.detect_edges();
        for number in 0..self.net.transitions().len() {
            self.transition(number);
            self.follow(number);
        }
        if !self.left.is_empty() {
            let coils = self.left.iter().map(reset).collect();
            self.push(
                "events that moved no supervisor are gone",
                Vec::new(),
                coils,
            );
        }
        for (tokens, place) in self.tokens.iter().zip(self.net.places()) {
            self.program.rungs.extend(tokens.count(&place.name));
        }
        let firsts = self.tokens.iter().filter_map(|tokens| match tokens {
            Tokens::Counter { first, .. } => first.clone(),
            Tokens::Flags(_) => None,
        });
        let firsts: Vec<Coil> = firsts.map(|first| reset(&first)).collect();
        if !firsts.is_empty() {
            self.push("the counters are loaded", Vec::new(), firsts);
        }
        self.levels();
        HybridLadder {
            places: self
                .tokens
                .iter()
                .map(|tokens| match tokens {
                    Tokens::Flags(flags) => flags.clone(),
                    Tokens::Counter { .. } => Vec::new(),
                })
                .collect(),
            program: self.program,
            states: self.states,
            fires: self.fires,
        }
    }

    fn timers(&mut self) {
        for (number, (timer, done)) in self.delays.clone() {
            let transition = &self.net.transitions()[number];
            let Some(delay) = transition.delay else {
                continue;
            };
            let mut network = self.enabled(transition);
            for arc in &transition.takes {
                network.extend(self.fresh.get(&arc.place).map(closed));
            }
            network.extend(self.condition(&transition.condition));
            network.push(closed(&done));
            network.push(Element::Block(Block {
                name: timer,
                kind: BlockKind::Ton(delay),
                pins: Vec::new(),
            }));
            self.push(format!("delay of {}", transition.name), network, Vec::new());
        }
    }

    fn begin(&mut self) {
        let mut coils: Vec<Coil> = self.fresh.values().map(reset).collect();
        coils.extend(self.delays.values().map(|(_, done)| reset(done)));
        let mut impulses = BTreeSet::new();
        for place in self.net.places() {
            for action in &place.actions {
                if let Action::Impulse(signal) = action
                    && impulses.insert(signal.to_string())
                {
                    coils.push(reset(signal));
                }
            }
        }
        for (tokens, place) in self.tokens.clone().iter().zip(self.net.places()) {
            if let Tokens::Counter {
                comes, goes, busy, ..
            } = tokens
            {
                let moved = any([comes, goes]).into_iter().collect();
                self.push(
                    format!("{} has counted", place.name),
                    moved,
                    vec![write(busy)],
                );
                coils.extend([reset(comes), reset(goes)]);
            }
        }
        if !coils.is_empty() {
            self.push("a scan begins", Vec::new(), coils);
        }
    }

    fn detect_edges(&mut self) {
        for ((signal, rises), bit) in self.edges.clone() {
            let signal = Name::from(signal);
            if rises {
                self.push(
                    format!("{signal} rises"),
                    vec![rising(&signal)],
                    vec![write(&bit)],
                );
            } else {
                let last = self.memory(&[&signal, "last"], false);
                let network = vec![open(&last), closed(&signal)];
                self.push(format!("{signal} falls"), network, vec![write(&bit)]);
                let title = format!("{signal} is remembered");
                self.push(title, vec![open(&signal)], vec![write(&last)]);
            }
        }
    }

    /// Enabling rules 1 to 3, capacities, and what counters wait for.
    fn enabled(&self, transition: &NetTransition) -> Vec<Element> {
        let mut network = Vec::new();
        for (index, place) in self.net.places().iter().enumerate() {
            let tokens = &self.tokens[index];
            let (taken, given) = (transition.taken(index), transition.given(index));
            network.extend(tokens.at_least(taken));
            let mut reads = transition.enablers.iter().chain(&transition.inhibitors);
            if taken + given > 0 || reads.any(|arc| arc.place == index) {
                network.extend(tokens.ready());
            }
            if let Some(capacity) = place.capacity.filter(|_| given > taken) {
                network.extend(match (capacity + 1).checked_sub(given - taken) {
                    None | Some(0) => tokens.never(),
                    Some(count) => tokens.fewer(count),
                });
            }
        }
        for arc in &transition.enablers {
            network.extend(self.tokens[arc.place].at_least(arc.weight));
        }
        for arc in &transition.inhibitors {
            network.extend(self.tokens[arc.place].fewer(arc.weight));
        }
        network
    }

    fn condition(&self, condition: &Condition) -> Vec<Element> {
        match condition {
            Condition::Always => Vec::new(),
            Condition::Signal(signal, When::High | When::Pulse) => vec![open(signal)],
            Condition::Signal(signal, When::Low) => vec![closed(signal)],
            Condition::Signal(signal, when) => {
                let key = (signal.to_string(), *when == When::Rising);
                self.edges.get(&key).map(open).into_iter().collect()
            }
            Condition::All(parts) => parts.iter().flat_map(|part| self.condition(part)).collect(),
            Condition::Any(parts) => {
                let branches: Vec<_> = parts.iter().map(|part| self.condition(part)).collect();
                match branches.len() {
                    // One that always holds makes all of them hold.
                    _ if branches.iter().any(Vec::is_empty) => Vec::new(),
                    0 | 1 => branches.into_iter().flatten().collect(),
                    _ => vec![Element::Branches(branches)],
                }
            }
        }
    }

    fn transition(&mut self, number: usize) {
        let transition = &self.net.transitions()[number];
        let mut network = self.enabled(transition);
        for (index, bit) in &self.fresh {
            if !self.rests(*index, transition) {
                continue;
            }
            // Another token of the place may have been there before.
            let older = match &self.tokens[*index] {
                Tokens::Flags(flags) => flags.get(transition.taken(*index) as usize),
                Tokens::Counter { .. } => None,
            };
            network.push(match older {
                Some(older) => Element::Branches(vec![vec![closed(bit)], vec![open(older)]]),
                None => closed(bit),
            });
        }
        match self.delays.get(&number) {
            Some((timer, _)) => network.push(open(&Name::from(format!("{timer}.Q")))),
            None => network.extend(self.condition(&transition.condition)),
        }
        if let Some(label) = transition.label.filter(|label| label.is_controllable()) {
            for (supervisor, bits) in self.supervisors.iter().zip(&self.states) {
                let Some(event) = supervisor.alphabet().place(label) else {
                    continue;
                };
                // The control data as inhibitor arcs.
                let disabling = supervisor
                    .states()
                    .filter(|&state| supervisor.successor(state, event).is_none());
                network.extend(disabling.map(|state| closed(&bits[state.index()])));
            }
        }
        let fires = self.fires[number].clone();
        let mut coils = vec![write(&fires)];
        let mut shifts = Vec::new();
        for (index, place) in self.net.places().iter().enumerate() {
            let (taken, given) = (transition.taken(index), transition.given(index));
            let change = i64::from(given) - i64::from(taken);
            coils.extend(self.tokens[index].coils(change));
            shifts.extend(self.tokens[index].shift(&place.name, change, &fires));
            if given > 0 {
                coils.extend(self.fresh.get(&index).map(set));
                coils.extend(place.actions.iter().filter_map(|action| match action {
                    Action::Impulse(signal) => Some(set(signal)),
                    Action::Level(_) => None,
                }));
            }
        }
        coils.extend(self.delays.get(&number).map(|(_, done)| set(done)));
        // Tokens go before they come, so that a place that does both keeps them.
        coils[1..].sort_by_key(|coil| coil.kind != understudy_ladder::CoilKind::Reset);
        self.push(transition.name.clone(), network, coils);
        self.program.rungs.extend(shifts);
    }

    /// The supervisors move on the event of a transition that has fired.
    fn follow(&mut self, number: usize) {
        let transition = &self.net.transitions()[number];
        let Some(label) = transition.label else {
            return;
        };
        for (index, supervisor) in self.supervisors.iter().enumerate() {
            let mut bit = self.fires[number].clone();
            let consumes = avalanche_events(supervisor).contains(&label);
            if consumes {
                let own = self.memory(&[&transition.name, supervisor.name()], false);
                let title = format!("{} for {}", transition.name, supervisor.name());
                self.push(title, vec![open(&bit)], vec![set(&own)]);
                self.left.push(own.clone());
                bit = own;
            }
            for step in supervisor.transitions() {
                if step.label != label || step.source == step.target {
                    continue;
                }
                let source = self.states[index][step.source.index()].clone();
                let target = self.states[index][step.target.index()].clone();
                let mut coils = vec![reset(&source), set(&target)];
                if consumes {
                    coils.push(reset(&bit));
                }
                let title = format!(
                    "{}: {} -- {} --> {}",
                    supervisor.name(),
                    supervisor.state_name(step.source),
                    transition.name,
                    supervisor.state_name(step.target)
                );
                self.push(title, vec![open(&bit), open(&source)], coils);
            }
        }
    }

    fn levels(&mut self) {
        let mut places: BTreeMap<String, Vec<Vec<Element>>> = BTreeMap::new();
        for (place, tokens) in self.net.places().iter().zip(&self.tokens) {
            for action in &place.actions {
                if let Action::Level(signal) = action {
                    places
                        .entry(signal.to_string())
                        .or_default()
                        .push(tokens.at_least(1));
                }
            }
        }
        for (signal, holding) in places {
            let network = if holding.len() > 1 {
                vec![Element::Branches(holding)]
            } else {
                holding.into_iter().flatten().collect()
            };
            let signal = Name::from(signal);
            self.push(format!("action {signal}"), network, vec![write(&signal)]);
        }
    }
}
