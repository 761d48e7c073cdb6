//! Stands between members and their peers, and does to what passes what it was told.
//!
//! ```text
//!   client ──► listen │ route: forth ──► to      one socket towards `to` for each client, so that answers find back
//!   client ◄──        │ route: back  ◄──
//! ```
//!
//! All datagrams pass through one thread ([`datagrams`]); each connection of a stream has threads of its own ([`streams`]).
//! Everything that waits is bounded: what finds no room is dropped and counted, or, in a stream, waits outside.

mod datagrams;
mod streams;

use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

use nix::sys::eventfd::{EfdFlags, EventFd};
use nix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use crate::error::NetworkError;
use crate::impairment::Impairment;

/// Of SCHED_FIFO.
const PRIORITY: u8 = 45;

/// What a route carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transport {
    /// Datagrams.
    Udp,
    /// Streams.
    Tcp,
}

/// From where to where, and what happens on the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// Where the proxy listens; port 0 for any that is free.
    pub listen: SocketAddr,
    /// Where it passes on to.
    pub to: SocketAddr,
    /// What.
    pub transport: Transport,
    /// On the way there.
    pub forth: Impairment,
    /// On the way back.
    pub back: Impairment,
}

/// What passed a proxy, over all routes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ProxyCounters {
    /// Datagrams or pieces of streams that came.
    pub came: u64,
    /// What was passed on, doubles included.
    pub passed: u64,
    /// What was lost on purpose: by chance, by a cut or by a rate.
    pub lost: u64,
    /// What the system did not take, or what found no room.
    pub refused: u64,
}

/// A running proxy. It ends when it is dropped.
#[derive(Debug)]
pub struct Proxy {
    addresses: Vec<SocketAddr>,
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// What the threads of one proxy have in common.
#[derive(Debug)]
pub(crate) struct Shared {
    /// Rung for the end.
    bell: EventFd,
    ending: AtomicBool,
    came: AtomicU64,
    passed: AtomicU64,
    lost: AtomicU64,
    refused: AtomicU64,
}

impl Shared {
    pub(crate) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::SeqCst)
    }

    fn ring(&self) {
        // It can fail only where the counter is full, and then it is readable.
        let _ = self.bell.write(1);
    }

    /// One came, and so many of it go on.
    fn count(&self, going_on: usize) {
        self.came.fetch_add(1, Ordering::Relaxed);
        if going_on == 0 {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn sent(&self, taken: bool) {
        let counter = if taken { &self.passed } else { &self.refused };
        counter.fetch_add(1, Ordering::Relaxed);
    }
}

/// Nanoseconds of CLOCK_MONOTONIC.
pub(crate) fn now_ns() -> u64 {
    // It exists on every Linux; without it everything is due at once.
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(u64::MAX / 2, |now| {
        u64::try_from(now.tv_sec()).unwrap_or(0) * 1_000_000_000
            + u64::try_from(now.tv_nsec()).unwrap_or(0)
    })
}

impl Proxy {
    /// Listens on all routes, or on none. The same `seed` gives the same fates to the same traffic.
    ///
    /// # Errors
    /// [`NetworkError::Listen`]; [`NetworkError::NotOverTcp`] where a route of streams doubles or reorders.
    pub fn start(routes: &[Route], seed: u64) -> Result<Self, NetworkError> {
        for route in routes {
            check(route)?;
        }
        let shared = Arc::new(Shared {
            bell: EventFd::from_flags(EfdFlags::EFD_CLOEXEC | EfdFlags::EFD_NONBLOCK)
                .map_err(NetworkError::system("an eventfd for the proxy"))?,
            ending: AtomicBool::new(false),
            came: AtomicU64::new(0),
            passed: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            refused: AtomicU64::new(0),
        });
        let mut addresses = Vec::new();
        let (mut lanes, mut streams) = (Vec::new(), Vec::new());
        for (number, route) in routes.iter().enumerate() {
            let failed = |source| NetworkError::Listen { address: route.listen, source };
            let seed = seed.wrapping_add(number as u64 * 2);
            match route.transport {
                Transport::Udp => {
                    let socket = UdpSocket::bind(route.listen).map_err(failed)?;
                    socket.set_nonblocking(true).map_err(failed)?;
                    addresses.push(socket.local_addr().map_err(failed)?);
                    lanes.push(datagrams::Lane::new(socket, route, seed));
                }
                Transport::Tcp => {
                    let listener = TcpListener::bind(route.listen).map_err(failed)?;
                    listener.set_nonblocking(true).map_err(failed)?;
                    addresses.push(listener.local_addr().map_err(failed)?);
                    streams.push(streams::Way::new(listener, route, seed));
                }
            }
        }
        let worker = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("proxy".into())
            .spawn(move || {
                run_before_members();
                datagrams::carry(lanes, streams, &worker);
            })
            .map_err(NetworkError::system("a thread for the proxy"))?;
        Ok(Self { addresses, shared, threads: vec![thread] })
    }

    /// Where it listens, in the order of the routes.
    pub fn addresses(&self) -> &[SocketAddr] {
        &self.addresses
    }

    /// What passed until now.
    pub fn counters(&self) -> ProxyCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        ProxyCounters {
            came: read(&self.shared.came),
            passed: read(&self.shared.passed),
            lost: read(&self.shared.lost),
            refused: read(&self.shared.refused),
        }
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.shared.ending.store(true, Ordering::SeqCst);
        self.shared.ring();
        for thread in self.threads.drain(..) {
            // One that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

/// A network does not wait for who uses it: before all members of this machine, where the system grants it.
fn run_before_members() {
    let priority = ThreadPriorityValue::try_from(PRIORITY).map(ThreadPriority::Crossplatform);
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let set = priority.and_then(|priority| {
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
            .map_err(|error| error.to_string())
    });
    if let Err(error) = set {
        tracing::debug!(error, "the proxy runs among the other programs");
    }
}

fn check(route: &Route) -> Result<(), NetworkError> {
    if route.transport == Transport::Udp {
        return Ok(());
    }
    for impairment in [&route.forth, &route.back] {
        for (share, what) in
            [(impairment.duplicate, "to double"), (impairment.reorder, "to reorder")]
        {
            if !share.is_never() {
                return Err(NetworkError::NotOverTcp { what });
            }
        }
    }
    Ok(())
}

impl AsFd for Shared {
    fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
        self.bell.as_fd()
    }
}
