//! What can be wrong with keys.

use std::io;
use std::path::PathBuf;

use crate::date::Date;

/// What is wrong, and with what; the codes are stable.
#[derive(Debug, thiserror::Error)]
pub enum KeysError {
    /// A file cannot be read.
    #[error("U0901: {} cannot be read: {source}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file or a folder cannot be written.
    #[error("U0902: {} cannot be written: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A secret that others can read.
    #[error("U0903: {} may be read by others than its owner (mode {mode:04o}); `chmod {} {}`", path.display(), if path.is_dir() { "700" } else { "600" }, path.display())]
    Permissions {
        /// Which file or folder.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// Nothing is overwritten.
    #[error("U0904: {} has an authority already; `understudy keys issue` renews what it issued", folder.display())]
    Exists {
        /// The folder of the keys.
        folder: PathBuf,
    },
    /// Nothing was ever made there.
    #[error("U0905: {} has no authority; make one with `understudy keys init`", folder.display())]
    NoAuthority {
        /// The folder of the keys.
        folder: PathBuf,
    },
    /// A file that is not as it was written.
    #[error("U0906: {} is damaged: {reason}", path.display())]
    Damaged {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A name that is neither a member's nor an operator's.
    #[error("U0907: nobody is called `{name}`; {known}")]
    NoHolder {
        /// The name.
        name: String,
        /// Who there is.
        known: String,
    },
    /// Too late.
    #[error(
        "U0908: the certificate of {name} expired on {expires}, and the clock of this machine is at {now}; `understudy keys issue` makes a new one; where the clock is wrong, set it"
    )]
    Expired {
        /// Whose.
        name: String,
        /// When.
        expires: Date,
        /// What the clock says.
        now: Date,
    },
    /// Too early, by the clock of the machine.
    #[error(
        "U0914: the certificate of {name} is valid from {begins}, and the clock of this machine is at {now}; set the clock"
    )]
    NotYetValid {
        /// Whose.
        name: String,
        /// When it begins.
        begins: Date,
        /// What the clock says.
        now: Date,
    },
    /// They no longer count.
    #[error(
        "U0909: the keys of {name} (generation {generation}) are revoked; `understudy keys issue` makes new ones"
    )]
    Revoked {
        /// Whose.
        name: String,
        /// Which of them.
        generation: u32,
    },
    /// Keys that are not for this.
    #[error("U0910: {} holds the keys of {found}, and those of {wanted} are needed", folder.display())]
    Others {
        /// Where.
        folder: PathBuf,
        /// Whose they are.
        found: String,
        /// Whose they should be.
        wanted: String,
    },
    /// The cluster file names a member that was issued nothing, or has grown since.
    #[error("U0911: {} has no key for {name}; issue the keys again and copy the folder anew", folder.display())]
    NoKey {
        /// Where.
        folder: PathBuf,
        /// For whom.
        name: String,
    },
    /// The library refuses.
    #[error("U0912: no certificate for {name}: {reason}")]
    Certificate {
        /// Whose.
        name: String,
        /// What it said.
        reason: String,
    },
    /// There is nothing left to take.
    #[error("U0913: the keys of {name} are revoked already, since {since}")]
    AlreadyRevoked {
        /// Whose.
        name: String,
        /// Since when.
        since: Date,
    },
}

impl KeysError {
    /// The stable code, such as `U0903`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Read { .. } => "U0901",
            Self::Write { .. } => "U0902",
            Self::Permissions { .. } => "U0903",
            Self::Exists { .. } => "U0904",
            Self::NoAuthority { .. } => "U0905",
            Self::Damaged { .. } => "U0906",
            Self::NoHolder { .. } => "U0907",
            Self::Expired { .. } => "U0908",
            Self::Revoked { .. } => "U0909",
            Self::Others { .. } => "U0910",
            Self::NoKey { .. } => "U0911",
            Self::Certificate { .. } => "U0912",
            Self::AlreadyRevoked { .. } => "U0913",
            Self::NotYetValid { .. } => "U0914",
        }
    }
}
