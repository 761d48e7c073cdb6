//! `understudy parity`: the generated parity controller as equations, ladder or Structured Text.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_cluster::{Cluster, Overrides};
use understudy_ladder::{circuit_as_structured_text, from_circuit, print};
use understudy_parity::{Equations, Style};

use crate::answer::Answer;
use crate::files;

/// Print the generated understudy of a cluster
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy parity examples/press-cell/cluster.toml
  understudy parity examples/press-cell/cluster.toml --as st --output understudy.st")]
pub(crate) struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Output format
    #[arg(long = "as", value_enum, default_value = "equations")]
    form: Form,
    /// Output file; default: standard output
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Polynomials over GF(2), as in (30)-(35), and Boolean functions, as in (37)-(40)
    Equations,
    /// Ladder text
    Ladder,
    /// IEC 61131-3 Structured Text
    St,
    /// Equations as JSON
    Json,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let (cluster, reports) = files::cluster(&arguments.cluster, Overrides::default())?;
    let (text, result) = made(&cluster, arguments.form)?;
    let output = arguments.output.as_deref();
    let answer = files::deliver(output, &text, result)?;
    let answer = match output {
        Some(_) => answer.and_next(&[&"verify", &arguments.cluster]),
        None => answer,
    };
    Ok(answer.with_used(reports))
}

/// Text and JSON of the controller.
fn made(cluster: &Cluster, form: Form) -> Result<(String, Value), Answer> {
    let parity = files::parity_of(cluster, "parity")?;
    let circuit = parity.circuit();
    let text = match form {
        Form::Ladder => {
            let note = not_retentive(cluster).map(|note| format!("-- {note}\n"));
            note.unwrap_or_default() + &print(&from_circuit(circuit))
        }
        // Addresses of the members belong to other PLCs and would collide here.
        Form::St => {
            let note = not_retentive(cluster).map(|note| format!("(* {note} *)\n"));
            let period = cluster.agreement().schedule.period();
            note.unwrap_or_default() + &circuit_as_structured_text(circuit, period)
        }
        Form::Equations | Form::Json => {
            let equations = Equations::of(&parity);
            let value = serde_json::to_value(&equations).unwrap_or_default();
            let text = if form == Form::Json {
                serde_json::to_string_pretty(&equations).unwrap_or_default()
            } else {
                equations.to_text(Style::Symbols)
            };
            return Ok((text, value));
        }
    };
    let result = json!({ "text": text });
    Ok((text, result))
}

/// what a reader of the text must know where programs have retentive variables: the text keeps none of them.
fn not_retentive(cluster: &Cluster) -> Option<String> {
    let of = |controller: &understudy_cluster::Controller| {
        let names = controller.code.typed().retentive_names();
        (!names.is_empty()).then(|| format!("{} of {}", names.join(", "), controller.name))
    };
    let names: Vec<String> = cluster.controllers().iter().filter_map(of).collect();
    let names = names.join("; ");
    (!names.is_empty()).then(|| {
        format!("Not retentive here, and initial after a power failure: {names}. An understudy of the cluster keeps them.")
    })
}
