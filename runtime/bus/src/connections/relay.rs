//! Connections for a library that accepts for itself.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::io::{copy, split};
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::oneshot;

use super::{Connections, Listener, lock};
use crate::rights::run_in_background;

/// A free port of the loopback interface, for a library that accepts for itself.
///
/// It is only found free: another process may take it before it is used, and the library then says so.
///
/// # Errors
/// What the system says.
pub fn inner_address() -> io::Result<SocketAddr> {
    std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()
}

/// Callers whose connections are relayed, by the addresses that the library sees.
#[derive(Debug, Clone, Default)]
pub struct RelayedCallers(Arc<Mutex<BTreeMap<SocketAddr, SocketAddr>>>);

impl RelayedCallers {
    /// The caller behind the address that the library sees.
    pub fn of(&self, seen: SocketAddr) -> Option<SocketAddr> {
        lock(&self.0).get(&seen).copied()
    }
}

/// Hands every connection that `listener` accepts over to the listener at `inner`, byte by byte, until either side has ended it. Each takes
/// three descriptors: two here, and one there.
pub async fn relay(listener: Listener, inner: SocketAddr) -> Infallible {
    relay_known(listener, inner, RelayedCallers::default()).await
}

/// As [`relay`]; `callers` knows each caller while its connection is open.
pub async fn relay_known(
    mut listener: Listener,
    inner: SocketAddr,
    callers: RelayedCallers,
) -> Infallible {
    loop {
        let (caller, peer) = listener.accept().await;
        let callers = callers.clone();
        tokio::spawn(async move {
            let socket = TcpSocket::new_v4().and_then(|socket| {
                socket.bind((Ipv4Addr::LOCALHOST, 0).into())?;
                let seen = socket.local_addr()?;
                Ok((socket, seen))
            });
            let Ok((socket, seen)) = socket else {
                return;
            };
            // The library may ask as soon as it accepts.
            lock(&callers.0).insert(seen, peer);
            if let Ok(answerer) = socket.connect(inner).await {
                let _ = answerer.set_nodelay(true);
                let (mut from_caller, mut to_caller) = split(caller);
                let (mut from_answerer, mut to_answerer) = answerer.into_split();
                // Why it ends is the matter of those who talk.
                tokio::select! {
                    _ = copy(&mut from_caller, &mut to_answerer) => {}
                    _ = copy(&mut from_answerer, &mut to_caller) => {}
                }
            }
            lock(&callers.0).remove(&seen);
        });
    }
}

/// A [`relay`] in a thread of its own, out of real time; it and its connections end when this is dropped.
#[derive(Debug)]
pub(crate) struct Relay {
    stop: Option<oneshot::Sender<Infallible>>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    pub(crate) fn start(
        listener: std::net::TcpListener,
        connections: Connections,
        patience: Duration,
        inner: SocketAddr,
    ) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let listener = {
            let _inside = runtime.enter();
            TcpListener::from_std(listener)?
        };
        let listener = Listener::new(listener, connections, patience);
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new().name("relay".into()).spawn(move || {
            run_in_background();
            runtime.block_on(async {
                tokio::select! {
                    never = relay(listener, inner) => match never {},
                    _ = stopped => {}
                }
            });
        })?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}
