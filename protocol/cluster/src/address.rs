//! What a member can be called and reached by.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};

use understudy_wire::Via;

/// Where a member listens, as far as that is known: on the network that every cluster has, on the second one of a cluster with two, and on the direct link
/// between the two remote I/Os of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Addresses<A = SocketAddr> {
    /// Address on the first network.
    pub first: Option<A>,
    /// Address on the second network.
    pub second: Option<A>,
    /// Address on the direct link.
    pub link: Option<A>,
}

impl<A> Default for Addresses<A> {
    fn default() -> Self {
        Self { first: None, second: None, link: None }
    }
}

impl<A> Addresses<A> {
    /// The same, borrowed.
    pub(crate) fn as_ref(&self) -> Addresses<&A> {
        Addresses {
            first: self.first.as_ref(),
            second: self.second.as_ref(),
            link: self.link.as_ref(),
        }
    }

    /// Each value that is there, mapped.
    pub(crate) fn map<B>(self, mut value: impl FnMut(A) -> B) -> Addresses<B> {
        Addresses {
            first: self.first.map(&mut value),
            second: self.second.map(&mut value),
            link: self.link.map(value),
        }
    }

    /// Address on a path.
    pub fn at(self, via: Via) -> Option<A> {
        match via {
            Via::First => self.first,
            Via::Second => self.second,
            Via::Link => self.link,
        }
    }
}

/// The longest name of a member, in characters.
pub const MAXIMUM_NAME_LENGTH: usize = 48;

/// Why no other member can reach one at this address; nothing where it could.
pub fn why_unreachable(address: SocketAddr) -> Option<&'static str> {
    let host = address.ip().to_canonical();
    let is_broadcast = matches!(host, IpAddr::V4(host) if host.is_broadcast());
    if host.is_unspecified() {
        Some("it means every interface of the machine that listens, and cannot be called")
    } else if host.is_multicast() || is_broadcast {
        Some("it means many devices at once")
    } else if address.port() == 0 {
        Some("port 0 means any free port, and cannot be called")
    } else {
        None
    }
}

/// Multicast groups of the frames of one cluster.
pub const MULTICAST_GROUPS: u8 = 33;

/// Whether the frames of a cluster can have multicast groups from this address on.
pub fn is_multicast_range(first: SocketAddrV4) -> bool {
    let last = u32::from(*first.ip()).saturating_add(u32::from(MULTICAST_GROUPS) - 1);
    first.ip().is_multicast() && Ipv4Addr::from(last).is_multicast() && first.port() != 0
}

/// Whether a member can have this name.
pub fn is_name(text: &str) -> bool {
    let legal = |character: char| character.is_ascii_alphanumeric() || "-_".contains(character);
    let starts = text.starts_with(|first: char| first.is_ascii_alphabetic());
    starts && text.chars().all(legal) && text.len() <= MAXIMUM_NAME_LENGTH
}
