//! What the remote I/Os of a group report, judged by a referee while they run.

use std::io::{BufRead, BufReader, Read};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use nix::time::{ClockId, clock_gettime};
use understudy_journal::{Happening, Record};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event;
use understudy_simulator::Referee;
use understudy_wire::Source;

/// Reports of one remote I/O so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    /// Outputs that the referee refutes.
    pub(super) wrong: u64,
    /// Times at which the referee could not judge.
    pub(super) gaps: u64,
    pub(super) held: u64,
    pub(super) fail_safe: u64,
    pub(super) stalls: u64,
    /// Nothing before the first report.
    pub(super) is_protected: Option<bool>,
    /// Time of the newest report of protection, on the monotonic clock of the host.
    pub(super) protected_ns: u64,
    /// Time of the newest loss of protection.
    pub(super) unprotected_ns: u64,
}

impl Counts {
    /// Deadlines without a provable output.
    pub(super) fn missed(&self) -> u64 {
        self.held + self.fail_safe
    }

    fn take(&mut self, at_ns: u64, event: &Event, referee: &mut Referee) {
        if referee.observe(event).is_err() {
            self.wrong += 1;
        }
        self.gaps = referee.gaps();
        match event {
            Event::Applied { source: Source::Held, .. } if self.is_protected.is_some() => {
                self.held += 1;
            }
            Event::Applied { source: Source::FailSafe, .. } if self.is_protected.is_some() => {
                self.fail_safe += 1;
            }
            Event::Stalled { .. } => self.stalls += 1,
            Event::Protected { .. } => {
                (self.is_protected, self.protected_ns) = (Some(true), at_ns);
            }
            Event::Unprotected { .. } => {
                (self.is_protected, self.unprotected_ns) = (Some(false), at_ns);
            }
            _ => {}
        }
    }
}

/// Counts the stalls that a journal tells of until it ends.
pub(super) fn follow_stalls(journal: impl Read + Send + 'static, stalls: Arc<AtomicU64>) {
    std::thread::spawn(move || {
        let lines = BufReader::new(journal).lines().map_while(Result::ok);
        // Reading all that a station reports would take more of a core than the station.
        for line in lines.filter(|line| line.contains("stalled")) {
            let event = serde_json::from_str::<Record>(&line).map(|record| record.event);
            if let Ok(Happening::Station(StationEvent::Stalled { .. })) = event {
                stalls.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
}

/// The monotonic clock of the host, as records have it.
pub(super) fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::CLOCK_MONOTONIC);
    now.map_or(0, |now| now.tv_sec() as u64 * 1_000_000_000 + now.tv_nsec() as u64)
}

pub(super) fn now(counts: &Arc<Mutex<Counts>>) -> Counts {
    *counts.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the journal of a remote I/O until it ends.
pub(super) fn follow(
    journal: impl Read + Send + 'static,
    mut referee: Referee,
    counts: Arc<Mutex<Counts>>,
) {
    std::thread::spawn(move || {
        for line in BufReader::new(journal).lines().map_while(Result::ok) {
            let Ok(Record { at_ns, event: Happening::RemoteIo(event), .. }) =
                serde_json::from_str::<Record>(&line)
            else {
                continue;
            };
            counts.lock().unwrap_or_else(PoisonError::into_inner).take(at_ns, &event, &mut referee);
        }
    });
}
