//! What a laboratory that was killed left in the directory of its run: keys, and the socket for operators. The next run that is begun in the
//! same place removes them.
//!
//! Invariant: nothing of a run that is being written is touched. Its writer takes the lock of the directory before it makes either of
//! them, so what is found before the lock is found free belongs to a writer that is gone.

use std::fs;
use std::path::{Path, PathBuf};

use crate::operator::SOCKET;
use crate::run_directory::{KEYS, is_of_latest};
use crate::writer::{Writing, writing};

/// Runs that are looked at, at most; the newest first.
const MAXIMUM_RUNS: usize = 1000;

/// Removes what dead writers left below a directory of runs. What cannot be removed stays.
pub(crate) fn remove_leftovers(runs: &Path) {
    let mut entries = entries_of(runs);
    entries.sort();
    for entry in entries.iter().rev().take(MAXIMUM_RUNS) {
        if entry.is_symlink() {
            if is_of_latest(entry) {
                let _ = fs::remove_file(entry);
            }
            continue;
        }
        clean(entry);
        // A campaign has a run for each replica in its directory.
        for inside in entries_of(entry) {
            if inside.is_dir() && !inside.is_symlink() {
                clean(&inside);
            }
        }
    }
}

/// One run.
fn clean(run: &Path) {
    let (keys, socket) = (run.join(KEYS), run.join(SOCKET));
    let left = keys.exists() || socket.exists();
    if left && writing(run) == Writing::Over {
        let _ = fs::remove_dir_all(keys);
        let _ = fs::remove_file(socket);
    }
}

fn entries_of(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).collect()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use understudy_testing::Folder;

    use super::*;
    use crate::writer::WriterLock;

    #[test]
    fn what_a_dead_writer_left_goes_and_all_else_stays() {
        let runs = Folder::new("leftovers");
        let run = |name: &str| {
            let run = runs.join(name);
            fs::create_dir_all(run.join(KEYS).join("members")).expect("a folder");
            for file in [SOCKET, "journal.jsonl"] {
                fs::write(run.join(file), "").expect("a file");
            }
            run
        };
        let (dead, replica) = (run("1"), run("1/replica-1"));
        let (living, foreign) = (run("2"), run("3"));
        for over in [&dead, &replica] {
            drop(WriterLock::of_new(over).expect("a lock"));
        }
        let lock = WriterLock::of_new(&living).expect("a lock");
        symlink("1", runs.join("latest")).expect("a link");
        symlink("1", runs.join(".latest-99999999")).expect("a link");
        remove_leftovers(&runs);
        for run in [&dead, &replica] {
            assert!(run.join("journal.jsonl").exists());
            assert!(!run.join(KEYS).exists() && !run.join(SOCKET).exists());
        }
        for run in [&living, &foreign] {
            assert!(run.join(KEYS).exists() && run.join(SOCKET).exists());
        }
        assert!(runs.join("latest").is_symlink() && !runs.join(".latest-99999999").is_symlink());
        drop(lock);
        remove_leftovers(&runs);
        assert!(!living.join(KEYS).exists() && !living.join(SOCKET).exists());
    }
}
