//! Free ports of the loopback interface, for members whose cluster file names no address.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::ops::Range;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr as UnixAddress, UnixDatagram};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::{Mutex, PoisonError};

use understudy_wire::ZENOH_PORT_OFFSET;

/// Ports that no system gives to outgoing connections of its own accord, so that a member that is restarted finds its port
/// again: Linux begins at 32768, others at 49152. So do the ports of their frames over Zenoh.
const PORTS: Range<u16> = 16_384..32_768 - ZENOH_PORT_OFFSET;
/// Ports that a process claims at once. The next process, whose number is one higher, begins as many ports further on.
const BLOCK: u16 = 61;

/// The port, counted from the first of [`PORTS`], that this process tries next: nobody in it is given one twice before all were tried.
static NEXT: AtomicU16 = AtomicU16::new(0);

/// The blocks of ports that this process has claimed, until it ends: each is the name of a socket, which the system gives to one process alone.
static CLAIMED: Mutex<BTreeMap<u16, UnixDatagram>> = Mutex::new(BTreeMap::new());

/// The name that a block of ports is claimed by.
fn claim(block: u16) -> io::Result<UnixDatagram> {
    let name = format!("understudy.ports.{block}");
    UnixDatagram::bind_addr(&UnixAddress::from_abstract_name(name)?)
}

/// Claims a block of ports, where this process has not claimed it yet.
///
/// # Errors
/// Another process has.
fn claimed(block: u16) -> io::Result<()> {
    let mut claimed = CLAIMED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Entry::Vacant(place) = claimed.entry(block) {
        place.insert(claim(block)?);
    }
    Ok(())
}

/// So many addresses on 127.0.0.1 that no process uses, neither by UDP nor by TCP, nor for frames over Zenoh. No other process is given them while this
/// one lives; one that asks for a port by its number may take it, and the member then says so.
///
/// # Errors
/// Where fewer are free, or no socket can be had.
pub fn free_addresses(count: usize) -> io::Result<Vec<SocketAddr>> {
    let span = PORTS.end - PORTS.start;
    let own = (std::process::id().wrapping_mul(BLOCK.into()) % u32::from(span)) as u16;
    let mut last = None;
    let mut found = Vec::with_capacity(count);
    for _ in PORTS {
        if found.len() == count {
            break;
        }
        let turn = NEXT.fetch_add(1, Ordering::Relaxed);
        let place = own.wrapping_add(turn) % span;
        let port = PORTS.start + place;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let frames = SocketAddr::from((Ipv4Addr::LOCALHOST, port + ZENOH_PORT_OFFSET));
        let free = claimed(place / BLOCK)
            .and_then(|()| UdpSocket::bind(address))
            .and_then(|_datagrams| TcpListener::bind(address))
            .and_then(|_operators| TcpListener::bind(frames));
        match free {
            Ok(_) => found.push(address),
            Err(error) => last = Some(error),
        }
    }
    if found.len() < count {
        return Err(last.unwrap_or_else(|| io::ErrorKind::AddrInUse.into()));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn free_addresses_differ_and_are_left_alone_by_the_system() {
        let both = [free_addresses(20), free_addresses(20)];
        let addresses: BTreeSet<SocketAddr> =
            both.into_iter().flat_map(|addresses| addresses.expect("20 free ports")).collect();
        assert_eq!(addresses.len(), 40);
        assert!(addresses.iter().all(|address| PORTS.contains(&address.port())));
    }

    #[test]
    fn the_ports_of_another_process_are_passed_over() {
        // As many as there are blocks are claimed elsewhere, each for a moment.
        for _ in 0..5 {
            let block = |address: SocketAddr| (address.port() - PORTS.start) / BLOCK;
            let own = block(free_addresses(1).expect("a free port")[0]);
            let blocks = (PORTS.end - PORTS.start) / BLOCK;
            let elsewhere = (own + 1) % blocks;
            let Ok(_other) = claim(elsewhere) else { continue };
            let found = free_addresses(2 * usize::from(BLOCK)).expect("free ports");
            assert!(found.into_iter().all(|address| block(address) != elsewhere));
        }
    }

    #[test]
    fn a_port_in_use_is_passed_over() {
        let taken: Vec<UdpSocket> = free_addresses(3)
            .expect("free ports")
            .into_iter()
            .map(|address| UdpSocket::bind(address).expect("found free"))
            .collect();
        let used: Vec<SocketAddr> =
            taken.iter().map(|socket| socket.local_addr().expect("bound")).collect();
        let others = free_addresses(50).expect("free ports");
        assert!(others.iter().all(|address| !used.contains(address)));
    }
}
