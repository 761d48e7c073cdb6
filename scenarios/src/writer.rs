//! Who writes a run: one process at a time holds the lock of its directory. The system takes the lock away when that process ends, however
//! it ends, so that a run that was killed is not taken for one that goes on.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;

/// In the directory of a run.
const LOCK: &str = "run.lock";

/// Held by whoever writes a run.
#[derive(Debug)]
pub(crate) struct WriterLock(#[allow(dead_code, reason = "it is held")] File);

impl WriterLock {
    /// Takes the lock of a run; nothing where another process has it.
    pub(crate) fn take(run: &Path) -> io::Result<Option<Self>> {
        let file = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(run.join(LOCK))?;
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
    let Ok(file) = File::open(run.join(LOCK)) else {
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
    use super::*;

    #[test]
    fn one_writes_and_the_others_see_it() {
        let name = format!("understudy-writer-{}", std::process::id());
        let run = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&run).expect("a folder");
        assert_eq!(writing(&run), Writing::Unknown);
        let lock = WriterLock::take(&run).expect("a file");
        assert!(lock.is_some());
        assert!(WriterLock::take(&run).expect("a file").is_none());
        assert_eq!(writing(&run), Writing::Now);
        drop(lock);
        assert_eq!(writing(&run), Writing::Over);
        assert!(WriterLock::take(&run).expect("a file").is_some());
        std::fs::remove_dir_all(run).expect("it goes");
    }
}
