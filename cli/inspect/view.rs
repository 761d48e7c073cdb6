//! Shared by the commands that inspect a run.

use std::path::PathBuf;

use clap::Args;
use jiff::Timestamp;
use jiff::tz::TimeZone;
use understudy_view::{Run, ViewError, Zone, find_run_of};

use crate::answer::{Answer, Status};
use crate::files;

/// The newest run, the default.
const RUN: &str = "runs/latest";

/// The run that a command inspects.
#[derive(Debug, Args)]
pub(crate) struct RunArgument {
    /// Directory of a run, or cluster file for its newest run below --out
    #[arg(value_name = "RUN|CLUSTER.toml", default_value = RUN)]
    pub(crate) run: PathBuf,
    /// Directory of runs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub(crate) out: PathBuf,
}

/// How times of day are shown.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct ZoneArgument {
    /// Show times of day in UTC instead of the local zone
    #[arg(long)]
    utc: bool,
}

impl ZoneArgument {
    pub(crate) fn zone(self) -> Zone {
        if self.utc { Zone::UTC } else { Zone::of(local_offset) }
    }
}

/// Seconds by which the zone of this machine, or of the variable `TZ`, is ahead of UTC at a time.
fn local_offset(unix_seconds: i64) -> i32 {
    let time = Timestamp::from_second(unix_seconds).unwrap_or_default();
    TimeZone::system().to_offset(time).seconds()
}

impl RunArgument {
    pub(crate) fn open(&self) -> Result<Run, Answer> {
        if !self.is_cluster() {
            return Ok(Run::open(&self.run)?);
        }
        let (cluster, _) = files::cluster(&self.run, Default::default())?;
        Ok(find_run_of(&self.out, &cluster)?)
    }

    pub(crate) fn is_cluster(&self) -> bool {
        let extension = self.run.extension();
        extension.is_some_and(|extension| extension == "toml")
    }
}

impl From<ViewError> for Answer {
    fn from(error: ViewError) -> Self {
        several(&[error])
    }
}

/// Failure with several errors.
pub(crate) fn several(errors: &[ViewError]) -> Answer {
    let mut answer = Answer::done("", ()).with_status(Status::BadInput);
    for error in errors {
        if let ViewError::Kept(understudy_journal::KeptError::Files { reports }) = error {
            answer.reports.extend(reports.iter().cloned());
        }
        answer = answer.and_failure(Status::BadInput, error.code(), error);
    }
    answer
}
