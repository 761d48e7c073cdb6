//! Commands on discrete-event models: automata, Petri nets, supervisors and their ladders.

pub(crate) mod automata;
mod des;
mod petri;
pub(crate) mod reconfigure;
mod reduction;
mod supervisor_to_ladder;
mod synth;

use understudy_supervisor::petri::ExplorationError;
use understudy_supervisor::proof::ProofError;
use understudy_supervisor::{AdsError, AutomatonError, TooComplex, TooLarge, TooLargeToDraw};

use crate::answer::{Answer, Status};
use crate::commands::{Group, command};

/// Errors with a code that end a command with exit status 1.
macro_rules! failures {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Answer {
            fn from(error: $error) -> Self {
                Self::failed(Status::Failed, error.code(), error)
            }
        })+
    };
}

failures!(
    AdsError,
    AutomatonError,
    ExplorationError,
    ProofError,
    TooComplex,
    TooLarge,
    TooLargeToDraw,
);

pub(crate) fn group() -> Group {
    Group {
        name: "supervisors",
        title: "Synthesise supervisors",
        entries: vec![
            command("synth", |it, console| synth::run(&it, console)),
            command("supervisor-to-ladder", |it, console| supervisor_to_ladder::run(&it, console)),
            command("des", |it, console| des::run(&it, console)),
            command("petri", |it, console| petri::run(&it, console)),
            command("reconfigure", |it, _| reconfigure::run(&it)),
        ],
    }
}
