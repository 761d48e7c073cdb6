//! A plant and what must not happen, as a file: our own readable format.
//!
//! ```toml
//! name = "small_factory"
//!
//! [events]
//! start_1  = { controllable = true }
//! finish_1 = { controllable = false, signal = "machine_1_done", when = "rising" }
//! break_1  = { controllable = false, label = 12 }
//!
//! [[plant]]
//! name = "machine_1"
//! transitions = [
//!     "idle     start_1   working",
//!     "working  finish_1  idle",
//!     "working  break_1   down",
//! ]
//! marked = ["idle"]
//!
//! [[specification]]
//! file = "BUFSPEC.ADS"
//! ```
//!
//! A transition is a state, an event, and the state to which it leads. The initial state is that of the first transition
//! where `initial` does not say otherwise; `marked = "all"` marks every state. An event without a `label` gets the lowest free one
//! that fits. `signal` and `when` say by which signal of the PLC an event is seen or made.

mod read;
mod write;

pub use read::{ReadModel, read_model};
pub use write::write_model;

use crate::alphabet::{Alphabet, Label};
use crate::automaton::Automaton;

/// Plants, specifications, and the signals of their events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Its events, those of its files included.
    pub alphabet: Alphabet,
    /// By which signals events are seen and made.
    pub signals: Vec<Signal>,
    /// What is.
    pub plants: Vec<Automaton>,
    /// What is wanted.
    pub specifications: Vec<Automaton>,
    /// What was synthesised, in a file that holds results.
    pub supervisors: Vec<Automaton>,
}

/// The signal of an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signal {
    /// The event.
    pub label: Label,
    /// A signal of the PLC.
    pub signal: String,
    /// What of the signal is the event: `rising`, `falling`, `high`, `low` or `pulse`.
    pub when: Option<String>,
}

impl Model {
    /// All plants by reference.
    pub fn plants(&self) -> Vec<&Automaton> {
        self.plants.iter().collect()
    }

    /// All specifications by reference.
    pub fn specifications(&self) -> Vec<&Automaton> {
        self.specifications.iter().collect()
    }

    /// A sequence of events by their names.
    pub fn word(&self, word: &[Label]) -> String {
        let names: Vec<String> = word
            .iter()
            .map(|&label| self.alphabet.name(label))
            .collect();
        names.join(" ")
    }
}
