//! Finds a cycle in a journal by its checkpoints and continuations, without reading it from the beginning.

use std::io::{self, BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};

use understudy_wire::Moment;

use crate::packed_file::SegmentFile;
use crate::record::{Happening, LABORATORY, Record, RunEvent};
use crate::segments::segments_of;
use crate::version::{LONGEST_HEADER, check_header};

/// Where a reader can begin.
#[derive(Debug)]
pub struct Place {
    /// The segment; it is open, so it stays the same when it is packed or closed meanwhile.
    pub file: SegmentFile,
    /// The number that its header says.
    pub promised: Option<u64>,
    /// Whether it will not be written to any more.
    pub is_closed: bool,
    /// Which of its pieces; each begins with a line.
    pub piece: usize,
}

/// A place with a checkpoint.
#[derive(Debug)]
pub struct CheckpointPlace {
    /// Where.
    pub place: Place,
    /// A moment of the first checkpoint in it.
    pub moment: Moment,
    /// The cycle of the run that this is.
    pub cycle: i64,
    /// Whether online changes were loaded or done before it: which programs and points there are, the beginning of its segment says.
    pub is_changed: bool,
}

impl Place {
    /// Nothing where the header of the segment cannot be read.
    fn of(mut file: SegmentFile, piece: usize, is_closed: bool) -> io::Result<Option<Self>> {
        let mut header = Vec::new();
        file.go_to(0)?;
        BufReader::new((&mut file).take(LONGEST_HEADER)).read_until(b'\n', &mut header)?;
        Ok(check_header(&header).ok().map(|promised| Self { file, promised, is_closed, piece }))
    }
}

/// The last segment that continues the run after a cycle that is not after `cycle`, but none of the `newest` newest; nothing where there is none,
/// as in journals of version 2 and in short ones.
///
/// # Errors
/// What the system says.
pub fn continuation_before(path: &Path, cycle: i64, newest: usize) -> io::Result<Option<Place>> {
    looked_again(|| {
        let mut segments = segments_of(path)?;
        segments.truncate(segments.len().saturating_sub(newest));
        let end = segments.partition_point(|segment| {
            let found =
                SegmentFile::open(segment).ok().and_then(|mut file| continued_after(&mut file));
            found.is_none_or(|found| found <= cycle)
        });
        let Some(segment) = segments[..end].last() else {
            return Ok(None);
        };
        let mut file = SegmentFile::open(segment)?;
        match continued_after(&mut file) {
            None => Ok(None),
            // The newest was closed since: this is the one after it.
            Some(found) if found > cycle => Err(io::ErrorKind::NotFound.into()),
            Some(_) => Place::of(file, 0, segment != path),
        }
    })
}

/// Looks again where a segment was packed, closed or removed between its listing and its opening.
fn looked_again<T>(look: impl Fn() -> io::Result<T>) -> io::Result<T> {
    let gone = |error: &io::Error| error.kind() == io::ErrorKind::NotFound;
    for _ in 1..LOOKS {
        match look() {
            Err(error) if gone(&error) => {}
            found => return found,
        }
    }
    look()
}

/// Attempts to find a place in a journal whose segments change.
const LOOKS: usize = 8;

/// The newest cycle before a segment, where its second record says it.
fn continued_after(file: &mut SegmentFile) -> Option<i64> {
    let mut lines = BufReader::new(file).lines();
    check_header(lines.next()?.ok()?.as_bytes()).ok()?;
    let line = lines.next()?.ok()?;
    match serde_json::from_str::<Record>(&line).ok()?.event {
        Happening::Run(RunEvent::Continues(from)) => Some(from.cycle),
        _ => None,
    }
}

/// The last place of a journal whose checkpoint is of `cycle` or before; nothing where there is none, as in journals of version 2.
///
/// # Errors
/// What the system says.
pub fn place_before(path: &Path, cycle: i64) -> io::Result<Option<CheckpointPlace>> {
    looked_again(|| find_place(path, cycle))
}

fn find_place(path: &Path, cycle: i64) -> io::Result<Option<CheckpointPlace>> {
    let segments = segments_of(path)?;
    // The first segments of a run may have none, and the newest has none yet.
    let is_before = |segment: &PathBuf| {
        let first = SegmentFile::open(segment).map(|mut file| checkpoint_of(&mut file, 0));
        !matches!(first, Ok(Some(first)) if first.cycle > cycle)
    };
    let end = segments.partition_point(is_before);
    for segment in segments[..end].iter().rev() {
        let mut file = SegmentFile::open(segment)?;
        let Some((piece, Checkpoint { moment, cycle, is_changed })) =
            piece_before(&mut file, cycle)
        else {
            continue;
        };
        let place = Place::of(file, piece, segment != path)?;
        return Ok(place.map(|place| CheckpointPlace { place, moment, cycle, is_changed }));
    }
    Ok(None)
}

fn piece_before(file: &mut SegmentFile, cycle: i64) -> Option<(usize, Checkpoint)> {
    let pieces: Vec<usize> = (0..file.pieces().ok()?.len()).collect();
    let end = pieces.partition_point(
        |piece| !matches!(checkpoint_of(file, *piece), Some(found) if found.cycle > cycle),
    );
    (0..end).rev().find_map(|piece| {
        let found = checkpoint_of(file, piece)?;
        (found.cycle <= cycle).then_some((piece, found))
    })
}

struct Checkpoint {
    moment: Moment,
    cycle: i64,
    is_changed: bool,
}

/// The first checkpoint of a piece.
fn checkpoint_of(file: &mut SegmentFile, piece: usize) -> Option<Checkpoint> {
    let text = file.text_of(piece).ok()?;
    let mut lines = text.split(|byte| *byte == b'\n');
    lines.find_map(|line| {
        let name = line.iter().position(|byte| *byte == b',')?;
        let of_run = format!(",\"name\":\"{LABORATORY}\"");
        if !line[name..].starts_with(of_run.as_bytes()) {
            return None;
        }
        match serde_json::from_slice::<Record>(line).ok()?.event {
            Happening::Run(RunEvent::Checkpoint { moment, cycle, is_changed }) => {
                Some(Checkpoint { moment, cycle, is_changed })
            }
            _ => None,
        }
    })
}
