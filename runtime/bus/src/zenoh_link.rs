//! Zenoh 1.10 in peer mode: the only place that names it for frames.
//!
//! * **One session for each member.** It listens on the member's own address and connects to the peers before it
//!   ([`Endpoints::called`]), so that no two connects cross. Zenoh itself connects again, with growing pauses, whenever a connection
//!   fails or ends.
//! * **TCP.** A session depends on declarations that are sent once, so it needs a transport that delivers them. Zenoh's listener
//!   for UDP has two more defects (1.10.2, `accept_read_task`): one task hands all datagrams on through a queue of one
//!   place for each sender, so it waits without end for a sender whose session has just ended, and then no peer is received any more.
//! * Scouting and gossip are off. A member subscribes to the stations, and to the remote I/Os, by one expression each.
//! * A member that publishes no frame for a [`PULSE`] publishes an empty message, however long its cycle is. A member that receives none
//!   of its peers for [`silence::SILENT_PULSES`], or is connected to one and does not receive it for [`silence::MUTE_PULSES`], opens its
//!   session anew, whatever the reason; the pause doubles each time. A connection in one direction only is Zenoh's (1.10.2,
//!   `open_transport_unicast_inner` and `init_new_transport_unicast`): where the time limit of an attempt passes after the transport began to
//!   send and before it began to receive, it stays so, and its signs of life keep the other end from ending it. One of a hundred
//!   suspensions of four seconds, a lease and a time limit, ended so for a peer.
//! * Callbacks only enqueue, and nothing that the cycle's thread calls waits for a peer: what does not fit into a queue is dropped.

mod settings;
mod silence;

use std::collections::{BTreeSet, HashMap};
use std::net::{SocketAddr, TcpListener};
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use understudy_wire::{ClusterHash, Frame, Member, Roster, Time, Topic, Via};
use zenoh::Wait;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;

use crate::clock::Clock;
use crate::doorbell::{Inbox, Outbox, doorbell};
use crate::endpoints::{Endpoints, Peer};
use crate::error::{BusError, reason};
use crate::linger::Lingering;
use crate::link::{Link, LinkCounters, LinkKind, Reopening};
use crate::rights::raise_link_thread;
use settings::{identity, settings};

pub use settings::{zenoh_runtime, zenoh_runtime_of_follower};
use silence::{Silence, Silent};

/// Datagrams that wait for the cycle's thread, at most; one of 72 stations and 64 remote I/Os hears fewer in a cycle.
const QUEUE_FRAMES: usize = 1024;

/// How often each member publishes something.
const PULSE: Duration = Duration::from_millis(250);

/// A session that closes is waited for so long, at most.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);

/// Of channels that say only that the other end is gone.
enum Never {}

/// What a member publishes with, by topic.
type Publishers = [Option<Publisher<'static>>; Topic::ALL.len()];

/// Whether something was published since the last pulse, by topic.
type Published = [AtomicBool; Topic::ALL.len()];

pub(crate) struct ZenohLink {
    address: SocketAddr,
    roster: Roster,
    inbox: Inbox<Vec<u8>>,
    /// Replaced by the keeper with those of a new session.
    publishers: Arc<Mutex<Arc<Publishers>>>,
    published: Arc<Published>,
    unsent: u64,
    reopened: Arc<AtomicU64>,
    reopenings: Receiver<Reopening>,
    // Dropping it ends the keeper's thread, and with it the session.
    stop: Option<Sender<Never>>,
    closed: Receiver<Never>,
}

impl ZenohLink {
    pub(crate) fn open(endpoints: &Endpoints) -> Result<Self, BusError> {
        let address = endpoints.own().address;
        let frames = LinkKind::Zenoh.frames_address(address)?;
        // Zenoh only has words for why it cannot listen; this asks the system first.
        TcpListener::bind(frames).map_err(|source| BusError::listen(frames, source))?;
        let (outbox, inbox) =
            doorbell(QUEUE_FRAMES).map_err(BusError::system("an eventfd for what arrives"))?;
        let senders = endpoints.senders().map(|peer| peer.member);
        let heard = senders.map(|member| (name(member), (member, AtomicBool::new(false))));
        let ears = Ears { outbox, heard: Arc::new(heard.collect()) };
        let session = Session::open(endpoints, &ears)
            .map_err(|error| BusError::Zenoh { address: frames, reason: reason(&error) })?;
        let publishers = Arc::new(Mutex::new(Arc::clone(&session.publishers)));
        let reopened = Arc::new(AtomicU64::new(0));
        let published = Arc::new(Published::default());
        let (stop, stopped) = channel::<Never>();
        let (closing, closed) = channel();
        let (report, reopenings) = channel();
        let clock = Clock::start();
        let own = endpoints.own().member;
        let before = endpoints.others().iter().filter(|peer| peer.member < own);
        let place = u32::try_from(before.count()).unwrap_or(u32::MAX);
        let mut keeper = Keeper {
            endpoints: endpoints.clone(),
            session: Some(session),
            publishers: Arc::clone(&publishers),
            published: Arc::clone(&published),
            ears,
            silence: Silence::new(clock.now(), place, endpoints.is_one_of_several()),
            lingering: Lingering::new()
                .map_err(|source| BusError::System { what: "a pair of sockets", source })?,
            failed: false,
            reopened: Arc::clone(&reopened),
            report,
        };
        std::thread::Builder::new()
            .name("zenoh-keeper".into())
            .spawn(move || {
                while matches!(stopped.recv_timeout(PULSE), Err(RecvTimeoutError::Timeout)) {
                    keeper.pulse(clock.now());
                }
                if let Some(session) = keeper.session.take() {
                    session.close();
                }
                drop(closing);
            })
            .map_err(|source| BusError::System {
                what: "a thread for the Zenoh session",
                source,
            })?;
        Ok(Self {
            address,
            roster: endpoints.roster().clone(),
            inbox,
            publishers,
            published,
            unsent: 0,
            reopened,
            reopenings,
            stop: Some(stop),
            closed,
        })
    }
}

impl Link for ZenohLink {
    fn address(&self) -> SocketAddr {
        self.address
    }

    fn send(&mut self, frame: &Frame, bytes: &[u8]) {
        // Held only to take what is there, never while something is sent.
        let publishers =
            Arc::clone(&self.publishers.lock().unwrap_or_else(PoisonError::into_inner));
        let topic = self.roster.topic(frame) as usize;
        if let Some(publisher) = &publishers[topic] {
            match publisher.put(bytes).wait() {
                Ok(()) => self.published[topic].store(true, Ordering::Relaxed),
                Err(_) => self.unsent += 1,
            }
        }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> Option<Via> {
        *bytes = self.inbox.take()?;
        Some(Via::First)
    }

    fn readiness(&self) -> BorrowedFd<'_> {
        self.inbox.readiness()
    }

    fn counters(&self) -> LinkCounters {
        LinkCounters {
            unsent: self.unsent,
            overrun: self.inbox.dropped(),
            reopened: self.reopened.load(Ordering::Relaxed),
        }
    }

    fn reopening(&mut self) -> Option<Reopening> {
        self.reopenings.try_recv().ok()
    }
}

impl Drop for ZenohLink {
    fn drop(&mut self) {
        self.stop = None;
        // Where Zenoh does not come to an end, the process does.
        let _ = self.closed.recv_timeout(2 * CLOSE_TIMEOUT);
    }
}

/// Where everything goes that is received, in every session of a member.
#[derive(Clone)]
struct Ears {
    outbox: Outbox<Vec<u8>>,
    /// Of each peer by its [`name`], whether it was received since it was last asked.
    heard: Arc<HashMap<String, (Member, AtomicBool)>>,
}

impl Ears {
    fn hear(&self, key: &str) {
        let name = key.rsplit_once('/').map_or(key, |(_, name)| name);
        if let Some((_, heard)) = self.heard.get(name) {
            heard.store(true, Ordering::Relaxed);
        }
    }

    /// Whether a peer was received since it was last asked, and those that were not.
    fn take(&self) -> (bool, BTreeSet<Member>) {
        let peers = self.heard.values();
        let unheard = peers.filter(|(_, heard)| !heard.swap(false, Ordering::Relaxed));
        let unheard: BTreeSet<Member> = unheard.map(|(member, _)| *member).collect();
        (unheard.len() < self.heard.len(), unheard)
    }
}

/// The one session of a member.
struct Session {
    session: zenoh::Session,
    publishers: Arc<Publishers>,
    subscribers: Vec<Subscriber<()>>,
    // Known by name, so that Zenoh finds the way of what arrives instead of computing it for each frame.
    _exact: Vec<KeyExpr<'static>>,
}

impl Session {
    fn open(endpoints: &Endpoints, ears: &Ears) -> zenoh::Result<Self> {
        let session = zenoh::open(settings(endpoints)?).wait()?;
        let (cluster, own) = (endpoints.cluster(), endpoints.own().member);
        let mut publishers = [const { None }; Topic::ALL.len()];
        for topic in Topic::ALL {
            if endpoints.audience(topic).next().is_some() {
                let publisher = session
                    .declare_publisher(key(cluster, topic, own))
                    .congestion_control(CongestionControl::Drop)
                    .priority(Priority::RealTime)
                    .express(true)
                    .wait()?;
                publishers[topic as usize] = Some(publisher);
            }
        }
        let mut exact = Vec::new();
        for topic in Topic::ALL {
            for peer in endpoints.heard(topic) {
                let key = key(cluster, topic, peer.member);
                exact.push(session.declare_keyexpr(key).wait()?);
            }
        }
        let subscribers = subscriptions(endpoints).into_iter().map(|key| {
            let ears = ears.clone();
            session
                .declare_subscriber(key)
                // A station's own turns match what it subscribes to.
                .allowed_origin(Locality::Remote)
                .callback(move |sample| {
                    raise_link_thread();
                    ears.hear(sample.key_expr().as_str());
                    let payload = sample.payload();
                    if !payload.is_empty() {
                        ears.outbox.put(payload.to_bytes().into_owned());
                    }
                })
                .wait()
        });
        Ok(Self {
            subscribers: subscribers.collect::<zenoh::Result<_>>()?,
            session,
            publishers: Arc::new(publishers),
            _exact: exact,
        })
    }

    /// Those of `peers` to which it is connected.
    fn connected(&self, endpoints: &Endpoints, mut peers: BTreeSet<Member>) -> BTreeSet<Member> {
        let identities: Vec<String> =
            self.session.info().peers_zid().wait().map(|id| id.to_string()).collect();
        peers.retain(|member| {
            let own = identity(endpoints.cluster(), *member);
            identities.iter().any(|id| id.starts_with(&own))
        });
        peers
    }

    /// Waits for its end, for [`CLOSE_TIMEOUT`] at most.
    fn close(self) {
        let (closing, closed) = channel::<Never>();
        let thread = std::thread::Builder::new().name("zenoh-close".into());
        let started = thread.spawn(move || {
            drop(self.subscribers);
            if let Err(error) = self.session.close().wait() {
                tracing::debug!(%error, "a session was not closed");
            }
            drop(closing);
        });
        if started.is_ok() {
            let _ = closed.recv_timeout(CLOSE_TIMEOUT);
        }
    }
}

/// Publishes signs of this member, and opens its session anew where no peer is received, or one that is connected is not.
struct Keeper {
    endpoints: Endpoints,
    /// None where it could not be opened anew.
    session: Option<Session>,
    publishers: Arc<Mutex<Arc<Publishers>>>,
    published: Arc<Published>,
    ears: Ears,
    silence: Silence,
    lingering: Lingering,
    /// Whether that it could not be opened is reported.
    failed: bool,
    reopened: Arc<AtomicU64>,
    report: Sender<Reopening>,
}

impl Keeper {
    fn pulse(&mut self, now: Time) {
        match self.lingering.end() {
            Ok(0) => {}
            Ok(connections) => tracing::trace!(connections, "do not linger any more"),
            Err(error) => tracing::warn!(%error, "the end of a connection may take ten seconds"),
        }
        if let Some(session) = &self.session {
            for (publisher, published) in session.publishers.iter().zip(self.published.iter()) {
                if let Some(publisher) = publisher
                    && !published.swap(false, Ordering::Relaxed)
                {
                    // One that is not sent is missed like one that is lost.
                    if let Err(error) = publisher.put([]).wait() {
                        tracing::debug!(%error, "a sign of life was not sent");
                    }
                }
            }
        }
        // Without senders there is nothing to conclude from.
        if self.ears.heard.is_empty() {
            return;
        }
        let (heard, unheard) = self.ears.take();
        let mute = match &self.session {
            Some(session) if !unheard.is_empty() => session.connected(&self.endpoints, unheard),
            _ => BTreeSet::new(),
        };
        let due = self.silence.look(now, heard, &mute);
        let lost = || self.session.is_none().then(|| self.silence.of_all(now));
        if let Some(silent) = due.or_else(lost) {
            self.reopen(silent);
        }
    }

    fn reopen(&mut self, silent: Silent) {
        if let Some(session) = self.session.take() {
            session.close();
        }
        let failure = match Session::open(&self.endpoints, &self.ears) {
            Ok(session) => {
                *self.publishers.lock().unwrap_or_else(PoisonError::into_inner) =
                    Arc::clone(&session.publishers);
                self.session = Some(session);
                self.reopened.fetch_add(1, Ordering::Relaxed);
                None
            }
            Err(error) => Some(reason(&error)),
        };
        let again = failure.is_some() && self.failed;
        self.failed = failure.is_some();
        if !again {
            // A link that is dropped asks no more.
            let _ = self.report.send(Reopening {
                via: None,
                silence: silent.lasts,
                peer: silent.peer,
                failure,
            });
        }
    }
}

fn key(cluster: ClusterHash, topic: Topic, speaker: Member) -> String {
    format!("{}/{}", prefix(cluster, topic), name(speaker))
}

/// The last part of a member's keys.
fn name(member: Member) -> String {
    let (kind, number) = match member {
        Member::Station(station) => ("station", station.0),
        Member::RemoteIo(program) => ("remote-io", program.0),
        Member::Plant(program) => ("plant", program.0),
        Member::Twin(program) => ("twin", program.0),
    };
    format!("{kind}-{number}")
}

fn prefix(cluster: ClusterHash, topic: Topic) -> String {
    let topic = match topic {
        Topic::Cycle => "cycle",
        Topic::Turn => "turn",
        Topic::Sample => "sample",
        Topic::Field => "field",
        Topic::Actuation => "actuation",
        Topic::Pair => "pair",
    };
    format!("understudy/{cluster}/{topic}")
}

/// What a member subscribes to. Of the cycle it hears all stations; a remote I/O also hears all turns of controllers, and an understudy these
/// and all samples. One expression for each costs every peer one declaration, where one for each peer would cost a cluster of n members n³.
fn subscriptions(endpoints: &Endpoints) -> BTreeSet<String> {
    let cluster = endpoints.cluster();
    let mut all = BTreeSet::new();
    for topic in Topic::ALL {
        let hears_all = match (topic, endpoints.own().member) {
            (Topic::Cycle, _) | (Topic::Turn, Member::RemoteIo(_) | Member::Twin(_)) => true,
            (Topic::Turn | Topic::Sample, own) => endpoints.roster().is_understudy(own),
            _ => false,
        };
        let of = |peer: &Peer| {
            if hears_all {
                format!("{}/*", prefix(cluster, topic))
            } else {
                key(cluster, topic, peer.member)
            }
        };
        all.extend(endpoints.heard(topic).map(of));
    }
    all
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use understudy_wire::{ProgramId, StationId};

    use super::*;
    use crate::ports::free_addresses;

    /// One of two peers is connected and publishes nothing: the session is opened anew because of that one.
    #[test]
    fn a_peer_that_is_connected_and_not_received_is_found() {
        let members = [
            Member::Station(StationId(0)),
            Member::Station(StationId(1)),
            Member::RemoteIo(ProgramId(0)),
        ];
        let addresses = free_addresses(members.len()).expect("there are ports");
        let peers = members.iter().zip(addresses);
        let peers = peers.map(|(&member, address)| Peer::new(member, name(member), address));
        let peers: Vec<Peer> = peers.collect();
        let endpoints = |own| {
            let roster = Roster::new(1, 2, Vec::new());
            Endpoints::new(ClusterHash(1), own, peers.clone(), roster).expect("a member")
        };
        let [first, mute, speaker] = members;
        let mut link = ZenohLink::open(&endpoints(first)).expect("a link");
        let _speaker = ZenohLink::open(&endpoints(speaker)).expect("a link");
        let settings = settings(&endpoints(mute)).expect("valid");
        let _mute = zenoh::open(settings).wait().expect("a session");
        let start = Instant::now();
        let reopening = loop {
            if let Some(reopening) = link.reopening() {
                break reopening;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "not found");
            std::thread::yield_now();
        };
        assert_eq!(reopening.peer, Some(mute));
        assert_eq!(reopening.silence, PULSE * silence::MUTE_PULSES);
    }
}
