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
mod writing;

use std::io;
use std::path::{Path, PathBuf};

use understudy_wire::{
    AuthorityHash, Carried, ClusterHash, Moment, Note, ProgramId, Retained, RetainedProgram,
    RetainedRun,
};

pub use program::LoadedPrograms;
pub(crate) use writing::Retainer;

/// Bytes of a file that are read, at most: a state, and the steps of an hour.
const MAXIMUM_FILE_BYTES: u64 = 64 << 20;

/// Two files that are written in turn, and the text of the program next to them.
#[derive(Debug, Clone)]
pub struct RetainedFiles {
    folder: PathBuf,
    name: String,
    program: Option<RetainedProgram>,
    loaded: LoadedPrograms,
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
        let loaded = LoadedPrograms::default();
        Self { folder: folder.to_owned(), name, program: None, loaded, authority: None }
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

    /// Keeps the texts of the programs of online changes too, once a record is of one of them.
    #[must_use]
    pub fn with_loaded(self, loaded: LoadedPrograms) -> Self {
        Self { loaded, ..self }
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
#[derive(Debug, Clone, Default, PartialEq, Eq)]
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

#[cfg(test)]
mod tests;
