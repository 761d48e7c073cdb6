//! `journal.jsonl`: every record of a run, one JSON object a line, in the order in which they were seen.
//!
//! It is kept in segments ([`Segments`]), of which those that are closed are packed, and the oldest go when it reaches its limit.
//!
//! Invariant: the journal never stops the run. A full disk or any other failure to write ends the journal, not the cycle; how
//! many records it lacks and why is said in the summary.

use std::io::{self, BufRead, BufReader, Write};
use std::iter;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use crate::continuation::Followed;
use crate::record::Record;
use crate::segments::{OpenSegments, Segments};
use crate::version::{WrongVersion, check_header, journal_header};

/// Where records go.
#[derive(Debug)]
pub struct Journal<W: Write = Segments> {
    writer: Option<W>,
    /// Bytes of a continuation that the next line is to be written after, at most; 0 within a segment.
    room: fn(&W) -> u64,
    followed: Followed,
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
    /// A journal in a new file, of `limit_bytes` at most: the oldest records go when it is full.
    pub fn create(path: &Path, limit_bytes: u64) -> io::Result<Self> {
        let mut journal = Segments::create(path, limit_bytes).map(Self::of_headed)?;
        journal.room = Segments::room_to_continue;
        Ok(journal)
    }
}

impl<W: Write> Journal<W> {
    /// A journal in any writer.
    pub fn new(mut writer: W) -> Self {
        let headed = writer.write_all(&journal_header(1));
        let mut journal = Self::of_headed(writer);
        if let Err(error) = headed {
            journal.stop(&error);
        }
        journal
    }

    /// A journal in a writer that writes the header itself.
    fn of_headed(writer: W) -> Self {
        Self {
            writer: Some(writer),
            room: |_| 0,
            followed: Followed::default(),
            state: JournalState::default(),
        }
    }

    /// Appends a record; never fails.
    pub fn write(&mut self, record: &Record) {
        let Some(writer) = &mut self.writer else {
            self.state.lost += 1;
            return;
        };
        let continued = match (self.room)(writer) {
            0 => Ok(()),
            room => write_continuation(writer, &self.followed, record.at_ns, room),
        };
        match continued.and_then(|()| write_line(writer, record)) {
            Ok(bytes) => {
                self.state.records += 1;
                // It is none of the records of the run.
                if let Some(checkpoint) = self.followed.after(record, bytes)
                    && let Err(error) = write_line(writer, &checkpoint)
                {
                    self.writer = None;
                    self.state.stopped_by = Some(error.to_string());
                }
            }
            Err(error) => self.stop(&error),
        }
    }

    /// Writes what is buffered.
    pub fn flush(&mut self) {
        if let Some(Err(error)) = self.writer.as_mut().map(Write::flush) {
            self.stop(&error);
        }
    }

    /// Writes what is buffered, and says how it went.
    pub fn finish(mut self) -> JournalState {
        self.flush();
        self.state
    }

    fn stop(&mut self, error: &io::Error) {
        self.writer = None;
        self.state.lost += 1;
        self.state.stopped_by = Some(error.to_string());
    }
}

/// What a segment begins with that goes on after others; nothing where it does not fit into the room for it.
fn write_continuation(
    writer: &mut impl Write,
    followed: &Followed,
    at_ns: u64,
    room: u64,
) -> io::Result<()> {
    let mut lines = Vec::new();
    for record in followed.continuation(at_ns) {
        write_line(&mut lines, &record)?;
    }
    if lines.len() as u64 <= room {
        writer.write_all(&lines)?;
    }
    Ok(())
}

/// The number of bytes.
fn write_line(writer: &mut impl Write, record: &Record) -> io::Result<usize> {
    let mut line = serde_json::to_vec(record)?;
    line.push(b'\n');
    writer.write_all(&line)?;
    Ok(line.len())
}

/// A line of a journal that is no record.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The text could not be read.
    #[error("the journal cannot be read: {0}")]
    Read(#[from] io::Error),
    /// It is of another version.
    #[error(transparent)]
    Version(#[from] WrongVersion),
    /// A line is no record.
    #[error("line {line} is no record: {reason}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Why.
        reason: serde_json::Error,
    },
}

/// Bytes of a journal, its older segments included, where nobody says otherwise.
pub const JOURNAL_LIMIT_BYTES: u64 = 1 << 30;

/// The records of a journal in a file and its older segments, in order. A segment that cannot be opened is an error among them. The last line of
/// a closed segment may be cut, where its writer was killed, and is left out.
///
/// # Errors
/// Where the folder cannot be read.
pub fn records_of(
    path: &Path,
) -> io::Result<impl Iterator<Item = Result<Record, JournalError>> + use<>> {
    Ok(OpenSegments::of(path)?.flat_map(|opened| {
        let (is_closed, file, error) = match opened {
            Ok((is_closed, file)) => (is_closed, Some(file), None),
            Err(error) => (false, None, Some(Err(error.into()))),
        };
        let mut found = file.into_iter().map(BufReader::new).flat_map(records).peekable();
        let whole = iter::from_fn(move || {
            let next = found.next()?;
            let is_cut = matches!(next, Err(JournalError::Line { line, .. }) if line > 1);
            (!is_cut || !is_closed || found.peek().is_some()).then_some(next)
        });
        whole.chain(error)
    }))
}

/// The records of one file of a journal after its header, in order. A file of another version has none: the only item is the error.
pub fn records(journal: impl BufRead) -> impl Iterator<Item = Result<Record, JournalError>> {
    let mut refused = false;
    journal.lines().enumerate().filter_map(move |(index, line)| {
        if refused {
            return None;
        }
        let line = match line {
            Ok(line) => line,
            Err(error) => return Some(Err(error.into())),
        };
        if index == 0 {
            let wrong = check_header(line.as_bytes()).err();
            refused = matches!(wrong, Some(JournalError::Version(_)));
            return wrong.map(Err);
        }
        let record = serde_json::from_str(&line);
        Some(record.map_err(|reason| JournalError::Line { line: index + 1, reason }))
    })
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

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
    fn a_journal_of_another_version_is_refused_once() {
        let record = "{\"at_ns\":7,\"name\":\"laboratory\",\"member\":null,\"event\":{\"event\":\"finished\"}}\n";
        let read: Vec<_> = records(record.repeat(3).as_bytes()).collect();
        assert!(matches!(read.as_slice(), [Err(JournalError::Version(WrongVersion { found: 1 }))]));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut bytes = Vec::new();
        let record = Record::of_run(7, RunEvent::Finished);
        let mut journal = Journal::new(&mut bytes);
        journal.write(&record);
        assert_eq!(journal.finish().lost, 0);
        let read: Vec<Record> =
            records(bytes.as_slice()).collect::<Result<_, _>>().expect("one record");
        assert_eq!(read, [record]);
    }

    #[test]
    fn readers_follow_the_segments() {
        let folder = Folder::new("journal");
        let path = folder.join("journal.jsonl");
        let mut journal = Journal::create(&path, 0).expect("created");
        for at_ns in 0..5000_u64 {
            // What cannot be packed, so that the limit is reached.
            let verdict = format!("{:x}", at_ns.wrapping_mul(0x9e37_79b9_7f4a_7c15)).repeat(2);
            journal.write(&Record::of_run(at_ns, RunEvent::ScenarioOver { verdict }));
        }
        assert_eq!(journal.finish().lost, 0);
        let read: Vec<Record> =
            records_of(&path).expect("readable").collect::<Result<_, _>>().expect("whole lines");
        let times: Vec<u64> = read.iter().map(|record| record.at_ns).collect();
        let first = 5000 - times.len() as u64;
        assert!(first > 0 && times.len() > 100, "{}", times.len());
        assert_eq!(times, (first..5000).collect::<Vec<_>>());
    }
}
