//! Commands that run a cluster, on processes of this machine or in virtual time, and equipment for it.

pub(crate) mod campaign;
pub(crate) mod cluster_run;
pub(crate) mod demo;
mod device;
pub(crate) mod lab;
pub(crate) mod model_check;
pub(crate) mod outcome;
pub(crate) mod simulate;
pub(crate) mod wakefulness;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "run",
        title: "Run and test clusters",
        entries: vec![
            command("demo", |it, console| demo::run(&it, console)),
            command("lab", |it, console| lab::run(&it, console)),
            command("simulate", |it, _| simulate::run(&it)),
            command("device", |it, console| device::run(&it, console)),
            command("campaign", |it, console| campaign::run(&it, console)),
            command("model-check", |it, _| model_check::run(&it)),
        ],
    }
}
