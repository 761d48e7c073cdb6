//! Links that lose or break what they pass on.

use std::io::Read;
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use understudy_bus::{LinkKind, free_addresses};

/// Passes datagrams on to `target` and back, and loses one of ten in each direction.
pub(crate) struct LossyWire {
    pub(crate) address: SocketAddr,
    ended: Arc<AtomicBool>,
}

impl LossyWire {
    pub(crate) fn to(target: SocketAddr, seed: u64) -> Self {
        let socket = UdpSocket::bind(("127.0.0.1", 0)).expect("a free port");
        let address = socket.local_addr().expect("bound");
        let ended = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&ended);
        std::thread::spawn(move || {
            let mut clients: Vec<(SocketAddr, UdpSocket)> = Vec::new();
            let mut loss = Loss(seed);
            let mut bytes = vec![0; 65536];
            loop {
                let Ok((length, client)) = socket.recv_from(&mut bytes) else {
                    return;
                };
                if over.load(Ordering::Relaxed) {
                    return;
                }
                let known = clients.iter().position(|(address, _)| *address == client);
                let place = known.unwrap_or_else(|| {
                    let out = UdpSocket::bind(("127.0.0.1", 0)).expect("a free port");
                    out.connect(target).expect("it is loopback");
                    let back = out.try_clone().expect("a descriptor");
                    let front = socket.try_clone().expect("a descriptor");
                    let (over, mut loss) =
                        (Arc::clone(&over), Loss(seed ^ 0x5555 ^ u64::from(client.port())));
                    back.set_read_timeout(Some(Duration::from_millis(100))).expect("a timeout");
                    std::thread::spawn(move || {
                        let mut bytes = vec![0; 65536];
                        while !over.load(Ordering::Relaxed) {
                            if let Ok(length) = back.recv(&mut bytes)
                                && !loss.lost()
                            {
                                let _ = front.send_to(&bytes[..length], client);
                            }
                        }
                    });
                    clients.push((client, out));
                    clients.len() - 1
                });
                if !loss.lost() {
                    let _ = clients[place].1.send(&bytes[..length]);
                }
            }
        });
        Self { address, ended }
    }
}

impl Drop for LossyWire {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        let wake = UdpSocket::bind(("127.0.0.1", 0));
        let _ = wake.and_then(|socket| socket.send_to(&[0], self.address));
    }
}

/// One of ten, by the same sequence for the same seed.
struct Loss(u64);

impl Loss {
    fn lost(&mut self) -> bool {
        self.below(10) == 0
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }
}

/// Passes streams on to `target` and back, and breaks each of the first ones after some hundred or thousand bytes.
pub(crate) struct BreakingWire {
    pub(crate) address: SocketAddr,
    ended: Arc<AtomicBool>,
}

impl BreakingWire {
    /// Streams that break, one after the other.
    const BREAKS: u32 = 5;

    pub(crate) fn to(target: SocketAddr, seed: u64) -> Self {
        let address = free_addresses(1).expect("a free port")[0];
        let frames = LinkKind::Zenoh.frames_address(address).expect("a port");
        let listener = TcpListener::bind(frames).expect("a free port");
        let target = LinkKind::Zenoh.frames_address(target).expect("a port");
        let ended = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&ended);
        std::thread::spawn(move || {
            let mut random = Loss(seed);
            let mut breaks = 0;
            for front in listener.incoming().map_while(Result::ok) {
                if over.load(Ordering::Relaxed) {
                    return;
                }
                let Ok(back) = TcpStream::connect(target) else {
                    continue;
                };
                breaks += 1;
                let bytes = match breaks {
                    ..=Self::BREAKS => random.below(4000),
                    _ => u64::MAX,
                };
                for (from, to) in [(&front, &back), (&back, &front)] {
                    let from = from.try_clone().expect("a descriptor");
                    let mut to = to.try_clone().expect("a descriptor");
                    std::thread::spawn(move || {
                        // It ends where either end does.
                        let _ = std::io::copy(&mut (&from).take(bytes), &mut to);
                        let _ = from.shutdown(Shutdown::Both);
                        let _ = to.shutdown(Shutdown::Both);
                    });
                }
            }
        });
        Self { address, ended }
    }
}

impl Drop for BreakingWire {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        let frames = LinkKind::Zenoh.frames_address(self.address);
        // It waits for the next stream.
        let _ = frames.map(TcpStream::connect);
    }
}
