//! The proxy of impaired links as a process of its own, so that a laboratory that is suspended stops no link.
//!
//! Invariant: no orphan. The process ends when its standard input closes, however the laboratory ends.

use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::AsFd;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use understudy_network::{ProxyCounters, ProxyPlan, ProxyReport};

/// How long it may take to report that it has ended.
const END_PATIENCE_MS: u16 = 3000;

/// A running proxy.
#[derive(Debug)]
pub(super) struct LinkProxy {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl LinkProxy {
    /// Starts `program proxy` for all routes of `plan`, and waits until it listens.
    pub(super) fn start(program: &Path, plan: &ProxyPlan) -> io::Result<Self> {
        let mut child = Command::new(program)
            .args(["proxy", "--in-laboratory"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            // A signal from the terminal is for the laboratory, which ends the proxy after the members.
            .process_group(0)
            .spawn()?;
        let input = child.stdin.take();
        let output = child.stdout.take().ok_or(io::ErrorKind::BrokenPipe)?;
        let mut proxy = Self { child, input, output: BufReader::new(output) };
        let mut line = serde_json::to_string(plan)?;
        line.push('\n');
        if let Some(input) = &mut proxy.input {
            input.write_all(line.as_bytes())?;
        }
        match proxy.report()? {
            ProxyReport::Listening => Ok(proxy),
            ProxyReport::Failed(message) => Err(io::Error::other(message)),
            ProxyReport::Ended(_) => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }

    /// Ends it; what has passed, or nothing where it has not answered.
    pub(super) fn end(&mut self) -> Option<ProxyCounters> {
        self.input = None;
        let mut readable = [PollFd::new(self.output.get_ref().as_fd(), PollFlags::POLLIN)];
        let answers =
            poll(&mut readable, PollTimeout::from(END_PATIENCE_MS)).is_ok_and(|ready| ready > 0);
        match answers.then(|| self.report()) {
            Some(Ok(ProxyReport::Ended(counters))) => Some(counters),
            _ => None,
        }
    }

    fn report(&mut self) -> io::Result<ProxyReport> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(serde_json::from_str(&line)?)
    }
}

impl Drop for LinkProxy {
    fn drop(&mut self) {
        // One that has ended needs nothing.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
