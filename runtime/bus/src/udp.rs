//! Plain UDP: one datagram for each receiver, or one for all where the cluster has multicast groups.
//!
//! A datagram's sender is not looked at: what is in a frame decides. Without groups one send for each receiver, and not one sendmmsg for all,
//! because on loopback the time goes into delivering each datagram and not into entering the kernel.

use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};

use nix::sys::socket::{setsockopt, sockopt};
use understudy_seal::OVERHEAD_BYTES;
use understudy_wire::{Body, Frame, MAXIMUM_FRAME_BYTES, Member, Roster, Topic, Via};

use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::link::{Link, LinkCounters};
use crate::multicast::Groups;

/// Asked of the system for datagrams that wait while this member is not scheduled; the system may give less.
pub(crate) const RECEIVE_BUFFER_BYTES: usize = 1024 * 1024;

pub(crate) struct UdpLink {
    socket: UdpSocket,
    address: SocketAddr,
    roster: Roster,
    audiences: [Vec<(Member, SocketAddr)>; Topic::ALL.len()],
    groups: Option<Groups>,
    datagram: Box<[u8]>,
    unsent: u64,
}

impl UdpLink {
    pub(crate) fn open(endpoints: &Endpoints) -> Result<Self, BusError> {
        let address = endpoints.own().address;
        let failed = |source| BusError::listen(address, source);
        let socket = UdpSocket::bind(address).map_err(failed)?;
        socket.set_nonblocking(true).map_err(failed)?;
        setsockopt(&socket, sockopt::RcvBuf, &RECEIVE_BUFFER_BYTES)
            .map_err(BusError::system("a receive buffer for the socket"))?;
        let audience = |topic| {
            let peers = endpoints.audience(topic);
            peers.map(|peer| (peer.member, peer.address)).collect()
        };
        let groups = endpoints.multicast();
        let groups = groups.map(|first| Groups::join(endpoints, first, &socket));
        Ok(Self {
            groups: groups.transpose()?,
            address: socket.local_addr().map_err(failed)?,
            socket,
            roster: endpoints.roster().clone(),
            audiences: Topic::ALL.map(audience),
            // One byte more than a sealed frame may have, so that what is too long is seen to be.
            datagram: vec![0; MAXIMUM_FRAME_BYTES + OVERHEAD_BYTES + 1].into(),
            unsent: 0,
        })
    }
}

impl Link for UdpLink {
    fn address(&self) -> SocketAddr {
        self.address
    }

    fn send(&mut self, frame: &Frame, bytes: &[u8]) {
        let only = match &frame.body {
            Body::Transfer(transfer) => Some(Member::Station(transfer.to)),
            _ => None,
        };
        let topic = self.roster.topic(frame);
        let audience = &self.audiences[topic as usize];
        let group = self.groups.as_ref().and_then(|groups| groups.address(topic));
        if let Some(group) = group.filter(|_| only.is_none() && audience.len() > 1) {
            if self.socket.send_to(bytes, group).is_err() {
                self.unsent += 1;
            }
            return;
        }
        for (member, address) in audience {
            if only.is_none_or(|only| only == *member)
                && self.socket.send_to(bytes, address).is_err()
            {
                self.unsent += 1;
            }
        }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> Option<Via> {
        // Most frames come by the groups, where there are any.
        let groups = self.groups.as_ref();
        let length = groups.and_then(|groups| groups.receive(&mut self.datagram));
        let own = || self.socket.recv(&mut self.datagram).ok();
        let length = length.or_else(own)?;
        bytes.clear();
        bytes.extend_from_slice(&self.datagram[..length]);
        Some(Via::First)
    }

    fn readiness(&self) -> BorrowedFd<'_> {
        match &self.groups {
            Some(groups) => groups.readiness(),
            None => self.socket.as_fd(),
        }
    }

    fn counters(&self) -> LinkCounters {
        LinkCounters { unsent: self.unsent, ..LinkCounters::default() }
    }
}
