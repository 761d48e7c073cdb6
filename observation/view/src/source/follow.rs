//! Follows a journal through its segments.
//!
//! ```text
//!   journal.000007.packed ─► journal.000008.jsonl ─► … ─► journal.jsonl ─(closed as the next number)─► journal.jsonl
//! ```
//!
//! A file that is open stays readable when it is renamed, packed or removed, so nothing of it is lost once it has been opened. Which file
//! follows is told by the number that ours gets when it is closed; its header says it.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use understudy_journal::{Place, Record, SegmentFile, check_header, closed_segments};

use super::Trouble;
use super::progress::Progress;

/// Bytes read in one go, and so the work of one call.
const PIECE: usize = 1 << 20;

/// A line without an end is left out when it has so many bytes.
const LONGEST_LINE: usize = 1 << 20;

#[derive(Debug)]
pub(super) struct Follower {
    path: PathBuf,
    open: Option<Open>,
    /// The beginning of a line whose end is not written yet.
    line: Vec<u8>,
    /// The rest of a line that is too long is skipped.
    skipping: bool,
    piece: Vec<u8>,
    failure: Option<Trouble>,
    /// Bytes read so far, of all segments.
    read: u64,
    listed: Listed,
    progress: Progress,
    /// A member has reported since the end of the journal was reached.
    reports: bool,
}

/// The closed segments after the open one, as they were listed last. A folder can have thousands, so it is listed again only when they are read.
#[derive(Debug, Default)]
struct Listed {
    /// By number, with the bytes of the text; these do not change.
    segments: BTreeMap<u64, (PathBuf, u64)>,
    bytes: u64,
}

impl Listed {
    /// Drops the segments up to the one with this number.
    fn pass(&mut self, number: u64) {
        while let Some(first) = self.segments.first_entry()
            && *first.key() <= number
        {
            self.bytes -= first.remove().1;
        }
    }

    /// Takes a new listing of the segments.
    fn replace<'c>(&mut self, closed: impl Iterator<Item = &'c (u64, PathBuf)>) {
        let mut known = std::mem::take(&mut self.segments);
        for (number, path) in closed {
            let segment = known.remove(number).or_else(|| {
                let length = SegmentFile::open(path).and_then(|file| file.text_bytes());
                // One that is gone is not ahead.
                Some((path.clone(), length.ok()?))
            });
            self.segments.extend(segment.map(|segment| (*number, segment)));
        }
        self.bytes = self.segments.values().map(|(_, bytes)| bytes).sum();
    }
}

#[derive(Debug)]
struct Open {
    file: SegmentFile,
    /// Where it is closed already.
    number: Option<u64>,
    /// The number that its header says.
    promised: Option<u64>,
    /// Bytes read of it.
    read: u64,
    header: Header,
}

/// What is known of the first line of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Header {
    Unread,
    Accepted,
    /// The file is of another version, and its lines are left out.
    Refused,
}

impl Open {
    /// The number that it got when it was closed; nothing while it is written, and when it is gone.
    fn number_among(&self, closed: &[(u64, PathBuf)]) -> Option<u64> {
        self.number.or(self.promised).or_else(|| {
            let ours = |path: &Path| {
                fs::metadata(path).is_ok_and(|found| found.ino() == self.file.inode())
            };
            let found = closed.iter().find(|(_, path)| ours(path));
            found.map(|(number, _)| *number)
        })
    }
}

impl Follower {
    pub(super) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            open: None,
            line: Vec::new(),
            skipping: false,
            piece: vec![0; PIECE],
            failure: None,
            read: 0,
            listed: Listed::default(),
            progress: Progress::default(),
            reports: false,
        }
    }

    /// Begins at a place in the middle.
    pub(super) fn from_place(path: &Path, place: Place) -> io::Result<Self> {
        let mut follower = Self::new(path);
        let mut file = place.file;
        let read = file.go_to(place.piece)?;
        follower.open = Some(Open {
            file,
            number: place.promised.filter(|_| place.is_closed),
            promised: place.promised,
            read,
            header: match place.piece {
                0 => Header::Unread,
                _ => Header::Accepted,
            },
        });
        follower.read = read;
        Ok(follower)
    }

    pub(super) fn progress(&self) -> Progress {
        self.progress
    }

    pub(super) fn failure(&self) -> Option<Trouble> {
        self.failure.clone()
    }

    #[allow(
        clippy::disallowed_methods,
        reason = "whether a file was read to its end lately is a matter of the clock"
    )]
    pub(super) fn poll(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> usize {
        let began = Instant::now();
        // What is written from now on is for the next poll.
        let end = self.ahead().map(|ahead| self.read + ahead);
        let mut reports = false;
        let polled = self.try_poll(&mut |found| {
            reports |= found.as_ref().is_ok_and(|record| record.member.is_some());
            take(found);
        });
        match end.and_then(|end| Ok((end, polled?))) {
            Ok((end, taken)) => {
                self.failure = None;
                let ahead = end.saturating_sub(self.read);
                self.progress.polled(began, self.read, ahead);
                self.reports |= reports;
                if ahead == 0 && (self.reports || self.progress.reported.is_none()) {
                    self.reports = false;
                    self.progress.reported = self.age().and_then(|age| began.checked_sub(age));
                }
                taken
            }
            Err(error) => {
                self.failure =
                    Some(Trouble::Read { path: self.path.clone(), reason: error.to_string() });
                0
            }
        }
    }

    /// Bytes of the journal that have not been read.
    fn ahead(&mut self) -> io::Result<u64> {
        let mut ahead = 0;
        if let Some(open) = &self.open {
            ahead = open.file.text_bytes()?.saturating_sub(open.read);
            if !self.is_closed()? {
                return Ok(ahead);
            }
        }
        if let Some(number) = self.open.as_ref().and_then(|open| open.number) {
            self.listed.pass(number);
        }
        if self.listed.segments.is_empty() {
            let closed = match closed_segments(&self.path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound && self.open.is_none() => {
                    return Ok(0);
                }
                closed => closed?,
            };
            let own = self.open.as_ref();
            let own = own.and_then(|open| open.number_among(&closed));
            self.listed.replace(closed.iter().filter(|(number, _)| Some(*number) > own));
        }
        let newest = SegmentFile::open(&self.path).and_then(|file| file.text_bytes());
        Ok(ahead + self.listed.bytes + newest.unwrap_or(0))
    }

    /// For how long the open file has not been written to.
    #[allow(
        clippy::disallowed_methods,
        reason = "the system says when a file was written by the calendar"
    )]
    fn age(&self) -> Option<Duration> {
        let written = self.open.as_ref()?.file.modified().ok()?;
        // A clock that was set back makes no age.
        Some(SystemTime::now().duration_since(written).unwrap_or_default())
    }

    fn try_poll(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> io::Result<usize> {
        if self.open.is_none() && !self.open_first(take)? {
            return Ok(0);
        }
        // Until there is something, or nothing follows.
        loop {
            let mut taken = self.read(take)?;
            if taken > 0 || !self.is_closed()? {
                return Ok(taken);
            }
            // It may have been written to after it was read and before it was closed.
            taken = self.read(take)?;
            if taken > 0 {
                return Ok(taken);
            }
            let opened = self.open_next(take, &mut taken)?;
            if taken > 0 || !opened {
                return Ok(taken);
            }
        }
    }

    /// The oldest segment that there is.
    fn open_first(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> io::Result<bool> {
        let closed = match closed_segments(&self.path) {
            Ok(closed) => closed,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(error),
        };
        let first = closed.into_iter().next();
        if first.as_ref().is_some_and(|(number, _)| *number > 1) {
            take(Err(Trouble::Gone { count: None }));
        }
        match first {
            Some((number, path)) => self.open(&path, Some(number)),
            None => {
                let path = self.path.clone();
                self.open(&path, None)
            }
        }
    }

    /// False where it is not there (any more).
    fn open(&mut self, path: &Path, number: Option<u64>) -> io::Result<bool> {
        match SegmentFile::open(path) {
            Ok(file) => {
                self.open =
                    Some(Open { file, number, promised: None, read: 0, header: Header::Unread });
                Ok(true)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Whether the file that is open will not be written to any more.
    fn is_closed(&self) -> io::Result<bool> {
        let Some(open) = &self.open else {
            return Ok(false);
        };
        if open.number.is_some() {
            return Ok(true);
        }
        match fs::metadata(&self.path) {
            Ok(metadata) => Ok(metadata.ino() != open.file.inode()),
            // Closed, and the next one is not made yet.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
            Err(error) => Err(error),
        }
    }

    /// Opens what follows the file that is open. False where it is not there yet.
    fn open_next(
        &mut self,
        take: &mut dyn FnMut(Result<Record, Trouble>),
        taken: &mut usize,
    ) -> io::Result<bool> {
        let Some(open) = &self.open else {
            return Ok(false);
        };
        let number = open.number;
        if !self.line.is_empty() || self.skipping {
            // Its writer was killed within a line.
            (self.line, self.skipping) = (Vec::new(), false);
            let reason = "it has no end".to_owned();
            take(Err(Trouble::Line { reason }));
            *taken += 1;
        }
        // Where it is gone, the others are listed.
        if let Some(next) = number.and_then(|number| number.checked_add(1))
            && let Some((path, _)) = self.listed.segments.get(&next).cloned()
            && self.open(&path, Some(next))?
        {
            return Ok(true);
        }
        let Some(open) = &self.open else {
            return Ok(false);
        };
        let closed = closed_segments(&self.path)?;
        let number = open.number_among(&closed);
        let next = match number {
            Some(number) => closed.iter().find(|(other, _)| *other > number),
            // Ours is gone already: all that is left follows it.
            None => closed.first(),
        };
        self.listed.replace(closed.iter().filter(|(other, _)| Some(*other) > number));
        let gap = match (number, next) {
            (Some(number), Some((next, _))) => *next > number + 1,
            (None, _) => true,
            (Some(_), None) => false,
        };
        if gap {
            take(Err(Trouble::Gone { count: None }));
            *taken += 1;
        }
        match next.cloned() {
            Some((number, path)) => self.open(&path, Some(number)),
            None => {
                if let (Some(open), Some(number)) = (&mut self.open, number) {
                    open.number = Some(number);
                }
                let path = self.path.clone();
                if !self.open(&path, None)? {
                    return Ok(false);
                }
                // It may have been closed since it was listed: then the file is the one after what follows.
                let closed = closed_segments(&self.path)?;
                let follows = |(other, _): &&(u64, PathBuf)| number.is_some_and(|own| *other > own);
                match closed.iter().find(follows).cloned() {
                    Some((number, path)) => self.open(&path, Some(number)),
                    None => Ok(true),
                }
            }
        }
    }

    /// The records of the next piece that has one.
    fn read(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> io::Result<usize> {
        loop {
            let (length, taken) = self.read_piece(take)?;
            if taken > 0 || length == 0 {
                return Ok(taken);
            }
        }
    }

    /// How many bytes, and how many records and troubles they came to.
    fn read_piece(
        &mut self,
        take: &mut dyn FnMut(Result<Record, Trouble>),
    ) -> io::Result<(usize, usize)> {
        let Some(open) = &mut self.open else {
            return Ok((0, 0));
        };
        let length = open.file.read(&mut self.piece)?;
        open.read += length as u64;
        self.read += length as u64;
        let mut taken = 0;
        for part in self.piece[..length].split_inclusive(|byte| *byte == b'\n') {
            let ends = part.last() == Some(&b'\n');
            if !self.skipping {
                self.line.extend_from_slice(part);
            }
            if self.line.len() > LONGEST_LINE {
                self.skipping = true;
                self.line.clear();
                let reason = format!("it is longer than {LONGEST_LINE} bytes");
                take(Err(Trouble::Line { reason }));
                taken += 1;
            }
            if !ends {
                continue;
            }
            if !std::mem::take(&mut self.skipping) && self.line.len() > 1 {
                if open.header != Header::Accepted {
                    if open.header == Header::Unread {
                        open.header = Header::Accepted;
                        match check_header(&self.line) {
                            Ok(promised) => open.promised = promised,
                            Err(error) => {
                                open.header = Header::Refused;
                                take(Err(error.into()));
                                taken += 1;
                            }
                        }
                    }
                    self.line.clear();
                    continue;
                }
                take(serde_json::from_slice(&self.line).map_err(Trouble::of_line));
                taken += 1;
            }
            self.line.clear();
        }
        Ok((length, taken))
    }
}

#[cfg(test)]
mod tests;
