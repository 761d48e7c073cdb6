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
//! that fits. `signal` and `when` say by which signal of the PLC an event is seen or made, `[addresses]` where such a signal is.

mod component;
mod read;
mod write;

pub use read::{ReadModel, read_model};
pub use write::write_model;

use understudy_ladder::Name;

use crate::alphabet::{Alphabet, Label};
use crate::automaton::Automaton;
use crate::ladder::{Located, When};

/// Plants, specifications, and the signals of their events.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Its events, those of its files included.
    pub alphabet: Alphabet,
    /// By which signals events are seen and made.
    pub signals: Vec<Signal>,
    /// Where signals are in the PLC.
    pub addresses: Vec<Located>,
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
    pub signal: Name,
    /// What of the signal is the event, where that is said.
    pub when: Option<When>,
}

impl Signal {
    /// What of the signal is the event.
    pub fn when(&self) -> When {
        self.when.unwrap_or_default()
    }

    /// The same, not read from a text.
    #[must_use]
    pub fn without_place(self) -> Self {
        Self { signal: Name::from(self.signal.as_str()), ..self }
    }
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
        let names: Vec<String> = word.iter().map(|&label| self.alphabet.name(label)).collect();
        names.join(" ")
    }
}
