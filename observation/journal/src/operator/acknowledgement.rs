//! An alarm that somebody has seen, as the journal keeps it.

use std::fs::OpenOptions;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::clock::monotonic_ns;
use crate::record::{Record, RunEvent};
use crate::version::check_journal;
use crate::writer::WriterLock;

/// Which alarm, and who has seen it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Acknowledgement {
    /// Of whom the alarm is.
    pub name: String,
    /// What it is, in one word, such as `value-fault`.
    pub alarm: String,
    /// The time of the record that raised it.
    pub raised_ns: u64,
    /// The cycle of the run in which it was raised.
    pub cycle: i64,
    /// Who has seen it.
    pub owner: String,
    /// When, in seconds since 1970-01-01 UTC.
    pub at_unix_s: u64,
}

/// Writes it at the end of a journal that nobody writes any more. False where somebody writes it now.
pub(super) fn append(run: &Path, acknowledgement: &Acknowledgement) -> io::Result<bool> {
    let Some(_lock) = WriterLock::take(run)? else {
        return Ok(false);
    };
    let path = run.join("journal.jsonl");
    check_journal(&path).map_err(io::Error::other)?;
    let mut journal = OpenOptions::new().read(true).append(true).open(path)?;
    let event = RunEvent::Acknowledged(acknowledgement.clone());
    let mut line = serde_json::to_vec(&Record::of_run(monotonic_ns(), event))?;
    line.push(b'\n');
    // The last line has no end where its writer was killed.
    let mut last = [b'\n'];
    if journal.seek(SeekFrom::End(0))? > 0 {
        journal.seek(SeekFrom::End(-1))?;
        journal.read_exact(&mut last)?;
    }
    if last != [b'\n'] {
        line.insert(0, b'\n');
    }
    journal.write_all(&line)?;
    Ok(true)
}
