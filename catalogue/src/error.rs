//! What can be wrong with a database, with the numbers and names to act on.

use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;

use crate::VERSION;

/// Why a database cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// Not a file of SQLite.
    #[error("U1121: {} is no SQLite database", .0.display())]
    NoDatabase(PathBuf),
    /// A database of something else.
    #[error("U1122: {} is a SQLite database, but no catalogue of this program", .0.display())]
    NoCatalogue(PathBuf),
    /// Made by another version.
    #[error(
        "U1123: {} is a catalogue of version {version}, and this program reads version {VERSION}; export it with the program that made it, and import that file",
        path.display()
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: i32,
    },
    /// SQLite, or a figure in it, says so.
    #[error("U1124: {} is damaged: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// A model, or a figure of a family, that is there already.
    #[error("U1125: the catalogue has {0} already; --update takes over new figures for it")]
    Present(String),
    /// A file is in the way.
    #[error("U1126: {} exists already", .0.display())]
    Exists(PathBuf),
    /// The file system refused.
    #[error("U1127: {} cannot be written: {why}", path.display())]
    File {
        /// Where to.
        path: PathBuf,
        /// What the system says.
        why: String,
    },
    /// SQLite failed.
    #[error("U1128: the database failed: {0}")]
    Failed(String),
    /// An update that says something else of a model than the catalogue.
    #[error(
        "U1129: {model} is of the {what} `{known}` in the catalogue, and `{said}` in what is added"
    )]
    Disagrees {
        /// Vendor and model.
        model: String,
        /// `family` or `kind`.
        what: &'static str,
        /// In the catalogue.
        known: String,
        /// In what is added.
        said: String,
    },
}

impl StoreError {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoDatabase(_) => "U1121",
            Self::NoCatalogue(_) => "U1122",
            Self::OtherVersion { .. } => "U1123",
            Self::Damaged { .. } => "U1124",
            Self::Present(_) => "U1125",
            Self::Exists(_) => "U1126",
            Self::File { .. } => "U1127",
            Self::Failed(_) => "U1128",
            Self::Disagrees { .. } => "U1129",
        }
    }

    /// What SQLite's error means; the file is not known yet.
    pub(crate) fn of(error: rusqlite::Error) -> Self {
        let nowhere = PathBuf::new();
        match error.sqlite_error_code() {
            Some(ErrorCode::NotADatabase) => Self::NoDatabase(nowhere),
            Some(ErrorCode::DatabaseCorrupt) => Self::Damaged {
                path: nowhere,
                what: error.to_string(),
            },
            _ => Self::Failed(error.to_string()),
        }
    }

    /// The same of a file.
    pub(crate) fn at(self, file: &Path) -> Self {
        let file = file.to_owned();
        match self {
            Self::NoDatabase(_) => Self::NoDatabase(file),
            Self::Damaged { what, .. } => Self::Damaged { path: file, what },
            Self::Failed(what) => Self::Failed(format!("{}: {what}", file.display())),
            other => other,
        }
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        Self::of(error)
    }
}
