//! One member as a process: exactly `understudy node`, `remote-io` or `plant`.
//!
//! Invariant: no orphan. A process ends when it is told to, when its standard input closes, when the laboratory's process ends
//! however it ends (PR_SET_PDEATHSIG, which it sets for itself), and when this value is dropped.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncWriteExt, BufReader};
use tokio::process::{Child, ChildStdin, Command};
use tokio::sync::mpsc::Sender;
use understudy_bus::log_environment;
use understudy_wire::Member;

/// A line that a process says, at most; longer ones are cut by the reader's patience, not by memory.
const ERROR_LINES: usize = 12;

/// What a process says.
#[derive(Debug)]
pub(super) struct Said {
    pub(super) member: Member,
    /// Which of its lives.
    pub(super) life: u32,
    pub(super) what: Saying,
}

#[derive(Debug)]
pub(super) enum Saying {
    /// A line on standard output.
    Line(String),
    /// Standard output is closed, and with it the last lines of standard error.
    End(Vec<String>),
}

/// A running process.
#[derive(Debug)]
pub(super) struct Process {
    member: Member,
    life: u32,
    child: Child,
    input: Option<ChildStdin>,
    state: State,
}

/// What the laboratory knows of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Running,
    /// By SIGSTOP.
    Suspended,
    /// It was asked to end.
    Ending,
    Ended,
}

impl Process {
    /// Starts `command`; everything that it says goes to `said`.
    pub(super) fn start(
        member: Member,
        life: u32,
        mut command: Command,
        said: Sender<Said>,
    ) -> io::Result<Self> {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // A signal from the terminal is for the laboratory, which stops its processes in order.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()?;
        let input = child.stdin.take();
        let output = child.stdout.take();
        let errors = child.stderr.take();
        tokio::spawn(async move {
            let errors = tokio::spawn(last_lines(errors));
            if let Some(output) = output {
                let mut lines = BufReader::new(output).lines();
                while let Ok(Some(line)) = lines.next_line().await {
                    let what = Saying::Line(line);
                    if said.send(Said { member, life, what }).await.is_err() {
                        return;
                    }
                }
            }
            let what = Saying::End(errors.await.unwrap_or_default());
            // Nobody listens any more when the laboratory itself has ended.
            let _ = said.send(Said { member, life, what }).await;
        });
        Ok(Self { member, life, child, input, state: State::Running })
    }

    pub(super) fn life(&self) -> u32 {
        self.life
    }

    pub(super) fn member(&self) -> Member {
        self.member
    }

    /// Whether it has neither ended nor been asked to.
    pub(super) fn is_running(&self) -> bool {
        matches!(self.state, State::Running | State::Suspended)
    }

    /// Whether it is gone.
    pub(super) fn has_ended(&self) -> bool {
        self.state == State::Ended
    }

    /// Whether the laboratory has suspended it with SIGSTOP.
    pub(super) fn is_suspended(&self) -> bool {
        self.state == State::Suspended
    }

    /// As `kill -9`.
    pub(super) async fn crash(&mut self) -> io::Result<()> {
        self.state = State::Ended;
        self.child.kill().await
    }

    /// SIGSTOP.
    pub(super) fn stop(&mut self) -> io::Result<()> {
        self.state = State::Suspended;
        self.signal(Signal::SIGSTOP)
    }

    /// SIGCONT.
    pub(super) fn go_on(&mut self) -> io::Result<()> {
        self.state = State::Running;
        self.signal(Signal::SIGCONT)
    }

    /// A line on standard input.
    pub(super) async fn command(&mut self, line: &str) -> io::Result<()> {
        match &mut self.input {
            Some(input) => {
                input.write_all(format!("{line}\n").as_bytes()).await?;
                input.flush().await
            }
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    /// Asks it to end.
    pub(super) async fn ask_to_end(&mut self) {
        if self.has_ended() {
            return;
        }
        if self.is_suspended() {
            // One that is gone already needs nothing.
            let _ = self.go_on();
        }
        self.state = State::Ending;
        let _ = self.command("stop").await;
        self.input = None;
    }

    /// Waits for its end, and makes one after `patience`.
    pub(super) async fn end(&mut self, patience: Duration) -> Option<ExitStatus> {
        self.state = State::Ended;
        match tokio::time::timeout(patience, self.child.wait()).await {
            Ok(status) => status.ok(),
            Err(_) => {
                let _ = self.child.kill().await;
                None
            }
        }
    }

    fn signal(&self, signal: Signal) -> io::Result<()> {
        let id = self.child.id().and_then(|id| i32::try_from(id).ok());
        let id = id.ok_or(io::ErrorKind::NotFound)?;
        kill(Pid::from_raw(id), signal).map_err(io::Error::from)
    }
}

async fn last_lines(errors: Option<impl AsyncRead + Unpin>) -> Vec<String> {
    let mut last = VecDeque::new();
    let Some(errors) = errors else {
        return Vec::new();
    };
    let mut lines = BufReader::new(errors).lines();
    let is_shown = !log_environment().is_empty();
    while let Ok(Some(line)) = lines.next_line().await {
        if is_shown {
            // The log of a member goes where that of the laboratory goes; a closed standard error has no reader.
            let _ = writeln!(io::stderr(), "{line}");
        }
        if last.len() == ERROR_LINES {
            last.pop_front();
        }
        last.push_back(line);
    }
    last.into()
}
