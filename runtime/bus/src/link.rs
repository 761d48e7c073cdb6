//! What carries frames.

use std::fmt;
use std::net::SocketAddr;
use std::os::fd::BorrowedFd;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{Frame, Member, Via, ZENOH_PORT_OFFSET};

use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::paths::Paths;
use crate::udp::UdpLink;
use crate::zenoh_link::ZenohLink;

/// Carries frames between this member and its peers. Any frame may be lost, doubled, late or changed; nothing blocks.
pub trait Link: Send {
    /// Where this member listens.
    fn address(&self) -> SocketAddr;

    /// Sends `bytes`, which are `frame` encoded, to all whom it concerns.
    fn send(&mut self, frame: &Frame, bytes: &[u8]);

    /// Puts the next datagram in place of what is in `bytes`, and says over which network it came; nothing where none has arrived.
    fn receive(&mut self, bytes: &mut Vec<u8>) -> Option<Via>;

    /// Readable when there is something to receive.
    fn readiness(&self) -> BorrowedFd<'_>;

    /// What happened since the start.
    fn counters(&self) -> LinkCounters;

    /// Lets nothing more pass over one of several paths, in either direction, or everything again; a link over one network has nothing to
    /// pull.
    fn plug(&mut self, _: Via, _is_plugged: bool) {}

    /// The next time that the link was opened anew; to be asked again until there is none.
    fn reopening(&mut self) -> Option<Reopening> {
        None
    }
}

/// A link received none of its peers, or not one that is connected, and was closed and opened anew.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reopening {
    /// Over which of several paths it is.
    pub via: Option<Via>,
    /// How long no peer was received, or `peer` was not.
    pub silence: Duration,
    /// The one that is connected and was not received; none where no peer was.
    pub peer: Option<Member>,
    /// Why the link could not be opened; it is tried again.
    pub failure: Option<String>,
}

/// What a link could not do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LinkCounters {
    /// Frames that the system or the library did not take, one for each receiver where they are counted apart.
    pub unsent: u64,
    /// Datagrams that found this member's own queue full.
    pub overrun: u64,
    /// Times that the link was opened anew ([`Reopening`]).
    pub reopened: u64,
}

/// The links that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkKind {
    /// Zenoh over TCP: it loses no frame on its way, and a lost segment delays all frames behind it.
    #[default]
    Zenoh,
    /// Plain UDP, one datagram for each receiver or for each multicast group.
    Udp,
}

impl LinkKind {
    /// As it is written in files and on the command line.
    pub const NAMES: [(&'static str, Self); 2] = [("zenoh", Self::Zenoh), ("udp", Self::Udp)];

    /// Where the member with this address receives frames: at the address itself by UDP; over Zenoh at the TCP port
    /// [`ZENOH_PORT_OFFSET`] above it, because operators use the TCP port of the address.
    ///
    /// # Errors
    /// [`BusError::NoZenohPort`] where there is no such port.
    pub fn frames_address(self, address: SocketAddr) -> Result<SocketAddr, BusError> {
        let port = match self {
            Self::Udp => Some(address.port()),
            Self::Zenoh => address.port().checked_add(ZENOH_PORT_OFFSET),
        };
        let port = port.ok_or(BusError::NoZenohPort { address })?;
        Ok(SocketAddr::new(address.ip(), port))
    }

    /// Opens the link of one member, over each path that it is on.
    ///
    /// # Errors
    /// [`BusError::PortInUse`], [`BusError::Listen`], [`BusError::NoZenohPort`] or [`BusError::Zenoh`].
    pub fn open(self, endpoints: &Endpoints) -> Result<Box<dyn Link>, BusError> {
        let paths = endpoints.paths();
        match paths.len() {
            1 => self.open_one(endpoints),
            _ => Ok(Box::new(Paths::open(self, paths)?)),
        }
    }

    /// Opens the link over one path.
    pub(crate) fn open_one(self, endpoints: &Endpoints) -> Result<Box<dyn Link>, BusError> {
        Ok(match self {
            Self::Zenoh => Box::new(ZenohLink::open(endpoints)?),
            Self::Udp => Box::new(UdpLink::open(endpoints)?),
        })
    }
}

impl fmt::Display for LinkKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = Self::NAMES.iter().find(|(_, kind)| kind == self);
        formatter.write_str(known.map_or("", |(name, _)| name))
    }
}

/// A name that is no link.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no link: there are zenoh and udp")]
pub struct NoSuchLink {
    found: String,
}

impl FromStr for LinkKind {
    type Err = NoSuchLink;

    fn from_str(text: &str) -> Result<Self, NoSuchLink> {
        let known = Self::NAMES.iter().find(|(name, _)| *name == text);
        known.map(|(_, kind)| *kind).ok_or_else(|| NoSuchLink { found: text.to_owned() })
    }
}
