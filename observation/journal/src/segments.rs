//! A file that never grows past its limit: segments, of which the oldest go.
//!
//! ```text
//!   journal.000007.packed  …  journal.000031.packed  journal.000032.jsonl  journal.jsonl
//!   └ the oldest that is left                        └ to be packed        └ written now, as text
//! ```
//!
//! Each segment begins with the header that says the version of the journal and the segment's number. A thread of its own packs those
//! that are closed, so the writer waits for none of it.
//!
//! Invariant: all segments together have at most the limit, but for the line that is being written and the segment that is being packed; no
//! line is lost or read twice, wherever the writer is killed: a segment that is there as text and packed is the same.

use std::collections::VecDeque;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;

use crate::packed_file::{PACKED, SegmentFile, pack_file};
use crate::version::{check_header, journal_header};

/// Segments of one file at least, the one that is written now included.
const SEGMENTS: u64 = 8;

/// Text of a segment at most: what a reader reads to its end before it knows the present.
const SEGMENT_BYTES: u64 = 8 << 20;

/// The least limit that makes sense: some records in each segment.
const LEAST_LIMIT: u64 = 64 * 1024;

/// Stack of the thread that packs. In a member all of it is locked into memory.
const STACK_BYTES: usize = 1 << 20;

/// Writes lines to segments.
#[derive(Debug)]
pub struct Segments {
    path: PathBuf,
    limit_bytes: u64,
    segment_bytes: u64,
    writer: BufWriter<File>,
    written: u64,
    at_line_start: bool,
    /// The number of the segment that is written now.
    number: u64,
    packer: Packer,
}

impl Segments {
    /// Starts to write at `path`, with `limit_bytes` in all. What lies there already becomes the newest closed segment.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(path: &Path, limit_bytes: u64) -> io::Result<Self> {
        let limit_bytes = limit_bytes.max(LEAST_LIMIT);
        let packer = Packer::start()?;
        let closed = closed(path)?;
        let mut number = closed.last().map_or(0, |(number, _)| *number) + 1;
        for (_, left) in closed {
            packer.pack(left);
        }
        if path.exists() {
            // The number that it was promised: readers know it by that.
            number = number_in(path)?.unwrap_or(0).max(number);
            let closed = closed_path(path, number);
            fs::rename(path, &closed)?;
            packer.pack(closed);
            number += 1;
        }
        let (writer, written) = open(path, number)?;
        let segments = Self {
            path: path.to_owned(),
            limit_bytes,
            segment_bytes: (limit_bytes / SEGMENTS).min(SEGMENT_BYTES),
            writer,
            written,
            at_line_start: true,
            number,
            packer,
        };
        segments.remove_oldest()?;
        Ok(segments)
    }

    /// Whether the next line begins a new segment.
    fn is_full(&self) -> bool {
        self.at_line_start && self.written >= self.segment_bytes
    }

    /// Bytes of what the next segment begins with before its first line, at most; 0 where the next line goes into this segment.
    pub(crate) fn room_to_continue(&self) -> u64 {
        if self.is_full() { self.segment_bytes / 4 } else { 0 }
    }

    fn rotate(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        let closed = closed_path(&self.path, self.number);
        fs::rename(&self.path, &closed)?;
        self.number += 1;
        self.remove_oldest()?;
        (self.writer, self.written) = open(&self.path, self.number)?;
        self.packer.pack(closed);
        Ok(())
    }

    /// Removes the oldest segments until there is room for the one that begins.
    fn remove_oldest(&self) -> io::Result<()> {
        let closed = closed(&self.path)?;
        let sizes: Vec<u64> = closed.iter().map(|(_, path)| size_of(path)).collect();
        let mut all = sizes.iter().sum::<u64>() + self.segment_bytes;
        for ((_, path), size) in closed.iter().zip(sizes) {
            if all <= self.limit_bytes {
                break;
            }
            all -= size;
            // Its packer may have packed it since.
            for path in [path, &path.with_extension(PACKED)] {
                match fs::remove_file(path) {
                    Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

/// Bytes of a closed segment, as text or packed since; 0 where it is gone.
fn size_of(path: &Path) -> u64 {
    let packed = || fs::metadata(path.with_extension(PACKED));
    fs::metadata(path).or_else(|_| packed()).map_or(0, |found| found.len())
}

/// Packs closed segments in a thread of its own; one that cannot be packed stays as it is.
#[derive(Debug)]
struct Packer {
    closed: Option<Sender<PathBuf>>,
    thread: Option<JoinHandle<()>>,
}

impl Packer {
    fn start() -> io::Result<Self> {
        let (closed, to_pack) = channel::<PathBuf>();
        let pack_all = move || to_pack.iter().for_each(|text| pack(&text));
        let thread = std::thread::Builder::new()
            .name("packer".into())
            .stack_size(STACK_BYTES)
            .spawn(pack_all)?;
        Ok(Self { closed: Some(closed), thread: Some(thread) })
    }

    fn pack(&self, text: PathBuf) {
        if let Some(closed) = &self.closed {
            let _ = closed.send(text);
        }
    }
}

/// Packs a closed segment in place of its text.
fn pack(text: &Path) {
    let packed = text.with_extension(PACKED);
    if text == packed || !(packed.exists() || pack_file(text, &packed).is_ok()) {
        return;
    }
    if text.exists() {
        // Where it stays, readers take the packed one.
        let _ = fs::remove_file(text);
    } else {
        // It was removed as the oldest while it was packed. Whoever removes it after this look removes both.
        let _ = fs::remove_file(packed);
    }
}

impl Drop for Packer {
    /// Waits for what is to be packed: a segment takes some tenths of a second.
    fn drop(&mut self) {
        self.closed = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Write for Segments {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_full() {
            self.rotate()?;
        }
        // To the end of a line at most, so that the next one may go to the next segment.
        let line = bytes.iter().position(|byte| *byte == b'\n');
        let length = line.map_or(bytes.len(), |end| end + 1);
        let taken = self.writer.write(&bytes[..length])?;
        self.written += taken as u64;
        self.at_line_start = taken > 0 && bytes[taken - 1] == b'\n';
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// The files that `path` and its closed segments are, oldest first.
///
/// # Errors
/// What the system says of the folder.
pub fn segments_of(path: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = closed(path)?.into_iter().map(|(_, path)| path).collect();
    if path.exists() {
        files.push(path.to_owned());
    }
    Ok(files)
}

/// The segments of a journal, opened one after the other, oldest first.
///
/// A segment that is packed or closed between its listing and its opening is read as what it has become, and one that is removed as the oldest is
/// left out: so each line is read once, also of a journal that is written meanwhile.
#[derive(Debug)]
pub(crate) struct OpenSegments {
    path: PathBuf,
    listed: VecDeque<(u64, PathBuf)>,
    /// Number of the last one that was opened.
    last: Option<u64>,
    is_over: bool,
}

impl OpenSegments {
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let listed = closed(path)?.into();
        Ok(Self { path: path.to_owned(), listed, last: None, is_over: false })
    }

    /// Whether there are closed segments that were not opened.
    fn list_again(&mut self) -> io::Result<bool> {
        let last = self.last;
        self.listed = closed(&self.path)?.into();
        self.listed.retain(|(number, _)| Some(*number) > last);
        Ok(!self.listed.is_empty())
    }

    /// The segment, and whether it is closed.
    fn open_next(&mut self) -> io::Result<Option<(bool, SegmentFile)>> {
        loop {
            while let Some((number, path)) = self.listed.pop_front() {
                self.last = Some(number);
                if let Some(file) = found(SegmentFile::open(&path))? {
                    return Ok(Some((true, file)));
                }
            }
            if self.list_again()? {
                continue;
            }
            let file = found(SegmentFile::open(&self.path));
            self.is_over = file.is_err();
            let file = file?;
            // It may have been closed since, and the file is the one after it.
            if !self.list_again()? {
                self.is_over = true;
                return Ok(file.map(|file| (false, file)));
            }
        }
    }
}

impl Iterator for OpenSegments {
    type Item = io::Result<(bool, SegmentFile)>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over { None } else { self.open_next().transpose() }
    }
}

/// Nothing where there is no file (any more).
pub(crate) fn found<T>(opened: io::Result<T>) -> io::Result<Option<T>> {
    match opened {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// A new file with its header, and the bytes of it.
fn open(path: &Path, number: u64) -> io::Result<(BufWriter<File>, u64)> {
    let file = OpenOptions::new().create(true).write(true).truncate(true).open(path)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let header = journal_header(number);
    writer.write_all(&header)?;
    Ok((writer, header.len() as u64))
}

/// The number that the header of a segment says.
fn number_in(path: &Path) -> io::Result<Option<u64>> {
    let mut line = Vec::new();
    BufReader::new(SegmentFile::open(path)?).read_until(b'\n', &mut line)?;
    Ok(check_header(&line).ok().flatten())
}

/// `journal.jsonl` and 7 become `journal.000007.jsonl`.
fn closed_path(path: &Path, number: u64) -> PathBuf {
    let (stem, extension) = parts(path);
    path.with_file_name(format!("{stem}.{number:06}.{extension}"))
}

fn parts(path: &Path) -> (String, String) {
    let part = |part: Option<&std::ffi::OsStr>| {
        part.map_or_else(String::new, |part| part.to_string_lossy().into_owned())
    };
    (part(path.file_stem()), part(path.extension()))
}

/// The closed segments of `path` with their numbers, oldest first: what was written before the file that is written now.
///
/// # Errors
/// What the system says of the folder.
pub fn closed_segments(path: &Path) -> io::Result<Vec<(u64, PathBuf)>> {
    closed(path)
}

fn closed(path: &Path) -> io::Result<Vec<(u64, PathBuf)>> {
    let (stem, extension) = parts(path);
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let rest = name.strip_prefix(&format!("{stem}."));
        let number: Option<u64> = rest
            .and_then(|rest| {
                rest.strip_suffix(&format!(".{extension}"))
                    .or(rest.strip_suffix(&format!(".{PACKED}")))
            })
            .filter(|number| number.len() >= 6)
            .and_then(|number| number.parse().ok());
        if let Some(number) = number {
            found.push((number, entry.path()));
        }
    }
    // Where the writer was killed between both, a segment is there as text and packed.
    let is_text = |path: &Path| path.extension().is_none_or(|extension| extension != PACKED);
    found.sort_by(|(one, path), (other, of_other)| {
        one.cmp(other).then(is_text(path).cmp(&is_text(of_other)))
    });
    found.dedup_by_key(|(number, _)| *number);
    Ok(found)
}

#[cfg(test)]
mod tests;
