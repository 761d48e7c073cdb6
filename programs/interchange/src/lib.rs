//! Programs in and out of other tools: PLCopen XML, Structured Text, the digraph XML of the paper, LDmicro.

mod apart;
mod diagrams;
pub mod digraph;
mod format;
mod ldmicro;
mod listing;
mod lists;
mod outputs;
pub mod plcopen;
mod project;
mod rungs;
mod source;
mod text;
mod twincat;
mod typed_text;
mod written;

pub use apart::{Apart, Copies, IDLE_PROGRAM, NOT_EXECUTED, read_apart};
pub use diagrams::{DrawnBody, DrawnUnit, draw_typed, drawn_units, listing};
pub use format::{Format, Reading, read, read_ladder, unknown_form};
pub use listing::Listing;
pub use outputs::{NO_OUTPUT, OutputError, WithOutputs, read_with_outputs};
pub use project::{Joined, ProjectFile, can_be_joined, groups, is_part, read_project};
pub use source::{Rungs, Source, SourceFile, Wanted, no_program, read_source};
pub use typed_text::{Bodies, typed_text};
pub use written::{Compared, USUAL_PERIOD, WriteError, Written, write};
