//! What went wrong with datagrams and is not yet reported.
//!
//! Bounded, whoever sends what: one entry for each kind and sender, at most [`MAXIMUM_ENTRIES`]; what comes on top of them is
//! counted under its kind alone. The journal gets one record an entry, so often as the caller asks for them.

use std::collections::BTreeMap;
use std::time::Duration;

use understudy_wire::{Member, Time};

use crate::guard::Refused;
use crate::host_event::HostEvent;
use crate::refused_as::RefusedAs;

/// Kinds and senders told apart in one report.
const MAXIMUM_ENTRIES: usize = 32;

/// A duplicate that sent nothing for so long is gone.
const DUPLICATE_GONE_AFTER: Duration = Duration::from_secs(5);

/// Members that two processes run as, and when each was last seen to. Bounded by the number of members: only they have keys.
#[derive(Debug, Default)]
pub(crate) struct Duplicates {
    seen: BTreeMap<Member, Time>,
}

impl Duplicates {
    /// The event where it is new.
    pub(crate) fn note(&mut self, now: Time, refused: &Refused) -> Option<HostEvent> {
        let member = refused.sender.filter(|_| refused.kind == RefusedAs::OfAnotherLife)?;
        let is_new = self.seen.insert(member, now).is_none();
        is_new.then_some(HostEvent::DuplicateFound { member })
    }

    /// The events of those that are over.
    pub(crate) fn over(&mut self, now: Time) -> impl Iterator<Item = HostEvent> + use<> {
        let gone = |_: &Member, seen: &mut Time| now.since(*seen) >= DUPLICATE_GONE_AFTER;
        let gone: Vec<(Member, Time)> = self.seen.extract_if(.., gone).collect();
        gone.into_iter().map(|(member, _)| HostEvent::DuplicateGone { member })
    }
}

/// Datagrams that were refused.
#[derive(Debug, Default)]
pub(crate) struct Refusals {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    kind: RefusedAs,
    sender: Option<Member>,
    datagrams: u64,
    reason: String,
}

impl Refusals {
    pub(crate) fn note(&mut self, refused: Refused) {
        let Refused { kind, mut sender, reason } = refused;
        if self.place(kind, sender).is_none() && self.entries.len() >= MAXIMUM_ENTRIES {
            sender = None;
        }
        match self.place(kind, sender) {
            Some(place) => {
                self.entries[place].datagrams += 1;
                self.entries[place].reason = reason;
            }
            None => self.entries.push(Entry { kind, sender, datagrams: 1, reason }),
        }
    }

    fn place(&self, kind: RefusedAs, sender: Option<Member>) -> Option<usize> {
        let same = |entry: &Entry| entry.kind == kind && entry.sender == sender;
        self.entries.iter().position(same)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// One event for each entry.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = HostEvent> + '_ {
        self.entries.drain(..).map(|entry| match entry.kind {
            RefusedAs::NoFrame => {
                HostEvent::RefusedBytes { datagrams: entry.datagrams, reason: entry.reason }
            }
            refused_as => HostEvent::RefusedFrames {
                datagrams: entry.datagrams,
                refused_as,
                sender: entry.sender,
                reason: entry.reason,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    #[test]
    fn a_flood_of_every_kind_and_name_stays_bounded_and_counted() {
        let kinds = [RefusedAs::Forged, RefusedAs::Foreign, RefusedAs::Replayed];
        let mut refusals = Refusals::default();
        for round in 0..10_u64 {
            for rank in 0..=255 {
                for kind in kinds {
                    refusals.note(Refused {
                        kind,
                        sender: Some(Member::Station(StationId(rank))),
                        reason: round.to_string(),
                    });
                }
            }
        }
        assert!(refusals.entries.len() <= MAXIMUM_ENTRIES + kinds.len());
        let mut datagrams = 0;
        for event in refusals.take() {
            let HostEvent::RefusedFrames { datagrams: these, reason, .. } = event else {
                panic!("{event:?}");
            };
            assert_eq!(reason, "9", "the last one is shown");
            datagrams += these;
        }
        assert_eq!(datagrams, 10 * 256 * kinds.len() as u64);
        assert!(refusals.is_empty());
    }
}
