//! The files of a store: their names, and how they are read and written while other processes do the same.

use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::super::findings::Findings;
use super::super::seeds::Seeds;
use super::StoreError;

/// What every seed is run with.
pub(super) const STORE_FILE: &str = "store.json";

/// Name of the file with the findings of a range of seeds.
pub(super) fn part_name(seeds: &Seeds) -> String {
    let (first, last) = seeds.ends().unwrap_or((0, 0));
    format!("seeds-{first}-{last}.json")
}

/// The seeds of a file of findings; nothing for other names.
fn seeds_of(name: &str) -> Option<Seeds> {
    let (first, last) = name.strip_prefix("seeds-")?.strip_suffix(".json")?.split_once('-')?;
    let seeds = Seeds::range(first.parse().ok()?, last.parse().ok()?);
    (part_name(&seeds) == name).then_some(seeds)
}

fn names(folder: &Path) -> Result<Vec<String>, StoreError> {
    let unreadable = |error| StoreError::Unreadable { path: folder.to_owned(), error };
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        names.extend(entry.map_err(unreadable)?.file_name().into_string());
    }
    Ok(names)
}

/// Whether a folder has files other than those that a process is writing.
pub(super) fn is_occupied(folder: &Path) -> Result<bool, StoreError> {
    let staged = format!(".{STORE_FILE}.");
    match names(folder) {
        Ok(names) => Ok(names.iter().any(|name| name != STORE_FILE && !name.starts_with(&staged))),
        Err(StoreError::Unreadable { error, .. }) if error.kind() == ErrorKind::NotFound => {
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

/// The seeds of each file of findings, in any order.
pub(super) fn entries(folder: &Path) -> Result<Vec<Seeds>, StoreError> {
    Ok(names(folder)?.iter().filter_map(|name| seeds_of(name)).collect())
}

/// The same without the files whose seeds are those of a block too.
pub(super) fn parts(folder: &Path) -> Result<Vec<Seeds>, StoreError> {
    let mut listed = entries(folder)?;
    listed.sort_by_key(|seeds| (std::cmp::Reverse(seeds.count()), seeds.first()));
    let mut covered = Seeds::default();
    listed.retain(|seeds| {
        let is_new = !covered.has_all(seeds);
        covered.add(seeds);
        is_new
    });
    Ok(listed)
}

/// Text of a file.
pub(super) fn text(path: &Path) -> Result<String, StoreError> {
    fs::read_to_string(path)
        .map_err(|error| StoreError::Unreadable { path: path.to_owned(), error })
}

/// The findings of a range of seeds; nothing if their file is gone.
pub(super) fn read_part(folder: &Path, seeds: &Seeds) -> Result<Option<Findings>, StoreError> {
    let path = folder.join(part_name(seeds));
    let text = match text(&path) {
        Ok(text) => text,
        Err(StoreError::Unreadable { error, .. }) if error.kind() == ErrorKind::NotFound => {
            return Ok(None);
        }
        Err(error) => return Err(error),
    };
    let findings = Findings::parse(&text);
    findings.map(Some).map_err(|error| StoreError::Damaged { path, reason: error.to_string() })
}

/// Removes a file whose seeds are those of a block.
pub(super) fn remove_part(folder: &Path, seeds: &Seeds) -> Result<(), StoreError> {
    let path = folder.join(part_name(seeds));
    match fs::remove_file(&path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(StoreError::Unwritable { path, error })
        }
        _ => Ok(()),
    }
}

/// Writes a file at once: a reader has its old content or the new one, also after a loss of power. Makes the folder. What processes that were
/// killed while they wrote the same file have left is removed.
pub(super) fn replace(folder: &Path, name: &str, text: &str) -> Result<(), StoreError> {
    let path = folder.join(name);
    let unwritable = |error| StoreError::Unwritable { path: path.clone(), error };
    fs::create_dir_all(folder).map_err(unwritable)?;
    let unique = RandomState::new().hash_one(std::process::id());
    let staged = folder.join(format!(".{name}.{unique:016x}"));
    match written(&staged, &path, text) {
        // The process that wrote the same file first has removed what was begun here.
        Err(error) if error.kind() == ErrorKind::NotFound && path.exists() => {}
        written => written.map_err(unwritable)?,
    }
    let begun = format!(".{name}.");
    for left in names(folder)?.iter().filter(|name| name.starts_with(&begun)) {
        let _ = fs::remove_file(folder.join(left));
    }
    Ok(())
}

fn written(staged: &PathBuf, path: &PathBuf, text: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(staged)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    fs::rename(staged, path)?;
    File::open(path.parent().unwrap_or(Path::new(".")))?.sync_all()
}
