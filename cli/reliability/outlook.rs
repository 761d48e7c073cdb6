//! `understudy outlook`: predicted reliability of a running cluster.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use understudy_campaigns::{look_ahead, observe_journal};
use understudy_cycle::Mode;
use understudy_journal::records_of;

use crate::answer::{Answer, Status};
use crate::reliability::prediction::{Times, refused};

/// Predict the reliability of a running cluster from its journal
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy outlook runs/latest --ahead 8h

The rates of failure, detection and repair and the coverage are estimated from the journal, each with a 95 % credible interval. R over the
prediction period assumes that all stations are working now. The run may still be in progress.")]
pub(crate) struct Arguments {
    /// Directory of a run, or journal file
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Prediction period
    #[arg(long, value_name = "TIME", default_value = "24h", allow_hyphen_values = true)]
    ahead: String,
    /// MTTR, for a journal without repairs
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mttr: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let ahead = times.required("ahead", Some(&arguments.ahead));
    let mttr = times.optional("mttr", arguments.mttr.as_deref());
    times.finish(Vec::new())?;
    let Some(ahead) = ahead else {
        return Err(refused(&[]));
    };
    let bad = |code: &str, message: String| Answer::failed(Status::BadInput, code, message);
    let folder = arguments.run.is_dir();
    let journal = if folder { arguments.run.join("journal.jsonl") } else { arguments.run.clone() };
    let told = File::open(&journal).and_then(|_| records_of(&journal));
    let told = told.map_err(|error| {
        let replica = arguments.run.join("replica-1");
        let hint = if replica.is_dir() {
            format!("; each replica has one, such as {}", replica.display())
        } else {
            String::new()
        };
        let message = format!("{} cannot be read: {error}{hint}", journal.display());
        bad("U0601", message)
    })?;
    let view = observe_journal(told).map_err(|error| {
        let said = error.to_string();
        let said = said.trim_start_matches(error.code()).trim_start_matches(": ");
        bad(error.code(), format!("{}: {said}", journal.display()))
    })?;
    let mode = if folder { mode_of(&arguments.run) } else { Mode::Full };
    let found = look_ahead(view, mode, ahead, mttr).map_err(|errors| refused(&errors))?;
    Ok(Answer::done(found.to_text(), &found))
}

/// Mode from the summary of a run; a run in progress counts as full.
fn mode_of(run: &Path) -> Mode {
    let summary = fs::read(run.join("summary.json")).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&summary).unwrap_or_default();
    match summary["circumstances"]["mode"].as_str() {
        Some("paper") => Mode::Paper,
        _ => Mode::Full,
    }
}
