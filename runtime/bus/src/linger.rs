//! No connection of this process lingers when it is closed.
//!
//! Zenoh (1.10.2, `LinkUnicastTcp::new`) sets SO_LINGER to ten seconds on each of its connections. To close one whose peer has lost its power or its
//! cable then takes the thread ten seconds, and that thread carries all other connections of the member: the failure of one machine would deafen
//! every other one. Zenoh has no setting for it, and its sockets are known here by their numbers only. So each is passed over a socket of
//! this process to itself, which gives a descriptor of the same connection, and there the option is taken back.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;

use nix::sys::socket::{ControlMessage, MsgFlags, sendmsg};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};
use socket2::SockRef;

/// The sockets of this process that were looked at.
#[derive(Debug)]
pub(crate) struct Lingering {
    /// By descriptor, the name that the system gives the socket.
    known: BTreeMap<RawFd, String>,
    passing: (UnixStream, UnixStream),
}

impl Lingering {
    /// Nothing looked at yet.
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self { known: BTreeMap::new(), passing: UnixStream::pair()? })
    }

    /// Takes the option back from the connections that are new; how many had it.
    pub(crate) fn end(&mut self) -> io::Result<usize> {
        let mut found = BTreeMap::new();
        let mut lingering = 0;
        for entry in fs::read_dir("/proc/self/fd")?.flatten() {
            let number = entry.file_name().to_string_lossy().parse().ok();
            // One that was closed meanwhile is none.
            let name = fs::read_link(entry.path()).ok();
            let name = name.map(|name| name.to_string_lossy().into_owned());
            let (Some(number), Some(name)) = (number, name) else {
                continue;
            };
            if !name.starts_with("socket:") {
                continue;
            }
            if self.known.get(&number) != Some(&name) {
                lingering += usize::from(self.end_of(number).unwrap_or(false));
            }
            found.insert(number, name);
        }
        self.known = found;
        Ok(lingering)
    }

    /// Whether a socket lingered.
    fn end_of(&self, number: RawFd) -> io::Result<bool> {
        let socket = self.duplicate(number)?;
        let socket = SockRef::from(&socket);
        if socket.linger()?.is_none() {
            return Ok(false);
        }
        socket.set_linger(None)?;
        Ok(true)
    }

    /// Another descriptor of the socket with this number.
    fn duplicate(&self, number: RawFd) -> io::Result<OwnedFd> {
        let (here, there) = &self.passing;
        let rights = [ControlMessage::ScmRights(&[number])];
        sendmsg::<()>(here.as_raw_fd(), &[IoSlice::new(&[0])], &rights, MsgFlags::empty(), None)?;
        let mut byte = [0];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut received = RecvAncillaryBuffer::new(&mut space);
        recvmsg(there, &mut [IoSliceMut::new(&mut byte)], &mut received, RecvFlags::CMSG_CLOEXEC)?;
        let messages = received.drain();
        let mut descriptors = messages.filter_map(|message| match message {
            RecvAncillaryMessage::ScmRights(rights) => Some(rights),
            _ => None,
        });
        let descriptor = descriptors.next().and_then(|mut rights| rights.next());
        descriptor.ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};
    use std::time::Duration;

    use super::*;

    #[test]
    fn no_connection_lingers_after_a_look() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let connections: Vec<TcpStream> =
            (0..3).map(|_| TcpStream::connect(address).expect("a connection")).collect();
        for connection in &connections[1..] {
            let ten = Some(Duration::from_secs(10));
            SockRef::from(connection).set_linger(ten).expect("a socket");
        }
        let mut lingering = Lingering::new().expect("a pair of sockets");
        // Other tests of this process have sockets too, and none of them lingers.
        assert_eq!(lingering.end().expect("/proc"), 2);
        assert_eq!(lingering.end().expect("/proc"), 0);
        for connection in &connections {
            assert_eq!(SockRef::from(connection).linger().expect("a socket"), None);
        }
    }
}
