//! The thread of the proxy: it carries all datagrams, and accepts the streams.
//!
//! Invariant: it waits for nothing but `ppoll`, and takes [`IN_A_ROW`] datagrams of one socket at most before it looks at
//! the others and at what is due.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::os::fd::AsFd;
use std::sync::Arc;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::streams::Way;
use super::{Route, Shared, now_ns};
use crate::shaper::{Passed, Shaper};

/// The longest datagram that UDP has.
const MAXIMUM_DATAGRAM: usize = 65_535;
/// Datagrams of one socket before the others are looked at.
const IN_A_ROW: usize = 64;
/// Clients of one route; the one that was silent for longest makes room for the next.
const MAXIMUM_CLIENTS: usize = 64;
/// Datagrams on their way, over all routes; what comes on top of them is refused.
const MAXIMUM_ON_THE_WAY: usize = 1 << 16;

/// One route of datagrams.
#[derive(Debug)]
pub(super) struct Lane {
    listener: UdpSocket,
    to: SocketAddr,
    forth: Shaper,
    back: Shaper,
    clients: Vec<Client>,
}

#[derive(Debug)]
struct Client {
    address: SocketAddr,
    towards: Arc<UdpSocket>,
    used_ns: u64,
}

/// A datagram on its way. The way itself is part of it, so that it arrives also where its client is forgotten meanwhile.
#[derive(Debug)]
struct OnTheWay {
    due_ns: u64,
    /// Of two that are due at once, the one that came first goes first.
    number: u64,
    bytes: Vec<u8>,
    exit: Exit,
}

#[derive(Debug)]
enum Exit {
    Forth(Arc<UdpSocket>),
    Back(usize, SocketAddr),
}

impl PartialEq for OnTheWay {
    fn eq(&self, other: &Self) -> bool {
        (self.due_ns, self.number) == (other.due_ns, other.number)
    }
}

impl Eq for OnTheWay {}

impl PartialOrd for OnTheWay {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OnTheWay {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.due_ns, self.number).cmp(&(other.due_ns, other.number))
    }
}

/// What is on its way, by when it is due.
#[derive(Debug, Default)]
struct Road {
    waiting: BinaryHeap<Reverse<OnTheWay>>,
    count: u64,
}

impl Road {
    /// False where there is no room.
    fn enter(&mut self, passed: Passed, exit: Exit) -> bool {
        if self.waiting.len() >= MAXIMUM_ON_THE_WAY {
            return false;
        }
        self.count += 1;
        self.waiting.push(Reverse(OnTheWay {
            due_ns: passed.due_ns,
            number: self.count,
            bytes: passed.bytes,
            exit,
        }));
        true
    }

    fn next_due_ns(&self) -> Option<u64> {
        self.waiting.peek().map(|Reverse(next)| next.due_ns)
    }

    fn take_due(&mut self, now_ns: u64) -> Option<OnTheWay> {
        let due = self.next_due_ns()? <= now_ns;
        due.then(|| self.waiting.pop().map(|Reverse(next)| next)).flatten()
    }
}

impl Lane {
    pub(super) fn new(listener: UdpSocket, settings: &Route, seed: u64) -> Self {
        Self {
            listener,
            to: settings.to,
            forth: Shaper::new(settings.forth, seed),
            back: Shaper::new(settings.back, seed + 1),
            clients: Vec::new(),
        }
    }

    /// The socket of a client, made where it is new; nothing where the system gives none.
    fn towards(&mut self, address: SocketAddr, now_ns: u64) -> Option<Arc<UdpSocket>> {
        if let Some(client) = self.clients.iter_mut().find(|one| one.address == address) {
            client.used_ns = now_ns;
            return Some(Arc::clone(&client.towards));
        }
        let any: SocketAddr = match self.to {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(any).ok()?;
        socket.connect(self.to).ok()?;
        socket.set_nonblocking(true).ok()?;
        if self.clients.len() >= MAXIMUM_CLIENTS {
            let oldest = self.clients.iter().enumerate();
            let oldest = oldest.min_by_key(|(_, client)| client.used_ns);
            if let Some((place, _)) = oldest {
                self.clients.swap_remove(place);
            }
        }
        let towards = Arc::new(socket);
        self.clients.push(Client { address, towards: Arc::clone(&towards), used_ns: now_ns });
        Some(towards)
    }

    fn take_forth(&mut self, buffer: &mut [u8], road: &mut Road, shared: &Shared) {
        for _ in 0..IN_A_ROW {
            let Ok((length, address)) = self.listener.recv_from(buffer) else {
                return;
            };
            let now = now_ns();
            let Some(towards) = self.towards(address, now) else {
                shared.sent(false);
                continue;
            };
            let passed: Vec<Passed> = self.forth.datagram(now, &buffer[..length]).collect();
            shared.count(passed.len());
            for passed in passed {
                if !road.enter(passed, Exit::Forth(Arc::clone(&towards))) {
                    shared.sent(false);
                }
            }
        }
    }

    fn take_back(
        &mut self,
        place: usize,
        client: usize,
        buffer: &mut [u8],
        road: &mut Road,
        shared: &Shared,
    ) {
        for _ in 0..IN_A_ROW {
            let Some(found) = self.clients.get_mut(client) else {
                return;
            };
            // A refused connection says only that nobody listens there now.
            let Ok(length) = found.towards.recv(buffer) else {
                return;
            };
            let now = now_ns();
            found.used_ns = now;
            let address = found.address;
            let passed: Vec<Passed> = self.back.datagram(now, &buffer[..length]).collect();
            shared.count(passed.len());
            for passed in passed {
                if !road.enter(passed, Exit::Back(place, address)) {
                    shared.sent(false);
                }
            }
        }
    }
}

/// Runs until the proxy ends.
pub(super) fn carry(mut lanes: Vec<Lane>, mut streams: Vec<Way>, shared: &Arc<Shared>) {
    let mut buffer = vec![0; MAXIMUM_DATAGRAM];
    let mut road = Road::default();
    while !shared.is_ending() {
        let ready = wait(&lanes, &streams, shared, road.next_due_ns());
        let mut ready = ready.into_iter();
        // The bell, which rings for the end alone.
        ready.next();
        for way in &mut streams {
            if ready.next() == Some(true) {
                way.accept(shared);
            }
        }
        for (place, lane) in lanes.iter_mut().enumerate() {
            // Clients first: a new one would move the others' places.
            let forth = ready.next() == Some(true);
            for client in 0..lane.clients.len() {
                if ready.next() == Some(true) {
                    lane.take_back(place, client, &mut buffer, &mut road, shared);
                }
            }
            if forth {
                lane.take_forth(&mut buffer, &mut road, shared);
            }
        }
        let now = now_ns();
        while let Some(next) = road.take_due(now) {
            let sent = match &next.exit {
                // An answer that nobody listened to the one before spoils one sending, and no more.
                Exit::Forth(towards) => {
                    towards.send(&next.bytes).or_else(|_| towards.send(&next.bytes))
                }
                Exit::Back(lane, client) => lanes[*lane].listener.send_to(&next.bytes, client),
            };
            shared.sent(sent.is_ok());
        }
    }
    for way in streams {
        way.end();
    }
}

/// What is readable: the bell, each listener of streams, and each lane's listener with its clients.
fn wait(lanes: &[Lane], streams: &[Way], shared: &Shared, until_ns: Option<u64>) -> Vec<bool> {
    let readable = |descriptor| PollFd::new(descriptor, PollFlags::POLLIN);
    let mut descriptors = vec![readable(shared.as_fd())];
    descriptors.extend(streams.iter().map(|way| readable(way.listener().as_fd())));
    for lane in lanes {
        descriptors.push(readable(lane.listener.as_fd()));
        let clients = lane.clients.iter();
        descriptors.extend(clients.map(|client| readable(client.towards.as_fd())));
    }
    let timeout = until_ns.map(|until| {
        let wait = std::time::Duration::from_nanos(until.saturating_sub(now_ns()));
        TimeSpec::from_duration(wait)
    });
    match ppoll(&mut descriptors, timeout, None) {
        Ok(_) => descriptors.iter().map(|descriptor| descriptor.any().unwrap_or(false)).collect(),
        Err(Errno::EINTR) => Vec::new(),
        // Without memory for it nothing is readable; the next round may have it.
        Err(_) => Vec::new(),
    }
}
