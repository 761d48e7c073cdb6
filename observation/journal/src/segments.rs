//! A file that never grows past its limit: a ring of segments, of which the oldest go.
//!
//! ```text
//!   journal.000007.jsonl  journal.000008.jsonl  …  journal.jsonl
//!   └ the oldest that is left                      └ written now
//! ```
//!
//! Each segment begins with the header that says the version of the journal.
//!
//! Invariant: all segments together have at most the limit, but for the line that is being written; no line is in two segments.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::version::journal_header;

/// Segments of one file, the one that is written now included.
const SEGMENTS: u64 = 8;

/// The least limit that makes sense: some records in each segment.
const LEAST_LIMIT: u64 = 64 * 1024;

/// Writes lines to segments.
#[derive(Debug)]
pub struct Segments {
    path: PathBuf,
    segment_bytes: u64,
    writer: BufWriter<File>,
    written: u64,
    at_line_start: bool,
    /// The number of the next segment that is closed.
    next: u64,
}

impl Segments {
    /// Starts to write at `path`, with `limit_bytes` in all. What lies there already becomes the newest closed segment.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(path: &Path, limit_bytes: u64) -> io::Result<Self> {
        let newest = closed(path)?.last().map_or(0, |(number, _)| *number);
        let mut next = newest + 1;
        if path.exists() {
            fs::rename(path, closed_path(path, next))?;
            next += 1;
        }
        let (writer, written) = open(path)?;
        let segments = Self {
            path: path.to_owned(),
            segment_bytes: limit_bytes.max(LEAST_LIMIT) / SEGMENTS,
            writer,
            written,
            at_line_start: true,
            next,
        };
        segments.remove_oldest()?;
        Ok(segments)
    }

    fn rotate(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        fs::rename(&self.path, closed_path(&self.path, self.next))?;
        self.next += 1;
        self.remove_oldest()?;
        (self.writer, self.written) = open(&self.path)?;
        Ok(())
    }

    fn remove_oldest(&self) -> io::Result<()> {
        for (number, path) in closed(&self.path)? {
            if number + SEGMENTS <= self.next {
                fs::remove_file(path)?;
            }
        }
        Ok(())
    }
}

impl Write for Segments {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.at_line_start && self.written >= self.segment_bytes {
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

/// A new file with its header, and the bytes of it.
fn open(path: &Path) -> io::Result<(BufWriter<File>, u64)> {
    let file = OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(true)
        .open(path)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let header = journal_header();
    writer.write_all(&header)?;
    Ok((writer, header.len() as u64))
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
        let number = name
            .strip_prefix(&format!("{stem}."))
            .and_then(|rest| rest.strip_suffix(&format!(".{extension}")))
            .filter(|number| number.len() >= 6)
            .and_then(|number| number.parse().ok());
        if let Some(number) = number {
            found.push((number, entry.path()));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

    use super::*;

    fn lines(path: &Path) -> Vec<u64> {
        let files = segments_of(path).expect("readable");
        let text: String = files
            .iter()
            .map(|file| fs::read_to_string(file).expect("text"))
            .collect();
        assert!(text.is_empty() || text.ends_with('\n'));
        text.lines()
            .filter(|line| line.as_bytes() != journal_header().trim_ascii_end())
            .map(|line| line.trim_end_matches('x').parse().expect("a number"))
            .collect()
    }

    fn size(path: &Path) -> u64 {
        let files = segments_of(path).expect("readable");
        files
            .iter()
            .map(|file| fs::metadata(file).expect("a file").len())
            .sum()
    }

    #[test]
    fn the_newest_lines_are_kept_whole_and_the_limit_holds() {
        let folder = Folder::new("segments");
        let path = folder.join("journal.jsonl");
        let mut segments = Segments::create(&path, LEAST_LIMIT).expect("created");
        let filler = "x".repeat(100);
        for number in 0..5000 {
            // In pieces, as a writer of JSON does.
            write!(segments, "{number}").expect("written");
            segments.write_all(filler.as_bytes()).expect("written");
            segments.write_all(b"\n").expect("written");
            if number % 512 == 0 {
                segments.flush().expect("written");
                assert!(size(&path) <= LEAST_LIMIT + 200, "{}", size(&path));
            }
        }
        segments.flush().expect("written");
        let kept = lines(&path);
        let first = 5000 - kept.len() as u64;
        assert_eq!(kept, (first..5000).collect::<Vec<_>>());
        assert!(kept.len() as u64 * 100 > LEAST_LIMIT / 2);
        drop(segments);
        // One that starts again goes on, and loses nothing that is within the limit.
        let mut segments = Segments::create(&path, LEAST_LIMIT * 2).expect("created");
        writeln!(segments, "5000").expect("written");
        segments.flush().expect("written");
        assert_eq!(lines(&path).last(), Some(&5000));
        assert!(lines(&path).len() > kept.len() / 2);
    }

    #[test]
    fn other_files_of_the_folder_are_left_alone() {
        let folder = Folder::new("segments-others");
        for name in [
            "journal.jsonl.bak",
            "journal.1.jsonl",
            "summary.000001.json",
        ] {
            fs::write(folder.join(name), "kept").expect("written");
        }
        let path = folder.join("journal.jsonl");
        let mut segments = Segments::create(&path, 0).expect("created");
        for number in 0..10_000 {
            writeln!(
                segments,
                "{number}xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            )
            .expect("written");
        }
        for name in [
            "journal.jsonl.bak",
            "journal.1.jsonl",
            "summary.000001.json",
        ] {
            let text = fs::read_to_string(folder.join(name));
            assert_eq!(text.expect("it is there"), "kept");
        }
    }
}
