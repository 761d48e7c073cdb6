//! A link over two independent networks: everything is sent over both.
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

/// How long after an attempt a network that is not there is tried again.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(1);

pub(crate) struct TwoNetworks {
    address: SocketAddr,
    links: [Option<Box<dyn Link>>; 2],
    is_plugged: [bool; 2],
    /// The network that is asked first next time, so that a flood on one of them does not hide the other.
    next: Via,
    /// Readable when one of the links is, or when one has been opened.
    readiness: Epoll,
    awaited: Option<Awaited>,
    reopenings: Vec<Reopening>,
}

/// A network whose interface was not there at the start: a thread of its own tries again.
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
            .map_err(BusError::system("an eventfd for the other network"))?;
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
        std::thread::Builder::new().name("other-network".into()).spawn(attempts).map_err(
            |source| BusError::System { what: "a thread for the other network", source },
        )?;
        Ok(Self { via, opened, bell, _stop: stop })
    }
}

impl TwoNetworks {
    /// Opens both links, or one of them where the other's interface is not there: it is opened when it is.
    pub(crate) fn open(
        kind: LinkKind,
        first: &Endpoints,
        second: &Endpoints,
    ) -> Result<Self, BusError> {
        let (mut awaited, mut reopenings) = (None, Vec::new());
        let links = match (kind.open_one(first), kind.open_one(second)) {
            (Ok(first), Ok(second)) => [Some(first), Some(second)],
            (Ok(link), Err(error)) if is_absent(&error) => {
                reopenings.push(failed(Via::Second, &error));
                awaited = Some(Awaited::start(Via::Second, kind, second.clone())?);
                [Some(link), None]
            }
            (Err(error), Ok(link)) if is_absent(&error) => {
                reopenings.push(failed(Via::First, &error));
                awaited = Some(Awaited::start(Via::First, kind, first.clone())?);
                [None, Some(link)]
            }
            (Err(error), _) | (_, Err(error)) => return Err(error),
        };
        let readiness = Epoll::new(EpollCreateFlags::EPOLL_CLOEXEC);
        let readiness = readiness.map_err(BusError::system("to wait for two networks at once"))?;
        let opened = Self {
            address: first.own().address,
            links,
            is_plugged: [true; 2],
            next: Via::First,
            readiness,
            awaited,
            reopenings,
        };
        for link in opened.links.iter().flatten() {
            opened.watch(link.readiness())?;
        }
        if let Some(awaited) = &opened.awaited {
            opened.watch(awaited.bell.as_fd())?;
        }
        Ok(opened)
    }

    fn watch(&self, descriptor: BorrowedFd<'_>) -> Result<(), BusError> {
        let added = self.readiness.add(descriptor, EpollEvent::new(EpollFlags::EPOLLIN, 0));
        added.map_err(BusError::system("to wait for two networks at once"))
    }

    /// Takes the link of a network that has come.
    fn welcome(&mut self) {
        let Some(awaited) = &self.awaited else {
            return;
        };
        let Ok(link) = awaited.opened.try_recv() else {
            return;
        };
        let via = awaited.via;
        let watched = self.watch(link.readiness());
        let failure = watched.err().map(|error| error.to_string());
        self.reopenings.push(Reopening {
            via: Some(via),
            silence: Duration::ZERO,
            peer: None,
            failure,
        });
        self.links[via.index()] = Some(link);
        // Its bell is closed with it, and so leaves the epoll.
        self.awaited = None;
    }
}

/// Whether there is no interface with this address.
fn is_absent(error: &BusError) -> bool {
    matches!(error, BusError::Listen { source, .. } if source.kind() == io::ErrorKind::AddrNotAvailable)
}

fn failed(via: Via, error: &BusError) -> Reopening {
    let failure = Some(error.to_string());
    Reopening { via: Some(via), silence: Duration::ZERO, peer: None, failure }
}

impl Link for TwoNetworks {
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
        for via in [self.next, self.next.other()] {
            let Some(link) = &mut self.links[via.index()] else {
                continue;
            };
            while link.receive(bytes).is_some() {
                if self.is_plugged[via.index()] {
                    self.next = via.other();
                    return Some(via);
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
        Via::BOTH.into_iter().find_map(|via| {
            let reopening = self.links[via.index()].as_mut()?.reopening()?;
            Some(Reopening { via: Some(via), ..reopening })
        })
    }
}
