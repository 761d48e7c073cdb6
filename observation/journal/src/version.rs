//! The version of a journal: the first record of each of its files says it.
//!
//! ```text
//! {"at_ns":0,"name":"laboratory","member":null,"event":{"event":"journal","version":4}}
//! ```
//!
//! Invariant: no record of another version is read. Journals that were written before they had a version have other events and keys, and
//! count as version 1.

use std::io::{self, BufRead, BufReader, Read as _};
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;
use understudy_bus::JOURNAL_VERSION;

use crate::journal::JournalError;
use crate::packed_file::SegmentFile;
use crate::record::{Record, RunEvent};
use crate::segments::segments_of;

/// Bytes of the first line, at most.
pub(crate) const LONGEST_HEADER: u64 = 4096;

/// A journal that this program does not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the journal has version {found}{}, and this program reads version {JOURNAL_VERSION}: read it with the understudy that wrote it, or repeat the run",
    if *.found == 1 { " (it does not say one)" } else { "" }
)]
pub struct WrongVersion {
    /// The version of the journal.
    pub found: u32,
}

/// The first line: a record of any version has a time.
#[derive(Deserialize)]
struct First {
    #[serde(rename = "at_ns")]
    _at_ns: u64,
    #[serde(default)]
    event: Value,
}

#[derive(Deserialize)]
struct Header {
    event: String,
    version: u32,
    /// Since version 3.
    segment: Option<u64>,
}

/// The line that each file of a journal begins with. Its time is 0: it belongs to the file and to no moment of the run. `segment` is the number
/// that the file has when it is closed.
pub fn journal_header(segment: u64) -> Vec<u8> {
    let version = JOURNAL_VERSION;
    let segment = Some(segment);
    let record = Record::of_run(0, RunEvent::Journal { version, segment });
    let mut line = serde_json::to_vec(&record).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Checks the first line of a file of a journal; the number of the segment, where it says one.
///
/// # Errors
/// [`JournalError::Line`] where it is not a record of any version, [`JournalError::Version`] where it is one of another version.
pub fn check_header(line: &[u8]) -> Result<Option<u64>, JournalError> {
    let first: First =
        serde_json::from_slice(line).map_err(|reason| JournalError::Line { line: 1, reason })?;
    let header = Header::deserialize(first.event).ok();
    let header = header.filter(|header| header.event == "journal");
    let found = header.as_ref().map_or(1, |header| header.version);
    check_version(found)?;
    Ok(header.and_then(|header| header.segment))
}

/// Whether the records of a member that says its version can be taken: only those of this one.
///
/// # Errors
/// [`WrongVersion`].
pub fn check_version(found: u32) -> Result<(), WrongVersion> {
    if found == JOURNAL_VERSION { Ok(()) } else { Err(WrongVersion { found }) }
}

/// Whether a journal can be read, by its oldest and its newest segment; readers check each one. A file that is empty yet says nothing.
///
/// # Errors
/// [`JournalError`].
pub fn check_journal(path: &Path) -> Result<(), JournalError> {
    let segments = segments_of(path)?;
    let newest = segments.last().filter(|_| segments.len() > 1);
    for segment in segments.first().into_iter().chain(newest) {
        let file = match SegmentFile::open(segment) {
            // The oldest segment may go at any time.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            file => file?,
        };
        let mut line = Vec::new();
        BufReader::new(file.take(LONGEST_HEADER)).read_until(b'\n', &mut line)?;
        if line.ends_with(b"\n") {
            check_header(&line)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_version_is_read() {
        let check = |line: &str, expected: Result<Option<u64>, Option<u32>>| {
            let checked = check_header(line.as_bytes()).map_err(|error| match error {
                JournalError::Version(wrong) => Some(wrong.found),
                _ => None,
            });
            assert_eq!(checked, expected, "{line}");
        };
        let header = String::from_utf8(journal_header(7)).expect("text");
        check(&header, Ok(Some(7)));
        let of = |version: u32| header.replace(":4,\"segment\":7}", &format!(":{version}}}"));
        check(&of(4), Ok(None));
        for other in [2, 3, 5] {
            check(&of(other), Err(Some(other)));
        }
        check(
            r#"{"at_ns":1,"name":"laboratory","party":null,"event":{"event":"started","party":{"station":0}}}"#,
            Err(Some(1)),
        );
        check("{\"at_ns\":1}", Err(Some(1)));
        check("", Err(None));
        check("{\"at_ns\"", Err(None));
    }
}
