//! What a member keeps on disk for the time after a power failure: files, and the threads that write them.
//!
//! ```text
//!   cycle ──► queue ──► writer: a state or a full file of notes begins the other file of two, the rest is appended
//!                          └──► syncer: what begins a file is on the disk before the older file is begun again
//! ```
//!
//! The cycle never waits for the disk: where the queue is full, or the disk is, records are left out, and that is reported. A file
//! that is being written is never the only one: the other one has the state before.

mod program;

use std::fs::{File, OpenOptions, create_dir_all};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use understudy_wire::{
    AuthorityHash, Carried, ClusterHash, Moment, Note, ProgramId, Retained, RetainedProgram,
    RetainedRun,
};

use crate::error::BusError;

/// Records that wait for the disk, at most.
const WAITING_RECORDS: usize = 1024;

/// Notes in one file.
const NOTES_IN_A_FILE: u32 = 4096;

/// Bytes of a file that are read, at most: a state, and the steps of an hour.
const MAXIMUM_FILE_BYTES: u64 = 64 << 20;

/// Two files that are written in turn, and the text of the program next to them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RetainedFiles {
    folder: PathBuf,
    name: String,
    program: Option<RetainedProgram>,
    authority: Option<AuthorityHash>,
}

/// To whom the records of a file belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Owner {
    /// The cluster.
    pub cluster: ClusterHash,
    /// The authority of its keys; nothing without keys. A cluster of the same name with other keys, such as a copy on a test bench, is another one.
    pub authority: Option<AuthorityHash>,
}

/// What was found in one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundFile {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it, in words; nothing where it was read to its end.
    pub problem: Option<String>,
}

/// What a remote I/O has noted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundNotes {
    /// The newest note, where no file lacks one that may be newer.
    pub newest: Option<Note>,
    /// Whether a file may lack a note.
    pub is_damaged: bool,
    /// Whether the newest note that can be read is of a program with retentive variables, of another cluster too; nothing where none can be read.
    pub was_retentive: Option<bool>,
    /// The files.
    pub files: Vec<FoundFile>,
}

/// What a member keeps for the time after a power failure.
#[derive(Debug, Clone, Default)]
pub struct Retention {
    /// The pair of files of each program of a station, or that of a remote I/O, which has no program; nothing is kept without any.
    pub files: Vec<(Option<ProgramId>, RetainedFiles)>,
    /// What was found there at the start.
    pub found: Vec<FoundFile>,
    /// What was taken over from the program before each one.
    pub carried: Vec<CarriedOver>,
    /// Whether a program has retentive variables, and no folder was given.
    pub is_missing: bool,
}

impl RetainedFiles {
    /// Those of `name` in `folder`: a remote I/O, or a station and a program of it.
    pub fn new(folder: &Path, name: String) -> Self {
        Self { folder: folder.to_owned(), name, program: None, authority: None }
    }

    /// Begins each file with the authority of the keys of this member.
    #[must_use]
    pub fn with_authority(self, authority: Option<AuthorityHash>) -> Self {
        Self { authority, ..self }
    }

    /// Keeps the text of the program too, so that a changed program can take over its values.
    #[must_use]
    pub fn with_program(self, program: RetainedProgram) -> Self {
        Self { program: Some(program), ..self }
    }

    fn paths(&self) -> [PathBuf; 2] {
        ["1", "2"].map(|which| self.folder.join(format!("{}.{which}.retained", self.name)))
    }

    /// The states that a station has kept, of this program and of others before it; those of every owner where none is given. States that were kept
    /// with the keys of another authority are not whole ([`Carried::is_whole`]), so that the operator decides, and are left out where there are others.
    pub fn runs(&self, owner: Option<Owner>) -> (Vec<RetainedRun>, Vec<FoundFile>) {
        let of_file = |records, is_of_others| {
            let mut runs = RetainedRun::of_records(records);
            let all = runs.len();
            runs.retain(|run| owner.is_none_or(|owner| run.state.cluster == owner.cluster));
            let foreign = runs.len() < all;
            let newest = runs.iter().map(RetainedRun::stepped).max();
            for run in runs.iter_mut().filter(|_| is_of_others) {
                run.carried = Some(Carried { from: run.state.hash, is_whole: false });
            }
            (runs, newest, foreign)
        };
        let (mut runs, files) = self.read(owner, of_file);
        if runs.iter().any(|run| run.carried.is_none()) {
            runs.retain(|run| run.carried.is_none());
        }
        (runs, files)
    }

    /// The notes that a remote I/O has made; those of every owner where none is given.
    pub fn notes(&self, owner: Option<Owner>) -> FoundNotes {
        let (mut readable, mut made) = (None, 0);
        let of_file = |records: Vec<Retained>, _| {
            let notes = records.into_iter().filter_map(|record| match record {
                Retained::Note(note) => Some(note),
                Retained::State(_) | Retained::Step(_) | Retained::Authority(_) => None,
            });
            let newest = notes.inspect(|_| made += 1).max_by_key(|note| note.number);
            let read = newest.as_ref().map(|note| (note.number, note.is_retentive));
            readable = readable.max(read);
            let is_own = |note: &Note| owner.is_none_or(|owner| note.cluster == owner.cluster);
            let foreign = newest.as_ref().is_some_and(|note| !is_own(note));
            let newest = newest.filter(|_| !foreign);
            let sampled = newest.as_ref().map(|note| note.recalled.sampled);
            (newest.into_iter().collect(), sampled, foreign)
        };
        let (notes, mut files) = self.read(owner, of_file);
        let is_there = |path: &PathBuf| files.iter().any(|file| file.path == *path);
        let missing = self.paths().into_iter().find(|path| !is_there(path));
        // The very first note alone: the power failed before the other file was begun.
        let is_first = made == 1 && readable.is_some_and(|(number, _)| number == 0);
        if let Some(path) = missing.filter(|_| !files.is_empty() && !is_first) {
            let problem = "it is missing, and may have had the newest note".to_owned();
            files.push(FoundFile { path, problem: Some(problem) });
        }
        let is_damaged = files.iter().any(|file| file.problem.is_some());
        let newest = notes.into_iter().max_by_key(|note: &Note| note.number);
        let was_retentive = readable.map(|(_, was_retentive)| was_retentive);
        FoundNotes { newest: newest.filter(|_| !is_damaged), is_damaged, was_retentive, files }
    }

    fn read<T>(
        &self,
        owner: Option<Owner>,
        mut of_file: impl FnMut(Vec<Retained>, bool) -> (Vec<T>, Option<Moment>, bool),
    ) -> (Vec<T>, Vec<FoundFile>) {
        let (mut all, mut files) = (Vec::new(), Vec::new());
        for path in self.paths() {
            let bytes = match read_bounded(&path) {
                Ok(bytes) => bytes,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => {
                    files.push(FoundFile { path, problem: Some(error.to_string()) });
                    continue;
                }
            };
            let (records, error) = Retained::read(&bytes);
            let authority = authority_in(&records);
            let is_of_others = owner.is_some_and(|owner| owner.authority != authority);
            let (found, newest, is_foreign) = of_file(records, is_of_others);
            let told = |is_so: bool, problem: &str| is_so.then(|| problem.to_owned());
            let problem = told(is_foreign, "it is of another cluster")
                .or(error.map(|error| error.to_string()))
                // A file that was made and has no record of this member: its records did not reach the disk.
                .or(told(newest.is_none(), "it has no whole record"))
                .or(told(is_of_others, "its member had keys of another authority, or none"));
            all.extend(found);
            files.push(FoundFile { path, problem });
        }
        (all, files)
    }
}

/// The authority of the keys that the records of a file were written with.
fn authority_in(records: &[Retained]) -> Option<AuthorityHash> {
    records.iter().find_map(|record| match record {
        Retained::Authority(authority) => Some(*authority),
        Retained::State(_) | Retained::Step(_) | Retained::Note(_) => None,
    })
}

fn read_bounded(path: &Path) -> io::Result<Vec<u8>> {
    let length = std::fs::metadata(path)?.len();
    if length > MAXIMUM_FILE_BYTES {
        return Err(io::Error::other(format!("it has {length} bytes")));
    }
    std::fs::read(path)
}

/// What was taken over of the values that the program before has left behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CarriedOver {
    /// The program.
    pub program: String,
    /// Values that are kept.
    pub kept: usize,
    /// Values of a type that is another one now.
    pub converted: usize,
    /// Values that the program before did not have.
    pub new: usize,
    /// Paths whose values are not taken over.
    pub dropped: Vec<String>,
}

/// Why the disk takes nothing, since when it does not; shared with the writer.
type Failure = Arc<Failing>;

#[derive(Debug, Default)]
struct Failing {
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
type Queued = (u64, Retained);

/// What begins a file, and whether it is on the disk.
type Begun = (File, Arc<AtomicBool>);

/// Hands records of a member to the threads that write them.
pub struct Retainer {
    queue: Option<SyncSender<Queued>>,
    failure: Failure,
    reported: bool,
    writer: Option<JoinHandle<()>>,
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
struct Turn {
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
    /// Whether the text of the program is kept.
    has_program: bool,
    notes: u32,
    /// Bytes of the current file.
    written: u64,
    /// Bytes of the longest file that could not be continued, while the disk takes no more than that.
    fails_at: Option<u64>,
}

impl Turn {
    fn new(of: Option<ProgramId>, files: RetainedFiles) -> Self {
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
            has_program: false,
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

    /// A record of so many bytes is written. A full disk takes as much again as the file had that was truncated, so a failure is over with a longer
    /// file, or with a whole one.
    fn succeeds(&mut self, bytes: usize, is_complete: bool) {
        self.written = self.written.saturating_add(bytes as u64);
        self.fails_at = self.fails_at.filter(|at| self.written <= *at && !is_complete);
    }

    /// Begins the other file with a record; the one before stays as it is where that fails.
    fn begin(&mut self, bytes: &[u8]) -> io::Result<Begun> {
        let path = &self.files.paths()[self.next];
        create_dir_all(&self.files.folder)?;
        if !self.has_program {
            // A state is of no use for the next program without the text of its own.
            self.files.keep_program()?;
            self.has_program = true;
        }
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

struct Writer {
    turns: Vec<Turn>,
    sync: SyncSender<Begun>,
    failure: Failure,
}

impl Writer {
    fn run(mut self, records: &Receiver<Queued>) {
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
        let (failed, is_open) = (turn.fails_at, turn.current.is_some());
        let begins = is_whole && may_begin;
        if begins {
            turn.written = 0;
        }
        let written =
            if begins { turn.begin(bytes).map(Some) } else { turn.append(bytes).map(|()| None) };
        if written.is_ok() {
            // A step without a file is not written.
            let length = if turn.current.is_some() { bytes.len() } else { 0 };
            turn.succeeds(length, begins && is_open);
        }
        match written {
            Ok(None) => {}
            // Where the disk is slow, the next record waits here, and the cycle does not.
            Ok(Some(begun)) => drop(self.sync.send(begun)),
            Err(error) => {
                if of.is_none() {
                    turn.remove_both();
                }
                turn.fails();
                return Err((turn.files.folder.clone(), error));
            }
        }
        Ok(is_whole || failed.is_some() && turn.fails_at.is_none())
    }
}

#[cfg(test)]
mod tests;
