//! The table of a station: each reachable named state, with each input, and the state that follows.
//!
//! The states are found from a controller that has just started, breadth first. The drawing in
//! `docs/pictures/station.dot` is made from the same table.

use understudy_testing::states::Table;

use super::*;
use crate::replica::Standing;
use crate::station::Role;

const OWN: u8 = 1;
/// Cycles of one input: more than the history of a sample, the shadow mode and `listen_cycles` last.
const CYCLES: u64 = 4;

/// What happens to a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Happening {
    /// No member is received.
    NoMember,
    /// Another station starts the cycles; no sample is received.
    OtherMaster,
    /// The remote I/O starts a history from the initial state.
    ColdStart,
    /// Samples that continue the history.
    Samples,
    /// The same, after samples that were not received.
    SamplesAfterGap,
    /// The understudy transfers the state after the newest sample.
    Transfer,
    /// The understudy publishes the same lineage with another digest.
    OtherDigest,
    /// The remote I/O excludes this station.
    Exclusion,
}

const ALL: [(Happening, &str); 8] = [
    (Happening::NoMember, "no member is received"),
    (Happening::OtherMaster, "another station starts cycles"),
    (Happening::ColdStart, "remote I/O: cold start"),
    (Happening::Samples, "remote I/O: samples"),
    (Happening::SamplesAfterGap, "remote I/O: samples after a gap"),
    (Happening::Transfer, "state transferred"),
    (Happening::OtherDigest, "other digest published"),
    (Happening::Exclusion, "remote I/O: excludes this station"),
];

#[derive(Debug, Clone)]
struct Bench {
    station: Station,
    now: Time,
    /// Samples that the remote I/O has made before the history started.
    born: u64,
    /// Samples that it has made.
    samples: u64,
}

impl Bench {
    fn new() -> Self {
        Self {
            station: Station::new(Time(0), settings(OWN, 2, Turns::Token)),
            now: Time(0),
            born: 0,
            samples: 50,
        }
    }

    fn happens(&mut self, happening: Happening) {
        match happening {
            Happening::NoMember => self.wait(PERIOD * (CYCLES as u32 + 2)),
            Happening::OtherMaster => (0..CYCLES).for_each(|_| self.follow()),
            Happening::ColdStart => {
                self.born = self.samples;
                self.sample(StationSet::EMPTY);
            }
            Happening::Samples => self.sample(StationSet::EMPTY),
            Happening::SamplesAfterGap => {
                self.samples += CYCLES;
                self.sample(StationSet::EMPTY);
            }
            Happening::Transfer => {
                self.begin();
                self.send(Sent::Transfer(UNDERSTUDY, OWN, self.born));
            }
            Happening::OtherDigest => self.publish_other_digest(),
            Happening::Exclusion => self.sample(StationSet::only(StationId(OWN))),
        }
        self.wait(PERIOD * 8 / 10);
    }

    /// The station runs for a time without a frame.
    fn wait(&mut self, time: Duration) {
        let end = self.now + time;
        while self.station.wakeup() < end {
            self.wake();
        }
        self.now = end;
    }

    fn wake(&mut self) {
        self.now = self.now.max(self.station.wakeup());
        self.station.handle_input(self.now, Input::Wakeup);
        while self.station.poll_output().is_some() {}
    }

    fn moment(&self) -> Moment {
        self.station.member.moment()
    }

    /// Runs up to the end of the current cycle; a cycle master starts the next one.
    fn begin(&mut self) {
        let end = self.station.member.clock.anchor() + PERIOD;
        if self.now < end {
            self.wait(end.since(self.now));
        }
        let before = self.moment();
        while self.station.role == Role::CycleMaster && self.moment() == before {
            self.wake();
        }
    }

    /// The cycle of the next frame of another member.
    fn next(&self) -> Moment {
        match self.station.role {
            Role::Listening => moment(100),
            Role::Following => self.moment().plus(1),
            Role::CycleMaster => self.moment(),
        }
    }

    fn give(&mut self, moment: Moment, sent: (Member, Body)) {
        let frame = frame(moment, sent);
        self.station.handle_input(self.now, Input::Frame(&frame));
        while self.station.poll_output().is_some() {}
    }

    fn send(&mut self, what: Sent) {
        let sent = sent(what, self.samples, OWN).expect("it is sent");
        self.give(self.next(), sent);
    }

    /// One cycle that another station starts.
    fn follow(&mut self) {
        let anchor = self.station.member.clock.anchor();
        let end = (anchor + PERIOD).max(self.now);
        self.wait(end.since(self.now));
        let next = match self.station.role {
            Role::CycleMaster => self.moment().plus(1),
            _ => self.next(),
        };
        let sent = sent(Sent::Sync(0), 1, OWN).expect("it is sent");
        self.give(next, sent);
    }

    /// The samples of some cycles.
    fn sample(&mut self, excluded: StationSet) {
        for _ in 0..CYCLES {
            self.begin();
            let (sender, mut body) =
                sent(Sent::Sample(OWN, self.born), self.samples, OWN).expect("it is sent");
            if let Body::Sample(sample) = &mut body {
                sample.excluded = excluded;
            }
            self.give(self.next(), (sender, body));
            self.samples += 1;
        }
    }

    fn publish_other_digest(&mut self) {
        self.begin();
        let mut holdings = self.station.holdings();
        for holding in &mut holdings {
            holding.digest = Digest(!holding.digest.0);
        }
        let turn = understudy_wire::Turn {
            heard: StationSet::EMPTY,
            holdings,
            words: Default::default(),
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            relayed: Vec::new(),
        };
        let sender = Member::Station(StationId(UNDERSTUDY));
        self.give(self.next(), (sender, Body::Turn(turn)));
    }

    /// The name of its state.
    fn state(&self) -> String {
        let replica = &self.station.replicas[0];
        let standing = match (replica.standing(), replica.state()) {
            (Standing::Lost, None) => "Lost",
            (Standing::Lost, Some(_)) => "Lost, older state held",
            (Standing::Shadow(_), _) => "Shadow",
            (Standing::Proven, _) => "Proven",
            (Standing::Excluded, _) => "Excluded",
        };
        format!("{:?}, {standing}", self.station.role)
    }
}

fn table() -> Table {
    Table::explore(Bench::new(), &ALL, Bench::happens, Bench::state)
}

#[test]
fn each_state_answers_each_input() {
    insta::assert_snapshot!(table().text());
}

#[test]
fn the_drawing_is_the_table() {
    let drawing = table().drawing("station", "node/src/station/tests/states.rs");
    let drawn = include_str!("../../../../docs/pictures/station.dot");
    assert!(drawing == drawn, "docs/pictures/station.dot should be\n{drawing}");
}
