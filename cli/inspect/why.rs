//! `understudy why`: the chain of contacts that made an output what it is.

use std::path::PathBuf;

use clap::Args;
use understudy_view::{Bounds, Run};

use crate::answer::Answer;
use crate::inspect::view::{RUN, refused};

/// Say why an output was as it was in a cycle of a run
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy why press.move_down --at 212
  understudy why grip --run runs/latest
  understudy why robot.%QX0.0 --at 250 --json

The program is run again from the samples in the journal, and its rungs are looked at as its station evaluated them: the contacts that
let the power through or held it back, what set the memory bits that they read, and in which cycle. Where the output was
restored, the word, its members and the lineage that proves it are named.")]
pub(crate) struct Arguments {
    /// An output or a memory bit by its name or address, with its controller's name before it where several have one
    #[arg(value_name = "OUTPUT")]
    output: String,
    /// The cycle, counted from the origin of the run; by default the newest
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    at: Option<i64>,
    /// The directory of a run
    #[arg(long, value_name = "DIR", default_value = RUN)]
    run: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let found = Run::open(&arguments.run).and_then(|run| {
        let until = arguments.at.unwrap_or(i64::MAX);
        let model = run.read_until(Bounds::default(), until)?;
        model.why(&arguments.output, arguments.at)
    });
    match found {
        Ok(why) => Answer::done(why.to_text(), &why).and_next(&[&"watch", &arguments.run]),
        Err(error) => refused(&error),
    }
}
