//! In which order the groups of rungs of uncontrollable events stand, so that of two events in one scan none is lost.
//!
//! Both can have happened in either order; the scan cannot see in which. Event e goes *before* f where e makes f possible,
//! or where f then e is impossible while e then f is not. Where that is a circle, an event stands a second time, below the
//! one that it waits for.

use std::collections::{BTreeMap, BTreeSet};

use super::partition::Modules;
use crate::{Automaton, Label, State};

/// The rungs of one event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Group {
    pub(crate) label: Label,
    /// Second occurrence, for events enabled by others in the same scan.
    pub(crate) again: bool,
}

/// The uncontrollable events that move something.
pub(crate) fn moving(modules: &Modules) -> BTreeSet<Label> {
    let transitions = modules.all().flat_map(Automaton::transitions);
    transitions
        .filter(|transition| {
            !transition.label.is_controllable() && transition.source != transition.target
        })
        .map(|transition| transition.label)
        .collect()
}

/// The groups of all uncontrollable events that move something, where at most one of them is processed in a scan.
pub(crate) fn single_groups(modules: &Modules) -> Vec<Group> {
    moving(modules).into_iter().map(|label| Group { label, again: false }).collect()
}

/// The groups of all uncontrollable events that move something, from the first rung to the last.
pub(crate) fn groups(modules: &Modules) -> Vec<Group> {
    let moving = moving(modules);
    let (enables, saves) = before(modules, &moving);
    let mut waiting: BTreeMap<Label, BTreeSet<Label>> =
        moving.iter().map(|&label| (label, BTreeSet::new())).collect();
    for (first, second) in enables.union(&saves) {
        if let Some(waits) = waiting.get_mut(second) {
            waits.insert(*first);
        }
    }
    let mut order = Vec::new();
    while !waiting.is_empty() {
        // What is forbidden for ever cannot be made good below, what is only not possible yet can. So it is first the one that
        // would be forbidden by the fewest, then the one that waits for the fewest, then the one with the smallest label.
        let next = waiting
            .iter()
            .min_by_key(|(label, waits)| {
                let saving = waits.iter().filter(|&&first| saves.contains(&(first, **label)));
                (saving.count(), waits.len(), **label)
            })
            .map(|(label, _)| *label);
        let Some(next) = next else { break };
        waiting.remove(&next);
        for waits in waiting.values_mut() {
            waits.remove(&next);
        }
        order.push(next);
    }
    let place: BTreeMap<Label, usize> = order.iter().copied().zip(0..).collect();
    // Last position after which an event must occur again.
    let mut again: BTreeMap<usize, BTreeSet<Label>> = BTreeMap::new();
    for &label in &order {
        let late = enables
            .iter()
            .filter(|(first, second)| *second == label && place[first] > place[second]);
        if let Some(last) = late.map(|(first, _)| place[first]).max() {
            again.entry(last).or_default().insert(label);
        }
    }
    let mut groups = Vec::new();
    for (index, label) in order.into_iter().enumerate() {
        groups.push(Group { label, again: false });
        let later = again.remove(&index).into_iter().flatten();
        groups.extend(later.map(|label| Group { label, again: true }));
    }
    groups
}

type Pairs = BTreeSet<(Label, Label)>;

/// The pairs of which the first goes before the second: because it makes the second possible, and because the second would
/// forbid the first.
fn before(modules: &Modules, moving: &BTreeSet<Label>) -> (Pairs, Pairs) {
    let automata: Vec<_> = modules.all().collect();
    let mut enables = Pairs::new();
    let mut saves = Pairs::new();
    for (index, automaton) in automata.iter().enumerate() {
        let is_witness = |label: Label| modules.witnesses(label).contains(&index);
        let witnessed: BTreeSet<Label> =
            moving.iter().copied().filter(|&label| is_witness(label)).collect();
        let uncontrollable = |state: State| {
            automaton
                .edges(state)
                .iter()
                .map(|edge| (automaton.label(*edge), edge.target))
                .filter(|(label, _)| witnessed.contains(label))
        };
        for source in automaton.states() {
            for (first, middle) in uncontrollable(source).filter(|(_, target)| *target != source) {
                for (second, target) in uncontrollable(middle) {
                    if second == first {
                        continue;
                    }
                    match automaton.step(source, second) {
                        // What a plant only allows may still move a supervisor.
                        None if target != middle || !modules.plants.is_empty() => {
                            enables.insert((first, second));
                        }
                        Some(other) if automaton.step(other, first).is_none() => {
                            saves.insert((first, second));
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    (enables, saves)
}
