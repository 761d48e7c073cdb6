//! Connections: for each direction one thread that reads and one that writes when it is time.
//!
//! ```text
//!   client ──► reader ──(at most QUEUE pieces)──► writer ──► server      and the same back
//! ```
//!
//! A full queue stops the reader, so that TCP itself slows its sender down. When one side closes, what is on its way arrives first.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use super::{Route, Shared, now_ns};
use crate::impairment::Impairment;
use crate::shaper::{Passed, Shaper};

/// Pieces on their way in one direction.
const QUEUE: usize = 256;
/// Of one piece, at most: about what one packet carries.
const PIECE_BYTES: usize = 1400;
/// Connections of one route at a time; further ones are closed at once.
const MAXIMUM_CONNECTIONS: usize = 64;
/// How long the far side may take to answer a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// How often a thread that waits looks whether the proxy ends.
const LOOK: Duration = Duration::from_millis(100);

/// One route of streams.
#[derive(Debug)]
pub(super) struct Way {
    listener: TcpListener,
    to: SocketAddr,
    impairments: [Impairment; 2],
    seed: u64,
    open: Vec<Connection>,
}

#[derive(Debug)]
struct Connection {
    client: TcpStream,
    thread: std::thread::JoinHandle<()>,
}

impl Way {
    pub(super) fn new(listener: TcpListener, settings: &Route, seed: u64) -> Self {
        Self {
            listener,
            to: settings.to,
            impairments: [settings.forth, settings.back],
            seed,
            open: Vec::new(),
        }
    }

    pub(super) fn listener(&self) -> &TcpListener {
        &self.listener
    }

    /// Takes the connections that wait.
    pub(super) fn accept(&mut self, shared: &Arc<Shared>) {
        while let Ok((client, _)) = self.listener.accept() {
            self.open.retain(|connection| !connection.thread.is_finished());
            let room = self.open.len() < MAXIMUM_CONNECTIONS;
            let Some(kept) = client.try_clone().ok().filter(|_| room) else {
                shared.sent(false);
                continue;
            };
            self.seed = self.seed.wrapping_add(0x9e37_79b9);
            let (to, seed, shared) = (self.to, self.seed, Arc::clone(shared));
            let impairments = self.impairments;
            let thread = std::thread::Builder::new()
                .name("proxy-stream".into())
                .spawn(move || join(&client, to, impairments, seed, &shared));
            if let Ok(thread) = thread {
                self.open.push(Connection { client: kept, thread });
            }
        }
    }

    pub(super) fn end(self) {
        for connection in self.open {
            // Its reader wakes; one that is closed already needs nothing.
            let _ = connection.client.shutdown(Shutdown::Both);
            let _ = connection.thread.join();
        }
    }
}

/// One connection, until both sides have closed.
fn join(
    client: &TcpStream,
    to: SocketAddr,
    impairments: [Impairment; 2],
    seed: u64,
    shared: &Shared,
) {
    let Ok(server) = TcpStream::connect_timeout(&to, CONNECT_TIMEOUT) else {
        shared.sent(false);
        let _ = client.shutdown(Shutdown::Both);
        return;
    };
    // Accepted sockets may inherit that the listener does not block; and small pieces must not wait for each other here.
    for stream in [client, &server] {
        let _ = stream.set_nonblocking(false);
        let _ = stream.set_nodelay(true);
        let _ = stream.set_read_timeout(Some(LOOK));
        let _ = stream.set_write_timeout(Some(LOOK));
    }
    std::thread::scope(|scope| {
        for (from, into, side) in [(client, &server, 0), (&server, client, 1)] {
            let (sender, receiver) = sync_channel(QUEUE);
            let shaper = Shaper::new(impairments[side], seed.wrapping_add(side as u64));
            scope.spawn(move || read(from, shaper, &sender, shared));
            scope.spawn(move || write(into, &receiver, shared));
        }
    });
}

fn read(mut from: &TcpStream, mut shaper: Shaper, into: &SyncSender<Passed>, shared: &Shared) {
    let mut buffer = [0; PIECE_BYTES];
    while !shared.is_ending() {
        match from.read(&mut buffer) {
            Ok(0) => return,
            Ok(length) => {
                shared.count(1);
                if into.send(shaper.piece(now_ns(), &buffer[..length])).is_err() {
                    return;
                }
            }
            Err(error) if is_patience(&error) => {}
            Err(_) => return,
        }
    }
}

fn write(mut into: &TcpStream, from: &Receiver<Passed>, shared: &Shared) {
    loop {
        let passed = match from.recv_timeout(LOOK) {
            Ok(passed) => passed,
            Err(RecvTimeoutError::Timeout) if !shared.is_ending() => continue,
            Err(_) => break,
        };
        if !wait_until(passed.due_ns, shared) {
            break;
        }
        let taken = write_whole(&mut into, &passed.bytes, shared);
        shared.sent(taken);
        if !taken {
            break;
        }
    }
    // The end of the stream is passed on as well.
    let _ = into.shutdown(Shutdown::Write);
}

/// False where the proxy ends before.
fn wait_until(due_ns: u64, shared: &Shared) -> bool {
    while !shared.is_ending() {
        let early = Duration::from_nanos(due_ns.saturating_sub(now_ns()));
        if early.is_zero() {
            return true;
        }
        std::thread::park_timeout(early.min(LOOK));
    }
    false
}

/// False where the far side is gone or the proxy ends.
fn write_whole(into: &mut &TcpStream, mut bytes: &[u8], shared: &Shared) -> bool {
    while !bytes.is_empty() && !shared.is_ending() {
        match into.write(bytes) {
            Ok(0) => return false,
            Ok(written) => bytes = &bytes[written..],
            Err(error) if is_patience(&error) => {}
            Err(_) => return false,
        }
    }
    bytes.is_empty()
}

fn is_patience(error: &std::io::Error) -> bool {
    use std::io::ErrorKind;
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
