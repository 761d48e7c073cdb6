//! Free ports of the loopback interface, for parties whose cluster file names no address.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};

/// How often another port is tried for one party.
const MAXIMUM_TRIES: usize = 64;

/// So many addresses on 127.0.0.1 that nobody uses, neither by UDP nor by TCP.
///
/// They are only found free: another process may take one before it is used, and the party then says so.
pub(crate) fn free_addresses(count: usize) -> io::Result<Vec<SocketAddr>> {
    // All are held until all are found, so that none is found twice.
    let mut held = Vec::with_capacity(count);
    while held.len() < count {
        held.push(free_address()?);
    }
    Ok(held.iter().map(|(address, _, _)| *address).collect())
}

fn free_address() -> io::Result<(SocketAddr, TcpListener, UdpSocket)> {
    let mut last = None;
    for _ in 0..MAXIMUM_TRIES {
        let datagrams = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        let address = datagrams.local_addr()?;
        match TcpListener::bind(address) {
            Ok(listener) => return Ok((address, listener, datagrams)),
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| io::ErrorKind::AddrInUse.into()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn free_addresses_differ() {
        let addresses = free_addresses(40).expect("40 free ports");
        let different: BTreeSet<SocketAddr> = addresses.iter().copied().collect();
        assert_eq!(different.len(), 40);
    }
}
