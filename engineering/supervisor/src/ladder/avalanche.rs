//! Which events can run through several states in one scan: Uzam and Gelen, Figure 9.

use crate::{Automaton, Label, State};

/// An event on two transitions one behind the other: where its rungs stand in an unlucky order, one occurrence of it goes
/// through both in one scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repetition {
    /// The event.
    pub label: Label,
    /// The first transition leaves here,
    pub source: State,
    /// arrives here, where the second one leaves,
    pub middle: State,
    /// and that one arrives here.
    pub target: State,
}

/// The first repetition of each event that has one, by ascending label. Self-loops change no state and do not count.
pub fn repetitions(automaton: &Automaton) -> Vec<Repetition> {
    let mut found: Vec<Option<Repetition>> = vec![None; automaton.alphabet().len()];
    for source in automaton.states() {
        for edge in automaton.edges(source) {
            let place = &mut found[edge.event as usize];
            if place.is_some() || edge.target == source {
                continue;
            }
            let second = automaton.successor(edge.target, edge.event);
            *place = second.filter(|&target| target != edge.target).map(|target| Repetition {
                label: automaton.label(*edge),
                source,
                middle: edge.target,
                target,
            });
        }
    }
    found.into_iter().flatten().collect()
}

/// The events that cause the avalanche effect, ascending: the output of Av_effect_detector.
///
/// This is all that can happen while rungs are grouped by event, as [`convert`](super::convert) groups them. Where they stand
/// by state, an event can also come back to a rung by way of other events and commands of the same scan.
pub fn avalanche_events(automaton: &Automaton) -> Vec<Label> {
    repetitions(automaton).into_iter().map(|repetition| repetition.label).collect()
}
