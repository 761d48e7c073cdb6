//! The bits of a net's ladder.

use std::collections::{BTreeMap, BTreeSet};

use understudy_ladder::{Name, Program, Signal};

use super::Maker;
use crate::Automaton;
use crate::ladder::{Names, When};
use crate::petri::net::{Action, Net, NetTransition};
use crate::petri::tokens::Tokens;

impl<'a> Maker<'a> {
    pub(super) fn new(net: &'a Net, supervisors: &'a [Automaton], bounds: &[u32]) -> Self {
        let mut names = Names::default();
        let mut program = Program {
            name: Names::default().fresh(&[net.name()]),
            comments: vec![
                format!(
                    "Generated from the Petri net {} ({} places, {} transitions) by token passing logic.",
                    net.name(),
                    net.places().len(),
                    net.transitions().len()
                ),
                "The rungs of the supervisors for an event follow the transition of this event."
                    .into(),
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
            transition.condition.visit(&mut |name, _| declare(&mut program.inputs, name));
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

    pub(super) fn memory(&mut self, parts: &[&str], initial: bool) -> Name {
        let name = self.names.fresh(parts);
        self.program.memory.push(Signal { initial: Some(initial), ..Signal::new(name.clone()) });
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
            let holds = net.transitions().iter().any(|taker| self.rests(index, taker));
            if holds && !is_counter {
                let bit = self.memory(&[&net.places()[index].name, "fresh"], false);
                self.fresh.insert(index, bit);
            }
        }
    }

    /// Whether a token that reaches the place in this scan must wait for the next scan before `taker` removes it.
    pub(super) fn rests(&self, place: usize, taker: &NetTransition) -> bool {
        let edges_of = |transition: &NetTransition| {
            let mut edges = BTreeSet::new();
            transition.condition.visit(&mut |name, when| {
                if matches!(when, When::Rising | When::Falling) {
                    edges.insert((name.to_string(), when == When::Rising));
                }
            });
            edges
        };
        let mut givers = self.net.transitions().iter().filter(|giver| giver.given(place) > 0);
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
}
