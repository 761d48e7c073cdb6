use std::fmt::Write as _;

use super::{MAXIMUM_LABEL, MAXIMUM_STATES, Vocal};
use crate::automaton::Automaton;

/// Why an automaton has no place in an .ADS file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AdsError {
    /// More states than the format has room for.
    #[error(
        "U0805: {states} states: an .ADS file has room for {MAXIMUM_STATES}; write a model file"
    )]
    TooManyStates {
        /// How many there are.
        states: usize,
    },
    /// A label beyond those of the format.
    #[error("U0806: event {name} has label {label}: an .ADS file has labels 0 to {MAXIMUM_LABEL}")]
    LabelTooHigh {
        /// The label.
        label: u32,
        /// The event's name.
        name: String,
    },
}

impl AdsError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::TooManyStates { .. } => "U0805",
            Self::LabelTooHigh { .. } => "U0806",
        }
    }
}

/// The .ADS text of `automaton`, as TCT writes it.
///
/// The format has no list of events: events without a transition are lost, see [`Automaton::blocked_events`].
///
/// # Errors
/// More states or higher labels than the format has.
pub fn write_ads(automaton: &Automaton, vocal: &[Vocal]) -> Result<String, AdsError> {
    let states = automaton.state_count();
    if states > MAXIMUM_STATES {
        return Err(AdsError::TooManyStates { states });
    }
    let events = automaton.alphabet().events();
    if let Some(event) = events.iter().find(|event| event.label.number() > MAXIMUM_LABEL) {
        return Err(AdsError::LabelTooHigh {
            label: event.label.number(),
            name: event.name.clone(),
        });
    }
    let mut text = format!("# CTCT ADS auto-generated\n\n{}\n\n", automaton.name());
    text.push_str("State size (State set will be (0,1....,size-1)):\n");
    text.push_str("# <-- Enter state size, in range 0 to 2000000, on line below.\n");
    let _ = writeln!(text, "{states}\n");
    text.push_str("Marker states:\n# <-- Enter marker states, one per line.\n");
    text.push_str("# To mark all states, enter *.\n# If no marker states, leave line blank.\n");
    text.push_str("# End marker list with blank line.\n");
    for state in automaton.marked() {
        let _ = writeln!(text, "{state}");
    }
    text.push_str("\nVocal states:\n# <-- Enter vocal output states, one per line.\n");
    text.push_str("# Format: State  Vocal_Output.  Vocal_Output in range 10 to 99.\n");
    text.push_str("# Example: 0 10\n# If no vocal states, leave line blank.\n");
    text.push_str("# End vocal list with blank line.\n");
    for Vocal { state, output } in vocal {
        let _ = writeln!(text, "{state} {output}");
    }
    text.push_str("\nTransitions:\n# <-- Enter transition triple, one per line.\n");
    text.push_str("# Format: Exit_(Source)_State  Transition_Label  Entrance_(Target)_State.\n");
    text.push_str("# Transition_Label in range 0 to 999.\n");
    text.push_str("# Example: 2 0 1 (for transition labeled 0 from state 2 to state 1).\n\n");
    for transition in automaton.transitions() {
        let _ = writeln!(text, "{} {} {}", transition.source, transition.label, transition.target);
    }
    Ok(text)
}
