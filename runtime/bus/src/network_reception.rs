//! What a member receives over each of several paths (two networks, the direct link to the other remote I/O of its program), and which copy of a frame
//! counts.
//!
//! The first copy of a datagram counts; one over another path is a *second copy*, and dropped. Each copy is counted for the path that
//! carried it before anything is dropped, so a network is seen to be lost while another path carries everything.
//!
//! | a path from one peer, in [`JUDGED_EVERY`] | is |
//! |---|---|
//! | carried no frame that came over another one, or each too late | lost |
//! | carried less than [`WELL_PERCENT`] of them in time | impaired |
//! | carried more, for [`WELL_AGAIN`] such times after it was lost or impaired | in order |
//!
//! A peer of which nothing arrives over any path is down as long as other peers are received: nothing is said of the paths to it, nor of the only path
//! to a peer. Where no peer is received any more, all paths are lost.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};
use std::time::Duration;

use understudy_wire::{Member, Time, Via};

use crate::endpoints::Endpoints;
use crate::host_event::HostEvent;

/// How often the networks are judged.
const JUDGED_EVERY: Duration = Duration::from_millis(500);
/// Frames of a peer on which it is judged, at least.
const FEWEST_FRAMES: u32 = 8;
/// Percentage of frames below which a network is impaired.
const WELL_PERCENT: u32 = 90;
/// Times in a row that a network is in order before that is reported.
const WELL_AGAIN: u8 = 4;
/// Times in a row without a frame of a peer over any path after which nothing is said of the paths to it: the peer is down.
const SILENT_FOR: u8 = 4;
/// Times in a row without a frame of any peer after which all paths are lost.
const DEAF_AFTER: u8 = 2;
/// Datagrams that are remembered: those of five cycles of 64 programs, and more.
const REMEMBERED: usize = 4096;

/// Number of paths.
const PATHS: usize = Via::ALL.len();

/// Which copy of a datagram this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// The first that arrives.
    First,
    /// It came over another path before.
    Second {
        /// Whether it came within the time that a frame is of use.
        in_time: bool,
    },
    /// It came over this path before: the sender or another device has sent it again.
    Again,
}

/// A datagram that has arrived.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    datagram: u64,
    at: Time,
    over: [bool; PATHS],
}

/// What came of one peer since it was last judged.
#[derive(Debug, Default)]
struct Received {
    frames: u32,
    over: [u32; PATHS],
    state: [State; PATHS],
    well: [u8; PATHS],
    silent: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
enum State {
    #[default]
    InOrder,
    Impaired,
    Lost,
}

/// What one member receives over each of several paths.
#[derive(Debug)]
pub struct NetworkReception {
    /// Whether there are two networks.
    has_two_networks: bool,
    /// The other remote I/O of the program, where a direct link joins the two.
    linked: Option<Member>,
    seen: Box<[Seen]>,
    /// A second copy that comes later than this after the first one is too late.
    patience: Duration,
    peers: BTreeMap<Member, Received>,
    judged: Time,
    /// Times in a row without a frame of any peer.
    silent: u8,
    /// What was reported, by path: the peers of which it is lost, and of which it is impaired.
    reported: [[Vec<Member>; 2]; PATHS],
}

impl NetworkReception {
    /// Nothing received yet; a copy counts for its path where it comes within `patience` of the first one. Nothing for a member on one path.
    pub fn of(now: Time, patience: Duration, endpoints: &Endpoints) -> Option<Self> {
        let own = endpoints.own();
        let linked = own.member.partner().filter(|_| own.link.is_some());
        let has_two_networks = own.second.is_some();
        (has_two_networks || linked.is_some())
            .then(|| Self::new(now, patience, has_two_networks, linked))
    }

    fn new(now: Time, patience: Duration, has_two_networks: bool, linked: Option<Member>) -> Self {
        Self {
            has_two_networks,
            linked,
            seen: vec![Seen::default(); REMEMBERED].into(),
            patience,
            peers: BTreeMap::new(),
            judged: now,
            silent: 0,
            reported: Default::default(),
        }
    }

    /// What tells a datagram from others.
    pub(crate) fn identity(datagram: &[u8]) -> u64 {
        let mut hasher = DefaultHasher::new();
        hasher.write(datagram);
        hasher.finish()
    }

    /// Notes a datagram that is authentic.
    pub(crate) fn note(&mut self, now: Time, via: Via, datagram: u64) -> Arrival {
        let seen = &mut self.seen[datagram as usize % REMEMBERED];
        let place = via.index();
        if seen.datagram != datagram || seen.over == [false; PATHS] {
            *seen = Seen { datagram, at: now, over: [false; PATHS] };
            seen.over[place] = true;
            return Arrival::First;
        }
        if std::mem::replace(&mut seen.over[place], true) {
            return Arrival::Again;
        }
        Arrival::Second { in_time: now.since(seen.at) <= self.patience }
    }

    /// Counts a copy for the path that carried it.
    pub(crate) fn count(&mut self, sender: Member, via: Via, arrival: Arrival) {
        let received = self.peers.entry(sender).or_default();
        match arrival {
            Arrival::First => {
                received.frames += 1;
                received.over[via.index()] += 1;
            }
            Arrival::Second { in_time: true } => received.over[via.index()] += 1,
            Arrival::Second { in_time: false } | Arrival::Again => {}
        }
    }

    /// What has changed, once it is time to look.
    pub(crate) fn judge(&mut self, now: Time) -> Vec<HostEvent> {
        if now.since(self.judged) < JUDGED_EVERY {
            return Vec::new();
        }
        self.judged = now;
        let none = self.peers.values().all(|received| received.frames == 0);
        self.silent = if none { self.silent.saturating_add(1) } else { 0 };
        let is_deaf = self.silent >= DEAF_AFTER;
        let (has_two_networks, linked) = (self.has_two_networks, self.linked);
        for (member, received) in &mut self.peers {
            let is_joined = |via: &Via| match via {
                Via::First => true,
                Via::Second => has_two_networks,
                Via::Link => linked == Some(*member),
            };
            let paths = Via::ALL.into_iter().filter(is_joined);
            match (none, is_deaf) {
                (false, _) => received.judge(paths),
                (true, true) => paths.for_each(|via| received.state[via.index()] = State::Lost),
                (true, false) => {}
            }
        }
        let mut changes = Vec::new();
        for via in Via::ALL {
            let of = |state| {
                let peers = self.peers.iter();
                let found = peers.filter(|(_, received)| received.state[via.index()] == state);
                found.map(|(member, _)| *member).collect::<Vec<Member>>()
            };
            let found = [of(State::Lost), of(State::Impaired)];
            let reported = &mut self.reported[via.index()];
            if *reported != found {
                let [lost, impaired] = found.clone();
                *reported = found;
                changes.push(HostEvent::NetworkReception { network: via, lost, impaired });
            }
        }
        changes
    }
}

impl Received {
    fn judge(&mut self, paths: impl Iterator<Item = Via>) {
        if self.frames == 0 {
            self.silent = self.silent.saturating_add(1);
            if self.silent == SILENT_FOR {
                *self = Self::default();
            }
            return;
        }
        self.silent = 0;
        if self.frames < FEWEST_FRAMES {
            return;
        }
        for place in paths.map(Via::index) {
            let found = match self.over[place] {
                0 => State::Lost,
                over if over * 100 < self.frames * WELL_PERCENT => State::Impaired,
                _ => State::InOrder,
            };
            let (state, well) = (&mut self.state[place], &mut self.well[place]);
            if found >= *state {
                (*state, *well) = (found, 0);
                continue;
            }
            *well += 1;
            if *well >= WELL_AGAIN {
                (*state, *well) = (found, 0);
            }
        }
        (self.frames, self.over) = (0, [0; PATHS]);
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{ProgramId, StationId};

    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);
    const PRESS: Member = Member::Station(StationId(1));

    /// What is reported, with its millisecond, where a frame comes every period for `seconds`; `late(period, network)` says by how much each copy is
    /// late, nothing for one that is lost.
    fn reports(
        seconds: u32,
        late: impl Fn(u32, Via) -> Option<Duration>,
    ) -> Vec<(u64, u8, usize, usize)> {
        let mut reception = NetworkReception::new(Time(0), PERIOD, true, None);
        let mut copies = Vec::new();
        for period in 0..seconds * 100 {
            for via in Via::NETWORKS {
                if let Some(late) = late(period, via) {
                    copies.push((Time(0) + PERIOD * period + late, via, u64::from(period) + 1));
                }
            }
        }
        copies.sort_by_key(|(at, ..)| *at);
        let mut found = Vec::new();
        for (now, via, datagram) in copies {
            let arrival = reception.note(now, via, datagram);
            reception.count(PRESS, via, arrival);
            for event in reception.judge(now) {
                let HostEvent::NetworkReception { network, lost, impaired } = event else {
                    panic!("{event:?}");
                };
                let ms = now.since(Time(0)).as_millis() as u64;
                found.push((ms, u8::from(network), lost.len(), impaired.len()));
            }
        }
        found
    }

    #[test]
    fn two_networks_in_order_are_not_mentioned() {
        let at_once = |_, _| Some(Duration::ZERO);
        assert_eq!(reports(20, at_once), []);
        // One that is always a little later, and one frame of twenty lost on each.
        let a_little = |period, via| match via {
            Via::First => (period % 20 != 3).then_some(Duration::ZERO),
            _ => (period % 20 != 9).then_some(PERIOD / 2),
        };
        assert_eq!(reports(20, a_little), []);
    }

    #[test]
    fn a_lost_network_is_reported_within_a_second_and_its_return_later() {
        let lost = |period, via| {
            let is_lost = via == Via::Second && (320..900).contains(&period);
            (!is_lost).then_some(Duration::ZERO)
        };
        let found = reports(20, lost);
        let [(begins, 2, 0, 1), (lost, 2, 1, 0), (ends, 2, 0, 0)] = found[..] else {
            panic!("{found:?}");
        };
        assert!((3000..=3500).contains(&begins) && lost == begins + 500, "{found:?}");
        assert!((11_000..=11_500).contains(&ends), "{found:?}");
    }

    #[test]
    fn each_kind_of_impairment_is_found() {
        let from_three = |bad: fn(u32) -> Option<Duration>| {
            move |period: u32, via| match via {
                Via::First if period >= 300 => bad(period),
                _ => Some(Duration::ZERO),
            }
        };
        let check = |bad, expected: (u8, usize, usize)| {
            let found = reports(10, from_three(bad));
            let (at, network, lost, impaired) = *found.last().expect("a report");
            assert_eq!((network, lost, impaired), expected, "{found:?}");
            assert!(found[0].0 <= 4000 && at <= 4500, "{found:?}");
        };
        // Five cycles late: each copy is of no use.
        check(|_| Some(PERIOD * 5), (1, 1, 0));
        // Up and down every 50 ms.
        check(|period| (period / 5 % 2 == 0).then_some(Duration::ZERO), (1, 0, 1));
        // Three of ten lost.
        check(|period| (period * 7 % 10 >= 3).then_some(Duration::ZERO), (1, 0, 1));
    }

    #[test]
    fn nothing_is_said_of_the_networks_to_a_peer_that_is_down() {
        let mut reception = NetworkReception::new(Time(0), PERIOD, true, None);
        let mut found = Vec::new();
        for period in 0..2000_u32 {
            let now = Time(0) + PERIOD * period;
            if period < 500 {
                let arrival = reception.note(now, Via::First, u64::from(period) + 1);
                reception.count(PRESS, Via::First, arrival);
            }
            for via in Via::NETWORKS {
                let arrival = reception.note(now, via, u64::from(period) + 10_000);
                reception.count(Member::Station(StationId(2)), via, arrival);
            }
            found.extend(reception.judge(now));
        }
        let lost =
            |lost| HostEvent::NetworkReception { network: Via::Second, lost, impaired: Vec::new() };
        assert_eq!(found, [lost(vec![PRESS]), lost(Vec::new())]);
    }

    /// Where both networks fail one after the other, or at once, both are lost, and neither is in order before it carries frames.
    #[test]
    fn both_networks_can_be_lost() {
        let check = |first: std::ops::Range<u32>, second: std::ops::Range<u32>| {
            let late = |period: u32, via| {
                let lost = if via == Via::First { &first } else { &second };
                (!lost.contains(&period)).then_some(Duration::ZERO)
            };
            let mut reception = NetworkReception::new(Time(0), PERIOD, true, None);
            let mut found = Vec::new();
            for period in 0..2000_u32 {
                let now = Time(0) + PERIOD * period;
                for via in Via::NETWORKS.into_iter().filter(|via| late(period, *via).is_some()) {
                    let arrival = reception.note(now, via, u64::from(period) + 1);
                    reception.count(PRESS, via, arrival);
                }
                for event in reception.judge(now) {
                    let HostEvent::NetworkReception { network, lost, impaired } = event else {
                        panic!("{event:?}");
                    };
                    found.push((period, u8::from(network), lost.len() + impaired.len()));
                }
            }
            found
        };
        let is_reported = |found: &[(u32, u8, usize)], period: u32, network: u8| {
            let last = found.iter().rfind(|(at, of, _)| *at <= period && *of == network);
            last.is_some_and(|(.., peers)| *peers > 0)
        };
        let at_once = check(320..1000, 320..1000);
        let apart = check(320..1000, 520..1200);
        for period in [500, 700, 999] {
            assert!(
                is_reported(&at_once, period, 1) && is_reported(&at_once, period, 2),
                "{at_once:?}"
            );
        }
        for period in [700, 999] {
            assert!(is_reported(&apart, period, 1) && is_reported(&apart, period, 2), "{apart:?}");
        }
        assert!(is_reported(&apart, 1150, 2), "{apart:?}");
        for network in [1, 2] {
            assert!(!is_reported(&at_once, 1999, network) && !is_reported(&apart, 1999, network));
        }
    }

    /// The direct link is judged for the one peer on it, and the only path to a peer is not.
    #[test]
    fn the_direct_link_is_judged_for_the_other_remote_io_alone() {
        let twin = Member::Twin(ProgramId(0));
        let check = |has_two_networks: bool, lost: Via| {
            let mut reception =
                NetworkReception::new(Time(0), PERIOD, has_two_networks, Some(twin));
            let networks = if has_two_networks { 2 } else { 1 };
            let mut found = Vec::new();
            for period in 0..1000_u32 {
                let now = Time(0) + PERIOD * period;
                let is_lost = |via| via == lost && (300..600).contains(&period);
                for (peer, paths) in
                    [(PRESS, &Via::NETWORKS[..networks]), (twin, &Via::NETWORKS[..networks])]
                {
                    let link = (peer == twin).then_some(Via::Link);
                    let carrying = paths.iter().copied().chain(link);
                    for via in carrying.filter(|via| !is_lost(*via)) {
                        let datagram = u64::from(period) * 2 + u64::from(peer == twin) + 1;
                        let arrival = reception.note(now, via, datagram);
                        reception.count(peer, via, arrival);
                    }
                }
                found.extend(reception.judge(now));
            }
            found
        };
        let reception = |network, lost: &[Member]| {
            let lost = lost.to_vec();
            HostEvent::NetworkReception { network, lost, impaired: Vec::new() }
        };
        for has_two_networks in [false, true] {
            let found = check(has_two_networks, Via::Link);
            assert_eq!(found, [reception(Via::Link, &[twin]), reception(Via::Link, &[])]);
        }
        // A station of which nothing arrives over its only path is down.
        let found = check(false, Via::First);
        assert_eq!(found, [reception(Via::First, &[twin]), reception(Via::First, &[])]);
        let both = vec![PRESS, twin];
        let found = check(true, Via::Second);
        assert_eq!(found, [reception(Via::Second, &both), reception(Via::Second, &[])]);
    }

    #[test]
    fn copies_are_told_apart() {
        let mut reception = NetworkReception::new(Time(0), PERIOD, true, None);
        let datagram = NetworkReception::identity(b"turn");
        let now = Time(0) + PERIOD;
        assert_eq!(reception.note(now, Via::Second, datagram), Arrival::First);
        assert_eq!(reception.note(now, Via::Second, datagram), Arrival::Again);
        assert_eq!(reception.note(now, Via::First, datagram), Arrival::Second { in_time: true });
        assert_eq!(reception.note(now, Via::First, datagram), Arrival::Again);
        let other = NetworkReception::identity(b"turn ");
        assert_eq!(reception.note(now, Via::First, other), Arrival::First);
        let late = reception.note(now + PERIOD * 2, Via::Second, other);
        assert_eq!(late, Arrival::Second { in_time: false });
    }
}
