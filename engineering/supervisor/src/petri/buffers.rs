//! Step 4: each place of a bounded net as a buffer, an automaton of as many states as it can hold tokens, and one.

use super::net::Net;
use crate::{Automaton, AutomatonError, State, Transition};

/// The buffers of the places, whose synchronous product is the net: a place bounded by b has the states 0 (its initial
/// marking) to b. Transitions that share an event must touch each place alike.
///
/// # Errors
/// Two transitions of one event that move a place differently.
pub fn buffers(net: &Net, bounds: &[u32]) -> Result<Vec<Automaton>, AutomatonError> {
    let events = net.events();
    let places = net.places().iter().enumerate();
    let buffers = places.map(|(index, place)| {
        let bound = bounds[index].max(place.initial);
        // State 0 is the initial one: the marking k is state 0 where it is M0, and else after the smaller ones.
        let state = |tokens: u32| match tokens.cmp(&place.initial) {
            std::cmp::Ordering::Equal => State::INITIAL,
            std::cmp::Ordering::Less => State::new(tokens + 1),
            std::cmp::Ordering::Greater => State::new(tokens),
        };
        let mut transitions = Vec::new();
        let mut known = Vec::new();
        for (transition, event) in net.transitions().iter().zip(&events) {
            let arcs = transition.takes.iter().chain(&transition.gives);
            let mut arcs = arcs.chain(&transition.inhibitors).chain(&transition.enablers);
            if !arcs.any(|arc| arc.place == index) {
                continue;
            }
            known.push(event.clone());
            let allows = |tokens: u32| {
                let has = |arc: &super::Arc| arc.place == index && tokens >= arc.weight;
                let lacks = |arc: &super::Arc| arc.place == index && tokens < arc.weight;
                !transition.inhibitors.iter().any(has) && !transition.enablers.iter().any(lacks)
            };
            for tokens in (0..=bound).filter(|&tokens| allows(tokens)) {
                let rest = tokens.checked_sub(transition.taken(index));
                let next = rest.map(|rest| rest + transition.given(index));
                if let Some(next) = next.filter(|&next| next <= bound) {
                    transitions.push(Transition {
                        source: state(tokens),
                        label: event.label,
                        target: state(next),
                    });
                }
            }
        }
        let marked = (0..=bound).map(|number| number == 0).collect();
        Automaton::new(place.name.clone(), known, marked, transitions)
    });
    buffers.collect()
}
