//! Errors of a store.

use std::io;
use std::path::PathBuf;

use understudy_simulator::NotReady;

use super::super::seeds::Seeds;

/// A folder that cannot be used as the store of a campaign.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file cannot be read.
    #[error("cannot read {}: {error}", path.display())]
    Unreadable {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason of the operating system.
        error: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {error}", path.display())]
    Unwritable {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason of the operating system.
        error: io::Error,
    },
    /// A file is not one of a store, or has been changed.
    #[error("{} is damaged: {reason}; remove it, and its seeds are run again", path.display())]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The folder has other files.
    #[error("{} has files and is not a store; name an empty folder", .0.display())]
    Occupied(PathBuf),
    /// Files were replaced faster than they could be read.
    #[error("the files of {} change faster than they are read; try again", .0.display())]
    Busy(PathBuf),
    /// The store is for other runs.
    #[error("{} is a store of another campaign: {what} is {found} there and {expected} here", store.display())]
    Other {
        /// Folder of the store.
        store: PathBuf,
        /// What differs.
        what: &'static str,
        /// Its value in the store.
        found: String,
        /// Its value here.
        expected: String,
    },
    /// A program of the same version number behaves otherwise.
    #[error(
        "{} was made by another build of this version: the first runs of its campaign apply other outputs here",
        .0.display()
    )]
    Behaviour(PathBuf),
    /// Two stores cannot be of one program.
    #[error("findings of {seeds} differ between {} and {}: they were made by different builds", one.display(), two.display())]
    Differ {
        /// The seeds.
        seeds: Seeds,
        /// Folder of the first store.
        one: PathBuf,
        /// Folder of the second store.
        two: PathBuf,
    },
    /// The cluster does not synchronise.
    #[error(transparent)]
    NotReady(#[from] NotReady),
}

impl StoreError {
    /// Stable code of the error.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "U0601",
            Self::Unwritable { .. } => "U0602",
            Self::Other { .. } | Self::Behaviour(_) | Self::Differ { .. } => "U0628",
            Self::Damaged { .. } | Self::Occupied(_) | Self::Busy(_) => "U0629",
            Self::NotReady(_) => "U0530",
        }
    }
}
