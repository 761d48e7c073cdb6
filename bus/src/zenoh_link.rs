//! Zenoh 1.10 in peer mode: the only place that names it.
//!
//! * Scouting and gossip are off; every party listens on its own address and calls those before it ([`Endpoints::called`]).
//! * One subscription for each peer. Over UDP Zenoh never sends a lost declaration again, so every party gives a sign of itself
//!   ([`PULSE`]), however long its cycle is, and a peer of whom nothing comes gets its subscription declared anew until something
//!   does. That heals, because a subscription here is *one* message: its key starts with a wildcard, so that no separate
//!   declaration of a key prefix has to arrive before it. To renew the subscription to a peer that has died costs two
//!   messages to each of the others, and nobody hears less meanwhile.
//! * Whoever is called is called by a session of its own, and by another one where nothing comes of it: see [`Line`].
//! * Callbacks only enqueue: one that lingers starves all peers of a UDP listener.

use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use understudy_wire::{ClusterHash, Frame, Party, Topic};
use zenoh::Wait;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};

use crate::doorbell::{Inbox, Outbox, doorbell};
use crate::endpoints::{Endpoints, Peer};
use crate::error::{BusError, reason};
use crate::link::{Link, LinkCounters, LinkKind};
use crate::rights::raise_link_thread;

/// Datagrams that wait for the cycle's thread, at most; one of 64 stations and 64 remote I/Os hears fewer in a cycle.
const QUEUE_FRAMES: usize = 1024;

/// How often each party says an empty message, whatever else it says.
const PULSE: Duration = Duration::from_millis(50);

/// A peer of whom nothing came during so many pulses gets its subscription declared anew, and again after every so many.
const RENEW_AFTER_PULSES: u32 = 3;

/// A peer that was called and of whom nothing came during so many pulses is called anew, by a session of a new name.
const CALL_AFTER_PULSES: u32 = 8;

/// How long a session may take to open. It takes four datagrams, none of which is sent again: of three tries one fails where a
/// tenth of all datagrams is lost, and each costs this time before the next.
const OPEN_TIMEOUT_MS: u32 = 100;

/// How long a session lives without a sign of the other. Long, because over UDP a session costs nothing and survives whatever
/// its peer does: one that is stopped for less goes on at once, and one that was killed is called anew as soon as the system says that
/// nobody listens there. A session that runs out while datagrams wait for it can block Zenoh's UDP listener for ever.
const LEASE_MS: u32 = 10_000;

/// How Zenoh's own threads are to be set up, as a variable of the environment of every process that opens a Zenoh link. Zenoh
/// reads it once, when its first session opens, and takes nothing else; without it there are six threads where two do.
pub const ZENOH_RUNTIME: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), app: (handover: net), net: (worker_threads: 1))",
);

/// A party that ends waits so long for its session to end, at most.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);

/// Of channels that say only that the other end is gone.
enum Never {}

/// What one session publishes on, by topic.
type Mouths = [Option<Publisher<'static>>; Topic::ALL.len()];

/// The same of all sessions; the keeper replaces what it calls anew, and the cycle's thread only looks.
type AllMouths = Vec<Mutex<Arc<Mouths>>>;

pub(crate) struct ZenohLink {
    address: SocketAddr,
    inbox: Inbox<Vec<u8>>,
    mouths: Arc<AllMouths>,
    unsent: u64,
    renewed: Arc<AtomicU64>,
    // Dropping it ends the keeper's thread, and with it the subscriptions and the sessions.
    stop: Option<Sender<Never>>,
    closed: Receiver<Never>,
}

impl ZenohLink {
    pub(crate) fn open(endpoints: &Endpoints, kind: LinkKind) -> Result<Self, BusError> {
        let address = endpoints.own().address;
        bindable(address, kind)?;
        let failed = |error: zenoh::Error| BusError::Zenoh {
            address,
            reason: reason(&error),
        };
        let (outbox, inbox) =
            doorbell(QUEUE_FRAMES).map_err(BusError::system("an eventfd for what arrives"))?;
        let calls = endpoints.called().map(|peer| Some(peer.clone()));
        let lines = std::iter::once(None).chain(calls);
        let lines = lines
            .map(|called| Line::open(endpoints.clone(), kind, called, &outbox))
            .collect::<zenoh::Result<Vec<Line>>>()
            .map_err(failed)?;
        let mouths: AllMouths = lines
            .iter()
            .map(|line| Mutex::new(Arc::clone(&line.mouths)))
            .collect();
        let mouths = Arc::new(mouths);
        let renewed = Arc::new(AtomicU64::new(0));
        let (stop, stopped) = channel::<Never>();
        let (closing, closed) = channel();
        let mut keeper = Keeper {
            lines,
            mouths: Arc::clone(&mouths),
            outbox,
            renewed: Arc::clone(&renewed),
        };
        std::thread::Builder::new()
            .name("zenoh-keeper".into())
            .spawn(move || {
                while matches!(stopped.recv_timeout(PULSE), Err(RecvTimeoutError::Timeout)) {
                    keeper.pulse();
                }
                keeper.close();
                drop(closing);
            })
            .map_err(|source| BusError::System {
                what: "a thread for the Zenoh sessions",
                source,
            })?;
        Ok(Self {
            address,
            inbox,
            mouths,
            unsent: 0,
            renewed,
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
        let topic = Topic::of(&frame.body) as usize;
        for mouths in self.mouths.iter() {
            // Held only to take what is there, never while something is sent.
            let mouths = Arc::clone(&mouths.lock().unwrap_or_else(PoisonError::into_inner));
            if let Some(publisher) = &mouths[topic]
                && publisher.put(bytes).wait().is_err()
            {
                self.unsent += 1;
            }
        }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> bool {
        let Some(datagram) = self.inbox.take() else {
            return false;
        };
        *bytes = datagram;
        true
    }

    fn readiness(&self) -> BorrowedFd<'_> {
        self.inbox.readiness()
    }

    fn counters(&self) -> LinkCounters {
        LinkCounters {
            unsent: self.unsent,
            overrun: self.inbox.dropped(),
            renewed: self.renewed.load(Ordering::Relaxed),
        }
    }
}

impl Drop for ZenohLink {
    fn drop(&mut self) {
        self.stop = None;
        // Where Zenoh does not come to an end, the process does.
        let _ = self.closed.recv_timeout(CLOSE_TIMEOUT);
    }
}

/// One session: with those who call this party, or with one peer that it calls.
///
/// Each call is a session of its own, with a name of its own, because a session can be left half open: where its last datagram
/// of opening is lost, the one who was called believes in it, and refuses whoever calls again by the same name until the lease is over.
struct Line {
    endpoints: Endpoints,
    kind: LinkKind,
    called: Option<Peer>,
    session: zenoh::Session,
    mouths: Arc<Mouths>,
    ears: Vec<Ear>,
    silent_pulses: u32,
}

impl Line {
    fn open(
        endpoints: Endpoints,
        kind: LinkKind,
        called: Option<Peer>,
        outbox: &Outbox<Vec<u8>>,
    ) -> zenoh::Result<Self> {
        let session = zenoh::open(settings(&endpoints, kind, called.as_ref())?).wait()?;
        let own = endpoints.own().party;
        // Who calls this party is later in the order than it, and whom it calls is earlier.
        let belongs = |peer: &Peer| match &called {
            Some(called) => peer.party == called.party,
            None => peer.party > own,
        };
        let mut mouths = [const { None }; Topic::ALL.len()];
        for topic in Topic::ALL {
            if endpoints.audience(topic).any(belongs) {
                let publisher = session
                    .declare_publisher(key(endpoints.cluster(), topic, own))
                    .congestion_control(CongestionControl::Drop)
                    .priority(Priority::RealTime)
                    .express(true)
                    .wait()?;
                mouths[topic as usize] = Some(publisher);
            }
        }
        let mut ears = Vec::new();
        for (peer, topic) in endpoints.heard().filter(|(peer, _)| belongs(peer)) {
            let key = key(endpoints.cluster(), topic, peer.party);
            ears.push(Ear::new(&session, &key, outbox)?);
        }
        Ok(Self {
            endpoints,
            kind,
            called,
            session,
            mouths: Arc::new(mouths),
            ears,
            silent_pulses: 0,
        })
    }

    /// Gives a sign, and sees to it that the others are heard; so many subscriptions were renewed.
    fn pulse(&mut self, outbox: &Outbox<Vec<u8>>) -> u64 {
        for mouth in self.mouths.iter().flatten() {
            // One that is not sent is missed like one that is lost.
            let _ = mouth.put([]).wait();
        }
        let heard = self.ears.iter().any(Ear::hears);
        self.silent_pulses = if heard { 0 } else { self.silent_pulses + 1 };
        let mut renewed = 0;
        for ear in &mut self.ears {
            if ear.is_deaf() && ear.renew(&self.session, outbox) {
                renewed += 1;
            }
        }
        renewed
    }

    /// Whether the peer is to be called anew. Of one that says nothing to this party nobody can tell.
    fn is_deaf(&self) -> bool {
        self.called.is_some() && !self.ears.is_empty() && self.silent_pulses >= CALL_AFTER_PULSES
    }

    /// Takes its subscriptions back, and ends it.
    fn close(self) {
        drop(self.ears);
        if let Err(error) = self.session.close().wait() {
            tracing::debug!(%error, "a session was not closed");
        }
    }
}

/// Gives signs of this party, and sees to it that the others are heard.
struct Keeper {
    lines: Vec<Line>,
    mouths: Arc<AllMouths>,
    outbox: Outbox<Vec<u8>>,
    renewed: Arc<AtomicU64>,
}

impl Keeper {
    fn pulse(&mut self) {
        for (line, mouths) in self.lines.iter_mut().zip(self.mouths.iter()) {
            let mut renewed = line.pulse(&self.outbox);
            if line.is_deaf() {
                line.silent_pulses = 0;
                let again = Line::open(
                    line.endpoints.clone(),
                    line.kind,
                    line.called.clone(),
                    &self.outbox,
                );
                if let Ok(again) = again {
                    *mouths.lock().unwrap_or_else(PoisonError::into_inner) =
                        Arc::clone(&again.mouths);
                    std::mem::replace(line, again).close();
                    renewed += 1;
                }
            }
            self.renewed.fetch_add(renewed, Ordering::Relaxed);
        }
    }

    fn close(self) {
        self.lines.into_iter().for_each(Line::close);
    }
}

/// The subscription to one peer.
struct Ear {
    key: String,
    // Known by name, so that Zenoh finds the way of what arrives instead of computing it for each frame. Never leaves the process.
    _exact: KeyExpr<'static>,
    heard: Arc<AtomicBool>,
    silent_pulses: u32,
    subscriber: Option<Subscriber<()>>,
}

impl Ear {
    fn new(session: &zenoh::Session, key: &str, outbox: &Outbox<Vec<u8>>) -> zenoh::Result<Self> {
        let mut ear = Self {
            _exact: session.declare_keyexpr(key.to_owned()).wait()?,
            key: format!("*/{}", key.split_once('/').map_or(key, |(_, rest)| rest)),
            heard: Arc::new(AtomicBool::new(false)),
            silent_pulses: 0,
            subscriber: None,
        };
        ear.subscriber = Some(ear.subscribe(session, outbox)?);
        Ok(ear)
    }

    fn subscribe(
        &self,
        session: &zenoh::Session,
        outbox: &Outbox<Vec<u8>>,
    ) -> zenoh::Result<Subscriber<()>> {
        let (heard, outbox) = (Arc::clone(&self.heard), outbox.clone());
        session
            .declare_subscriber(self.key.clone())
            .callback(move |sample| {
                raise_link_thread();
                heard.store(true, Ordering::Relaxed);
                let payload = sample.payload();
                if !payload.is_empty() {
                    outbox.put(payload.to_bytes().into_owned());
                }
            })
            .wait()
    }

    /// Whether something came since the last pulse.
    fn hears(&self) -> bool {
        self.heard.load(Ordering::Relaxed)
    }

    /// Counts one more pulse; true where it is time to renew.
    fn is_deaf(&mut self) -> bool {
        if self.heard.swap(false, Ordering::Relaxed) {
            self.silent_pulses = 0;
        } else {
            self.silent_pulses += 1;
        }
        let deaf = self.silent_pulses == RENEW_AFTER_PULSES;
        if deaf {
            self.silent_pulses = 0;
        }
        deaf
    }

    fn renew(&mut self, session: &zenoh::Session, outbox: &Outbox<Vec<u8>>) -> bool {
        // Taken back first, because Zenoh declares one key once only.
        self.subscriber = None;
        self.subscriber = self.subscribe(session, outbox).ok();
        self.subscriber.is_some()
    }
}

fn key(cluster: ClusterHash, topic: Topic, speaker: Party) -> String {
    let topic = match topic {
        Topic::Cycle => "cycle",
        Topic::Field => "field",
        Topic::Actuation => "actuation",
    };
    match speaker {
        Party::Station(station) => format!("understudy/{cluster}/{topic}/station-{}", station.0),
        Party::RemoteIo(program) => format!("understudy/{cluster}/{topic}/remote-io-{}", program.0),
        Party::Plant(program) => format!("understudy/{cluster}/{topic}/plant-{}", program.0),
    }
}

/// Zenoh only has words for why it cannot listen; this asks the system first.
fn bindable(address: SocketAddr, kind: LinkKind) -> Result<(), BusError> {
    let bound = match kind {
        LinkKind::ZenohTcp => TcpListener::bind(address).map(drop),
        LinkKind::Zenoh | LinkKind::Udp => UdpSocket::bind(address).map(drop),
    };
    bound.map_err(|source| BusError::listen(address, source))
}

fn settings(
    endpoints: &Endpoints,
    kind: LinkKind,
    called: Option<&Peer>,
) -> zenoh::Result<zenoh::Config> {
    let protocol = if kind == LinkKind::ZenohTcp {
        "tcp"
    } else {
        "udp"
    };
    let (listen, connect) = match called {
        None => (
            vec![format!("{protocol}/{}", endpoints.own().address)],
            Vec::new(),
        ),
        Some(peer) => (Vec::new(), vec![format!("{protocol}/{}", peer.address)]),
    };
    // The low-latency transport sends on the calling thread, without priorities and batches. Over TCP it would wait there for a
    // peer that is stopped, so TCP keeps the transport with queues.
    let low_latency = protocol == "udp";
    let mut config = zenoh::Config::default();
    for (setting, value) in [
        ("mode", "\"peer\"".to_owned()),
        ("listen/endpoints", format!("{listen:?}")),
        ("connect/endpoints", format!("{connect:?}")),
        // For ever, in the background, and soon: a peer that was restarted is to be heard within a second.
        ("connect/timeout_ms", "-1".into()),
        ("connect/exit_on_failure", "false".into()),
        (
            "connect/retry",
            "{ period_init_ms: 10, period_max_ms: 50, period_increase_factor: 2 }".into(),
        ),
        ("open/return_conditions/connect_scouted", "false".into()),
        ("open/return_conditions/declares", "false".into()),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("transport/unicast/lowlatency", low_latency.to_string()),
        ("transport/unicast/qos/enabled", (!low_latency).to_string()),
        (
            "transport/unicast/open_timeout",
            OPEN_TIMEOUT_MS.to_string(),
        ),
        (
            "transport/unicast/accept_timeout",
            OPEN_TIMEOUT_MS.to_string(),
        ),
        ("transport/link/tx/lease", LEASE_MS.to_string()),
        ("transport/link/tx/keep_alive", "4".into()),
        (
            "transport/link/tx/queue/congestion_control/drop/wait_before_drop",
            "0".into(),
        ),
    ] {
        config
            .insert_json5(setting, &value)
            .map_err(|error| format!("{setting} = {value}: {error}"))?;
    }
    Ok(config)
}
