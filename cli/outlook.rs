//! `understudy outlook`: the hours to come, by the journal of a cluster.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use understudy_campaigns::{look_ahead, observe_journal};
use understudy_journal::records;
use understudy_wire::Mode;

use crate::answer::{Answer, Status};
use crate::reliability::{Times, refused};

/// Say how likely a cluster works over the hours to come, by what its journal shows
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy outlook runs/latest --ahead 8h

The journal gives the rates of failure, detection and repair and the share of failures that were masked, each with a 95 %
credible interval, and R over the time ahead with all stations working now. A journal that is still written may be read.")]
pub(crate) struct Arguments {
    /// The directory of a run, or a journal
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// How far to look ahead
    #[arg(
        long,
        value_name = "TIME",
        default_value = "24h",
        allow_hyphen_values = true
    )]
    ahead: String,
    /// Mean time to repair, for a journal that shows no repair
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mttr: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    answered(arguments).unwrap_or_else(|answer| answer)
}

fn answered(arguments: &Arguments) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let ahead = times.required("ahead", Some(&arguments.ahead));
    let mttr = times.optional("mttr", arguments.mttr.as_deref());
    times.finish(Vec::new())?;
    let Some(ahead) = ahead else {
        return Err(refused(&[]));
    };
    let bad = |code: &str, message: String| Answer::failed(Status::BadInput, code, message);
    let folder = arguments.run.is_dir();
    let journal = if folder {
        arguments.run.join("journal.jsonl")
    } else {
        arguments.run.clone()
    };
    let file = File::open(&journal).map_err(|error| {
        let replica = arguments.run.join("replica-1");
        let hint = if replica.is_dir() {
            format!("; each replica has one, such as {}", replica.display())
        } else {
            String::new()
        };
        let message = format!("{} cannot be read: {error}{hint}", journal.display());
        bad("U0601", message)
    })?;
    let view = observe_journal(records(BufReader::new(file))).map_err(|error| {
        let said = error.to_string();
        let said = said
            .trim_start_matches(error.code())
            .trim_start_matches(": ");
        bad(error.code(), format!("{}: {said}", journal.display()))
    })?;
    let mode = if folder {
        mode_of(&arguments.run)
    } else {
        Mode::Full
    };
    let found = look_ahead(view, mode, ahead, mttr).map_err(|errors| refused(&errors))?;
    Ok(Answer::done(found.to_text(), &found))
}

/// As the summary of a run says it; one that still runs has none, and counts as full.
fn mode_of(run: &Path) -> Mode {
    let summary = fs::read(run.join("summary.json")).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&summary).unwrap_or_default();
    match summary["circumstances"]["mode"].as_str() {
        Some("paper") => Mode::Paper,
        _ => Mode::Full,
    }
}
