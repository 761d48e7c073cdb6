//! Follows the reports of a few remote I/Os of a group.

use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use understudy_bus::{
    BusError, Call, Peer, Request, SPARE_REPORTS_EVERY, SpareReport, TlsKeys, Told,
};
use understudy_cycle::spare::AttendanceReport;
use understudy_wire::{ClusterHash, ConfigurationHash};

/// Between two calls.
const AGAIN: Duration = Duration::from_secs(1);

/// The shortest time without a report after which a remote I/O is no longer followed.
const SILENT_AFTER: Duration = Duration::from_millis(2_500);

/// What comes of a witness.
pub(crate) enum Seen {
    /// The stations that it misses.
    Report(AttendanceReport),
    /// It is not followed, and why.
    Lost(String),
}

/// Where a spare is awake, for the reports of all its witnesses.
#[derive(Debug, Clone, Default)]
pub(crate) struct Whereabouts(Arc<Mutex<Option<String>>>);

impl Whereabouts {
    /// It is awake in this group, or asleep.
    pub(crate) fn set(&self, group: Option<String>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = group;
    }

    fn get(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A witness: one of the remote I/Os of a group, another one where that is not received.
pub(crate) struct Watch {
    /// Name of the spare.
    pub(crate) spare: String,
    pub(crate) whereabouts: Whereabouts,
    pub(crate) cluster: ClusterHash,
    pub(crate) configuration: ConfigurationHash,
    pub(crate) period: Duration,
    pub(crate) keys: TlsKeys,
    /// The remote I/Os that it follows in turn; at least one.
    pub(crate) peers: Vec<Peer>,
}

impl Watch {
    /// Follows until the spare ends; its end of the channel is gone then.
    pub(crate) fn run(self, group: usize, witness: usize, seen: &Sender<(usize, usize, Seen)>) {
        for peer in self.peers.iter().cycle() {
            let lost = match Call::to(peer.call_address(), self.cluster, &peer.name, &self.keys) {
                Ok(call) => self.follow(&call, |report| {
                    seen.send((group, witness, Seen::Report(report))).is_ok()
                }),
                Err(BusError::Uncalled { reason, .. }) => reason,
                Err(error) => error.to_string(),
            };
            let lost = Seen::Lost(format!("{}: {lost}", peer.name));
            if seen.send((group, witness, lost)).is_err() {
                return;
            }
            std::thread::sleep(AGAIN);
        }
    }

    /// Until the journal ends: the reason.
    fn follow(&self, call: &Call, mut report: impl FnMut(AttendanceReport) -> bool) -> String {
        let mut other = None;
        let patience = (self.period * 10).max(SILENT_AFTER);
        let mut reported = None;
        let ended = call.follow_attendance(patience, |told| match told {
            Told::By(reporter) => {
                self.report(call, &mut reported);
                let theirs = reporter.map(|by| by.configuration.as_str()).unwrap_or_default();
                let same = reporter.is_some_and(|by| by.is_of(self.configuration));
                if !same {
                    other = Some(format!("it runs configuration {theirs}"));
                }
                same
            }
            // Another line is of a later version.
            Told::Line(line) => serde_json::from_str(line).map_or(true, &mut report),
            // The next report is complete in itself, and its absence is for the patience to judge.
            Told::Lost(_) | Told::Silent => true,
        });
        let silent = || ended.err().map(|_| "it sends no report".to_owned());
        other.or_else(silent).unwrap_or_else(|| "the call ended".to_owned())
    }
}

/// The report that was sent last, and when.
type Reported = Option<(Instant, SpareReport)>;

impl Watch {
    /// Reports to the witness that the spare watches, and where it is awake.
    fn report(&self, call: &Call, reported: &mut Reported) {
        let report = SpareReport { spare: self.spare.clone(), serves: self.whereabouts.get() };
        let is_known = reported
            .as_ref()
            .is_some_and(|(at, last)| at.elapsed() < SPARE_REPORTS_EVERY && *last == report);
        if !is_known && call.tell(&Request::Spare(report.clone())) {
            *reported = Some((Instant::now(), report));
        }
    }
}
