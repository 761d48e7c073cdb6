//! Connections that anyone on the network may open: how many a listener accepts, and how long a caller may keep it waiting.
//!
//! Applies to every TCP listener of the project, and before the first byte of a connection is read:
//!
//! * **Number.** A listener accepts a number of connections at once, and a quarter of them from one address (IPv6: from one network of
//!   64 bits). The others are closed at once, and counted.
//! * **Descriptors.** All listeners of a process together leave [`RESERVED_DESCRIPTORS`] to the cycle, its link, its field and its journal.
//! * **Time.** A connection is closed when this process has sent nothing over it for the listener's patience: the caller does not finish the
//!   handshake, sends a request byte by byte, does not take the answer, or has nothing to ask.
//!
//! A library that accepts for itself gets its connections from [`relay`], which is the only one to know where it listens.

mod relay;

use std::collections::BTreeMap;
use std::future::Future;
use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::socket::{Backlog, listen};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep, sleep};

pub(crate) use relay::Relay;
pub use relay::{RelayedCallers, inner_address, relay, relay_known};

/// Descriptors that no listener gives to its callers; half of all where a process may have fewer than twice as many.
pub const RESERVED_DESCRIPTORS: usize = 512;

/// A process asks for so many descriptors at most.
const MOST_DESCRIPTORS: u64 = 65_536;

/// Of all connections of a listener, one address gets this part.
const ADDRESSES: usize = 4;

/// From an `accept` that failed to the next.
const REFUSAL_PAUSE: Duration = Duration::from_millis(200);

/// Connections that wait to be accepted: past them the system lets callers wait for a second and more. They take no descriptors.
const WAITING: i32 = 1024;

/// Descriptors that the listeners of this process have not taken yet; unknown until the first asks.
static DESCRIPTORS: Mutex<Option<usize>> = Mutex::new(None);

/// The connections of one listener.
#[derive(Debug, Clone)]
pub struct Connections(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    most: usize,
    most_of_address: usize,
    descriptors: usize,
    open: Mutex<Open>,
}

#[derive(Debug, Default)]
struct Open {
    total: usize,
    by_address: BTreeMap<IpAddr, usize>,
    refused: Option<RefusedConnections>,
}

/// Connections that were closed at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefusedConnections {
    /// How many.
    pub connections: u64,
    /// Where the last one came from.
    pub address: IpAddr,
}

/// The place of one connection, until it is dropped.
#[derive(Debug)]
pub struct Slot {
    shared: Arc<Shared>,
    address: IpAddr,
}

impl Connections {
    /// At most `most` at once, each of which takes `descriptors` of this process; fewer where the process may not have so many.
    pub fn new(most: usize, descriptors: usize) -> Self {
        let wanted = most.saturating_mul(descriptors);
        let mut left = lock(&DESCRIPTORS);
        let free = left.unwrap_or_else(descriptors_for_connections);
        // The next listener gets something as well.
        let taken = wanted.min(free / 2).max(descriptors);
        *left = Some(free.saturating_sub(taken));
        let most = taken / descriptors.max(1);
        Self(Arc::new(Shared {
            most,
            most_of_address: most.div_ceil(ADDRESSES),
            descriptors: taken,
            open: Mutex::default(),
        }))
    }

    /// A place for a connection from `address`; nothing where there are too many already, and then it is counted as refused.
    pub fn admit(&self, address: IpAddr) -> Option<Slot> {
        let shared = &self.0;
        let place = network_of(address);
        let mut open = lock(&shared.open);
        let of_address = open.by_address.get(&place).copied().unwrap_or(0);
        if open.total >= shared.most || of_address >= shared.most_of_address {
            let before = open.refused.map_or(0, |refused| refused.connections);
            open.refused = Some(RefusedConnections { connections: before + 1, address });
            return None;
        }
        open.total += 1;
        open.by_address.insert(place, of_address + 1);
        Some(Slot { shared: Arc::clone(shared), address: place })
    }

    /// What was refused since the last call.
    pub fn take_refused(&self) -> Option<RefusedConnections> {
        lock(&self.0.open).refused.take()
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut open = lock(&self.shared.open);
        open.total -= 1;
        if let Some(count) = open.by_address.get_mut(&self.address) {
            *count -= 1;
            if *count == 0 {
                open.by_address.remove(&self.address);
            }
        }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        let mut left = lock(&DESCRIPTORS);
        *left = left.map(|left| left + self.descriptors);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing can panic while it is held.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Raises the limit of this process to what the system allows, and keeps the reserve back.
fn descriptors_for_connections() -> usize {
    // It fails only for a resource that does not exist.
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap_or((1024, 1024));
    let wanted = hard.min(MOST_DESCRIPTORS).max(soft);
    let raised = setrlimit(Resource::RLIMIT_NOFILE, wanted, hard).is_ok();
    let limit = if raised { wanted } else { soft };
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    limit - RESERVED_DESCRIPTORS.min(limit / 2)
}

/// One caller may have all addresses of an IPv6 network.
fn network_of(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
        address => address,
    }
}

/// A connection that has a place, and whose caller is not waited for longer than the listener's patience.
#[derive(Debug)]
pub struct Connection {
    stream: TcpStream,
    patience: Duration,
    deadline: Pin<Box<Sleep>>,
    _slot: Slot,
}

impl Connection {
    /// Within a runtime.
    pub fn new(stream: TcpStream, slot: Slot, patience: Duration) -> Self {
        // Answers are small, and wanted at once; it fails only where the caller has gone already.
        let _ = stream.set_nodelay(true);
        Self { stream, patience, deadline: Box::pin(sleep(patience)), _slot: slot }
    }

    fn in_time(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        match self.deadline.as_mut().poll(context) {
            Poll::Pending => Ok(()),
            Poll::Ready(()) => Err(io::ErrorKind::TimedOut.into()),
        }
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.in_time(context)?;
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        match written {
            Poll::Ready(Ok(1..)) => {
                let next = Instant::now() + self.patience;
                self.deadline.as_mut().reset(next);
            }
            Poll::Pending => self.in_time(context)?,
            Poll::Ready(_) => {}
        }
        written
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// Accepts connections, and closes at once what has no place.
#[derive(Debug)]
pub struct Listener {
    listener: TcpListener,
    connections: Connections,
    patience: Duration,
}

impl Listener {
    /// Closes a connection over which nothing was sent for `patience`.
    pub fn new(listener: TcpListener, connections: Connections, patience: Duration) -> Self {
        // Where it fails, fewer wait.
        if let Err(error) = Backlog::new(WAITING).and_then(|waiting| listen(&listener, waiting)) {
            tracing::warn!(%error, "fewer connections wait for their place");
        }
        Self { listener, connections, patience }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the system says.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// The next connection that has a place. The system's errors are waited out: most of them are a want of descriptors.
    pub async fn accept(&mut self) -> (Connection, SocketAddr) {
        loop {
            match self.listener.accept().await {
                Ok((stream, peer)) => {
                    if let Some(slot) = self.connections.admit(peer.ip()) {
                        return (Connection::new(stream, slot, self.patience), peer);
                    }
                }
                Err(error) => {
                    tracing::debug!(%error, "a connection was not accepted");
                    sleep(REFUSAL_PAUSE).await;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    fn check(most: usize, callers: &[(u8, bool)]) {
        let connections = Connections::new(most, 1);
        let mut slots: Vec<(u8, Slot)> = Vec::new();
        let mut refused = 0;
        for &(host, goes) in callers {
            if goes {
                slots.pop();
                continue;
            }
            let of_host = slots.iter().filter(|(other, _)| *other == host).count();
            let expected = slots.len() < most && of_host < most.div_ceil(ADDRESSES);
            let slot = connections.admit(IpAddr::from([10, 0, 0, host]));
            assert_eq!(slot.is_some(), expected);
            match slot {
                Some(slot) => slots.push((host, slot)),
                None => refused += 1,
            }
        }
        let told = connections.take_refused();
        assert_eq!(told.map_or(0, |told| told.connections), refused);
        assert_eq!(connections.take_refused(), None);
        drop(slots);
        let open = lock(&connections.0.open);
        assert_eq!((open.total, open.by_address.len()), (0, 0));
    }

    proptest! {
        #[test]
        fn no_listener_holds_more_than_its_bounds(
            most in 1_usize..20,
            callers in prop::collection::vec((0_u8..6, any::<bool>()), 0..200),
        ) {
            check(most, &callers);
        }
    }

    #[test]
    fn a_network_of_ipv6_counts_as_one_address() {
        let network = |text: &str| network_of(text.parse().expect("an address"));
        assert_eq!(network("2001:db8::1"), network("2001:db8::ffff:1"));
        assert_ne!(network("2001:db8::1"), network("2001:db8:0:1::1"));
        assert_eq!(network("::ffff:10.0.0.1"), network("10.0.0.1"));
    }

    fn within<T>(work: impl Future<Output = T>) -> T {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let deadline = Duration::from_secs(60);
            tokio::time::timeout(deadline, work).await.expect("in time")
        })
    }

    async fn listener(patience: Duration) -> (Listener, SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        let connections = Connections::new(8, 1);
        (Listener::new(listener, connections, patience), address)
    }

    /// Whether a connection stays open for longer than the patience while each question is answered; one that is closed was not answered for as long.
    async fn is_kept(listener: &mut Listener, address: SocketAddr, patience: Duration) -> bool {
        let opened = Instant::now();
        let mut caller = TcpStream::connect(address).await.expect("it listens");
        let (mut connection, _) = listener.accept().await;
        let mut byte = [0; 1];
        let mut answered = opened;
        while opened.elapsed() < 3 * patience {
            caller.write_all(b"?").await.expect("it is open");
            if let Err(error) = connection.read_exact(&mut byte).await {
                assert_eq!(error.kind(), io::ErrorKind::TimedOut);
                assert!(answered.elapsed() >= patience, "{:?}", answered.elapsed());
                return false;
            }
            answered = Instant::now();
            connection.write_all(b"!").await.expect("it is open");
            caller.read_exact(&mut byte).await.expect("an answer");
            sleep(Duration::from_millis(20)).await;
        }
        true
    }

    /// Sends a byte every now and then, and never a whole request.
    #[test]
    fn a_caller_who_never_finishes_is_closed_and_one_who_is_answered_is_not() {
        within(async {
            let patience = Duration::from_millis(300);
            let (mut listener, address) = listener(patience).await;
            let mut caller = TcpStream::connect(address).await.expect("it listens");
            let (mut connection, _) = listener.accept().await;
            let slow = async {
                while caller.write_all(b"x").await.is_ok() {
                    sleep(Duration::from_millis(20)).await;
                }
            };
            let read = async {
                let mut bytes = [0; 1];
                loop {
                    if let Err(error) = connection.read_exact(&mut bytes).await {
                        return error;
                    }
                }
            };
            let error = tokio::select! {
                () = slow => panic!("the caller gives up first"),
                error = read => error,
            };
            assert_eq!(error.kind(), io::ErrorKind::TimedOut);

            // On a machine that stalls for longer than the patience, the connection is closed by right, and another one is tried.
            while !is_kept(&mut listener, address, patience).await {}
        });
    }

    #[test]
    fn a_relay_carries_both_ways_and_ends_with_either_side() {
        within(async {
            let inside = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
            let inner = inside.local_addr().expect("bound");
            let (outside, address) = listener(Duration::from_secs(60)).await;
            let connections = outside.connections.clone();
            let relaying = tokio::spawn(relay(outside, inner));
            for caller_ends in [true, false] {
                let mut caller = TcpStream::connect(address).await.expect("it listens");
                let (mut answerer, _) = inside.accept().await.expect("relayed");
                caller.write_all(b"question").await.expect("open");
                let mut bytes = [0; 8];
                answerer.read_exact(&mut bytes).await.expect("open");
                assert_eq!(&bytes, b"question");
                answerer.write_all(b"solution").await.expect("open");
                caller.read_exact(&mut bytes).await.expect("open");
                assert_eq!(&bytes, b"solution");
                let mut left = if caller_ends {
                    drop(caller);
                    answerer
                } else {
                    drop(answerer);
                    caller
                };
                assert_eq!(left.read(&mut bytes).await.expect("closed in order"), 0);
                while lock(&connections.0.open).total > 0 {
                    tokio::task::yield_now().await;
                }
            }
            relaying.abort();
        });
    }
}
