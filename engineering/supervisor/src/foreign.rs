//! Automata of other tools, which know states and events by names: Supremica's modules (.wmod) and libFAUDES' generators (.gen).
//!
//! Names keep their letters except those that no word of a model file has (white space, quotes), which become `_`; labels
//! are those of `labels`. What a file says and an automaton cannot is an error, never left out.

mod draft;
mod generator;
mod module;
mod tokens;
mod write;

use understudy_text::Diagnostic;

pub use generator::read_generator;
pub use module::read_module;
pub use write::{write_generator, write_module};

use crate::alphabet::Label;
use crate::model::Model;

/// What was read from a file of another tool.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadForeign {
    /// Its automata; none where there are errors. The labels of the events are not the file's own:
    /// [`agree_on_events`](crate::agree_on_events) before they meet those of other files.
    pub model: Option<Model>,
    /// The events that cannot be observed.
    pub unobservable: Vec<Label>,
    /// What is wrong with it, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
}

/// The proposition of Supremica for marked states.
const ACCEPTING: &str = ":accepting";
