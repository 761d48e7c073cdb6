//! A link over several paths: two independent networks, or a network and the direct link to the other remote I/O of a program. A frame is sent over
//! each path that its receivers are on.
//!
//! Which copy counts is decided where the frames are opened ([`crate::network_reception`]); nothing is dropped here.

use std::io;
use std::net::SocketAddr;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use nix::sys::epoll::{Epoll, EpollCreateFlags, EpollEvent, EpollFlags};
use nix::sys::eventfd::{EfdFlags, EventFd};
use understudy_wire::{Frame, Via};

use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::link::{Link, LinkCounters, LinkKind, Reopening};

/// How long after an attempt a path that is not there is tried again.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(1);

pub(crate) struct Paths {
    address: SocketAddr,
    /// The link of each path, by its index.
    links: [Option<Box<dyn Link>>; Via::ALL.len()],
    is_plugged: [bool; Via::ALL.len()],
    /// Index of the path that is asked first next time, so that a flood on one of them does not hide the others.
    next: usize,
    /// Readable when one of the links is, or when one has been opened.
    readiness: Epoll,
    awaited: Vec<Awaited>,
    reopenings: Vec<Reopening>,
}

/// A path whose interface was not there at the start: a thread of its own tries again.
struct Awaited {
    via: Via,
    opened: Receiver<Box<dyn Link>>,
    /// Rung by the thread.
    bell: Arc<EventFd>,
    /// Dropping it ends the thread.
    _stop: Sender<()>,
}

impl Awaited {
    fn start(via: Via, kind: LinkKind, endpoints: Endpoints) -> Result<Self, BusError> {
        let bell = EventFd::from_flags(EfdFlags::EFD_CLOEXEC | EfdFlags::EFD_NONBLOCK)
            .map_err(BusError::system("an eventfd for another network"))?;
        let bell = Arc::new(bell);
        let (opens, opened) = channel();
        let (stop, stopped) = channel::<()>();
        let ring = Arc::clone(&bell);
        let attempts = move || {
            while stopped.recv_timeout(TRY_AGAIN_AFTER) == Err(RecvTimeoutError::Timeout) {
                if let Ok(link) = kind.open_one(&endpoints) {
                    // The member may have ended meanwhile.
                    let _ = opens.send(link);
                    let _ = ring.write(1);
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name("other-network".into())
            .spawn(attempts)
            .map_err(|source| BusError::System { what: "a thread for another network", source })?;
        Ok(Self { via, opened, bell, _stop: stop })
    }
}

impl Paths {
    /// Opens the links, or some of them where the interfaces of the others are not there: each of these is opened when it is.
    pub(crate) fn open(kind: LinkKind, paths: Vec<(Via, Endpoints)>) -> Result<Self, BusError> {
        let failed = "to wait for several networks at once";
        let readiness =
            Epoll::new(EpollCreateFlags::EPOLL_CLOEXEC).map_err(BusError::system(failed))?;
        let Some(address) = paths.first().map(|(_, endpoints)| endpoints.own().address) else {
            return Err(BusError::System { what: failed, source: io::ErrorKind::NotFound.into() });
        };
        let mut opened = Self {
            address,
            links: [const { None }; Via::ALL.len()],
            is_plugged: [true; Via::ALL.len()],
            next: 0,
            readiness,
            awaited: Vec::new(),
            reopenings: Vec::new(),
        };
        let mut absent = Vec::new();
        for (via, endpoints) in paths {
            match kind.open_one(&endpoints) {
                Ok(link) => {
                    opened.watch(link.readiness())?;
                    opened.links[via.index()] = Some(link);
                }
                Err(error) if is_absent(&error) => absent.push((via, endpoints, error)),
                Err(error) => return Err(error),
            }
        }
        if opened.links.iter().all(Option::is_none)
            && let Some((.., error)) = absent.pop()
        {
            return Err(error);
        }
        for (via, endpoints, error) in absent {
            let failure = Some(error.to_string());
            opened.reopenings.push(changed(via, failure));
            let awaited = Awaited::start(via, kind, endpoints)?;
            opened.watch(awaited.bell.as_fd())?;
            opened.awaited.push(awaited);
        }
        Ok(opened)
    }

    fn watch(&self, descriptor: BorrowedFd<'_>) -> Result<(), BusError> {
        let added = self.readiness.add(descriptor, EpollEvent::new(EpollFlags::EPOLLIN, 0));
        added.map_err(BusError::system("to wait for several networks at once"))
    }

    /// Takes the links of paths that have come.
    fn welcome(&mut self) {
        let opened = |awaited: &Awaited| Some((awaited.via, awaited.opened.try_recv().ok()?));
        while let Some((place, (via, link))) =
            self.awaited.iter().enumerate().find_map(|(place, it)| Some((place, opened(it)?)))
        {
            let watched = self.watch(link.readiness());
            self.reopenings.push(changed(via, watched.err().map(|error| error.to_string())));
            self.links[via.index()] = Some(link);
            // Its bell is closed with it, and so leaves the epoll.
            self.awaited.remove(place);
        }
    }
}

/// Whether there is no interface with this address.
fn is_absent(error: &BusError) -> bool {
    matches!(error, BusError::Listen { source, .. } if source.kind() == io::ErrorKind::AddrNotAvailable)
}

/// A path has been opened, or could not be.
fn changed(via: Via, failure: Option<String>) -> Reopening {
    Reopening { via: Some(via), silence: Duration::ZERO, peer: None, failure }
}

impl Link for Paths {
    fn address(&self) -> SocketAddr {
        self.address
    }

    fn send(&mut self, frame: &Frame, bytes: &[u8]) {
        for (link, is_plugged) in self.links.iter_mut().zip(self.is_plugged) {
            if let Some(link) = link
                && is_plugged
            {
                link.send(frame, bytes);
            }
        }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> Option<Via> {
        self.welcome();
        let first = self.next;
        for offset in 0..Via::ALL.len() {
            let place = (first + offset) % Via::ALL.len();
            let Some(link) = &mut self.links[place] else {
                continue;
            };
            while link.receive(bytes).is_some() {
                if self.is_plugged[place] {
                    self.next = (place + 1) % Via::ALL.len();
                    return Some(Via::ALL[place]);
                }
            }
        }
        None
    }

    fn readiness(&self) -> BorrowedFd<'_> {
        self.readiness.0.as_fd()
    }

    fn counters(&self) -> LinkCounters {
        let links = self.links.iter().flatten().map(|link| link.counters());
        links.fold(LinkCounters::default(), |sum, one| LinkCounters {
            unsent: sum.unsent + one.unsent,
            overrun: sum.overrun + one.overrun,
            reopened: sum.reopened + one.reopened,
        })
    }

    fn plug(&mut self, via: Via, is_plugged: bool) {
        self.is_plugged[via.index()] = is_plugged;
    }

    fn reopening(&mut self) -> Option<Reopening> {
        if let Some(reopening) = self.reopenings.pop() {
            return Some(reopening);
        }
        Via::ALL.into_iter().find_map(|via| {
            let reopening = self.links[via.index()].as_mut()?.reopening()?;
            Some(Reopening { via: Some(via), ..reopening })
        })
    }
}
