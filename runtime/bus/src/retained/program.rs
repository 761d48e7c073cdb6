//! The text of a program next to what is kept of it: a file for each hash, written once.

use std::collections::{BTreeSet, HashSet};
use std::fs::{File, read_dir, remove_file, rename};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use understudy_wire::{ProgramHash, Retained, RetainedProgram};

use super::{RetainedFiles, read_bounded};

/// The programs that online changes have brought to a member: its records may be of these. All clones are of one member.
#[derive(Debug, Clone, Default)]
pub struct LoadedPrograms(Arc<Mutex<Vec<RetainedProgram>>>);

impl LoadedPrograms {
    /// These in the place of those before.
    pub fn are(&self, programs: Vec<RetainedProgram>) {
        *self.all() = programs;
    }

    fn find(&self, hash: ProgramHash) -> Option<RetainedProgram> {
        self.all().iter().find(|program| program.hash == hash).cloned()
    }

    fn all(&self) -> MutexGuard<'_, Vec<RetainedProgram>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl RetainedFiles {
    /// The pairs of files in a folder, or that of one file, in the order of their names.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn at(path: &Path) -> io::Result<Vec<Self>> {
        let name_of = |path: &Path| {
            let name = path.file_name()?.to_str()?;
            let name = name.strip_suffix(".1.retained").or(name.strip_suffix(".2.retained"))?;
            Some(name.to_owned())
        };
        let mut names = BTreeSet::new();
        let folder = if path.is_dir() {
            for entry in read_dir(path)? {
                names.extend(name_of(&entry?.path()));
            }
            path
        } else {
            std::fs::metadata(path)?;
            names.extend(name_of(path));
            path.parent().unwrap_or(Path::new(""))
        };
        Ok(names.into_iter().map(|name| Self::new(folder, name)).collect())
    }

    /// What the files are called, without their endings.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file of the text of a program.
    pub fn program_path(&self, hash: ProgramHash) -> PathBuf {
        self.folder.join(format!("{}.{:016x}.program", self.name, hash.0))
    }

    /// The text of a program whose state or note is kept.
    ///
    /// # Errors
    /// Why there is none, in words.
    pub fn program(&self, hash: ProgramHash) -> Result<RetainedProgram, String> {
        let path = self.program_path(hash);
        let bytes = read_bounded(&path).map_err(|error| error.to_string())?;
        let program = RetainedProgram::from_bytes(&bytes).map_err(|error| error.to_string())?;
        match program.hash == hash {
            true => Ok(program),
            false => Err("it is of another program".to_owned()),
        }
    }

    /// Writes the text of the program of a record, and removes those that no file needs any more.
    pub(super) fn keep_program(&self, hash: ProgramHash) -> io::Result<()> {
        let Some(own) = &self.program else {
            return Ok(());
        };
        let loaded = self.loaded.find(hash).filter(|_| own.hash != hash);
        // An online change keeps the inputs.
        let loaded = loaded.map(|it| RetainedProgram { inputs: own.inputs.clone(), ..it });
        let program = loaded.as_ref().unwrap_or(own);
        let Some(bytes) = program.to_bytes() else {
            let reason = format!("the text of the program has {} bytes", program.text.len());
            return Err(io::Error::other(reason));
        };
        let path = self.program_path(program.hash);
        if read_bounded(&path).ok().as_ref() != Some(&bytes) {
            let unfinished = path.with_extension("unfinished");
            let mut file = File::create(&unfinished)?;
            file.write_all(&bytes)?;
            file.sync_data()?;
            rename(&unfinished, &path)?;
            File::open(&self.folder)?.sync_all()?;
        }
        let needed = self.needed_programs(program.hash)?;
        for old in self.programs()?.into_iter().filter(|path| !needed.contains(path)) {
            remove_file(old)?;
        }
        Ok(())
    }

    /// Files of programs that are there.
    fn programs(&self) -> io::Result<Vec<PathBuf>> {
        let start = format!("{}.", self.name);
        let mut found = Vec::new();
        for entry in read_dir(&self.folder)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let hash = name.strip_prefix(&start).and_then(|rest| rest.strip_suffix(".program"));
            if hash.is_some_and(|hash| u64::from_str_radix(hash, 16).is_ok()) {
                found.push(path);
            }
        }
        Ok(found)
    }

    /// Those of this program and of what the two files have.
    fn needed_programs(&self, own: ProgramHash) -> io::Result<HashSet<PathBuf>> {
        let mut hashes = HashSet::from([own]);
        for path in self.paths() {
            let bytes = match read_bounded(&path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                read => read?,
            };
            hashes.extend(Retained::read(&bytes).0.iter().filter_map(|record| match record {
                Retained::State(state) => Some(state.hash),
                Retained::Note(note) => Some(note.hash),
                Retained::Step(_) | Retained::Authority(_) => None,
            }));
        }
        Ok(hashes.into_iter().map(|hash| self.program_path(hash)).collect())
    }
}
