//! Why there is no supervisor, with a shortest sequence of events that shows it.

use understudy_logic::bdd::{BddError, Diagram};

use super::TooComplex;
use super::saturation::predecessors;
use super::supervisor::SymbolicSupervisor;
use crate::alphabet::Label;
use crate::automaton::State;
use crate::operations::{Explanation, Violation};

/// Events, and the tuple to which they lead.
struct Way {
    word: Vec<Label>,
    states: Vec<State>,
}

impl SymbolicSupervisor<'_> {
    /// Why it is empty, where it is; `plants` are the first so many components. The sequence is a shortest one to where a
    /// specification is violated or no marked state can be reached, found backwards, set by set.
    ///
    /// # Errors
    /// The diagrams pass the bounds.
    pub fn explanation(&self, plants: usize) -> Result<Option<Explanation>, TooComplex> {
        let empty = self.parts.iter().find(|part| part.is_empty());
        if let Some(part) = empty {
            let name = part.name().to_owned();
            return Ok(Some(Explanation::EmptyPart { name }));
        }
        if !self.is_empty() {
            return Ok(None);
        }
        let way = self.way_to_a_cause();
        let way = way.map_err(|error| TooComplex::of(&error, self.bounds))?;
        Ok(way.map(|Way { word, states }| {
            let is_violated = |&event: &Label| {
                Some((event, self.violated_specification(&states, event, plants)?))
            };
            let mut uncontrollable =
                self.alphabet.labels().filter(|label| !label.is_controllable());
            match uncontrollable.find_map(|event| is_violated(&event)) {
                Some((event, specification)) => {
                    Explanation::Violated(Violation { word, event, specification })
                }
                None => Explanation::Blocked { word, states },
            }
        }))
    }

    /// Uncontrollable events from the initial tuple to a tuple that is not good by itself.
    fn way_to_a_cause(&self) -> Result<Option<Way>, BddError> {
        let mut states = vec![State::INITIAL; self.parts.len()];
        let within = self.space.tuples()?;
        let mut seen = self.space.and(&self.causes, &within)?;
        let mut layers = vec![seen.clone()];
        // Each layer has a tuple that none before it has, so this ends.
        while let Some(layer) = layers.last()
            && !self.holds(layer, &states)
        {
            let mut before = self.space.nothing();
            for (event, label) in self.alphabet.labels().enumerate() {
                if !label.is_controllable() {
                    let sources = predecessors(&self.space, &self.events[event], layer)?;
                    before = self.space.or(&before, &sources)?;
                }
            }
            let before = self.space.and(&before, &within)?;
            let before = self.space.without(&before, &seen)?;
            if before.is_constant(false) {
                return Ok(None);
            }
            seen = self.space.or(&seen, &before)?;
            layers.push(before);
        }
        layers.pop();
        let mut word = Vec::new();
        for layer in layers.iter().rev() {
            let step = self.alphabet.labels().find_map(|label| {
                let next = self.next(&states, label).filter(|next| self.holds(layer, next));
                Some((label, next.filter(|_| !label.is_controllable())?))
            });
            let Some((label, next)) = step else {
                return Ok(None);
            };
            word.push(label);
            states = next;
        }
        Ok(Some(Way { word, states }))
    }

    fn holds(&self, set: &Diagram, states: &[State]) -> bool {
        self.space.contains(set, |level| states[self.order[level]].number())
    }

    /// The specification that forbids `event` where all plants can do it.
    fn violated_specification(
        &self,
        states: &[State],
        event: Label,
        plants: usize,
    ) -> Option<usize> {
        let allows = |place: usize| {
            let part = self.parts[place];
            !part.alphabet().contains(event) || part.step(states[place], event).is_some()
        };
        if !(0..plants).all(allows) {
            return None;
        }
        (plants..self.parts.len()).position(|specification| !allows(specification))
    }
}
