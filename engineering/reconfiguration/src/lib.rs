//! Ladders that go on when input channels fail, after J. Liu and H. Darabi, *Reconfiguration of Ladder Logic Diagrams with
//! Dynamic Input Sets*; numbers of sections and constraints are theirs.
//!
//! The understudy covers a failed controller; this covers a failed input channel. A ladder becomes an automaton
//! ([`Controller`], by [`explore`] against a model of its plant or from [`record`]s of its scans), what its outputs can prevent is a
//! [`Relation`], and from both comes what is possible while channels are failed: the [`MegaController`], whose states are sets
//! of states in which the plant may be, each with an output command that is safe for all of them. [`module_two`] writes it as
//! rungs below the ladder, and [`proof`] holds the whole to the relation without a line of what made it.

mod advice;
mod analysis;
pub mod command;
mod controller;
mod diagnosis;
mod drawing;
pub mod explore;
mod mega;
pub mod module_two;
pub mod project;
pub mod proof;
mod quotient;
pub mod record;
mod relation;
mod report;
mod settle;
mod signals;
mod timing;

pub use advice::{ChannelAdvice, Effect};
pub use analysis::{Failure, Outcome, analyse};
pub use controller::{Controller, Move, State};
pub use diagnosis::Patience;
pub use mega::{
    Analysis, Label, MegaController, MegaState, Question, Reached, Trimming, Unbuilt,
    failed_channels,
};
pub use relation::{Feedback, Relation, Row, feedback, joint_feedback};
pub use settle::{Command, NoCommand};
pub use signals::{Bits, Event, Signals};
pub use timing::Timing;
