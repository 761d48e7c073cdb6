//! Why nothing can be attached to.

use std::io;
use std::net::SocketAddr;

use understudy_journal::JOURNAL_VERSION;
use understudy_wire::ConfigurationHash;

/// Why a cluster elsewhere cannot be looked at.
#[derive(Debug, thiserror::Error)]
pub enum AttachError {
    /// No member listens at any of its addresses.
    #[error("U0561: no member of the cluster answers: {}", list(.tried))]
    Nobody {
        /// Who was called where, and what came of it.
        tried: Vec<Unheard>,
    },
    /// Somebody listens, and does not take calls from the holder of these keys; or is nobody whom these keys trust.
    #[error("U0562: no member takes a call from the holder of these keys: {}", list(.tried))]
    NotAdmitted {
        /// Who was called where, and what came of it.
        tried: Vec<Unheard>,
    },
    /// The cluster that runs there has another file.
    #[error(
        "U0563: {name} at {address} runs configuration {theirs}, and the cluster file is configuration {ours}: take the file that it runs"
    )]
    OtherConfiguration {
        /// The first member that reported it.
        name: String,
        /// Where it listens.
        address: SocketAddr,
        /// What it runs.
        theirs: String,
        /// Configuration of the file.
        ours: ConfigurationHash,
    },
    /// A member is of another version of this program.
    #[error(
        "U0535: {name} at {address} reports version {found} of the journal, and this program reads version {JOURNAL_VERSION}: use the understudy that it runs"
    )]
    OtherVersion {
        /// Which member said so first.
        name: String,
        /// Where it listens.
        address: SocketAddr,
        /// Version of its records.
        found: u32,
    },
    /// Its members take no calls.
    #[error(
        "U0564: the cluster file has security = \"off\": its members have no keys and take no calls; read the journals that they write (--journal)"
    )]
    NoKeys,
    /// The system refused something.
    #[error("U0565: {what}: {source}")]
    System {
        /// What was wanted.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
}

/// A member that was called in vain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unheard {
    /// Its name.
    pub name: String,
    /// Where it should listen.
    pub address: SocketAddr,
    /// What came of it.
    pub reason: String,
}

fn list(tried: &[Unheard]) -> String {
    let each = tried.iter().map(|member| {
        let Unheard { name, address, reason } = member;
        format!("{name} at {address} ({reason})")
    });
    each.collect::<Vec<_>>().join(", ")
}

impl AttachError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Nobody { .. } => "U0561",
            Self::NotAdmitted { .. } => "U0562",
            Self::OtherConfiguration { .. } => "U0563",
            Self::OtherVersion { .. } => "U0535",
            Self::NoKeys => "U0564",
            Self::System { .. } => "U0565",
        }
    }
}
