//! The threads that write what a member keeps: a record goes to a queue, a writer puts it into one of two files, and a syncer waits for the disk.

use std::fs::{File, OpenOptions, create_dir_all};
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use understudy_wire::{ProgramHash, ProgramId, Retained};

use super::{RetainedFiles, authority_in, read_bounded};
use crate::error::BusError;

/// Records that wait for the disk, at most.
pub(super) const WAITING_RECORDS: usize = 1024;

/// Notes in one file.
pub(super) const NOTES_IN_A_FILE: u32 = 4096;

/// Why the disk takes nothing, since when it does not; shared with the writer.
pub(super) type Failure = Arc<Failing>;

#[derive(Debug, Default)]
pub(super) struct Failing {
    reason: Mutex<Option<String>>,
    /// Records that were left out because the queue was full.
    left_out: AtomicU64,
}

impl Failing {
    fn reason(&self) -> MutexGuard<'_, Option<String>> {
        self.reason.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A record, and how many were left out before it.
pub(super) type Queued = (u64, Retained);

/// What begins a file, and whether it is on the disk.
pub(super) type Begun = (File, Arc<AtomicBool>);

/// Hands records of a member to the threads that write them.
pub struct Retainer {
    pub(super) queue: Option<SyncSender<Queued>>,
    pub(super) failure: Failure,
    pub(super) reported: bool,
    pub(super) writer: Option<JoinHandle<()>>,
}

impl Retainer {
    /// Starts the threads. `files` are those of each program of a station, in the order of `programs`, or the one pair of a remote I/O.
    ///
    /// # Errors
    /// [`BusError::System`] without a thread. A folder that cannot be made or written is no error: the member runs, and reports it.
    pub fn start(files: Vec<(Option<ProgramId>, RetainedFiles)>) -> Result<Self, BusError> {
        let (queue, records) = sync_channel(WAITING_RECORDS);
        let failure = Failure::default();
        let of_writer = Arc::clone(&failure);
        let (sync, to_sync) = sync_channel::<Begun>(files.len().max(1) * 2);
        let thread = |what| move |source| BusError::System { what, source };
        let syncer = Builder::new()
            .name("retain-sync".into())
            .spawn(move || {
                for (file, is_synced) in to_sync {
                    is_synced.store(file.sync_data().is_ok(), Ordering::Release);
                }
            })
            .map_err(thread("a thread that waits for the disk"))?;
        let writer = Builder::new()
            .name("retain".into())
            .spawn(move || {
                let turns = files.into_iter().map(|(of, files)| Turn::new(of, files)).collect();
                Writer { turns, sync, failure: of_writer }.run(&records);
                // Its channel is closed: what was given to it is on the disk then.
                let _ = syncer.join();
            })
            .map_err(thread("a thread that writes retained states"))?;
        Ok(Self { queue: Some(queue), failure, reported: false, writer: Some(writer) })
    }

    /// Keeps a record, where the queue has room.
    pub(crate) fn keep(&self, record: Retained) {
        let Some(queue) = &self.queue else {
            return;
        };
        let left_out = self.failure.left_out.load(Ordering::Acquire);
        if let Err(TrySendError::Full(_)) = queue.try_send((left_out, record)) {
            // First, or a state from before the gap could end the report.
            self.failure.left_out.fetch_add(1, Ordering::AcqRel);
            self.failure.reason().get_or_insert_with(|| {
                format!("more than {WAITING_RECORDS} records wait for the disk")
            });
        }
    }

    /// What has changed since it was asked last: the reason where the disk takes nothing any more, and `None` in it where it does again.
    pub(crate) fn take_change(&mut self) -> Option<Option<String>> {
        let failure = self.failure.reason().clone();
        let changed = failure.is_some() != self.reported;
        self.reported = failure.is_some();
        changed.then_some(failure)
    }

    /// Ends the threads, once all that waits is written.
    pub(crate) fn finish(mut self) {
        self.queue = None;
        if let Some(writer) = self.writer.take() {
            // It has ended either way.
            let _ = writer.join();
        }
    }
}

/// Two files of one program, or of the notes.
pub(super) struct Turn {
    of: Option<ProgramId>,
    files: RetainedFiles,
    /// Which of the two is begun next.
    next: usize,
    /// Files of an earlier life that cannot be read to their end: they go once something newer is written.
    damaged: Vec<PathBuf>,
    /// Whether one of two files of notes is missing: the numbers of new notes may be smaller than those in the other one.
    is_halved: bool,
    current: Option<File>,
    /// Whether what begins the current file is on the disk: until then the other one is needed.
    is_synced: Arc<AtomicBool>,
    /// The program whose text is kept.
    kept: Option<ProgramHash>,
    notes: u32,
    /// Bytes of the current file.
    written: u64,
    /// Bytes of the longest file that could not be continued, while the disk takes no more than that.
    fails_at: Option<u64>,
}

impl Turn {
    pub(super) fn new(of: Option<ProgramId>, files: RetainedFiles) -> Self {
        let is_note = of.is_none();
        let is_damaged = |path: &&PathBuf| {
            read_bounded(path).is_ok_and(|bytes| {
                let (records, error) = Retained::read(&bytes);
                let is_of_others = authority_in(&records) != files.authority;
                bytes.is_empty() || error.is_some() || is_note && is_of_others
            })
        };
        // The older one of an earlier life is begun first.
        let newest = |path: &PathBuf| std::fs::metadata(path).and_then(|of| of.modified()).ok();
        let paths = files.paths();
        let damaged = paths.iter().filter(is_damaged).cloned().collect();
        let next = usize::from(newest(&paths[0]) > newest(&paths[1]));
        let is_halved = is_note && paths.iter().filter(|path| path.exists()).count() == 1;
        Self {
            of,
            files,
            next,
            damaged,
            is_halved,
            current: None,
            is_synced: Arc::default(),
            kept: None,
            notes: 0,
            written: 0,
            fails_at: None,
        }
    }

    /// The disk refuses a record: behind a torn one, or a gap in the steps, nothing would be read.
    fn fails(&mut self) {
        self.fails_at = Some(self.fails_at.unwrap_or(0).max(self.written));
        self.current = None;
        self.written = 0;
    }

    /// A record is written; whether a failure is over with it. A full disk takes as much again as the file had that was truncated, so that is a longer file,
    /// or a whole one.
    fn succeeds(&mut self, bytes: usize, is_complete: bool) -> bool {
        self.written = self.written.saturating_add(bytes as u64);
        let failed = self.fails_at.is_some();
        self.fails_at = self.fails_at.filter(|at| self.written <= *at && !is_complete);
        failed && self.fails_at.is_none()
    }

    /// Keeps the text of the program of a record: the record is of no use for the next program without it.
    fn keep_program(&mut self, record: &Retained) -> io::Result<()> {
        let hash = match record {
            Retained::State(state) => state.hash,
            Retained::Note(note) => note.hash,
            Retained::Step(_) | Retained::Authority(_) => return Ok(()),
        };
        if self.kept != Some(hash) {
            create_dir_all(&self.files.folder)?;
            self.files.keep_program(hash)?;
            self.kept = Some(hash);
        }
        Ok(())
    }

    /// Begins the other file with a record; the one before stays as it is where that fails.
    fn begin(&mut self, bytes: &[u8]) -> io::Result<Begun> {
        let path = &self.files.paths()[self.next];
        create_dir_all(&self.files.folder)?;
        let mut content = Vec::new();
        if let Some(authority) = self.files.authority {
            Retained::Authority(authority).write(&mut content);
        }
        content.extend_from_slice(bytes);
        if self.is_halved {
            let paths = self.files.paths();
            paths.iter().filter(|left| left.exists()).try_for_each(std::fs::remove_file)?;
            self.damaged.clear();
            self.is_halved = false;
        }
        let other = &self.files.paths()[1 - self.next];
        let is_note = self.of.is_none();
        let is_first = is_note && !path.exists() && !other.exists();
        if is_first {
            File::create(other)?.write_all(&content)?;
            content.extend_from_slice(bytes);
        }
        let mut file = OpenOptions::new().create(true).write(true).truncate(true).open(path)?;
        file.write_all(&content)?;
        let synced = file.try_clone()?;
        for damaged in self.damaged.drain(..).filter(|damaged| damaged != path) {
            std::fs::remove_file(damaged)?;
        }
        // A note that is there twice tells that both files were begun, so that one that is missing later is told from one that was not begun.
        if is_note && !other.exists() {
            content.extend_from_slice(bytes);
            File::create(other)?.write_all(&content)?;
        } else if is_first {
            OpenOptions::new().append(true).open(other)?.write_all(bytes)?;
        }
        self.current = Some(file);
        self.next = 1 - self.next;
        self.is_synced = Arc::default();
        Ok((synced, Arc::clone(&self.is_synced)))
    }

    /// A note that is too old would prove what is not true; without one a person is asked. Files can be removed from a full disk.
    fn remove_both(&self) {
        for path in self.files.paths() {
            let _ = std::fs::remove_file(path);
        }
    }

    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.current {
            Some(file) => file.write_all(bytes),
            // No state was kept yet.
            None => Ok(()),
        }
    }
}

pub(super) struct Writer {
    pub(super) turns: Vec<Turn>,
    pub(super) sync: SyncSender<Begun>,
    pub(super) failure: Failure,
}

impl Writer {
    pub(super) fn run(mut self, records: &Receiver<Queued>) {
        let mut bytes = Vec::new();
        for (left_out, record) in records {
            bytes.clear();
            record.write(&mut bytes);
            let written = self.write(&record, &bytes);
            let mut reason = self.failure.reason();
            match written {
                // A step behind a gap is not read: only a whole record behind it shows that the disk takes states again.
                Ok(true)
                    if left_out == self.failure.left_out.load(Ordering::Acquire)
                        && self.turns.iter().all(|turn| turn.fails_at.is_none()) =>
                {
                    *reason = None;
                }
                Ok(_) => {}
                Err((folder, error)) => {
                    *reason = Some(format!("{}: {error}", folder.display()));
                }
            }
        }
    }

    /// Whether the record shows that the disk takes states: a state, a note that begins a file, or the one with which a failure ends.
    fn write(&mut self, record: &Retained, bytes: &[u8]) -> Result<bool, (PathBuf, io::Error)> {
        let of = match record {
            Retained::State(state) => Some(state.program),
            Retained::Step(step) => Some(step.program),
            Retained::Note(_) | Retained::Authority(_) => None,
        };
        let Some(turn) = self.turns.iter_mut().find(|turn| turn.of == of) else {
            return Ok(false);
        };
        let is_whole = match record {
            Retained::State(_) => true,
            Retained::Step(_) | Retained::Authority(_) => false,
            Retained::Note(_) => {
                turn.notes = if turn.current.is_none() { 0 } else { turn.notes + 1 };
                turn.notes.is_multiple_of(NOTES_IN_A_FILE)
            }
        };
        let may_begin = turn.current.is_none() || turn.is_synced.load(Ordering::Acquire);
        let is_open = turn.current.is_some();
        let begins = is_whole && may_begin;
        if begins {
            turn.written = 0;
        }
        let written = turn.keep_program(record).and_then(|()| match begins {
            true => turn.begin(bytes).map(Some),
            false => turn.append(bytes).map(|()| None),
        });
        let begun = written.map_err(|error| {
            if of.is_none() {
                turn.remove_both();
            }
            turn.fails();
            (turn.files.folder.clone(), error)
        })?;
        // A step without a file is not written.
        let length = if turn.current.is_some() { bytes.len() } else { 0 };
        let recovers = turn.succeeds(length, begins && is_open);
        if let Some(begun) = begun {
            // Where the disk is slow, the next record waits here, and the cycle does not.
            drop(self.sync.send(begun));
        }
        Ok(is_whole || recovers)
    }
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

    use super::*;

    /// A full disk takes as much again as the file had that is begun anew: an alarm that ends and begins with each file means nothing.
    #[test]
    fn a_failure_is_over_with_a_longer_file_or_a_whole_one() {
        let folder = Folder::new("retained-turn");
        let mut turn =
            Turn::new(Some(ProgramId(0)), RetainedFiles::new(&folder, "robot.robot".to_owned()));
        let file = |turn: &mut Turn, steps: usize| {
            turn.written = 0;
            turn.succeeds(100, false);
            for _ in 0..steps {
                turn.succeeds(10, false);
            }
        };
        file(&mut turn, 5);
        turn.fails();
        for _ in 0..3 {
            file(&mut turn, 5);
            assert_eq!(turn.fails_at, Some(150));
            turn.fails();
            // Nothing of the next file.
            turn.fails();
        }
        file(&mut turn, 6);
        assert_eq!(turn.fails_at, None, "it is longer");
        turn.fails();
        file(&mut turn, 2);
        assert_eq!(turn.fails_at, Some(160));
        turn.succeeds(100, true);
        assert_eq!(turn.fails_at, None, "the file before is whole");
    }
}
