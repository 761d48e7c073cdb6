//! Errors of the gateways.

use std::io;
use std::net::SocketAddr;

use understudy_bus::BusError;
use understudy_view::Trouble;

/// Error of a gateway.
#[derive(Debug, thiserror::Error)]
pub enum GatewayError {
    /// It cannot listen.
    #[error("U0590: cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// The system refused something that it needs.
    #[error("U0591: {what}: {source}")]
    System {
        /// What was requested.
        what: &'static str,
        /// Error of the system.
        source: io::Error,
    },
    /// More signals than a Modbus address can name.
    #[error("U0592: the process image has {bits} bits; a register map holds {most} at most")]
    TooManyBits {
        /// Of all programs.
        bits: usize,
        /// At most.
        most: usize,
    },
    /// More numbers than a Modbus address can name.
    #[error("U0592: the register map has {registers} registers; it holds {most} at most")]
    TooManyRegisters {
        /// Of the run and all programs.
        registers: usize,
        /// At most.
        most: usize,
    },
    /// The journal cannot be read.
    #[error("U0593: {0}")]
    Journal(Trouble),
    /// Nothing to forward.
    #[error(
        "U0597: no input of `{cluster}` takes a signal of another group; declare one in its cluster file: ready = {{ from = \"line-1/press.done\", default = false, stale_after = 100 }}"
    )]
    NoGroupSignals {
        /// Name of the cluster.
        cluster: String,
    },
    /// No command for alarms.
    #[error(
        "U0599: the cluster file of `{cluster}` has no [notify]; add one with the command: command = [\"logger\", \"-t\", \"understudy\"]"
    )]
    NoNotify {
        /// Name of the cluster.
        cluster: String,
    },
    /// Zenoh did not start.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl GatewayError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Listen { .. } => "U0590",
            Self::System { .. } => "U0591",
            Self::TooManyBits { .. } | Self::TooManyRegisters { .. } => "U0592",
            Self::Journal(_) => "U0593",
            Self::NoGroupSignals { .. } => "U0597",
            Self::NoNotify { .. } => "U0599",
            Self::Bus(error) => error.code(),
        }
    }
}
