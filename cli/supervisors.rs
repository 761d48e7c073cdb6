//! Commands on discrete-event models: automata, Petri nets, supervisors and their ladders.

pub(crate) mod automata;
mod des;
mod petri;
pub(crate) mod reconfigure;
mod reduction;
mod supervisor_to_ladder;
mod synth;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "supervisors",
        title: "Synthesise supervisors",
        entries: vec![
            command("synth", |it, console| synth::run(&it, console)),
            command("supervisor-to-ladder", |it, _| {
                supervisor_to_ladder::run(&it)
            }),
            command("des", |it, console| des::run(&it, console)),
            command("petri", |it, _| petri::run(&it)),
            command("reconfigure", |it, _| reconfigure::run(&it)),
        ],
    }
}
