//! `understudy diff`: the first difference between two runs.

use std::path::{Path, PathBuf};

use clap::Args;
use understudy_view::{Bounds, Model, Run, ViewError, diff};

use crate::answer::{Answer, Status};
use crate::inspect::view::several;

/// Compare two runs and show the first difference
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy diff runs/2026-11-21T20-00-00Z runs/latest

Cycles are counted from the origin of each run and compared up to the end of the shorter run. Exit status: 0 if the runs
are equal, 1 if they differ.")]
pub(crate) struct Arguments {
    /// Directory of a run
    #[arg(value_name = "RUN")]
    left: PathBuf,
    /// Directory of another run
    #[arg(value_name = "OTHER")]
    right: PathBuf,
}

/// Bounds of the comparison: a million changes of signals; states are not compared.
const BOUNDS: Bounds = Bounds { cycles: 64, events: 100_000, changes: 1_000_000, timings: 1 };

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let read = |path: &Path| -> Result<Model, ViewError> { Run::open(path)?.read(BOUNDS) };
    match (read(&arguments.left), read(&arguments.right)) {
        (Ok(left), Ok(right)) => {
            let found = diff(&left, &right);
            let status = match found.is_equal() {
                true => Status::Done,
                false => Status::Failed,
            };
            Answer::done(found.to_text(), &found)
                .with_status(status)
                .and_next(&[&"journal", &arguments.right])
        }
        (left, right) => {
            let errors: Vec<ViewError> = [left.err(), right.err()].into_iter().flatten().collect();
            several(&errors)
        }
    }
}
