//! A writer whose lines others can follow.
//!
//! Lines are numbered, so that who follows knows where some are lost. Those that are told at once begin with a line of their own, which says
//! the configuration of the process that tells them: a member may start again with another one while it is followed.
//!
//! ```text
//!   {"lines":{"first":1234,"count":17},"reporter":{"configuration":"0123456789abcdef","version":4}}
//! ```

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};

use serde::{Deserialize, Serialize};
use understudy_wire::{ConfigurationHash, Configurations};

use crate::changes::Changes;
use crate::journal::JOURNAL_VERSION;

/// Lines of the journal that wait for those who follow it, at most; they lose what comes on top.
const WAITING_LINES: usize = 1024;

/// A line without an end is cut here.
const LINE_BYTES: usize = 64 * 1024;

/// Bytes that are told at once, but for the last line.
const GATHERED_BYTES: usize = 64 * 1024;

/// A line of the journal with its number.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Line {
    number: u64,
    pub(crate) text: Vec<u8>,
}

/// The journal's end of the channel: what is written goes to `inner`, and line by line to those who follow.
pub(crate) struct Followed<W> {
    inner: W,
    begun: Vec<u8>,
    count: u64,
    lines: SyncSender<Line>,
}

/// The process that tells lines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reporter {
    /// Hash of its configuration.
    pub configuration: String,
    /// Hash of the configuration that it has loaded for an online change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prepared: Option<String>,
    /// Version of its journal.
    pub version: u32,
}

impl Reporter {
    /// This program with a configuration.
    pub fn with(configuration: ConfigurationHash) -> Self {
        Self::of(Configurations { own: configuration, prepared: None })
    }

    /// This program with the configurations of an online change.
    pub(crate) fn of(Configurations { own, prepared }: Configurations) -> Self {
        let prepared = prepared.map(|prepared| prepared.to_string());
        Self { configuration: own.to_string(), prepared, version: JOURNAL_VERSION }
    }

    /// Whether what it tells is of the signals of a configuration: both of an online change have the same.
    pub fn is_of(&self, configuration: ConfigurationHash) -> bool {
        let hash = configuration.to_string();
        self.configuration == hash || self.prepared.as_ref() == Some(&hash)
    }
}

/// A channel that is not started yet.
pub(crate) struct Telemetry {
    pub(super) lines: Receiver<Line>,
    pub(super) wake: SyncSender<Line>,
    changes: Changes,
    /// Number of the last line that was told.
    told: u64,
    /// A line that did not follow the one before it.
    next: Option<Line>,
}

pub(crate) fn followed<W: Write>(inner: W, changes: Changes) -> (Followed<W>, Telemetry) {
    let (sender, lines) = sync_channel(WAITING_LINES);
    let followed = Followed { inner, begun: Vec::new(), count: 0, lines: sender.clone() };
    (followed, Telemetry { lines, wake: sender, changes, told: 0, next: None })
}

impl<W: Write> Write for Followed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        for piece in bytes[..written].split_inclusive(|&byte| byte == b'\n') {
            self.begun.extend_from_slice(piece);
            if piece.ends_with(b"\n") || self.begun.len() > LINE_BYTES {
                let mut text = std::mem::take(&mut self.begun);
                text.truncate(LINE_BYTES);
                self.count += 1;
                // One that finds no room is missing in the numbers.
                let _ = self.lines.try_send(Line { number: self.count, text });
            }
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl Telemetry {
    /// The lines from `first` on that wait and follow each other, as they are told at once; `note` is shown each of them.
    pub(super) fn gather(&mut self, first: Line, mut note: impl FnMut(&[u8])) -> Vec<u8> {
        let mut batch = Batch { first: first.number, count: 0 };
        let mut text = Vec::new();
        let mut line = Some(first);
        while let Some(next) = line.take() {
            note(&next.text);
            text.extend_from_slice(&next.text);
            batch.count += 1;
            if text.len() >= GATHERED_BYTES {
                break;
            }
            match self.lines.try_recv() {
                Ok(found) if found.number == batch.first + batch.count => line = Some(found),
                Ok(found) => self.next = Some(found),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
            }
        }
        self.told = batch.first.saturating_add(batch.count).saturating_sub(1);
        self.told_at_once(batch, &text)
    }

    /// Lines without numbers, as they are told at once.
    pub(super) fn repeated(&self, text: &[u8]) -> Vec<u8> {
        self.told_at_once(Batch { first: self.told.saturating_add(1), count: 0 }, text)
    }

    fn told_at_once(&self, lines: Batch, text: &[u8]) -> Vec<u8> {
        let head = Head { lines, reporter: Some(Reporter::of(self.changes.configurations())) };
        // Writing to memory does not fail.
        let mut told = serde_json::to_vec(&head).unwrap_or_default();
        told.push(b'\n');
        told.extend_from_slice(text);
        told
    }

    /// The line that did not belong to the ones that were told.
    pub(super) fn take_next(&mut self) -> Option<Line> {
        self.next.take()
    }
}

/// Which lines are told at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Batch {
    first: u64,
    count: u64,
}

/// The line that says which lines follow, and whose they are.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Head {
    pub(crate) lines: Batch,
    /// Nothing where an older version tells them.
    pub(crate) reporter: Option<Reporter>,
}

/// The beginning of a line that says which lines follow.
const BEGINS: &str = "{\"lines\":";

impl Head {
    /// What a line says of those that follow; nothing for a line of the journal.
    pub(crate) fn of_line(line: &str) -> Option<Self> {
        line.starts_with(BEGINS).then(|| serde_json::from_str(line).ok()).flatten()
    }
}

/// Counts the lines that one who follows has lost.
#[derive(Debug, Default)]
pub(crate) struct Gaps {
    next: Option<u64>,
}

impl Gaps {
    /// Takes what comes next; how many lines before it are lost. A journal that begins anew has lost none.
    pub(crate) fn before(&mut self, batch: Batch) -> u64 {
        let next = self.next.replace(batch.first.saturating_add(batch.count));
        next.map_or(0, |next| batch.first.saturating_sub(next))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reporter() -> Reporter {
        Reporter::with(ConfigurationHash::of(b"a cluster"))
    }

    fn changes() -> Changes {
        Changes::none(ConfigurationHash::of(b"a cluster"))
    }

    /// What is told next, without waiting.
    fn told(telemetry: &mut Telemetry) -> Option<String> {
        let first = telemetry.take_next().or_else(|| telemetry.lines.try_recv().ok())?;
        Some(String::from_utf8(telemetry.gather(first, |_| {})).expect("text"))
    }

    #[test]
    fn what_is_written_is_followed_line_by_line_and_never_waited_for() {
        let (mut followed, telemetry) = followed(Vec::new(), changes());
        followed.write_all(b"one\ntw").expect("it is memory");
        followed.write_all(b"o\n").expect("it is memory");
        let lines = telemetry.lines.try_iter().map(|line| (line.number, line.text));
        assert_eq!(lines.collect::<Vec<_>>(), [(1, b"one\n".to_vec()), (2, b"two\n".to_vec())]);
        for _ in 0..WAITING_LINES + 7 {
            followed.write_all(b"more\n").expect("it is memory");
        }
        assert_eq!(telemetry.lines.try_iter().count(), WAITING_LINES);
        followed.write_all(&[b'x'; LINE_BYTES * 2]).expect("it is memory");
        assert_eq!(followed.inner.len(), 8 + 5 * (WAITING_LINES + 7) + LINE_BYTES * 2);
        assert!(followed.begun.len() <= LINE_BYTES);
    }

    /// Whatever finds no room in the queue, or is dropped on its way, is counted before the next line.
    #[test]
    fn who_follows_knows_what_is_lost() {
        let (mut followed, mut telemetry) = followed(Vec::new(), changes());
        let mut gaps = Gaps::default();
        let (mut next, mut lost_in_all, mut taken) = (0, 0, 0);
        for round in 0..60_u32 {
            let mut repeats = round % 4 == 1;
            let many = if round % 7 == 3 { WAITING_LINES + 50 } else { 40 };
            for _ in 0..many {
                followed.write_all(format!("{next}\n").as_bytes()).expect("it is memory");
                next += 1;
            }
            loop {
                let text = match told(&mut telemetry) {
                    Some(text) => text,
                    None if std::mem::take(&mut repeats) => {
                        let text = telemetry.repeated(b"again\n");
                        String::from_utf8(text).expect("text")
                    }
                    None => break,
                };
                // On its way.
                if round % 5 == 2 {
                    continue;
                }
                let (head, lines) = text.split_once('\n').expect("lines");
                let head = Head::of_line(head).expect("a head");
                assert_eq!(head.reporter, Some(reporter()));
                let lost = gaps.before(head.lines);
                let first = if taken == 0 { 0 } else { lost };
                if head.lines.count == 0 {
                    // The lines before a repetition may be lost as well.
                    taken += first;
                }
                for (place, line) in lines.lines().filter(|line| *line != "again").enumerate() {
                    assert!(Head::of_line(line).is_none());
                    let missing = if place == 0 { first } else { 0 };
                    assert_eq!(line, (taken + missing).to_string(), "round {round}");
                    taken += missing + 1;
                }
                lost_in_all += first;
            }
        }
        assert!(lost_in_all > 500, "{lost_in_all}");
    }
}
