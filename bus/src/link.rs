//! What carries frames.

use std::fmt;
use std::net::SocketAddr;
use std::os::fd::BorrowedFd;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use understudy_wire::Frame;

use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::udp::UdpLink;
use crate::zenoh_link::ZenohLink;

/// Carries frames between this party and its peers. Any frame may be lost, doubled, late or changed; nothing blocks.
pub trait Link: Send {
    /// Where this party listens.
    fn address(&self) -> SocketAddr;

    /// Sends `bytes`, which are `frame` encoded, to all whom it concerns.
    fn send(&mut self, frame: &Frame, bytes: &[u8]);

    /// Puts the next datagram in place of what is in `bytes`; false where none has arrived.
    fn receive(&mut self, bytes: &mut Vec<u8>) -> bool;

    /// Readable when there is something to receive.
    fn readiness(&self) -> BorrowedFd<'_>;

    /// What happened since the start.
    fn counters(&self) -> LinkCounters;
}

/// What a link could not do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LinkCounters {
    /// Frames that the system or the library did not take, one for each receiver where they are counted apart.
    pub unsent: u64,
    /// Datagrams that found this party's own queue full.
    pub overrun: u64,
    /// Subscriptions that were made anew because nothing came through them.
    pub renewed: u64,
}

/// The links that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkKind {
    /// Zenoh with its low-latency transport over UDP.
    #[default]
    Zenoh,
    /// Zenoh over TCP, for networks that let no UDP through; a lost segment costs a cycle or twenty.
    ZenohTcp,
    /// Plain UDP, one datagram for each receiver.
    Udp,
}

impl LinkKind {
    /// As it is written in files and on the command line.
    pub const NAMES: [(&'static str, Self); 3] = [
        ("zenoh", Self::Zenoh),
        ("zenoh-tcp", Self::ZenohTcp),
        ("udp", Self::Udp),
    ];

    /// Opens the link of one party.
    ///
    /// # Errors
    /// [`BusError::PortInUse`], [`BusError::Listen`] or [`BusError::Zenoh`].
    pub fn open(self, endpoints: &Endpoints) -> Result<Box<dyn Link>, BusError> {
        Ok(match self {
            Self::Zenoh | Self::ZenohTcp => Box::new(ZenohLink::open(endpoints, self)?),
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
#[error("{found:?} is no link: there are zenoh, zenoh-tcp and udp")]
pub struct NoSuchLink {
    found: String,
}

impl FromStr for LinkKind {
    type Err = NoSuchLink;

    fn from_str(text: &str) -> Result<Self, NoSuchLink> {
        let known = Self::NAMES.iter().find(|(name, _)| *name == text);
        known.map(|(_, kind)| *kind).ok_or_else(|| NoSuchLink {
            found: text.to_owned(),
        })
    }
}
