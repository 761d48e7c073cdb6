//! When a session is opened anew: it receives no peer, or not one that is connected.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use understudy_wire::{Member, Time};

use super::PULSE;

/// A member that receives none of its peers during so many pulses, which take a second, opens its session anew. Not by the clock: on a
/// machine without time for its pulses, the peers have none for theirs, and new sessions would cost all of them more.
pub(super) const SILENT_PULSES: u32 = 4;

/// The same where one peer is connected and not received, but others are: 3 s, so that the connection to one that is suspended ends
/// first. Each member waits a pulse longer than the one before it, so that not all open their sessions anew at the same time.
pub(super) const MUTE_PULSES: u32 = 12;

/// The most times as long: a member whose peers are all switched off opens its session every 32 s.
const MOST_PATIENCE: u32 = 32;

/// The least times as long on one of two networks: a silent one is as a rule a network that has failed. Zenoh connects again by itself, and a new
/// session costs time that the other network needs.
const PATIENCE_OF_TWO: u32 = 8;

/// What was not received, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Silent {
    /// The one peer that is connected and was not received; none where no peer was received.
    pub(super) peer: Option<Member>,
    pub(super) lasts: Duration,
}

/// How long peers were not received, and when that is long enough to open the session anew.
pub(super) struct Silence {
    since: Time,
    pulses: u32,
    /// Of each peer that is connected, pulses in which others were received and it was not.
    mute: BTreeMap<Member, u32>,
    /// Factor of the pulses that must pass.
    patience: u32,
    /// The factor of the first time.
    first_patience: u32,
    /// The place of this member among all.
    place: u32,
}

impl Silence {
    pub(super) fn new(now: Time, place: u32, is_one_of_two: bool) -> Self {
        let first_patience = if is_one_of_two { PATIENCE_OF_TWO } else { 1 };
        Self {
            place,
            since: now,
            pulses: 0,
            mute: BTreeMap::new(),
            patience: first_patience,
            first_patience,
        }
    }

    /// At each pulse: the reason to open the session anew. `heard` where a peer was received since the last one; `mute` are the peers that
    /// are connected and were not.
    pub(super) fn look(
        &mut self,
        now: Time,
        heard: bool,
        mute: &BTreeSet<Member>,
    ) -> Option<Silent> {
        self.mute.retain(|peer, _| mute.contains(peer));
        let silent = if heard {
            (self.since, self.pulses) = (now, 0);
            for peer in mute {
                *self.mute.entry(*peer).or_default() += 1;
            }
            self.longest_mute()
        } else {
            self.pulses += 1;
            (self.pulses >= self.patience * SILENT_PULSES).then(|| self.of_all(now))
        };
        if silent.is_some() {
            self.pulses = 0;
            self.mute.clear();
            self.patience = (self.patience * 2).min(MOST_PATIENCE);
        } else if heard && self.mute.is_empty() {
            self.patience = self.first_patience;
        }
        silent
    }

    /// How long no peer was received.
    pub(super) fn of_all(&self, now: Time) -> Silent {
        Silent { peer: None, lasts: now.since(self.since) }
    }

    fn longest_mute(&self) -> Option<Silent> {
        let (&peer, &pulses) = self.mute.iter().max_by_key(|(_, pulses)| **pulses)?;
        let is_due = pulses >= self.patience * MUTE_PULSES + self.place;
        is_due.then(|| Silent { peer: Some(peer), lasts: PULSE * pulses })
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    fn station(rank: u8) -> Member {
        Member::Station(StationId(rank))
    }

    /// Those of `pulses` after which a session was opened anew, each with the peer that was mute.
    fn opened(
        silence: &mut Silence,
        pulses: std::ops::RangeInclusive<u32>,
        heard: &[Member],
        connected: &[Member],
    ) -> Vec<(u32, Option<Member>)> {
        let mute = connected.iter().filter(|peer| !heard.contains(peer));
        let mute: BTreeSet<Member> = mute.copied().collect();
        let mut opened = Vec::new();
        for pulse in pulses {
            let now = Time::default() + PULSE * pulse;
            if let Some(silent) = silence.look(now, !heard.is_empty(), &mute) {
                opened.push((pulse, silent.peer));
            }
        }
        opened
    }

    #[test]
    fn without_any_peer_after_a_second_and_then_less_often() {
        let mut silence = Silence::new(Time::default(), 0, false);
        // Seconds 1, 3, and 7: pauses of 1, 2 and 4 s.
        let found = opened(&mut silence, 1..=40, &[], &[station(1)]);
        assert_eq!(found, [(4, None), (12, None), (28, None)]);
        let now = Time::default() + PULSE * 40;
        assert_eq!(silence.of_all(now).lasts, PULSE * 40);
        assert!(opened(&mut silence, 41..=41, &[station(1)], &[]).is_empty());
        assert_eq!(opened(&mut silence, 42..=47, &[], &[]), [(45, None)]);
    }

    #[test]
    fn with_one_that_is_connected_and_mute_after_three_seconds() {
        let mut silence = Silence::new(Time::default(), 0, false);
        let both = [station(1), station(2)];
        let found = opened(&mut silence, 1..=40, &both[..1], &both);
        assert_eq!(found, [(12, Some(station(2))), (36, Some(station(2)))]);
        // Heard again, and as patient as at first.
        assert!(opened(&mut silence, 41..=41, &both, &both).is_empty());
        assert_eq!(opened(&mut silence, 42..=54, &both[..1], &both), [(53, Some(station(2)))]);
    }

    #[test]
    fn one_member_after_the_other() {
        let both = [station(1), station(2)];
        let first = |place| {
            let mut silence = Silence::new(Time::default(), place, false);
            opened(&mut silence, 1..=40, &both[..1], &both)[0].0
        };
        assert_eq!([0, 1, 7].map(first), [12, 13, 19]);
    }

    #[test]
    fn never_because_of_one_that_is_not_connected_or_heard_now_and_then() {
        let mut silence = Silence::new(Time::default(), 0, false);
        let (one, both) = ([station(1)], [station(1), station(2)]);
        assert!(opened(&mut silence, 1..=100, &one, &one).is_empty());
        for round in 0..20 {
            let first = 101 + 12 * round;
            assert!(opened(&mut silence, first..=first + 10, &one, &both).is_empty());
            assert!(opened(&mut silence, first + 11..=first + 11, &both, &both).is_empty());
        }
    }
}
