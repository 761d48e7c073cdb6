//! Commands that predict and measure the reliability of a cluster.

mod measure;
mod outlook;
mod prediction;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "reliability",
        title: "Predict and measure reliability",
        entries: vec![
            command("reliability", |it, console| prediction::run(&it, console)),
            command("measure", |it, console| measure::run(&it, console)),
            command("outlook", |it, _| outlook::run(&it)),
        ],
    }
}
