//! What a process says besides its answer and its journal: spans and events of `tracing`, as lines on standard error.
//!
//! A binary calls [`LogSettings::start`] once. Without a filter, only errors of this project are written. A thread of its own writes the
//! lines, so that no reader of standard error makes a cycle wait; lines for which it has no room are counted, and the number is written.

use std::io::{self, IsTerminal, Write};
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::Builder;
use std::time::Duration;

use nix::sys::signal::{SigSet, SigmaskHow};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::{MakeWriter, layer};
use tracing_subscriber::layer::{Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

use crate::refused_certificates;

/// Environment variable of the filter, as other programs with `tracing` have it.
const FILTER_VARIABLE: &str = "RUST_LOG";

/// Environment variable of the format.
const FORMAT_VARIABLE: &str = "UNDERSTUDY_LOG_FORMAT";

/// Filter where none is given. Targets are names of crates, and those of this project begin with this word.
const DEFAULT_FILTER: &str = "understudy=error";

/// Lines that wait for standard error, at most.
const WAITING_LINES: usize = 4096;

/// The process may lock all its memory, so the stack of the writing thread is small.
const STACK_BYTES: usize = 128 << 10;

/// How long the end of a process waits for the last lines.
const END_PATIENCE: Duration = Duration::from_secs(1);

/// Form of the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LogFormat {
    /// Text for people, one line for each event.
    #[default]
    Text,
    /// One JSON object on each line.
    Json,
}

impl LogFormat {
    /// The word of a command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
        }
    }
}

impl FromStr for LogFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = [Self::Text, Self::Json];
        let found = all.into_iter().find(|format| format.word() == text);
        found.ok_or_else(|| format!("`{text}` is not a format; expected text or json"))
    }
}

/// Which spans and events are written: a level, or levels of targets, separated by commas.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFilter {
    text: String,
    targets: Targets,
}

impl FromStr for LogFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut targets = Targets::new();
        for part in text.split(',').map(str::trim) {
            let (target, word) = match part.split_once('=') {
                Some((target, word)) => (Some(target.trim()), word.trim()),
                None => (None, part),
            };
            // Numbers are levels for the library, and none that a person means.
            let level =
                word.parse().ok().filter(|_| !word.bytes().any(|byte| byte.is_ascii_digit()));
            let level: LevelFilter = level.filter(|_| !word.is_empty()).ok_or_else(|| {
                format!(
                    "`{part}` is not a filter; expected a level (off, error, warn, info, debug, trace) or TARGET=LEVEL, \
                     such as understudy=debug,zenoh=warn"
                )
            })?;
            targets = match target {
                Some("") => return Err(format!("`{part}` has no target before the =")),
                Some(target) => targets.with_target(target, level),
                None => targets.with_default(level),
            };
        }
        Ok(Self { text: text.to_owned(), targets })
    }
}

/// What is written, and how; what is not given is taken from the environment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogSettings {
    /// Option of the command line, before `RUST_LOG`.
    pub filter: Option<LogFilter>,
    /// Option of the command line, before `UNDERSTUDY_LOG_FORMAT`.
    pub format: Option<LogFormat>,
}

/// What child processes of this one are to write: the settings that were asked for.
static PASSED_ON: OnceLock<Vec<(&'static str, String)>> = OnceLock::new();

/// Environment of child processes that run members, so that they write what this process was asked to write.
pub fn log_environment() -> &'static [(&'static str, String)] {
    PASSED_ON.get().map_or(&[], Vec::as_slice)
}

impl LogSettings {
    /// Starts to write; the last lines are written when the answer is dropped.
    ///
    /// To be called once in a process, from its main thread, before any other thread is started. Where the system refuses a thread, nothing is
    /// written.
    pub fn start(self) -> Option<Log> {
        let mut wrong = Vec::new();
        let filter = self.filter.or_else(|| of_environment(FILTER_VARIABLE, &mut wrong));
        let format = self.format.or_else(|| of_environment(FORMAT_VARIABLE, &mut wrong));
        if let Some(filter) = &filter {
            let format = format.unwrap_or_default().word().to_owned();
            let passed = vec![(FILTER_VARIABLE, filter.text.clone()), (FORMAT_VARIABLE, format)];
            // A second call keeps what the first has set.
            let _ = PASSED_ON.set(passed);
        }
        let targets = match filter {
            Some(filter) => filter.targets,
            None => DEFAULT_FILTER.parse().unwrap_or_default(),
        };
        let (lines, waiting) = sync_channel(WAITING_LINES);
        let lost = Arc::new(AtomicU64::new(0));
        let log = Log { lines, lost: Arc::clone(&lost) };
        spawn_writer(waiting, lost).ok()?;
        let made = log.clone();
        let layer = match format.unwrap_or_default() {
            LogFormat::Text => {
                let colours = io::stderr().is_terminal();
                layer().with_ansi(colours).log_internal_errors(false).with_writer(made).boxed()
            }
            LogFormat::Json => {
                let json = layer().with_ansi(false).json().flatten_event(true);
                json.log_internal_errors(false).with_writer(made).boxed()
            }
        };
        let lines = tracing_subscriber::registry().with(layer.with_filter(targets));
        let installed = lines.with(refused_certificates::layer()).try_init();
        for message in wrong {
            tracing::error!("{message}");
        }
        installed.is_ok().then_some(log)
    }
}

/// The value of a variable; one that cannot be read is reported, and ends no process.
fn of_environment<T: FromStr<Err = String>>(name: &str, wrong: &mut Vec<String>) -> Option<T> {
    let text = std::env::var_os(name)?;
    match text.to_string_lossy().parse() {
        _ if text.is_empty() => None,
        Ok(value) => Some(value),
        Err(error) => {
            wrong.push(format!("{name} is ignored: {error}"));
            None
        }
    }
}

/// A line, or the wish to know that all lines before it are written.
enum Said {
    Line(Vec<u8>),
    End(SyncSender<()>),
}

/// The lines of this process.
#[derive(Debug, Clone)]
pub struct Log {
    lines: SyncSender<Said>,
    lost: Arc<AtomicU64>,
}

impl Log {
    /// Waits until all lines are written, but not indefinitely: the reader may have stopped to read.
    pub fn finish(self) {
        let (written, end) = sync_channel(1);
        if self.lines.try_send(Said::End(written)).is_ok() {
            // The process ends in any case.
            let _ = end.recv_timeout(END_PATIENCE);
        }
    }
}

/// One event: sent as a whole when it is dropped.
pub struct Line<'a> {
    text: Vec<u8>,
    log: &'a Log,
}

impl Write for Line<'_> {
    fn write(&mut self, part: &[u8]) -> io::Result<usize> {
        self.text.extend_from_slice(part);
        Ok(part.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Line<'_> {
    fn drop(&mut self) {
        let text = std::mem::take(&mut self.text);
        if !text.is_empty() && self.log.lines.try_send(Said::Line(text)).is_err() {
            self.log.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl<'a> MakeWriter<'a> for Log {
    type Writer = Line<'a>;

    fn make_writer(&'a self) -> Line<'a> {
        Line { text: Vec::new(), log: self }
    }
}

/// Starts the writing thread. It takes no signal: those of a member are for its main thread.
fn spawn_writer(waiting: Receiver<Said>, lost: Arc<AtomicU64>) -> io::Result<()> {
    let before = SigSet::all().thread_swap_mask(SigmaskHow::SIG_BLOCK)?;
    let spawned = Builder::new()
        .name("log".into())
        .stack_size(STACK_BYTES)
        .spawn(move || write_all(&waiting, &lost, &mut io::stderr()));
    before.thread_set_mask()?;
    spawned.map(drop)
}

fn write_all(waiting: &Receiver<Said>, lost: &AtomicU64, output: &mut impl Write) {
    for said in waiting {
        // Where standard error is closed, the lines have no reader.
        let _ = match said {
            Said::Line(text) => output.write_all(&text),
            Said::End(written) => {
                let _ = output.flush();
                let _ = written.try_send(());
                Ok(())
            }
        };
        let lost = lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            let _ = writeln!(
                output,
                "{lost} lines of the log are left out: standard error took them too slowly"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_is_levels_and_targets() {
        for text in
            ["trace", "off", "WARN", "understudy=debug", "warn, understudy_bus = trace,zenoh=off"]
        {
            let filter: LogFilter = text.parse().expect(text);
            assert_eq!(filter.text, text);
        }
        for text in [
            "",
            "trce",
            "understudy",
            "understudy=",
            "=debug",
            "understudy=loud",
            "3",
            "info,",
            "[span]",
        ] {
            let error = text.parse::<LogFilter>().expect_err(text);
            assert!(error.contains('`'), "{text}: {error}");
        }
    }

    #[test]
    fn targets_are_prefixes_of_crates() {
        let filter: LogFilter = "understudy=debug".parse().expect("a filter");
        assert!(filter.targets.would_enable("understudy_bus::host", &tracing::Level::DEBUG));
        assert!(!filter.targets.would_enable("understudy_bus::host", &tracing::Level::TRACE));
        assert!(!filter.targets.would_enable("zenoh::net", &tracing::Level::ERROR));
    }

    /// A reader that has stopped makes no writer wait: what has no room is counted, and the number is written.
    #[test]
    fn lines_without_room_are_counted() {
        let (lines, waiting) = sync_channel(2);
        let lost = Arc::new(AtomicU64::new(0));
        let log = Log { lines, lost: Arc::clone(&lost) };
        for number in 0..5 {
            writeln!(log.make_writer(), "line {number}").expect("taken");
        }
        drop(log);
        let mut output = Vec::new();
        write_all(&waiting, &lost, &mut output);
        let said = String::from_utf8(output).expect("text");
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines.len(), 3, "{said}");
        assert_eq!((lines[0], lines[2]), ("line 0", "line 1"));
        assert!(lines[1].starts_with("3 lines of the log are left out"), "{said}");
    }
}
