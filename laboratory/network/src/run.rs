//! A proxy as a process of its own: until SIGINT or SIGTERM.

use std::net::SocketAddr;

use nix::sys::signal::{SigSet, Signal};

use crate::error::NetworkError;
use crate::proxy::{Proxy, ProxyCounters, Route};

/// Runs the routes until the process is told to end; `announce` learns where it listens.
///
/// To be called from the main thread before any other is started, because threads inherit that the two signals wait.
///
/// # Errors
/// As [`Proxy::start`].
pub fn run_proxy(
    routes: &[Route],
    seed: u64,
    announce: impl FnOnce(&[SocketAddr]),
) -> Result<ProxyCounters, NetworkError> {
    let mut ending = SigSet::empty();
    ending.add(Signal::SIGINT);
    ending.add(Signal::SIGTERM);
    ending
        .thread_block()
        .map_err(NetworkError::system("to hold back SIGINT and SIGTERM"))?;
    let proxy = Proxy::start(routes, seed)?;
    announce(proxy.addresses());
    ending
        .wait()
        .map_err(NetworkError::system("to wait for SIGINT or SIGTERM"))?;
    Ok(proxy.counters())
}
