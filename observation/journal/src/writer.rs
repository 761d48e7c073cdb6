//! Who writes a run: one process at a time holds the lock of its directory. The system takes the lock away when that process ends, however
//! it ends, so that a run that was killed is not taken for one that goes on.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::time::Duration;

use crate::packed_file::open_file;

/// In the directory of a run.
const LOCK: &str = "run.lock";

/// How often the lock of a new run is tried.
const ATTEMPTS: u32 = 200;
const BETWEEN_ATTEMPTS: Duration = Duration::from_millis(5);

/// Held by whoever writes a run.
#[derive(Debug)]
pub(crate) struct WriterLock(#[allow(dead_code, reason = "it is held")] File);

impl WriterLock {
    /// Takes the lock of a run that begins. Others only look at it for a moment ([`writing`]), so it is waited for.
    pub(crate) fn of_new(run: &Path) -> io::Result<Self> {
        for _ in 0..ATTEMPTS {
            if let Some(lock) = Self::take(run)? {
                return Ok(lock);
            }
            std::thread::sleep(BETWEEN_ATTEMPTS);
        }
        Err(io::ErrorKind::WouldBlock.into())
    }

    /// Takes the lock of a run; nothing where another process has it.
    pub(crate) fn take(run: &Path) -> io::Result<Option<Self>> {
        let file =
            OpenOptions::new().create(true).truncate(false).write(true).open(run.join(LOCK))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Self(file))),
            Err(std::fs::TryLockError::WouldBlock) => Ok(None),
            Err(std::fs::TryLockError::Error(error)) => Err(error),
        }
    }
}

/// Whether a run is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Writing {
    /// By a process that lives.
    Now,
    /// By nobody any more.
    Over,
    /// It has no lock: it was put together in another way.
    Unknown,
}

/// Whether somebody writes the run in this directory now.
pub fn writing(run: &Path) -> Writing {
    let Ok(file) = open_file(&run.join(LOCK)) else {
        return Writing::Unknown;
    };
    match file.try_lock_shared() {
        Ok(()) => Writing::Over,
        Err(std::fs::TryLockError::WouldBlock) => Writing::Now,
        Err(std::fs::TryLockError::Error(_)) => Writing::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use understudy_testing::Folder;

    use super::*;

    #[test]
    fn whoever_looks_does_not_keep_the_lock_of_a_new_run() {
        let run = Folder::new("writer-new");
        let looks = File::create(run.join(LOCK)).expect("a file");
        looks.lock_shared().expect("locked");
        let looking = std::thread::spawn(move || {
            std::thread::sleep(BETWEEN_ATTEMPTS * 4);
            drop(looks);
        });
        let lock = WriterLock::of_new(&run).expect("free soon");
        assert_eq!(writing(&run), Writing::Now);
        looking.join().expect("it looks");
        drop(lock);
    }

    #[test]
    fn one_writes_and_the_others_see_it() {
        let run = Folder::new("writer");
        assert_eq!(writing(&run), Writing::Unknown);
        let lock = WriterLock::take(&run).expect("a file");
        assert!(lock.is_some());
        assert!(WriterLock::take(&run).expect("a file").is_none());
        assert_eq!(writing(&run), Writing::Now);
        drop(lock);
        assert_eq!(writing(&run), Writing::Over);
        assert!(WriterLock::take(&run).expect("a file").is_some());
    }
}
