//! `understudy schema`: JSON schemas of files and answers.

use clap::{Args, ValueEnum};
use schemars::schema_for;
use understudy_scenarios::{Summary, scenario_schema};
use understudy_supervisor::{map_schema, model_schema, net_schema};

use crate::answer::{Answer, Envelope};

/// Print the JSON schema of a file or an answer
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy schema cluster > cluster.schema.json")]
pub(crate) struct Arguments {
    /// File or answer
    #[arg(value_enum)]
    of: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Shape {
    /// Answer of every command with --json
    Answer,
    /// Cluster file
    Cluster,
    /// Model of plants and specifications
    Model,
    /// Automation Petri net
    Net,
    /// Plant file
    Plant,
    /// Scenario file
    Scenario,
    /// Signal map of supervisor-to-ladder --io
    SignalMap,
    /// summary.json of a run
    Summary,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let schema = match arguments.of {
        Shape::Answer => schema_for!(Envelope<'_>),
        Shape::Cluster => understudy_cluster::schema(),
        Shape::Model => model_schema(),
        Shape::Net => net_schema(),
        Shape::Plant => understudy_cluster::plant_file_schema(),
        Shape::Scenario => scenario_schema(),
        Shape::SignalMap => map_schema(),
        Shape::Summary => schema_for!(Summary),
    };
    let text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    Answer::done(text, schema)
}
