//! A supervisor as an auto-net, and a net with its supervisors as one: steps 7 and 8 of Uzam and Gelen, section 3.

use std::fmt::Write as _;

use super::net::{Arc, Net, NetError, NetTransition, Place};
use super::to_ladder::{HybridError, check_events};
use crate::alphabet::Alphabet;
use crate::{Automaton, State};

/// `net` with the auto-net of each supervisor beside it: a place for each state, of which the initial one has the token, and a
/// transition for each of the supervisor's. An inhibitor arc leads from each state that forbids an event to the transitions of `net` with
/// it. Transitions of one event occur together, and one place of an auto-net has its token. Without a net, the auto-nets alone.
///
/// # Errors
/// A supervisor has no state, or knows an event that no transition of the net is.
pub fn hybrid_net(
    net: Option<&Net>,
    supervisors: &[Automaton],
    events: &Alphabet,
) -> Result<Net, HybridNetError> {
    let mut places = Vec::new();
    let mut transitions = Vec::new();
    let mut name = "auto-net".to_owned();
    if let Some(net) = net {
        check_events(net, supervisors)?;
        places.extend_from_slice(net.places());
        transitions.extend_from_slice(net.transitions());
        net.name().clone_into(&mut name);
    }
    let of_plant = transitions.len();
    for supervisor in supervisors {
        let first = places.len();
        places.extend(supervisor.states().map(|state| Place {
            name: state_place(supervisor, state),
            initial: u32::from(Some(state) == supervisor.initial()),
            ..Place::default()
        }));
        let place = |state: State| Arc { place: first + state.index(), weight: 1 };
        for plant in &mut transitions[..of_plant] {
            let Some(event) = plant.label.filter(|label| label.is_controllable()) else { continue };
            let Some(event) = supervisor.alphabet().place(event) else { continue };
            let forbidding =
                supervisor.states().filter(|&state| supervisor.successor(state, event).is_none());
            plant.inhibitors.extend(forbidding.map(place));
        }
        for step in supervisor.transitions() {
            transitions.push(NetTransition {
                name: format!("t{} {}", transitions.len() + 1, events.name(step.label)),
                label: Some(step.label),
                takes: vec![place(step.source)],
                gives: vec![place(step.target)],
                ..NetTransition::default()
            });
        }
    }
    Ok(Net::new(name, places, transitions)?)
}

/// What a place of an auto-net is called.
fn state_place(supervisor: &Automaton, state: State) -> String {
    format!("{}.{}", supervisor.name(), supervisor.state_name(state))
}

/// All arcs of a net, a line for each transition: Pre, Post, In and En with their weights, where these are not 1.
pub fn list_arcs(net: &Net) -> String {
    let mut text = String::new();
    for transition in net.transitions() {
        let arcs = [
            ("Pre", &transition.takes),
            ("Post", &transition.gives),
            ("In", &transition.inhibitors),
            ("En", &transition.enablers),
        ];
        let words = arcs.into_iter().flat_map(|(kind, arcs)| {
            arcs.iter().map(move |arc| {
                let place = &net.places()[arc.place].name;
                let weight =
                    if arc.weight == 1 { String::new() } else { format!(" = {}", arc.weight) };
                format!("{kind}({place}){weight}")
            })
        });
        let _ = writeln!(text, "{}: {}", transition.name, words.collect::<Vec<_>>().join(" "));
    }
    text
}

/// Control data as inhibitor arcs, a line for each state that forbids something: Table 2.
pub fn list_control(net: &Net, supervisors: &[Automaton]) -> String {
    let mut text = String::new();
    for supervisor in supervisors {
        for state in supervisor.states() {
            let place = state_place(supervisor, state);
            let forbidden = net.transitions().iter().filter(|transition| {
                transition.inhibitors.iter().any(|arc| net.places()[arc.place].name == place)
            });
            let names: Vec<&str> = forbidden.map(|transition| transition.name.as_str()).collect();
            if !names.is_empty() {
                let arcs = names.iter().map(|name| format!("In({place}, {name})"));
                let arcs = arcs.collect::<Vec<_>>().join(" ");
                let _ = writeln!(text, "{place}: {} forbidden by {arcs}", names.join(" "));
            }
        }
    }
    text
}

/// Why a net has no hybrid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HybridNetError {
    /// A supervisor does not fit the net.
    #[error(transparent)]
    Supervisor(#[from] HybridError),
    /// Names meet.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Net(Vec<NetError>),
}

impl From<Vec<NetError>> for HybridNetError {
    fn from(errors: Vec<NetError>) -> Self {
        Self::Net(errors)
    }
}

impl HybridNetError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Supervisor(error) => error.code(),
            Self::Net(errors) => errors.first().map_or("U0891", NetError::code),
        }
    }
}
