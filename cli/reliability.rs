//! Commands that predict and measure the reliability of a cluster.

mod measure;
mod outlook;
mod prediction;

use crate::commands::{Group, command};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use understudy_campaigns::{options_of, set_unequal};
use understudy_cluster::{Cluster, Overrides};
use understudy_journal::time_name;
use understudy_reliability::{
    Answer as Calculated, Assessment, CommonCauseConvention, Hours, Options, Provenance,
    ReliabilityError, SharedPart, UnequalBoxes, answer_chain, calculate, read_chain, report,
    report_data,
};
use understudy_scenarios::{options_of, set_unequal};
use understudy_text::{Report};

pub(crate) fn group() -> Group {
    Group {
        name: "reliability",
        title: "Predict and measure reliability",
        entries: vec![
            command("reliability", |it, _| prediction::run(&it)),
            command("measure", |it, console| measure::run(&it, console)),
            command("outlook", |it, _| outlook::run(&it)),
        ],
    }
}
