//! `understudy why`: the contacts that determined an output.

use clap::Args;

use crate::answer::Answer;
use crate::inspect::view::{RunArgument, ZoneArgument};

/// Explain the value of an output or a variable in a cycle of a run
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy why press.move_down --at 212
  understudy why grip examples/press-cell/cluster.toml
  understudy why robot.%QX0.0 --at 250 --json

The program is evaluated again with the samples of the journal. The explanation names the contacts that determined the output, and the
rungs and cycles that set the memory bits they read. For a reconstructed output it names the parity word, its members and the lineage
that proves it.")]
pub(crate) struct Arguments {
    /// Output, variable or part of one by name or address, prefixed with its controller if the name is ambiguous
    #[arg(value_name = "OUTPUT")]
    output: String,
    /// Cycle, counted from the origin of the run; default: the newest
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    at: Option<i64>,
    #[command(flatten)]
    run: RunArgument,
    #[command(flatten)]
    zone: ZoneArgument,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let why = arguments.run.open()?.why(&arguments.output, arguments.at)?;
    Ok(Answer::done(why.to_text(arguments.zone.zone()), &why)
        .and_next(&[&"watch", &arguments.run.run]))
}
