//! Whether anybody receives what this member sends; the turns of the others tell.
//!
//! Receivers take no frame of a member that started again later elsewhere, or whose life is older than one that they know: it runs, receives
//! everybody, and is refused by all. Then a new life helps. Where the network is broken instead, a new life does no harm.

use std::time::Duration;

use understudy_wire::{Body, Frame, Party, Time};

/// Without a sign for so long, a new life is tried; twice as long after each try.
const PATIENCE: Duration = Duration::from_secs(3);
const LONGEST_PATIENCE: Duration = Duration::from_secs(60);
/// After so long without a try, patience is short again.
const CALM: Duration = Duration::from_secs(600);
/// Others are received, and this member sends, where that was so no longer ago.
const RECENT: Duration = Duration::from_secs(1);

/// What one member knows of being received.
#[derive(Debug)]
pub(crate) struct Reception {
    own: Party,
    sent: Option<Time>,
    turned: Option<Time>,
    /// The last sign, or when this member began to send.
    since: Option<Time>,
    tried: Option<Time>,
    patience: Duration,
}

impl Reception {
    pub(crate) fn new(own: Party) -> Self {
        Self {
            own,
            sent: None,
            turned: None,
            since: None,
            tried: None,
            patience: PATIENCE,
        }
    }

    /// This member sends a frame.
    pub(crate) fn sends(&mut self, now: Time, frame: &Frame) {
        if !matches!(frame.body, Body::Turn(_) | Body::Sample(_)) {
            return;
        }
        let is_recent = |sent| now.since(sent) <= RECENT;
        if !self.sent.is_some_and(is_recent) {
            self.since = Some(now);
        }
        self.sent = Some(now);
    }

    /// A frame of another member counts.
    pub(crate) fn receives(&mut self, now: Time, frame: &Frame) {
        let Body::Turn(turn) = &frame.body else {
            return;
        };
        let (is_told, is_sign) = match self.own {
            // Whoever speaks before it in a cycle cannot have received it.
            Party::Station(own) => (frame.header.sender > self.own, turn.heard.contains(own)),
            Party::RemoteIo(own) => {
                let mut held = turn.holdings.iter();
                let held = held.find(|holding| holding.program == own);
                let stepped = held.is_some_and(|held| held.stepped == frame.header.moment);
                (held.is_some(), stepped)
            }
            Party::Plant(_) => (false, false),
        };
        if is_told {
            self.turned = Some(now);
        }
        if is_sign {
            self.since = Some(now);
        }
    }

    /// For how long nobody has received it, where it is time for a new life.
    pub(crate) fn is_refused(&mut self, now: Time) -> Option<Duration> {
        let is_recent = |at| now.since(at) <= RECENT;
        let goes_on = self.sent.is_some_and(is_recent) && self.turned.is_some_and(is_recent);
        let silence = now.since(self.since.filter(|_| goes_on)?);
        if self.tried.is_some_and(|tried| now.since(tried) > CALM) {
            self.patience = PATIENCE;
        }
        if silence < self.patience {
            return None;
        }
        self.patience = LONGEST_PATIENCE.min(self.patience * 2);
        self.tried = Some(now);
        self.since = Some(now);
        Some(silence)
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{
        ClusterHash, ConfigurationHash, Header, Moment, ProgramSet, StationId, StationSet, Turn,
    };

    use super::*;

    const ROBOT: Party = Party::Station(StationId(0));

    fn turn(sender: u8, heard: impl IntoIterator<Item = StationId>) -> Frame {
        Frame {
            header: Header {
                cluster: ClusterHash(1),
                configuration: ConfigurationHash(2),
                moment: Moment::default(),
                sender: Party::Station(StationId(sender)),
                alone: false,
            },
            body: Body::Turn(Turn {
                heard: heard.into_iter().collect::<StationSet>(),
                holdings: [].into_iter().collect(),
                words: [].into_iter().collect(),
                recalled: Vec::new(),
                lacks: ProgramSet::default(),
                relayed: Vec::new(),
            }),
        }
    }

    /// The seconds at which the robot begins another life, where its turns are received in these seconds.
    fn tries(seconds: u64, is_received: impl Fn(u64) -> bool, turns_come: bool) -> Vec<u64> {
        let mut reception = Reception::new(ROBOT);
        let mut tries = Vec::new();
        for step in 0..seconds * 10 {
            let now = Time(step * 100_000_000);
            reception.sends(now, &turn(0, []));
            if turns_come {
                let heard = is_received(step / 10).then_some(StationId(0));
                reception.receives(now, &turn(2, heard));
            }
            if reception.is_refused(now).is_some() {
                tries.push(step / 10);
            }
        }
        tries
    }

    #[test]
    fn who_is_received_by_nobody_begins_another_life_ever_more_rarely() {
        assert_eq!(tries(60, |_| false, true), [3, 9, 21, 45]);
        assert_eq!(tries(60, |second| second != 30, true), [] as [u64; 0]);
        assert_eq!(tries(60, |second| second < 30, true), [32, 38, 50]);
    }

    #[test]
    fn who_receives_nobody_cannot_know() {
        assert_eq!(tries(60, |_| false, false), [] as [u64; 0]);
    }

    #[test]
    fn those_who_speak_earlier_tell_nothing() {
        let mut reception = Reception::new(Party::Station(StationId(2)));
        for step in 0..600 {
            let now = Time(step * 100_000_000);
            reception.sends(now, &turn(2, []));
            reception.receives(now, &turn(0, []));
            assert_eq!(reception.is_refused(now), None);
        }
    }
}
