//! The automata synchronised, and the ways through them.

use std::collections::{BTreeMap, HashMap, VecDeque};

use super::{Finding, FindingKind, FindingSeverity};
use crate::ladder::Modules;
use crate::proof::ProofError;
use crate::{Automaton, Label, State, Transition};

/// The closed loop past which nothing is looked for.
const MAXIMUM_CLOSED_LOOP: usize = 2_000_000;

/// The automata synchronised.
pub(super) struct ClosedLoop {
    pub(super) automaton: Automaton,
    /// Whence each state was first reached.
    parents: Vec<Option<(State, Label)>>,
    pub(super) controllability: Vec<Finding>,
}

impl ClosedLoop {
    pub(super) fn of(modules: &Modules) -> Result<Self, ProofError> {
        let automata: Vec<&Automaton> = modules.all().collect();
        let alphabet = modules.alphabet();
        let mut closed = Self {
            automaton: Automaton::empty("closed loop", alphabet.clone()),
            parents: Vec::new(),
            controllability: Vec::new(),
        };
        if automata.iter().any(|automaton| automaton.is_empty()) {
            return Ok(closed);
        }
        let initial: Box<[State]> = automata.iter().map(|_| State::INITIAL).collect();
        let mut numbers = HashMap::from([(initial.clone(), State::INITIAL)]);
        let mut states = vec![initial];
        let mut transitions = Vec::new();
        closed.parents.push(None);
        let mut forbidden: BTreeMap<Label, (usize, State)> = BTreeMap::new();
        let mut index = 0;
        while index < states.len() {
            let source = State::new(index as u32);
            for label in alphabet.labels() {
                let mut next = states[index].clone();
                let mut refusing = Vec::new();
                for (place, automaton) in automata.iter().enumerate() {
                    if !automaton.alphabet().contains(label) {
                        continue;
                    }
                    match automaton.step(next[place], label) {
                        Some(target) => next[place] = target,
                        None => refusing.push(place),
                    }
                }
                if let Some(&first) = refusing.first() {
                    let plants = modules.supervisors.len()..;
                    let known = modules.plants.iter().any(|plant| plant.alphabet().contains(label));
                    if !label.is_controllable()
                        && known
                        && !refusing.iter().any(|place| plants.contains(place))
                    {
                        forbidden.entry(label).or_insert((first, source));
                    }
                    continue;
                }
                let target = *numbers.entry(next.clone()).or_insert_with(|| {
                    states.push(next);
                    closed.parents.push(Some((source, label)));
                    State::new(states.len() as u32 - 1)
                });
                transitions.push(Transition { source, label, target });
            }
            if states.len() > MAXIMUM_CLOSED_LOOP {
                return Err(ProofError::TooLarge { limit: MAXIMUM_CLOSED_LOOP });
            }
            index += 1;
        }
        let marked = states.iter().map(|state| {
            let mut pairs = automata.iter().zip(state);
            pairs.all(|(automaton, &state)| automaton.is_marked(state))
        });
        let events = alphabet.events().iter().cloned();
        // The product of deterministic automata is one.
        if let Ok(automaton) = Automaton::new("closed loop", events, marked.collect(), transitions)
        {
            closed.automaton = automaton;
        }
        for (label, (supervisor, state)) in forbidden {
            let message = format!(
                "`{}` forbids {} where the plant can generate it, and no PLC can prevent that",
                automata[supervisor].name(),
                alphabet.name(label)
            );
            let finding = closed.finding(
                FindingKind::Controllability,
                FindingSeverity::Error,
                message,
                vec![state],
                vec![label],
            );
            closed.controllability.push(finding);
        }
        Ok(closed)
    }

    pub(super) fn finding(
        &self,
        kind: FindingKind,
        severity: FindingSeverity,
        message: String,
        states: Vec<State>,
        events: Vec<Label>,
    ) -> Finding {
        let mut run = Vec::new();
        let mut at = states.first().copied();
        while let Some((parent, label)) = at.and_then(|state| self.parents[state.index()]) {
            run.push(label);
            at = Some(parent);
        }
        run.reverse();
        Finding { kind, severity, message, states, events, run }
    }

    pub(super) fn name(&self, label: Label) -> String {
        self.automaton.alphabet().name(label)
    }

    pub(super) fn edges(
        &self,
        state: State,
        controllable: bool,
    ) -> impl Iterator<Item = (Label, State)> + '_ {
        let edges = self.automaton.edges(state).iter();
        edges
            .map(|edge| (self.automaton.label(*edge), edge.target))
            .filter(move |(label, _)| label.is_controllable() == controllable)
    }

    /// The states from which `goals` can be reached along the transitions that `is_allowed` admits.
    pub(super) fn reaching(
        &self,
        goals: impl Iterator<Item = State>,
        is_allowed: impl Fn(State, Label) -> bool,
    ) -> Vec<bool> {
        let mut sources: Vec<Vec<State>> = vec![Vec::new(); self.automaton.state_count()];
        for transition in self.automaton.transitions() {
            if is_allowed(transition.source, transition.label) {
                sources[transition.target.index()].push(transition.source);
            }
        }
        let mut reaching = vec![false; self.automaton.state_count()];
        let mut pending: VecDeque<State> = goals.collect();
        for state in &pending {
            reaching[state.index()] = true;
        }
        while let Some(state) = pending.pop_front() {
            for &source in &sources[state.index()] {
                if !std::mem::replace(&mut reaching[source.index()], true) {
                    pending.push_back(source);
                }
            }
        }
        reaching
    }

    pub(super) fn unreached(&self, reaching: &[bool]) -> Vec<State> {
        let states = self.automaton.states();
        states.filter(|state| !reaching[state.index()]).collect()
    }
}

/// Where a finding is: `in state 5,`, or of several states their number and the first.
pub(super) fn in_states(states: &[State]) -> String {
    match states {
        [one] => format!("in state {one},"),
        [first, ..] => format!("in {} states, {first} the first,", states.len()),
        [] => "in no state".to_owned(),
    }
}
