//! Where a run leaves what it came to: `runs/<time>/`, and `runs/latest` beside it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;
use time::OffsetDateTime;

use crate::leftovers::remove_leftovers;
use crate::writer::WriterLock;

/// The folder of a run's keys, which goes when the run ends.
pub const KEYS: &str = "keys";
/// The folder of what the members of a run keep for the time after a power failure.
pub const RETAINED: &str = "retained";

/// Directories with one name and a number, at most; then something is wrong.
const MAXIMUM_TRIES: u32 = 1000;

/// The directory of one run. Whoever has it writes the run.
#[derive(Debug, Clone)]
pub struct RunDirectory {
    path: PathBuf,
    _lock: Arc<WriterLock>,
}

/// Something could not be written.
#[derive(Debug, thiserror::Error)]
pub enum RunDirectoryError {
    /// A file or directory.
    #[error("{} cannot be written: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file that has no form in JSON.
    #[error("{} cannot be written as JSON: {source}", path.display())]
    Json {
        /// Which.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
}

impl RunDirectory {
    /// A new directory below `runs`, named by the time, with `latest` pointing to it.
    ///
    /// # Errors
    /// [`RunDirectoryError::Write`].
    pub fn create(runs: &Path, now: SystemTime) -> Result<Self, RunDirectoryError> {
        let at = |path: &Path| {
            let path = path.to_owned();
            move |source| RunDirectoryError::Write { path, source }
        };
        fs::create_dir_all(runs).map_err(at(runs))?;
        let name = time_name(now);
        for number in 1..=MAXIMUM_TRIES {
            let name = match number {
                1 => name.clone(),
                _ => format!("{name}-{number}"),
            };
            let path = runs.join(&name);
            match fs::create_dir(&path) {
                Ok(()) => {
                    let lock = WriterLock::of_new(&path).map_err(at(&path))?;
                    point_latest(runs, &name).map_err(at(&runs.join("latest")))?;
                    remove_leftovers(runs);
                    return Ok(Self { path, _lock: Arc::new(lock) });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(at(&path)(error)),
            }
        }
        Err(at(runs)(io::ErrorKind::AlreadyExists.into()))
    }

    /// A new directory in it, for a part of the run.
    ///
    /// # Errors
    /// [`RunDirectoryError::Write`].
    pub fn inside(&self, name: &str) -> Result<Self, RunDirectoryError> {
        let path = self.path.join(name);
        fs::create_dir(&path)
            .map_err(|source| RunDirectoryError::Write { path: path.clone(), source })?;
        let lock = WriterLock::of_new(&path)
            .map_err(|source| RunDirectoryError::Write { path: path.clone(), source })?;
        Ok(Self { path, _lock: Arc::new(lock) })
    }

    /// Takes back a run that never began, of which there is no journal: its directory goes, and `latest` points to the newest that is
    /// left.
    pub fn take_back(&self) {
        if self.file("journal.jsonl").exists() {
            return;
        }
        // What cannot be removed stays, and is a run without records.
        let _ = fs::remove_dir_all(&self.path);
        let Some(runs) = self.path.parent() else {
            return;
        };
        let entries = fs::read_dir(runs).into_iter().flatten().filter_map(Result::ok);
        let directories = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
        let left = directories.filter_map(|entry| entry.file_name().into_string().ok());
        let _ = match left.max() {
            Some(newest) => point_latest(runs, &newest),
            None => fs::remove_file(runs.join("latest")),
        };
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a file in it, which is there whole or not at all.
    ///
    /// # Errors
    /// [`RunDirectoryError::Write`].
    pub fn write(&self, name: &str, text: &str) -> Result<(), RunDirectoryError> {
        let path = self.file(name);
        let parent = path.parent().unwrap_or(&self.path);
        // Two files of one name are not written at once: a run has one writer.
        let begun = path.with_extension("new");
        fs::create_dir_all(parent)
            .and_then(|()| fs::write(&begun, text))
            .and_then(|()| fs::rename(&begun, &path))
            .map_err(|source| RunDirectoryError::Write { path, source })
    }
}

/// How the names of links begin that are to become `latest`.
const NEW_LATEST: &str = ".latest-";

/// Whether a link was to become `latest` when the process that made it was killed.
pub(crate) fn is_of_latest(link: &Path) -> bool {
    let name = link.file_name().and_then(|name| name.to_str());
    let process = name.and_then(|name| name.strip_prefix(NEW_LATEST));
    process.is_some_and(|process| !Path::new("/proc").join(process).exists())
}

/// Replaces the link `latest`, so that it never points to nothing.
fn point_latest(runs: &Path, name: &str) -> io::Result<()> {
    let new = runs.join(format!("{NEW_LATEST}{}", std::process::id()));
    match fs::remove_file(&new) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    std::os::unix::fs::symlink(name, &new)?;
    fs::rename(&new, runs.join("latest"))
}

/// `2026-11-21T02-30-00Z`: sorts by time, and is a file name everywhere.
pub fn time_name(now: SystemTime) -> String {
    let now = OffsetDateTime::from(now);
    let (date, (hour, minute, second)) = (now.date(), now.to_hms());
    format!("{date}T{hour:02}-{minute:02}-{second:02}Z")
}

/// `2026-11-21T02:30:00.250Z`, for people.
pub fn time_text(time: SystemTime) -> String {
    let time = OffsetDateTime::from(time);
    let (date, (hour, minute, second, millisecond)) = (time.date(), time.to_hms_milli());
    format!("{date}T{hour:02}:{minute:02}:{second:02}.{millisecond:03}Z")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use understudy_testing::Folder;

    use super::*;

    #[test]
    fn a_run_that_never_began_is_taken_back() {
        let runs = Folder::new("taken-back");
        let second = |seconds| SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
        let latest = || fs::read_link(runs.join("latest")).ok();
        let first = RunDirectory::create(&runs, second(1)).expect("a directory");
        let name = first.path().file_name().map(PathBuf::from);
        let other = RunDirectory::create(&runs, second(2)).expect("a directory");
        assert_ne!(latest(), name);
        other.take_back();
        assert_eq!(latest(), name);
        first.take_back();
        assert_eq!(latest(), None);
        assert_eq!(fs::read_dir(&runs).expect("a folder").count(), 0);
    }

    #[test]
    fn names_are_times() {
        let check = |seconds, expected: &str| {
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
            assert_eq!(time_name(time), expected);
        };
        check(0, "1970-01-01T00-00-00Z");
        check(951_782_400, "2000-02-29T00-00-00Z");
        check(1_709_164_799, "2024-02-28T23-59-59Z");
        check(4_107_542_399, "2100-02-28T23-59-59Z");
        check(4_107_542_400, "2100-03-01T00-00-00Z");
    }
}
