//! Spares that report to this member: that they watch its group, and where they are awake.
//!
//! ```text
//!   (unknown) ──(report)──► received ──(no report for SILENT_AFTER)──► lost
//!                              ▲                                        │
//!                              └───────────────(report)─────────────────┘
//! ```
//!
//! Invariant: the journal has a record for each change and none for a repeated report. Reports decide nothing: which station is
//! received shows whether a spare is awake, and a spare that nothing reports of must not be taken for one that waits.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::Time;
use zenoh::query::Queryable;

use super::{Channel, DONE, SPARE_KEY, answer};
use crate::host_event::HostEvent;
use crate::journal::{EventSink, Noted};

/// A spare reports so often, and at once where it wakes or retires.
pub const SPARE_REPORTS_EVERY: Duration = Duration::from_secs(5);

/// A spare without a report for this time is lost.
const SILENT_AFTER: Duration = Duration::from_secs(15);

/// Spares that are known at once, at most; reports of others are refused.
const MOST: usize = 16;

/// Characters of a name.
const NAME_LENGTH: usize = 60;

/// Bytes of a report.
const REPORT_BYTES: usize = 512;

/// Reports that wait to be recorded.
const WAITING: usize = 16;

/// What a spare reports.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpareReport {
    /// Its name in the plant file.
    pub spare: String,
    /// The group in which it is awake, as the plant file names it.
    pub serves: Option<String>,
}

impl SpareReport {
    /// Whether both names are of a bounded length.
    fn is_bounded(&self) -> bool {
        let fits = |name: &String| (1..=NAME_LENGTH).contains(&name.chars().count());
        fits(&self.spare) && self.serves.as_ref().is_none_or(fits)
    }
}

/// The spares that have reported.
#[derive(Debug, Default)]
struct Spares(BTreeMap<String, Known>);

#[derive(Debug)]
struct Known {
    serves: Option<String>,
    at: Time,
    is_lost: bool,
}

impl Spares {
    /// Takes a report; what has changed.
    fn take(&mut self, now: Time, report: SpareReport) -> Option<HostEvent> {
        let SpareReport { spare, serves } = report;
        if self.0.len() >= MOST && !self.0.contains_key(&spare) {
            return None;
        }
        let known = Known { serves: serves.clone(), at: now, is_lost: false };
        let before = self.0.insert(spare.clone(), known);
        let is_repeated = before.is_some_and(|known| !known.is_lost && known.serves == serves);
        (!is_repeated).then_some(HostEvent::SpareReceived { spare, serves })
    }

    /// The spares that have fallen silent.
    fn lost(&mut self, now: Time) -> Vec<HostEvent> {
        let silent = self.0.iter_mut();
        let silent =
            silent.filter(|(_, known)| !known.is_lost && now.since(known.at) > SILENT_AFTER);
        silent
            .map(|(spare, known)| {
                known.is_lost = true;
                HostEvent::SpareLost { spare: spare.clone() }
            })
            .collect()
    }
}

/// Reports on their way to the journal.
pub(super) struct SpareReports {
    spares: Spares,
    sender: SyncSender<SpareReport>,
    receiver: Receiver<SpareReport>,
}

impl Default for SpareReports {
    fn default() -> Self {
        let (sender, receiver) = sync_channel(WAITING);
        Self { spares: Spares::default(), sender, receiver }
    }
}

impl<E: Send + 'static> Channel<E> {
    /// Records which spares have reported anew, and which have fallen silent.
    pub(super) fn note_spares(&mut self, now: Time) {
        let SpareReports { spares, receiver, .. } = &mut self.spares;
        let mut changes: Vec<HostEvent> =
            receiver.try_iter().filter_map(|report| spares.take(now, report)).collect();
        changes.extend(spares.lost(now));
        for change in changes {
            self.sink.record(now, Noted::Host(change));
        }
    }

    /// Takes reports of spares, each under its own name: the access control admits no other one. A report that finds no room is repeated by its spare.
    pub(super) fn answer_spares(&self, session: &zenoh::Session) -> zenoh::Result<Queryable<()>> {
        let sender = self.spares.sender.clone();
        answer(session, format!("{}/{SPARE_KEY}/*", self.prefix), move |query| {
            let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
            let report = match bytes.len() {
                ..=REPORT_BYTES => serde_json::from_slice::<SpareReport>(&bytes).ok(),
                _ => None,
            };
            let name = query.key_expr().as_str().rsplit('/').next();
            let is_own = |report: &SpareReport| name == Some(report.spare.as_str());
            match report.filter(|report| report.is_bounded() && is_own(report)) {
                Some(report) => {
                    let _ = sender.try_send(report);
                    DONE.to_owned()
                }
                None => "invalid report of a spare".to_owned(),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(spare: &str, serves: Option<&str>) -> SpareReport {
        SpareReport { spare: spare.to_owned(), serves: serves.map(str::to_owned) }
    }

    fn received(spare: &str, serves: Option<&str>) -> Option<HostEvent> {
        let SpareReport { spare, serves } = report(spare, serves);
        Some(HostEvent::SpareReceived { spare, serves })
    }

    #[test]
    fn each_change_is_told_once_and_silence_is_a_change() {
        let at = |seconds| Time(0) + Duration::from_secs(seconds);
        let mut spares = Spares::default();
        let rows = [
            (0, None, received("s", None)),
            (5, None, None),
            (6, Some("line-1"), received("s", Some("line-1"))),
            (11, Some("line-1"), None),
            (16, None, received("s", None)),
        ];
        for (seconds, serves, expected) in rows {
            assert_eq!(spares.take(at(seconds), report("s", serves)), expected, "{seconds}");
            assert_eq!(spares.lost(at(seconds)), []);
        }
        assert_eq!(spares.lost(at(31)), []);
        assert_eq!(spares.lost(at(32)), [HostEvent::SpareLost { spare: "s".to_owned() }]);
        assert_eq!(spares.lost(at(60)), [], "it is told once");
        assert_eq!(spares.take(at(61), report("s", None)), received("s", None));
    }

    #[test]
    fn the_number_of_spares_and_their_names_are_bounded() {
        let mut spares = Spares::default();
        let told = (0..MOST + 5)
            .filter_map(|number| spares.take(Time(0), report(&format!("spare-{number}"), None)));
        assert_eq!(told.count(), MOST);
        assert!(report(&"x".repeat(NAME_LENGTH), None).is_bounded());
        assert!(!report(&"x".repeat(NAME_LENGTH + 1), None).is_bounded());
        assert!(!report("s", Some("")).is_bounded());
    }
}
