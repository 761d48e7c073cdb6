//! What concerns people and not the cycle goes over mutual TLS: commands, the configuration, and what a party says of itself.
//!
//! Every party with keys listens on the TCP port of its own address. There, by the common name of the certificate that a caller
//! shows, and denied to everybody else (Zenoh's access control, default deny):
//!
//! | key, under `understudy/<cluster>/<party>/` | what | operators | members |
//! |---|---|---|---|
//! | `configuration` | asked: the canonical text of the configuration | yes | yes |
//! | `status` | asked: what it said when it was ready | yes | yes |
//! | `command/release`, `command/stop` | asked: done | yes | no |
//! | `journal` | told: each line of its journal | yes | no |
//!
//! Invariants: the cycle never waits for the channel, which has a thread and a bounded queue of its own; a channel that cannot be
//! opened is tried again, and the party runs without it; who is revoked is cut off as soon as the list of the admitted changes.

mod followed;
mod tls;

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

use crate::clock::Clock;
use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::journal::{EventSink, HostEvent, JournalSender, Noted};
use crate::orders::{Control, Order};
use crate::rights::run_in_background;

pub(crate) use followed::{Telemetry, followed};
pub use tls::{Admitted, TlsKeys};
pub(crate) use tls::{insert, prefix, tls_config};

use tls::access_control;

/// How often it is looked who is admitted.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// After a channel could not be opened.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(5);

/// A party that ends waits so long for its channel to end, at most.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);

/// What a party needs for its channel.
pub struct ChannelSettings {
    /// Its files.
    pub keys: TlsKeys,
    /// Says who is admitted now; asked again and again.
    pub admitted: Box<dyn FnMut() -> Admitted + Send>,
    /// The canonical text of its configuration.
    pub configuration: String,
}

/// A channel that runs; ends when it is dropped.
pub(crate) struct RunningChannel {
    stop: Arc<AtomicBool>,
    wake: SyncSender<Vec<u8>>,
    closed: Receiver<Never>,
}

/// Of queues that say only that the other end is gone.
enum Never {}

impl RunningChannel {
    /// Tells it to end, and does not wait.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
        // A full queue wakes it as well.
        let _ = self.wake.try_send(Vec::new());
    }
}

impl Drop for RunningChannel {
    fn drop(&mut self) {
        self.stop();
        // Where Zenoh does not come to an end, the process does.
        let _ = self.closed.recv_timeout(CLOSE_TIMEOUT);
    }
}

/// A party's end of the channel.
pub(crate) struct Channel<E> {
    settings: ChannelSettings,
    prefix: String,
    address: SocketAddr,
    /// What it said when it was ready.
    status: String,
    control: Control,
    telemetry: Telemetry,
    sink: JournalSender<E>,
    clock: Clock,
    stop: Arc<AtomicBool>,
    /// An operator wants the party to end.
    stop_wanted: Arc<AtomicBool>,
}

/// What is open.
struct Opened {
    session: zenoh::Session,
    journal: Publisher<'static>,
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
        let party = Self {
            settings,
            prefix: prefix(endpoints.cluster(), &own.name),
            address: own.address,
            status,
            control,
            telemetry,
            sink,
            clock,
            stop: Arc::clone(&stop),
            stop_wanted: Arc::default(),
        };
        std::thread::Builder::new()
            .name("channel".into())
            .spawn(move || {
                run_in_background();
                party.run();
                drop(closing);
            })
            .map_err(|source| BusError::System {
                what: "a thread for the channel",
                source,
            })?;
        Ok(RunningChannel { stop, wake, closed })
    }

    fn run(mut self) {
        let mut admitted = (self.settings.admitted)();
        let mut opened: Option<Opened> = None;
        let mut next_try = Time::default();
        let mut looked = self.clock.now();
        let mut stopping = false;
        loop {
            let now = self.clock.now();
            if opened.is_none() && now >= next_try {
                opened = self.open(&admitted);
                next_try = now + TRY_AGAIN_AFTER;
            }
            match self.telemetry.lines.recv_timeout(LOOK_EVERY) {
                Ok(line) => {
                    if let Some(opened) = &opened {
                        // One that nobody takes is lost to those who follow, and is in the journal.
                        let _ = opened.journal.put(line).wait();
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
            let lost = self.telemetry.lost.swap(0, Ordering::Relaxed);
            if lost > 0 {
                tracing::debug!(lost, "lines that nobody could follow");
            }
        }
        // The journal ends when nobody reports any more.
        drop(self.sink);
        close(opened);
    }

    fn open(&mut self, admitted: &Admitted) -> Option<Opened> {
        let event = match self.listen(admitted) {
            Ok(opened) => {
                let event = HostEvent::ChannelOpened {
                    address: self.address,
                    operators: admitted.operators.clone(),
                };
                self.sink.record(self.clock.now(), Noted::Host(event));
                return Some(opened);
            }
            Err(error) => HostEvent::ChannelFailed {
                reason: error.to_string(),
            },
        };
        self.sink.record(self.clock.now(), Noted::Host(event));
        None
    }

    fn listen(&self, admitted: &Admitted) -> zenoh::Result<Opened> {
        // Zenoh only has words for why it cannot listen; this asks the system first.
        TcpListener::bind(self.address)
            .map_err(|source| BusError::listen(self.address, source).to_string())?;
        let listen = format!("tls/{}", self.address);
        let mut config = tls_config("peer", &self.settings.keys)?;
        insert(&mut config, "listen/endpoints", &json!([listen]))?;
        let rules = access_control(&self.prefix, admitted);
        insert(&mut config, "access_control", &rules)?;
        let session = zenoh::open(config).wait()?;
        let journal = session
            .declare_publisher(format!("{}/journal", self.prefix))
            .congestion_control(CongestionControl::Drop)
            .wait()?;
        let mut answers = Vec::new();
        for (what, text) in [
            ("configuration", self.settings.configuration.clone()),
            ("status", self.status.clone()),
        ] {
            let key = format!("{}/{what}", self.prefix);
            answers.push(answer(&session, key, move || text.clone())?);
        }
        let control = self.control.clone();
        let release = move || {
            control.give(Order::Release);
            "done".to_owned()
        };
        let key = format!("{}/command/release", self.prefix);
        answers.push(answer(&session, key, release)?);
        let wanted = Arc::clone(&self.stop_wanted);
        let stop = move || {
            wanted.store(true, Ordering::SeqCst);
            "done".to_owned()
        };
        let key = format!("{}/command/stop", self.prefix);
        answers.push(answer(&session, key, stop)?);
        Ok(Opened {
            session,
            journal,
            _answers: answers,
        })
    }
}

fn close(opened: Option<Opened>) {
    if let Some(opened) = opened
        && let Err(error) = opened.session.close().wait()
    {
        tracing::debug!(%error, "the channel was not closed");
    }
}

fn answer(
    session: &zenoh::Session,
    key: String,
    say: impl Fn() -> String + Send + Sync + 'static,
) -> zenoh::Result<Queryable<()>> {
    session
        .declare_queryable(key.clone())
        .callback(move |query: Query| {
            if let Err(error) = query.reply(key.clone(), say()).wait() {
                tracing::debug!(%error, "an answer was not sent");
            }
        })
        .wait()
}
