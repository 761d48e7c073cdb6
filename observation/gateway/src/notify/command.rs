//! One run of the command: bounded in time, in a process group of its own, which is killed whole.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWriteExt};
use tokio::process::Command;
use understudy_cluster::Notify;
use understudy_text::duration;

use super::{MOST_WAITING, Notification};

/// Bytes of the standard error of the command that are reported, at most.
const MOST_SAID: u64 = 400;

/// Time for the last words of a command that has ended.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// Error of a notification.
#[derive(Debug, thiserror::Error)]
pub enum NotifyError {
    /// The command does not start.
    #[error("U0584: alarm `{alarm}`: cannot start the command `{program}`: {source}")]
    Start {
        /// Name of the alarm.
        alarm: String,
        /// The program.
        program: String,
        /// Error of the system.
        source: io::Error,
    },
    /// It has not ended in time.
    #[error(
        "U0585: alarm `{alarm}`: the command `{program}` was killed after {}; give it a `timeout` of its own, or raise that of [notify]", duration::text(*.timeout)
    )]
    Timeout {
        /// Name of the alarm.
        alarm: String,
        /// The program.
        program: String,
        /// The time that it had.
        timeout: Duration,
    },
    /// It has ended with an error.
    #[error("U0586: alarm `{alarm}`: the command `{program}` ended with {status}{said}")]
    Failed {
        /// Name of the alarm.
        alarm: String,
        /// The program.
        program: String,
        /// How it ended.
        status: ExitStatus,
        /// Its standard error.
        said: String,
    },
    /// More notifications wait than are kept.
    #[error(
        "U0587: alarm `{alarm}`: not passed on, because {MOST_WAITING} notifications wait for the command"
    )]
    Full {
        /// Name of the alarm.
        alarm: String,
    },
}

impl NotifyError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Start { .. } => "U0584",
            Self::Timeout { .. } => "U0585",
            Self::Failed { .. } => "U0586",
            Self::Full { .. } => "U0587",
        }
    }
}

/// The processes of a command, killed when this is dropped, unless the command has ended by itself.
struct Group(Option<Pid>);

impl Drop for Group {
    fn drop(&mut self) {
        if let Some(group) = self.0 {
            let _ = killpg(group, Signal::SIGKILL);
        }
    }
}

/// Runs the command with a notification as its standard input.
pub(super) async fn run(notify: &Notify, notification: &Notification) -> Result<(), NotifyError> {
    let alarm = || notification.alarm.name.clone();
    let program = || notify.program.clone();
    let refused = |source| NotifyError::Start { alarm: alarm(), program: program(), source };
    let text = serde_json::to_string(notification).map_err(|error| refused(error.into()))? + "\n";
    let mut command = std::process::Command::new(&notify.program);
    command
        .args(&notify.arguments)
        .env("UNDERSTUDY_EVENT", notification.event.word())
        .env("UNDERSTUDY_CLUSTER", &notification.cluster)
        .env("UNDERSTUDY_ALARM", &notification.alarm.name)
        .env("UNDERSTUDY_TEXT", &notification.alarm.text)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .process_group(0);
    let mut child = Command::from(command).spawn().map_err(refused)?;
    let group = child.id().and_then(|id| i32::try_from(id).ok()).map(Pid::from_raw);
    let mut group = Group(group);
    let errors = child.stderr.take().map(|errors| tokio::spawn(first_of(errors)));
    let input = child.stdin.take();
    let write = async {
        if let Some(mut input) = input {
            // A command need not read it.
            let _ = input.write_all(text.as_bytes()).await;
        }
    };
    let ended = async { tokio::join!(write, child.wait()).1 };
    let Ok(ended) = tokio::time::timeout(notify.timeout, ended).await else {
        drop(group);
        let _ = child.wait().await;
        let timeout = notify.timeout;
        return Err(NotifyError::Timeout { alarm: alarm(), program: program(), timeout });
    };
    group.0 = None;
    let status = ended.map_err(refused)?;
    if status.success() {
        return Ok(());
    }
    let said = match errors {
        Some(errors) => tokio::time::timeout(LAST_WORDS, errors).await.ok().and_then(Result::ok),
        None => None,
    };
    let said =
        said.filter(|said| !said.is_empty()).map_or_else(String::new, |said| format!(": {said}"));
    Err(NotifyError::Failed { alarm: alarm(), program: program(), status, said })
}

/// The first bytes of a stream, in one line; the rest is read and dropped.
async fn first_of(mut stream: impl AsyncRead + Unpin) -> String {
    let mut first = Vec::new();
    let _ = (&mut stream).take(MOST_SAID).read_to_end(&mut first).await;
    let _ = tokio::io::copy(&mut stream, &mut tokio::io::sink()).await;
    let text = String::from_utf8_lossy(&first);
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ").chars().filter(|letter| !letter.is_control()).collect()
}
