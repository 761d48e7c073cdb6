//! What comes from outside while a member runs: commands on standard input, and signals.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use understudy_wire::{ChangeRequest, Force, Write};

use crate::error::BusError;
use crate::orders::{Control, Cuts, Order};

/// Whether commands are read, one a line: `stop`, `release`, `force {...}`, `unforce {...}` and `write {...}` with a [`Force`], an [`Unforce`](understudy_wire::Unforce) and a [`Write`] as JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Commands {
    /// None: standard input is left alone.
    None,
    /// Commands are read; the end of standard input means nothing.
    Read,
    /// Commands are read, and `cut {...}` with a [`Cuts`] as JSON; the member ends with standard input: whoever started it is gone then.
    ReadAndEndWithInput,
}

/// A line without an end is cut here.
pub(crate) const LINE_BYTES: usize = 1024;

/// Holds SIGINT and SIGTERM back from the calling thread, and from all that it starts. To be called before any other thread
/// starts: one that does not hold them back dies of them, and the process with it.
///
/// # Errors
/// [`BusError::System`].
pub fn hold_back_signals() -> Result<(), BusError> {
    ending_signal_set().thread_block().map_err(BusError::system("to hold back SIGINT and SIGTERM"))
}

pub(crate) fn ending_signal_set() -> SigSet {
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGINT);
    signals.add(Signal::SIGTERM);
    signals
}

/// SIGINT and SIGTERM as a file descriptor.
pub(crate) fn ending_signals() -> Result<SignalFd, BusError> {
    hold_back_signals()?;
    SignalFd::with_flags(&ending_signal_set(), SfdFlags::SFD_CLOEXEC | SfdFlags::SFD_NONBLOCK)
        .map_err(BusError::system("a signalfd"))
}

/// SIGINT and SIGTERM to a command that has something to save: they do not end the process any more.
#[derive(Debug)]
pub struct Interruption(SignalFd);

impl Interruption {
    /// From now on. To be called before any other thread starts, as [`hold_back_signals`].
    ///
    /// # Errors
    /// [`BusError::System`].
    pub fn expected() -> Result<Self, BusError> {
        ending_signals().map(Self)
    }

    /// Whether one came since this was last asked.
    pub fn came(&self) -> bool {
        matches!(self.0.read_signal(), Ok(Some(_)))
    }
}

/// Passes commands and signals on until `finished` becomes readable. Lines that are no command go to `unknown`.
pub(crate) fn watch(
    commands: Commands,
    signals: &SignalFd,
    finished: BorrowedFd<'_>,
    control: &Control,
    mut unknown: impl FnMut(String),
) -> Result<(), BusError> {
    let input = io::stdin();
    let mut lines = Lines::default();
    let mut reads = commands != Commands::None;
    loop {
        let mut descriptors = vec![
            PollFd::new(finished, PollFlags::POLLIN),
            PollFd::new(signals.as_fd(), PollFlags::POLLIN),
        ];
        if reads {
            descriptors.push(PollFd::new(input.as_fd(), PollFlags::POLLIN));
        }
        match poll(&mut descriptors, PollTimeout::NONE) {
            Ok(_) => {}
            Err(Errno::EINTR) => continue,
            Err(error) => return Err(BusError::system("to wait for commands")(error)),
        }
        let ready: Vec<bool> =
            descriptors.iter().map(|descriptor| descriptor.any().unwrap_or(false)).collect();
        if ready[0] {
            return Ok(());
        }
        if ready[1] && matches!(signals.read_signal(), Ok(Some(_))) {
            control.give(Order::Stop);
        }
        if reads && ready[2] {
            let mut bytes = [0; LINE_BYTES];
            match nix::unistd::read(&input, &mut bytes) {
                Ok(0) | Err(Errno::EIO) => {
                    reads = false;
                    if commands == Commands::ReadAndEndWithInput {
                        control.give(Order::Stop);
                    }
                }
                Ok(length) => {
                    for line in lines.take(&bytes[..length]) {
                        let order = match cut(&line) {
                            Some(cuts) if commands == Commands::ReadAndEndWithInput => {
                                Some(Order::Cut(cuts))
                            }
                            _ => order(&line),
                        };
                        match order {
                            // One that is not taken is counted there.
                            Some(order) => {
                                control.give(order);
                            }
                            None if line.is_empty() => {}
                            None => unknown(line),
                        }
                    }
                }
                Err(_) => {}
            }
        }
    }
}

/// What a line says.
pub(crate) fn order(line: &str) -> Option<Order> {
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match (word, rest) {
        ("stop", "") => Some(Order::Stop),
        ("release", "") => Some(Order::Release),
        ("force", force) => {
            let force: Force = serde_json::from_str(force).ok()?;
            force.check().is_ok().then_some(Order::Force(force))
        }
        ("choose", choice) => serde_json::from_str(choice).ok().map(Order::Choose),
        ("write", write) => {
            let write: Write = serde_json::from_str(write).ok()?;
            write.check().is_ok().then_some(Order::Write(write))
        }
        ("unforce", unforce) => serde_json::from_str(unforce).ok().map(Order::Unforce),
        _ => None,
    }
}

/// A step of an online change.
pub(crate) fn change_request(line: &str) -> Option<ChangeRequest> {
    serde_json::from_str(line.strip_prefix("change ")?).ok()
}

/// The links that a laboratory wants to be cut; no operator can.
fn cut(line: &str) -> Option<Cuts> {
    serde_json::from_str(line.strip_prefix("cut ")?).ok()
}

/// Lines out of pieces.
#[derive(Debug, Default)]
struct Lines {
    begun: Vec<u8>,
}

impl Lines {
    fn take(&mut self, piece: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in piece {
            if byte == b'\n' || self.begun.len() == LINE_BYTES {
                let line = String::from_utf8_lossy(&std::mem::take(&mut self.begun)).into_owned();
                lines.push(line.trim().to_owned());
            }
            if byte != b'\n' {
                self.begun.push(byte);
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{Cycle, PointsHash, SignalPlace, StateChoice, Unforce};

    use super::*;

    fn check(pieces: &[&[u8]], expected: &[&str]) {
        let mut lines = Lines::default();
        let found: Vec<String> = pieces.iter().flat_map(|piece| lines.take(piece)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn lines_are_put_together_from_pieces() {
        check(&[b"st", b"op\nrel", b"ease\r\n"], &["stop", "release"]);
        check(&[b"stop"], &[]);
        check(&[b"\n\xff\n"], &["", "\u{fffd}"]);
    }

    #[test]
    fn a_line_is_an_order_or_none() {
        let check =
            |line: &str, expected: Option<Order>| assert_eq!(order(line), expected, "{line}");
        let force = Force {
            signal: SignalPlace::Output(3),
            value: true.into(),
            seconds: 60,
            owner: "anna".into(),
            reason: "to see the lamp".into(),
            points: Some(PointsHash(u64::MAX)),
        };
        let line = serde_json::to_string(&force).expect("JSON");
        assert!("force ".len() + line.len() < LINE_BYTES);
        check("stop", Some(Order::Stop));
        check("release", Some(Order::Release));
        check("release now", None);
        check(&format!("force {line}"), Some(Order::Force(force)));
        check(&format!("force {}", line.replace("60", "0")), None);
        let (signal, points) = (SignalPlace::Input(0), Some(PointsHash(7)));
        for (points, line) in [
            (None, r#"unforce {"signal":{"input":0}}"#),
            (points, r#"unforce {"signal":{"input":0},"points":7}"#),
        ] {
            check(line, Some(Order::Unforce(Unforce { signal, points })));
        }
        check(r#"unforce {"signal":{"input":70000}}"#, None);
        check("unforce", None);
        check(r#"choose "cold""#, Some(Order::Choose(StateChoice::Cold)));
        let cycle = Some(Cycle(7));
        check(
            r#"choose {"newest":{"cycle":7}}"#,
            Some(Order::Choose(StateChoice::Newest { cycle })),
        );
        check("choose", None);
        check("", None);
    }

    #[test]
    fn only_a_laboratory_cuts_links() {
        let line = r#"cut {"stations":1,"remote_ios":2}"#;
        let cuts = cut(line).expect("it is one");
        assert_eq!(
            serde_json::to_value(cuts).expect("JSON"),
            serde_json::json!({ "stations": 1, "remote_ios": 2 })
        );
        assert_eq!(order(line), None, "no operator's order");
        assert_eq!(cut("cut"), None);
        assert_eq!(cut(r#"heal {"stations":1,"remote_ios":2}"#), None);
    }

    #[test]
    fn a_line_without_an_end_is_cut() {
        let long = [b'a'; LINE_BYTES * 3 + 1];
        let cut = "a".repeat(LINE_BYTES);
        check(&[&long], &[&cut, &cut, &cut]);
    }
}
