use std::collections::{BTreeMap, BTreeSet};

use crate::alphabet::Label;
use crate::automaton::{Automaton, State};
use crate::explicit::{Bounds, Joint, Product, TooLarge};

/// What a supervisor disables where; the result of [`condat`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ControlData {
    /// For each state of the supervisor that disables anything, the controllable events that it disables there.
    pub table: BTreeMap<State, Vec<Label>>,
    /// Where it forbids what it cannot: it is not a supervisor of this plant.
    pub uncontrollable: Vec<UncontrollablyDisabled>,
}

/// An uncontrollable event that a plant may do and a supervisor forbids.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct UncontrollablyDisabled {
    /// The state of the supervisor.
    pub state: State,
    /// The event.
    pub event: Label,
}

impl ControlData {
    /// States where anything is disabled.
    pub fn states_with_disablement(&self) -> usize {
        self.table.len()
    }

    /// Pairs of a state and an event disabled there.
    pub fn pairs(&self) -> usize {
        self.table.values().map(Vec::len).sum()
    }
}

/// `condat`: which events `supervisor` disables in each of its states, that is those which some state of `plant` under it enables
/// and it does not. An event that the supervisor does not know is disabled everywhere, as in TCT.
///
/// # Errors
/// The product of the two passes the bounds.
pub fn condat(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<ControlData, TooLarge> {
    let product = Product::explore(&[plant, supervisor], &[], Joint::Meet, bounds)?;
    let mut disabled: BTreeMap<State, BTreeSet<Label>> = BTreeMap::new();
    let mut uncontrollable = BTreeSet::new();
    for number in 0..product.state_count() {
        let state = product.component_state(number, 1);
        for edge in plant.edges(product.component_state(number, 0)) {
            let event = plant.label(*edge);
            if supervisor.step(state, event).is_some() {
                continue;
            }
            if event.is_controllable() {
                disabled.entry(state).or_default().insert(event);
            } else {
                uncontrollable.insert(UncontrollablyDisabled { state, event });
            }
        }
    }
    let rows = disabled.into_iter();
    Ok(ControlData {
        table: rows.map(|(state, events)| (state, events.into_iter().collect())).collect(),
        uncontrollable: uncontrollable.into_iter().collect(),
    })
}
