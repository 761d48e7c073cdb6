//! The thread of one device, and what the cycle sees of it.
//!
//! ```text
//!   connecting ── there ──► exchanging ── one went well ──► good
//!       ▲                      │  ▲                          │
//!       │                      │  └── an exception: bad ◄────┤
//!       └── bad: no answer in time, or a new connection broke ┘
//! ```
//!
//! A device that ends its connection after some answers is served over a new one at once.
//!
//! Outputs are driven at each deadline. Where none come for two periods, the cycle does not run, or this process was suspended: then nothing is
//! exchanged, so that the device's own watchdog finds it and no old outputs are written. An exchange that has taken longer than it may is void,
//! also where all of it was answered while this process was suspended.
//!
//! When the remote I/O ends in order, the device is driven to the fail-safe values; when it dies, that is for the device's own
//! watchdog to do.

use std::cell::Cell;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::sys::signal::SigSet;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use tokio::sync::Notify;
use tokio::time::{sleep, timeout};
use understudy_cluster::{FieldDevice, Side};
use understudy_wire::Image;

use crate::contest::{Contest, READ_BACK_EVERY};
use crate::exchange::{Link, Trouble, exchange, leave, read_back};
use crate::plan::{Left, Plan, requests};

/// Of SCHED_FIFO: behind the cycle and the link, before programs that are not in real time.
const PRIORITY: u8 = 20;

/// From a connection that failed to the next try, and twice as long after each further one: it is tried for as long as the process lives.
const FIRST_PAUSE: Duration = Duration::from_millis(50);

/// At most; the outputs wait for it when the device is there again.
const LONGEST_PAUSE: Duration = Duration::from_millis(400);

/// Periods after which outputs that were driven are not written any more.
const OUTPUTS_LAST: u32 = 2;

/// A device that breaks off so often in a row, or does not answer, when its outputs are read is not asked for them any more.
const UNREAD: u8 = 2;

/// What the cycle sees of the device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Look {
    /// u(i), as the device gave it.
    Sensors(Image),
    /// Nothing that counts, and why.
    Lost(String),
}

/// A device and the thread that exchanges with it. It ends when it is dropped.
#[derive(Debug)]
pub struct Device {
    shared: Arc<Shared>,
    stale_after: Duration,
    /// The newest state that was looked at.
    looked_at: u64,
    stale: bool,
    /// What was told of it.
    contested: bool,
    connected: bool,
    /// The number of the wiring by which the newest look was read.
    looked_by: u64,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// Outputs are new, or it is over.
    changed: Notify,
}

#[derive(Debug)]
struct State {
    /// Grows with each answer and each trouble.
    number: u64,
    seen: Look,
    seen_at: Instant,
    /// The number of the wiring by which that was read.
    seen_by: u64,
    wiring: Arc<Wiring>,
    /// What only the wiring before has, until it is written for the last time.
    left: Left,
    /// With the time at which they were decided.
    outputs: Option<(Image, Instant)>,
    /// Another master writes its outputs too.
    contested: bool,
    /// Whether a connection is wanted: of two remote I/Os of a program, by the author only.
    connected: bool,
    /// What it is left with; nothing of one of two remote I/Os, since the other one continues.
    fail_safe: Option<Image>,
    ending: bool,
}

/// Which signal is at which address.
#[derive(Debug)]
struct Wiring {
    /// Counted from 0.
    number: u64,
    inputs: Plan,
    outputs: Plan,
}

impl Device {
    /// Starts to exchange with the device: whenever it is driven, and once a `period` at least; before the other programs of
    /// this machine where `real_time` is wanted and granted.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(
        settings: FieldDevice,
        fail_safe: Image,
        period: Duration,
        real_time: bool,
    ) -> std::io::Result<Self> {
        Self::start_as(settings, Some(fail_safe), period, real_time)
    }

    /// The same of one of two remote I/Os of a program: it connects when it is told to ([`Self::connect`]), and drives nothing when it ends, since the
    /// other one continues.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_in_pair(
        settings: FieldDevice,
        period: Duration,
        real_time: bool,
    ) -> std::io::Result<Self> {
        Self::start_as(settings, None, period, real_time)
    }

    fn start_as(
        settings: FieldDevice,
        fail_safe: Option<Image>,
        period: Duration,
        real_time: bool,
    ) -> std::io::Result<Self> {
        let in_pair = fail_safe.is_none();
        let connected = !in_pair;
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                number: 1,
                seen: Look::Lost("no answer yet".into()),
                seen_at: Instant::now(),
                seen_by: 0,
                wiring: Arc::new(Wiring {
                    number: 0,
                    inputs: Plan::new(&settings.inputs),
                    outputs: Plan::new(&settings.outputs),
                }),
                left: Left::new(),
                outputs: None,
                contested: false,
                connected,
                fail_safe,
                ending: false,
            }),
            changed: Notify::new(),
        });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let stale_after = settings.stale_after;
        let worker = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("field".into()).spawn(move || {
            prepare(real_time);
            runtime.block_on(
                Worker { settings, in_pair, period, unread: Cell::new(0), shared: worker }.run(),
            );
        })?;
        Ok(Self {
            shared,
            stale_after,
            looked_at: 0,
            stale: false,
            contested: false,
            connected,
            looked_by: 0,
            thread: Some(thread),
        })
    }

    /// Drives y(i), which was decided `age` ago, as soon as the device takes it; never waits for that.
    pub fn drive(&self, outputs: &Image, age: Duration) {
        let now = Instant::now();
        let decided_at = now.checked_sub(age).unwrap_or(now);
        self.shared.lock().outputs = Some((outputs.clone(), decided_at));
        self.shared.changed.notify_one();
    }

    /// Reads and drives by another wiring from now on, whose number it answers with. What was to be driven by the one before is not driven any more; outputs
    /// that only that one has are driven to `last`, its fail-safe values, once.
    pub fn rewire(&mut self, inputs: &Side, outputs: &Side, last: &Image) -> u64 {
        let mut state = self.shared.lock();
        let old = Arc::clone(&state.wiring);
        let (outputs, left) = Plan::new(outputs).after(&old.outputs, last);
        let number = old.number + 1;
        state.wiring = Arc::new(Wiring { number, inputs: Plan::new(inputs), outputs });
        let outputs = &Arc::clone(&state.wiring).outputs;
        state.left.retain(|(table, address), _| !outputs.has(*table, *address));
        state.left.extend(left);
        state.outputs = None;
        drop(state);
        self.shared.changed.notify_one();
        number
    }

    /// The number of the wiring by which the newest sensors that were looked at were read; 0 is that of the start.
    pub fn looked_by(&self) -> u64 {
        self.looked_by
    }

    /// What the device is left with at the end, from now on; without effect for one of two remote I/Os of a program.
    pub fn end_with(&self, outputs: &Image) {
        if let Some(fail_safe) = &mut self.shared.lock().fail_safe {
            fail_safe.clone_from(outputs);
        }
    }

    /// Connects to the device, or ends the connection without another request.
    pub fn connect(&mut self, connects: bool) {
        self.connected = connects;
        self.stale = false;
        let mut state = self.shared.lock();
        state.connected = connects;
        state.outputs = None;
        // What was seen before says nothing of now, and is no news.
        state.number += 1;
        state.seen = Look::Lost("no answer yet".into());
        self.looked_at = state.number;
        drop(state);
        self.shared.changed.notify_one();
    }

    /// What is new since the last look; never waits for the device.
    pub fn look(&mut self) -> Option<Look> {
        if !self.connected {
            return None;
        }
        let state = self.shared.lock();
        let is_new = state.number != std::mem::replace(&mut self.looked_at, state.number);
        let age = state.seen_at.elapsed();
        // An answer that was not looked at gets old too, where this process was suspended.
        if age > self.stale_after && matches!(state.seen, Look::Sensors(_)) {
            let was_stale = std::mem::replace(&mut self.stale, true);
            let age_ms = age.as_millis();
            let lost = || Look::Lost(format!("the last answer is {age_ms} ms old"));
            return (is_new || !was_stale).then(lost);
        }
        if is_new {
            self.stale = false;
            self.looked_by = state.seen_by;
        }
        is_new.then(|| state.seen.clone())
    }

    /// Whether another master writes the outputs too, where that is new.
    pub fn contested(&mut self) -> Option<bool> {
        let contested = self.shared.lock().contested;
        let told = std::mem::replace(&mut self.contested, contested);
        (contested != told).then_some(contested)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.shared.lock().ending = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing can panic while it is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What only the wiring before this one has is written for the last time.
    fn has_left(&self, wiring: u64) {
        let mut state = self.lock();
        if state.wiring.number == wiring {
            state.left.clear();
        }
    }

    /// Takes what was seen at a time: this process may have been suspended since.
    fn see(&self, look: Look, at: Instant, by: u64) {
        let mut state = self.lock();
        state.number += 1;
        state.seen_by = by;
        state.seen = look;
        state.seen_at = at;
    }
}

/// Signals are for the thread that waits for them.
fn prepare(real_time: bool) {
    // It fails only for a set that does not exist.
    let _ = SigSet::all().thread_block();
    if !real_time {
        return;
    }
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let set = ThreadPriorityValue::try_from(PRIORITY).and_then(|value| {
        let priority = ThreadPriority::Crossplatform(value);
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
            .map_err(|error| error.to_string())
    });
    if let Err(error) = set {
        tracing::debug!(error, "the device waits behind other programs");
    }
}

struct Worker {
    settings: FieldDevice,
    /// Whether the remote I/O is one of two of its program.
    in_pair: bool,
    period: Duration,
    /// How often in a row its outputs could not be read; [`UNREAD`] where it does not let them be read.
    unread: Cell<u8>,
    shared: Arc<Shared>,
}

impl Worker {
    async fn run(self) {
        let address = &self.settings.connection;
        let mut pause = self.first_pause();
        while !self.shared.lock().ending {
            if !self.shared.lock().connected {
                self.shared.changed.notified().await;
                pause = self.first_pause();
                continue;
            }
            let patience = self.settings.timeout;
            match timeout(patience, Link::connect(address, self.settings.unit)).await {
                Ok(Ok(device)) => {
                    if self.serve(device).await {
                        pause = self.first_pause();
                    }
                }
                Ok(Err(error)) => {
                    self.lose(format!("{address} does not take a connection: {error}"))
                }
                Err(_) => self.lose(format!("{address} takes no connection within {patience:?}")),
            }
            if !self.shared.lock().ending {
                sleep(pause).await;
                pause = (2 * pause).min(self.longest_pause());
            }
        }
    }

    /// One of two remote I/Os tries at each cycle: the device lets it write when the other one's connection is over.
    fn first_pause(&self) -> Duration {
        if self.in_pair { self.period.min(FIRST_PAUSE) } else { FIRST_PAUSE }
    }

    fn longest_pause(&self) -> Duration {
        if self.in_pair { self.first_pause() } else { LONGEST_PAUSE }
    }

    /// Exchanges until the connection is of no use, or it is over; whether it was of use before.
    async fn serve(&self, mut device: Link<'_>) -> bool {
        let mut was_of_use = false;
        // What this connection wrote last: what was there before may be what the device starts with.
        let mut written: Option<(Arc<Wiring>, Image)> = None;
        let mut contest = Contest::default();
        let mut read_at = Instant::now();
        loop {
            let patience = self.settings.timeout;
            device.ends_at(Instant::now() + patience);
            if let Some((wiring, written)) = &written
                && self.unread.get() < UNREAD
                && !self.shared.lock().ending
                && read_at.elapsed() >= READ_BACK_EVERY
            {
                read_at = Instant::now();
                let read = timeout(patience, read_back(&mut device, &wiring.outputs)).await;
                match read {
                    Ok(Ok(Some(read))) => {
                        self.unread.set(0);
                        let written = wiring.outputs.named(wiring.outputs.words(written));
                        self.shared.lock().contested = contest.compare(&written, &read);
                    }
                    Ok(Ok(None)) => self.unread.set(UNREAD),
                    Ok(Err(_)) | Err(_) => {
                        // An answer that is still to come would be taken for that to the next request.
                        self.unread.set(self.unread.get() + 1);
                        let address = &self.settings.connection;
                        self.lose(format!("{address} breaks off when its outputs are read"));
                        return was_of_use;
                    }
                }
            }
            // Before the outputs are taken: a suspension from here on is found by the requests.
            let begun = Instant::now();
            let (outputs, ending, wiring, left) = {
                let state = self.shared.lock();
                if !state.connected || state.ending && self.in_pair {
                    return was_of_use;
                }
                let (wiring, left) = (Arc::clone(&state.wiring), requests(&state.left));
                if let (true, Some(fail_safe)) = (state.ending, &state.fail_safe) {
                    (Some((fail_safe.clone(), Instant::now())), true, wiring, left)
                } else {
                    (state.outputs.clone(), false, wiring, left)
                }
            };
            if let Some((_, decided_at)) = &outputs
                && decided_at.elapsed() > self.period * OUTPUTS_LAST
            {
                self.shared.changed.notified().await;
                continue;
            }
            let outputs = outputs.map(|(outputs, _)| outputs);
            let driven = outputs.as_ref().map(|outputs| (&wiring.outputs, outputs));
            device.ends_at(begun + patience);
            let exchanged = timeout(patience, async {
                leave(&mut device, &left).await?;
                if !left.is_empty() {
                    self.shared.has_left(wiring.number);
                }
                exchange(&mut device, driven, &wiring.inputs).await
            });
            let exchanged = exchanged.await;
            let answered_at = Instant::now();
            if ending {
                return was_of_use;
            }
            match exchanged {
                // What was answered in time and is read late is as old as the time since.
                Ok(Ok(_)) if answered_at.duration_since(begun) > patience => {
                    self.lose_unanswered();
                    return was_of_use;
                }
                Ok(Ok(sensors)) => {
                    was_of_use = true;
                    written = outputs.map(|outputs| (Arc::clone(&wiring), outputs));
                    self.shared.see(Look::Sensors(sensors), answered_at, wiring.number);
                }
                Ok(Err(trouble)) => {
                    // Where only the values of the answer are wrong, the outputs were written.
                    let is_written = matches!(trouble, Trouble::Unread(_));
                    let driven = outputs.filter(|_| is_written);
                    written = driven.map(|outputs| (Arc::clone(&wiring), outputs));
                    let spared = trouble.spares_the_connection();
                    self.lose(self.said(&trouble));
                    if !spared {
                        return was_of_use;
                    }
                }
                Err(_) => {
                    self.lose_unanswered();
                    return was_of_use;
                }
            }
            // Woken early by new outputs and by the end.
            let _ = timeout(self.period, self.shared.changed.notified()).await;
        }
    }

    fn lose_unanswered(&self) {
        let (address, patience) = (&self.settings.connection, self.settings.timeout);
        self.lose(format!("{address} does not answer within {patience:?}"));
    }

    fn said(&self, trouble: &Trouble) -> String {
        format!("{}: {trouble}", self.settings.connection)
    }

    fn lose(&self, reason: String) {
        let by = self.shared.lock().wiring.number;
        self.shared.see(Look::Lost(reason), Instant::now(), by);
    }
}

#[cfg(test)]
mod tests;
