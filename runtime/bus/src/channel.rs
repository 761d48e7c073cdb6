//! What concerns people and not the cycle goes over mutual TLS: commands, the configuration, and what a member says of itself.
//!
//! Every member with keys listens on the TCP port of its own address. There, by the common name of the certificate that a caller
//! shows, and denied to everybody else (Zenoh's access control, default deny):
//!
//! | key, under `understudy/<cluster>/<member>/` | what | people | members |
//! |---|---|---|---|
//! | `configuration` | asked: the canonical text of the configuration | all | yes |
//! | `status` | asked: what it said when it was ready | all | yes |
//! | `command/release`, `command/stop` | asked: done | engineers | no |
//! | `command/prepare`, `command/change` | asked with the texts of an online change, or a step of it, as JSON: done, or why not | engineers | no |
//! | `write/operator`, `write/engineer` | asked with a write as JSON: its outcome | operators; engineers | no |
//! | `command/force`, `command/unforce` | asked with a force or a signal as JSON: done, or why not | engineers | no |
//! | `refused` | asked with a refused order of a person as JSON: it is recorded | all | no |
//! | `spare/NAME` | asked with the report of the spare NAME as JSON: changes are recorded | NAME | no |
//! | `attendance/lines` | told by a remote I/O, once a second and at once while a station is missed: the stations that it misses; with its configuration | all | no |
//! | `journal/lines` | told: the lines of its journal, those of a moment at once; twice a second those in effect again; with its configuration | all | no |
//!
//! and under `understudy/cluster/<member>`, for callers whose cluster file may be another one: asked, the hash of the configuration, and behind it
//! that of the one that an online change has loaded.
//!
//! Invariants: the cycle never waits for the channel, which has a thread and a bounded queue of its own; a channel that cannot be
//! opened is tried again, and the member runs without it; who is revoked is cut off as soon as the list of the admitted changes.

mod answers;
mod followed;
mod refused;
mod spares;
mod tls;
mod writing;

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, channel};
use std::time::Duration;

use serde_json::json;
use understudy_wire::Time;
use zenoh::Wait;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};

use crate::changes::Changes;
use crate::clock::Clock;
use crate::connections::{Connections, Relay, inner_address};
use crate::endpoints::Endpoints;
use crate::error::{BusError, reason};
use crate::host_event::HostEvent;
use crate::journal::{EventSink, JournalSender, Noted};
use crate::orders::{Control, Order};
use crate::rights::run_in_background;
use crate::writes::Callers;

pub use followed::Reporter;
pub(crate) use followed::{Gaps, Head, Telemetry, followed};
pub use spares::{SPARE_REPORTS_EVERY, SpareReport};
pub(crate) use tls::{
    ATTENDANCE_KEY, JOURNAL_KEY, REFUSED_KEY, SPARE_KEY, WRITE_KEYS, endpoint, hash_key, insert,
    prefix, tls_config, told_below,
};
pub use tls::{Admitted, TlsKeys, Validity};

pub(crate) use answers::given;

use answers::{answer, hashes, of_configuration, with_value};
use followed::Line;
use refused::RefusedReports;
use spares::SpareReports;
use tls::{access_control, told_as};

/// How often it is looked who is admitted.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Who follows a journal is told of it so often.
const GATHER: Duration = Duration::from_millis(50);

/// After a channel could not be opened.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(5);

/// Connections at once, each of which takes three descriptors.
const MOST_CONNECTIONS: usize = 64;

/// A caller who has not shown a certificate by then, or has not opened a session, is gone.
const HANDSHAKE_TIMEOUT_MS: u32 = 3_000;

/// An open session gives signs of life more often.
const PATIENCE: Duration = Duration::from_secs(30);

/// Time limit for the answer of the member to a command; less than a caller waits.
const ORDER_PATIENCE: Duration = Duration::from_secs(4);

/// Refused connections are reported together, so often at most.
const REFUSALS_EVERY: Duration = Duration::from_secs(1);

/// A member that ends waits so long for its channel to end, at most.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);

/// The answer to a command that was taken.
pub const DONE: &str = "done";

/// What a member needs for its channel.
pub struct ChannelSettings {
    /// Its files.
    pub keys: TlsKeys,
    /// Says who is admitted now; asked again and again.
    pub admitted: Box<dyn FnMut() -> Admitted + Send>,
    /// Its configuration, and the one that an online change has loaded beside it.
    pub changes: Changes,
    /// Finds the lines of its journal that are in effect.
    pub in_effect: Box<dyn LinesInEffect>,
}

/// The lines of a journal that are in effect: they are repeated for viewers that attach while the member runs.
pub trait LinesInEffect: Send {
    /// Takes the next line of the journal.
    fn note(&mut self, line: &[u8]);

    /// Those in effect now, as lines that can be told from others.
    fn repetition(&self) -> Vec<u8>;

    /// The line that tells spares which stations are missed, where it is due.
    fn attendance(&mut self) -> Option<Vec<u8>>;
}

/// A channel that runs; ends when it is dropped.
pub(crate) struct RunningChannel {
    stop: Arc<AtomicBool>,
    wake: SyncSender<Line>,
    closed: Receiver<Never>,
}

/// Of queues that say only that the other end is gone.
enum Never {}

impl RunningChannel {
    /// Tells it to end, and does not wait.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
        // A full queue wakes it as well.
        let _ = self.wake.try_send(Line::default());
    }
}

impl Drop for RunningChannel {
    fn drop(&mut self) {
        self.stop();
        // Where Zenoh does not come to an end, the process does.
        let _ = self.closed.recv_timeout(CLOSE_TIMEOUT);
    }
}

/// A member's end of the channel.
pub(crate) struct Channel<E> {
    settings: ChannelSettings,
    prefix: String,
    name: String,
    /// Where operators can call, on each network.
    addresses: Vec<SocketAddr>,
    /// What it said when it was ready.
    status: String,
    control: Control,
    callers: Callers,
    telemetry: Telemetry,
    sink: JournalSender<E>,
    clock: Clock,
    connections: Connections,
    refused: RefusedReports,
    spares: SpareReports,
    stop: Arc<AtomicBool>,
    /// An operator wants the member to end.
    stop_wanted: Arc<AtomicBool>,
}

/// What is open.
struct Opened {
    session: zenoh::Session,
    /// Where Zenoh listens.
    inner: SocketAddr,
    /// By the address at which operators call.
    relays: BTreeMap<SocketAddr, Relay>,
    journal: Publisher<'static>,
    attendance: Publisher<'static>,
    _answers: Vec<Queryable<()>>,
}

impl<E: Send + 'static> Channel<E> {
    #[allow(clippy::too_many_arguments, reason = "it is put together in one place")]
    pub(crate) fn start(
        settings: ChannelSettings,
        endpoints: &Endpoints,
        status: String,
        control: Control,
        telemetry: Telemetry,
        sink: JournalSender<E>,
        clock: Clock,
    ) -> Result<RunningChannel, BusError> {
        let own = endpoints.own();
        let stop = Arc::new(AtomicBool::new(false));
        let wake = telemetry.wake.clone();
        let (closing, closed) = channel();
        let callers = Callers::default();
        if let Some(answers) = control.take_answers() {
            let callers = callers.clone();
            std::thread::Builder::new()
                .name("answers".into())
                .spawn(move || {
                    run_in_background();
                    // Ends with the member.
                    answers.into_iter().for_each(|answer| callers.answer(answer));
                })
                .map_err(|source| BusError::System {
                    what: "a thread for answers to writes",
                    source,
                })?;
        }
        let member = Self {
            settings,
            prefix: prefix(endpoints.cluster(), &own.name),
            name: own.name.clone(),
            addresses: own.addresses().collect(),
            status,
            control,
            callers,
            telemetry,
            sink,
            clock,
            connections: Connections::new(MOST_CONNECTIONS, 3),
            refused: RefusedReports::default(),
            spares: SpareReports::default(),
            stop: Arc::clone(&stop),
            stop_wanted: Arc::default(),
        };
        std::thread::Builder::new()
            .name("channel".into())
            .spawn(move || {
                run_in_background();
                member.run();
                drop(closing);
            })
            .map_err(|source| BusError::System { what: "a thread for the channel", source })?;
        Ok(RunningChannel { stop, wake, closed })
    }

    fn run(mut self) {
        let mut admitted = (self.settings.admitted)();
        let mut opened: Option<Opened> = None;
        let mut next_try = Time::default();
        let mut looked = self.clock.now();
        let mut reported = looked;
        let (mut stopping, mut is_valid) = (false, true);
        loop {
            let now = self.clock.now();
            if now >= next_try {
                next_try = now + TRY_AGAIN_AFTER;
                match &mut opened {
                    Some(opened) => self.relay_all(opened),
                    None => opened = self.open(&admitted),
                }
            }
            let waiting = self.telemetry.take_next().map(Ok);
            match waiting.unwrap_or_else(|| self.telemetry.lines.recv_timeout(LOOK_EVERY)) {
                // Only to wake.
                Ok(line) if line.text.is_empty() => {}
                Ok(line) => {
                    let lines = self.gather(line);
                    let attendance = self.settings.in_effect.attendance();
                    if let Some(opened) = &opened {
                        // What is not sent is in the journal, and those who follow know by the numbers of the lines that they lack it.
                        if let Err(error) = opened.journal.put(lines).wait() {
                            tracing::debug!(%error, "lines of the journal were not published");
                        }
                        if let Some(line) = attendance {
                            let _ = opened.attendance.put(self.telemetry.repeated(&line)).wait();
                        }
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if self.stop.load(Ordering::SeqCst) {
                break;
            }
            let now = self.clock.now();
            if now.since(looked) < LOOK_EVERY {
                continue;
            }
            looked = now;
            // A viewer that attaches now knows the present soon, and not when something changes.
            let repetition = self.settings.in_effect.repetition();
            if let Some(opened) = opened.as_ref().filter(|_| !repetition.is_empty()) {
                let _ = opened.journal.put(self.telemetry.repeated(&repetition)).wait();
            }
            // One look later than it was seen, so that the answer is out before its channel ends.
            if stopping {
                self.control.give(Order::Stop);
            }
            stopping = self.stop_wanted.load(Ordering::SeqCst);
            let newly = (self.settings.admitted)();
            if newly != admitted {
                admitted = newly;
                close(opened.take());
                next_try = now;
            }
            if now.since(reported) >= REFUSALS_EVERY
                && let Some(refused) = self.connections.take_refused()
            {
                reported = now;
                let event = HostEvent::RefusedConnections {
                    connections: refused.connections,
                    address: refused.address,
                };
                self.sink.record(now, Noted::Host(event));
            }
            self.note_refused(now, &mut is_valid);
            self.note_spares(now);
        }
        // The journal ends when nobody reports any more.
        drop(self.sink);
        close(opened);
    }

    /// Lines that come within a moment are told at once: to seal and send each of them would cost a station more.
    #[allow(
        clippy::disallowed_methods,
        reason = "who looks on is told a moment later, and the cycle never waits for this thread"
    )]
    fn gather(&mut self, first: Line) -> Vec<u8> {
        std::thread::sleep(GATHER);
        let in_effect = &mut self.settings.in_effect;
        self.telemetry.gather(first, |line| in_effect.note(line))
    }

    fn open(&mut self, admitted: &Admitted) -> Option<Opened> {
        let event = match self.listen(admitted) {
            Ok(opened) => {
                for address in opened.relays.keys() {
                    let event = HostEvent::ChannelOpened {
                        address: *address,
                        operators: admitted.people().cloned().collect(),
                    };
                    self.sink.record(self.clock.now(), Noted::Host(event));
                }
                return Some(opened);
            }
            Err(error) => HostEvent::ChannelFailed { reason: reason(&error) },
        };
        self.sink.record(self.clock.now(), Noted::Host(event));
        None
    }

    fn listen(&self, admitted: &Admitted) -> zenoh::Result<Opened> {
        // Asked before Zenoh is started, which takes longer.
        let listener = self.bind_first()?;
        let inner = inner_address()?;
        let listen = format!("{}#tls_handshake_timeout_ms={HANDSHAKE_TIMEOUT_MS}", endpoint(inner));
        let mut config = tls_config("peer", &self.settings.keys)?;
        insert(&mut config, "transport/unicast/accept_timeout", &json!(HANDSHAKE_TIMEOUT_MS))?;
        insert(&mut config, "listen/endpoints", &json!([listen]))?;
        let rules = access_control(&self.prefix, &hash_key(&self.name), admitted);
        insert(&mut config, "access_control", &rules)?;
        let session = zenoh::open(config).wait()?;
        let publisher = |key: &str| {
            let publisher = session.declare_publisher(told_as(&self.prefix, key));
            publisher.congestion_control(CongestionControl::Drop).wait()
        };
        let (journal, attendance) = (publisher(JOURNAL_KEY)?, publisher(ATTENDANCE_KEY)?);
        let mut answers = Vec::new();
        let status = self.status.clone();
        let key = format!("{}/status", self.prefix);
        answers.push(answer(&session, key, move |_| status.clone())?);
        let changes = self.settings.changes.clone();
        let key = format!("{}/configuration", self.prefix);
        answers.push(answer(&session, key, move |_| changes.text())?);
        let changes = self.settings.changes.clone();
        let key = hash_key(&self.name);
        answers.push(answer(&session, key, move |_| hashes(changes.configurations()))?);
        let (control, changes) = (self.control.clone(), self.settings.changes.clone());
        let release = move |query: &Query| {
            let order = of_configuration(query, &changes).map(|()| Order::Release);
            order.map_or_else(|reason| reason, |order| given(&control, order))
        };
        let key = format!("{}/command/release", self.prefix);
        answers.push(answer(&session, key, release)?);
        let wanted = Arc::clone(&self.stop_wanted);
        let stop = move |_: &Query| {
            wanted.store(true, Ordering::SeqCst);
            DONE.to_owned()
        };
        let key = format!("{}/command/stop", self.prefix);
        answers.push(answer(&session, key, stop)?);
        for word in ["force", "unforce", "choose"] {
            let (control, changes) = (self.control.clone(), self.settings.changes.clone());
            let force = move |query: &Query| {
                let order =
                    of_configuration(query, &changes).and_then(|()| with_value(word, query));
                order.map_or_else(|reason| reason, |order| given(&control, order))
            };
            let key = format!("{}/command/{word}", self.prefix);
            answers.push(answer(&session, key, force)?);
        }
        for (role, key) in WRITE_KEYS {
            answers.push(self.answer_writes(&session, role, key)?);
        }
        for key in ["prepare", "change"] {
            answers.push(self.answer_changes(&session, key)?);
        }
        answers.push(self.answer_refused(&session)?);
        answers.push(self.answer_spares(&session)?);
        let mut opened = Opened {
            session,
            inner,
            relays: BTreeMap::new(),
            journal,
            attendance,
            _answers: answers,
        };
        self.relay(&mut opened, listener)?;
        self.relay_all(&mut opened);
        Ok(opened)
    }

    /// A listener at the first address that there is now.
    fn bind_first(&self) -> Result<TcpListener, String> {
        let mut failure = String::new();
        for address in &self.addresses {
            match TcpListener::bind(address) {
                Ok(listener) => return Ok(listener),
                Err(source) => failure = BusError::listen(*address, source).to_string(),
            }
        }
        Err(failure)
    }

    /// Hands over to Zenoh what calls at one more address. Zenoh accepts whatever calls, and where that takes all descriptors it closes none of
    /// them again. So it gets no more than has a place.
    fn relay(&self, opened: &mut Opened, listener: TcpListener) -> io::Result<()> {
        let address = listener.local_addr()?;
        let relay = Relay::start(listener, self.connections.clone(), PATIENCE, opened.inner)?;
        opened.relays.insert(address, relay);
        Ok(())
    }

    /// Listens at the addresses, of two networks, at which it does not listen yet.
    fn relay_all(&self, opened: &mut Opened) {
        for address in &self.addresses {
            if !opened.relays.contains_key(address)
                && let Ok(listener) = TcpListener::bind(address)
                && let Err(error) = self.relay(opened, listener)
            {
                tracing::debug!(%error, %address, "operators cannot call here");
            }
        }
    }
}

fn close(opened: Option<Opened>) {
    let Some(opened) = opened else {
        return;
    };
    // No call comes to a session that ends.
    drop(opened.relays);
    if let Err(error) = opened.session.close().wait() {
        tracing::debug!(%error, "the channel was not closed");
    }
}
