//! A proxy as a process of its own: until SIGINT or SIGTERM, or until its input ends.

use std::io::{self, BufRead, Write};
use std::net::SocketAddr;

use nix::sys::signal::{SigSet, Signal};
use serde::{Deserialize, Serialize};

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
    ending.thread_block().map_err(NetworkError::system("to hold back SIGINT and SIGTERM"))?;
    let proxy = Proxy::start(routes, seed)?;
    announce(proxy.addresses());
    ending.wait().map_err(NetworkError::system("to wait for SIGINT or SIGTERM"))?;
    Ok(proxy.counters())
}

/// First line of the input of [`serve_proxy`], as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProxyPlan {
    /// What it carries.
    pub routes: Vec<Route>,
    /// As in [`Proxy::start`].
    pub seed: u64,
}

/// A line of the output of [`serve_proxy`], as JSON.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProxyReport {
    /// It listens on all routes.
    Listening,
    /// It does not, and ends.
    Failed(String),
    /// Its input has ended, and so does it.
    Ended(ProxyCounters),
}

/// Runs the routes that the first line of `input` has, until `input` ends: with the process that started this one, also if that is
/// killed, but not while that is suspended.
///
/// # Errors
/// Those of `input` and `output`; a proxy that cannot listen is reported on `output`.
pub fn serve_proxy(mut input: impl BufRead, mut output: impl Write) -> io::Result<()> {
    let mut line = String::new();
    input.read_line(&mut line)?;
    let plan: ProxyPlan = serde_json::from_str(&line)?;
    let mut report = |report: &ProxyReport| {
        let text = serde_json::to_string(report)?;
        writeln!(output, "{text}")?;
        output.flush()
    };
    let proxy = match Proxy::start(&plan.routes, plan.seed) {
        Ok(proxy) => proxy,
        Err(error) => return report(&ProxyReport::Failed(error.to_string())),
    };
    report(&ProxyReport::Listening)?;
    io::copy(&mut input, &mut io::sink())?;
    report(&ProxyReport::Ended(proxy.counters()))
}
