//! What can be wrong about the OPC UA gateway.

use std::net::SocketAddr;
use std::path::PathBuf;

use understudy_gateway::GatewayError;
use understudy_view::ViewError;

/// Why it does not run.
#[derive(Debug, thiserror::Error)]
pub enum OpcuaError {
    /// There is no such run.
    #[error(transparent)]
    Run(#[from] ViewError),
    /// Other machines could reach it, and there is no access control.
    #[error(
        "U0594: {address} can be reached by others, and without --certificates there is neither a login nor encryption: listen on 127.0.0.1, or name a folder for certificates"
    )]
    InTheClear {
        /// Where it was to listen.
        address: SocketAddr,
    },
    /// The password cannot be used.
    #[error("U0595: {}: {reason}", path.display())]
    Password {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The certificate or its key cannot be used.
    #[error("U0596: {}: {reason}", path.display())]
    Certificate {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It cannot listen or serve, or the journal cannot be read.
    #[error(transparent)]
    Gateway(#[from] GatewayError),
}

impl OpcuaError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Run(error) => error.code(),
            Self::InTheClear { .. } => "U0594",
            Self::Password { .. } => "U0595",
            Self::Certificate { .. } => "U0596",
            Self::Gateway(error) => error.code(),
        }
    }

    /// Whether nothing was started, because something that was given is wrong.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Gateway(_))
    }
}
