//! A core that a member has for itself, so that it can wait actively on it.
//!
//! A member that waits actively keeps its core busy. On a core of another member it would take the time in which that one publishes. So each core is
//! claimed by a lock on a file, which ends with the process; a member without a core waits as always.

use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use nix::fcntl::{Flock, FlockArg, OFlag};
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;

/// The kernel's list of the cores that it keeps free of other processes (`isolcpus`).
const ISOLATED: &str = "/sys/devices/system/cpu/isolated";

/// Where the locks are; the folder for temporary files where there is none.
const LOCKS: &str = "/run/lock";

/// A core that no other member of this machine waits on.
#[derive(Debug)]
pub(crate) struct OwnCore {
    pub(crate) number: usize,
    _lock: Flock<File>,
}

impl OwnCore {
    /// Claims an isolated core, or any other one but the first where none is isolated.
    ///
    /// # Errors
    /// Why there is no core, for people.
    pub(crate) fn claim() -> Result<Self, String> {
        let isolated = isolated();
        let candidates = if isolated.is_empty() { shared() } else { isolated };
        Self::claim_of(&candidates, &folder())
    }

    fn claim_of(candidates: &[usize], folder: &Path) -> Result<Self, String> {
        for &number in candidates {
            let path = folder.join(format!("understudy-core-{number}.lock"));
            let opened = OpenOptions::new()
                .create(true)
                .truncate(false)
                .write(true)
                .mode(0o666)
                .custom_flags(OFlag::O_NOFOLLOW.bits())
                .open(&path);
            let file = opened.map_err(|error| format!("{}: {error}", path.display()))?;
            if let Ok(lock) = Flock::lock(file, FlockArg::LockExclusiveNonblock) {
                return Ok(Self { number, _lock: lock });
            }
        }
        Err(match candidates.len() {
            0 => "this process may run on one core only".to_owned(),
            count => format!("other members have claimed the {count} cores that can be claimed"),
        })
    }

    /// Keeps the calling thread on this core.
    ///
    /// # Errors
    /// Reason of the operating system, for people.
    pub(crate) fn hold(&self) -> Result<(), String> {
        let refused = |error: nix::Error| format!("core {}: {}", self.number, error.desc());
        let mut set = CpuSet::new();
        set.set(self.number).map_err(refused)?;
        sched_setaffinity(Pid::from_raw(0), &set).map_err(refused)
    }
}

fn folder() -> PathBuf {
    let locks = PathBuf::from(LOCKS);
    if locks.is_dir() { locks } else { std::env::temp_dir() }
}

/// Cores that the kernel keeps free of other processes.
pub(crate) fn isolated() -> Vec<usize> {
    fs::read_to_string(ISOLATED).map(|text| listed(&text)).unwrap_or_default()
}

/// Cores that this process may run on, but for the first: other processes of the machine need one.
pub(crate) fn shared() -> Vec<usize> {
    let Ok(allowed) = sched_getaffinity(Pid::from_raw(0)) else {
        return Vec::new();
    };
    let cores = 0..CpuSet::count();
    cores.filter(|core| allowed.is_set(*core).unwrap_or(false)).skip(1).collect()
}

/// Cores of a list of the kernel, such as `2-3,6`.
fn listed(text: &str) -> Vec<usize> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
    };
    text.trim().split(',').filter_map(range).flatten().take(CpuSet::count()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_the_kernel_are_read() {
        assert_eq!(listed("2-4,7\n"), [2, 3, 4, 7]);
        assert_eq!(listed("5"), [5]);
        assert_eq!(listed("\n"), [0_usize; 0]);
        assert_eq!(listed("0-18446744073709551615").len(), CpuSet::count());
    }

    /// Each core is claimed once, and again when its member has ended.
    #[test]
    fn a_core_is_claimed_once() {
        let folder = std::env::temp_dir().join(format!("understudy-cores-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let claim = || OwnCore::claim_of(&[3, 5], &folder);
        let (first, second) = (claim().expect("free"), claim().expect("free"));
        assert_eq!((first.number, second.number), (3, 5));
        assert!(claim().is_err_and(|reason| reason.contains("claimed the 2 cores")));
        drop(first);
        assert_eq!(claim().map(|core| core.number), Ok(3));
        assert!(OwnCore::claim_of(&[], &folder).is_err_and(|reason| reason.contains("one core")));
        fs::remove_dir_all(&folder).expect("its own");
    }
}
