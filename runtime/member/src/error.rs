//! Why a member cannot run.

use std::io;
use std::path::PathBuf;

use understudy_bus::BusError;
use understudy_keys::KeysError;

/// A member that cannot run. [`MemberError::code`] is stable.
#[derive(Debug, thiserror::Error)]
pub enum MemberError {
    /// The cluster has no member of this name.
    #[error("the cluster has no `{name}`; it has {}", known.join(", "))]
    NoName {
        /// As it was asked for.
        name: String,
        /// Names of all members.
        known: Vec<String>,
    },
    /// The member is of another kind.
    #[error("`{name}` is no {wanted}, which `{command}` runs")]
    WrongKind {
        /// As it was asked for.
        name: String,
        /// The kind that the command runs.
        wanted: &'static str,
        /// The command.
        command: &'static str,
    },
    /// The list of endpoints cannot be used.
    #[error("{} is no list of endpoints: {reason}", path.display())]
    List {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Some members have no address.
    #[error(
        "no address for {}; give each an `address = \"HOST:PORT\"` in the cluster file",
        names.join(", ")
    )]
    NoAddress {
        /// Which members.
        names: Vec<String>,
    },
    /// The cluster wants keys, and no folder is named.
    #[error(
        "the cluster wants keys: name this member's folder with --keys (`understudy keys init` makes them), or write `security = \"off\"` in the cluster file"
    )]
    NoKeys,
    /// The keys cannot be used.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Keys(Vec<KeysError>),
    /// The first numbers of a test cannot be read.
    #[error(
        "invalid UNDERSTUDY_FIRST_NUMBERS `{0}`: expected EPOCH:CYCLE:FRAME, three whole numbers; only tests set it"
    )]
    FirstNumbers(String),
    /// The thread of a device cannot start.
    #[error("a thread for the device: {0}")]
    Device(io::Error),
    /// The file of the journal cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Journal {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The addresses do not fit together.
    #[error(transparent)]
    Endpoints(BusError),
    /// The link or the process failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl MemberError {
    /// The stable code.
    pub fn code(&self) -> &str {
        match self {
            Self::NoName { .. } => "U0605",
            Self::WrongKind { .. } => "U0606",
            Self::List { .. } => "U0607",
            Self::NoAddress { .. } => "U0608",
            Self::FirstNumbers(_) => "U0600",
            Self::NoKeys => "U0620",
            Self::Keys(errors) => errors.first().map_or("U0902", KeysError::code),
            Self::Device(_) => "U0506",
            Self::Journal { .. } => "U0602",
            Self::Endpoints(error) | Self::Bus(error) => error.code(),
        }
    }

    /// Whether an input is wrong, and nothing was started.
    pub fn is_of_input(&self) -> bool {
        !matches!(self, Self::Device(_) | Self::Journal { .. } | Self::Bus(_))
    }
}
