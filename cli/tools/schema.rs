//! `understudy schema`: the shapes of what this program reads and writes, for editors and other programs.

use clap::{Args, ValueEnum};
use schemars::schema_for;
use understudy_scenarios::{Summary, scenario_schema};
use understudy_supervisor::{map_schema, model_schema, net_schema};

use crate::answer::{Answer, Envelope};

/// Print a JSON schema
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy schema cluster > cluster.schema.json")]
pub(crate) struct Arguments {
    /// Of what
    #[arg(value_enum)]
    of: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Shape {
    /// The answer of every command under --json
    Answer,
    /// A cluster file
    Cluster,
    /// A model of plants and specifications
    Model,
    /// An automation Petri net
    Net,
    /// A scenario file
    Scenario,
    /// A map of signals, for supervisor-to-ladder --io
    SignalMap,
    /// The summary.json of a run
    Summary,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let schema = match arguments.of {
        Shape::Answer => schema_for!(Envelope<'_>),
        Shape::Cluster => understudy_cluster::schema(),
        Shape::Model => model_schema(),
        Shape::Net => net_schema(),
        Shape::Scenario => scenario_schema(),
        Shape::SignalMap => map_schema(),
        Shape::Summary => schema_for!(Summary),
    };
    let text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    Answer::done(text, schema)
}
