//! `understudy diff`: where two runs part.

use std::path::{Path, PathBuf};

use clap::Args;
use understudy_view::{Bounds, Model, Run, ViewError, diff};

use crate::answer::Answer;
use crate::inspect::view::several;

/// Compare two runs: the first cycle in which inputs, outputs, sources or events differ
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy diff runs/2026-11-21T20-00-00Z runs/latest

Cycles are compared from the origin of each run on, as far as both go. Exit status 0 also where they differ: that is an answer.")]
pub(crate) struct Arguments {
    /// The directory of a run
    #[arg(value_name = "RUN")]
    left: PathBuf,
    /// The directory of another one
    #[arg(value_name = "OTHER")]
    right: PathBuf,
}

/// Signals of a run may change a million times before the oldest changes are forgotten; states are not compared.
const BOUNDS: Bounds = Bounds {
    cycles: 64,
    events: 100_000,
    changes: 1_000_000,
    timings: 1,
};

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let read = |path: &Path| -> Result<Model, ViewError> { Run::open(path)?.read(BOUNDS) };
    match (read(&arguments.left), read(&arguments.right)) {
        (Ok(left), Ok(right)) => {
            let found = diff(&left, &right);
            Answer::done(found.to_text(), &found).and_next(&[&"journal", &arguments.right])
        }
        (left, right) => {
            let errors: Vec<ViewError> = [left.err(), right.err()].into_iter().flatten().collect();
            several(&errors)
        }
    }
}
