//! `journal.jsonl`: every record of a run, one JSON object a line, in the order in which they were seen.
//!
//! Invariant: the journal never stops the run. A full disk or any other failure to write ends the journal, not the cycle; how
//! many records it lacks and why is said in the summary.

use std::fs::File;
use std::io::{self, BufRead, BufWriter, Write};
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use crate::record::Record;

/// Where records go.
#[derive(Debug)]
pub struct Journal<W: Write = BufWriter<File>> {
    writer: Option<W>,
    state: JournalState,
}

/// How a journal fared.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct JournalState {
    /// Records that were written.
    pub records: u64,
    /// Records that were not, because writing had failed.
    pub lost: u64,
    /// Why writing failed; nothing where it did not.
    pub stopped_by: Option<String>,
}

impl Journal {
    /// A journal in a new file.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self::new(BufWriter::with_capacity(
            1 << 16,
            File::create(path)?,
        )))
    }
}

impl<W: Write> Journal<W> {
    /// A journal in any writer.
    pub fn new(writer: W) -> Self {
        Self {
            writer: Some(writer),
            state: JournalState::default(),
        }
    }

    /// Appends a record; never fails.
    pub fn write(&mut self, record: &Record) {
        let Some(writer) = &mut self.writer else {
            self.state.lost += 1;
            return;
        };
        let written = serde_json::to_vec(record)
            .map_err(io::Error::from)
            .and_then(|mut line| {
                line.push(b'\n');
                writer.write_all(&line)
            });
        match written {
            Ok(()) => self.state.records += 1,
            Err(error) => self.stop(&error),
        }
    }

    /// Writes what is buffered, and says how it went.
    pub fn finish(mut self) -> JournalState {
        if let Some(Err(error)) = self.writer.as_mut().map(Write::flush) {
            self.stop(&error);
        }
        self.state
    }

    fn stop(&mut self, error: &io::Error) {
        self.writer = None;
        self.state.lost += 1;
        self.state.stopped_by = Some(error.to_string());
    }
}

/// A line of a journal that is no record.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The text could not be read.
    #[error("the journal cannot be read: {0}")]
    Read(#[from] io::Error),
    /// A line is no record.
    #[error("line {line} is no record: {reason}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Why.
        reason: serde_json::Error,
    },
}

/// The records of a journal, in order.
pub fn records(journal: impl BufRead) -> impl Iterator<Item = Result<Record, JournalError>> {
    journal.lines().enumerate().map(|(index, line)| {
        serde_json::from_str(&line?).map_err(|reason| JournalError::Line {
            line: index + 1,
            reason,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::RunEvent;

    /// A disk with room for so many bytes.
    struct SmallDisk(usize);

    impl Write for SmallDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if bytes.len() > self.0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.0 -= bytes.len();
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_stops_the_journal_and_is_said() {
        let mut journal = Journal::new(SmallDisk(200));
        for at_ns in 0..10 {
            journal.write(&Record::of_run(at_ns, RunEvent::Interrupted));
        }
        let state = journal.finish();
        assert_eq!(state.records + state.lost, 10);
        assert!(state.records > 0 && state.lost > 0);
        assert_eq!(state.stopped_by.as_deref(), Some("no storage space"));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut bytes = Vec::new();
        let record = Record::of_run(7, RunEvent::Finished);
        let mut journal = Journal::new(&mut bytes);
        journal.write(&record);
        assert_eq!(journal.finish().lost, 0);
        let read: Vec<Record> = records(bytes.as_slice())
            .collect::<Result<_, _>>()
            .expect("one record");
        assert_eq!(read, [record]);
    }
}
