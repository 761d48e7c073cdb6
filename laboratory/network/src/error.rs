//! What stops a network of this crate. The codes are stable.

use std::io;
use std::net::SocketAddr;

/// Why there is no such network.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The proxy cannot listen.
    #[error("U0541: the proxy cannot listen on {address}: {source}")]
    Listen {
        /// Where it was to listen.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// An impairment that a stream of bytes cannot have.
    #[error("U0542: {what} means nothing over TCP, which delivers every byte once and in order")]
    NotOverTcp {
        /// Which.
        what: &'static str,
    },
    /// Namespaces need a right that this process does not have.
    #[error(
        "U0543: hosts of their own need the right to make network namespaces ({source}): run it as root, or as \
         `unshare --user --map-root-user --net understudy …`"
    )]
    NotPermitted {
        /// What the system said.
        source: io::Error,
    },
    /// A program that is needed is not there.
    #[error(
        "U0544: `{program}` is not there: install it, on Debian and Ubuntu by `apt install {package}`"
    )]
    NoTool {
        /// Which program.
        program: &'static str,
        /// The Debian package that has it.
        package: &'static str,
    },
    /// A program that sets up the network refused.
    #[error("U0545: {command}: {said}")]
    Tool {
        /// What was called.
        command: String,
        /// What it said.
        said: String,
    },
    /// The system refused something that is needed.
    #[error("U0546: {what}: {source}")]
    System {
        /// What was asked of it.
        what: &'static str,
        /// What it said.
        source: io::Error,
    },
}

impl NetworkError {
    /// The stable code, such as `U0541`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Listen { .. } => "U0541",
            Self::NotOverTcp { .. } => "U0542",
            Self::NotPermitted { .. } => "U0543",
            Self::NoTool { .. } => "U0544",
            Self::Tool { .. } => "U0545",
            Self::System { .. } => "U0546",
        }
    }

    pub(crate) fn system<E: Into<io::Error>>(what: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self::System { what, source: error.into() }
    }
}
