//! The automaton and the mega-controller as automata to draw.

use std::collections::{BTreeSet, HashMap};

use understudy_supervisor::{
    Automaton, AutomatonError, Event as Named, Label as Number, State, Transition,
};

use crate::analysis::Outcome;
use crate::controller::Controller;
use crate::mega::Label;

impl Outcome {
    /// S as an automaton to draw; transitions of uncontrollable events are those without a row in Λ.
    ///
    /// # Errors
    /// It has more transitions than numbers.
    pub fn drawn_controller(&self) -> Result<Automaton, AutomatonError> {
        let controller = &self.controller;
        let edges = (0..controller.states().len()).flat_map(|state| {
            controller.moves(state).iter().map(move |step| {
                let controllable = !step.events.is_empty()
                    && step
                        .events
                        .iter()
                        .all(|&event| !self.relation.rows(state, event).is_empty());
                let name = self.label(&Label::Seen(step.events.clone()));
                (state, step.target, name, controllable)
            })
        });
        let names = (0..controller.states().len())
            .map(|place| format!("{} {}", Controller::number(place), controller.state_name(place)));
        drawn("S", names.collect(), controller.marked(), edges.collect())
    }

    /// Θ as an automaton to draw.
    ///
    /// # Errors
    /// It has more transitions than numbers.
    pub fn drawn_mega_controller(&self) -> Result<Automaton, AutomatonError> {
        let edges = self.mega.edges.iter().enumerate().flat_map(|(source, edges)| {
            edges.iter().map(move |(label, target)| {
                (
                    source,
                    *target,
                    self.label(label),
                    matches!(label, Label::Seen(events) if !events.is_empty()),
                )
            })
        });
        let states = &self.mega.states;
        let names = states.iter().map(|state| match &state.command {
            None => self.describe(state),
            Some(command) => format!("{}: {}", self.describe(state), command.outputs),
        });
        let marked = self.mega.dangling.iter().map(|dangling| !dangling).collect();
        drawn("Theta", names.collect(), marked, edges.collect())
    }
}

/// Numbers the labels; a label that leads from one state to several gets a mark for each.
fn drawn(
    name: &str,
    names: Vec<String>,
    marked: Vec<bool>,
    edges: Vec<(usize, usize, String, bool)>,
) -> Result<Automaton, AutomatonError> {
    let mut labels: Vec<(String, bool)> = Vec::new();
    let mut places = HashMap::new();
    let mut taken = BTreeSet::new();
    let mut transitions = Vec::new();
    for (source, target, mut text, controllable) in edges {
        while !taken.insert((source, text.clone())) {
            text.push('\'');
        }
        let place = *places.entry((text.clone(), controllable)).or_insert_with(|| {
            labels.push((text, controllable));
            labels.len() - 1
        });
        let number = 2 * place as u32 + u32::from(controllable);
        transitions.push(Transition {
            source: State::new(source as u32),
            label: Number::new(number),
            target: State::new(target as u32),
        });
    }
    let events = labels.into_iter().enumerate().map(|(place, (name, controllable))| Named {
        label: Number::new(2 * place as u32 + u32::from(controllable)),
        name,
    });
    Automaton::new(name, events, marked, transitions)?.with_state_names(names)
}
