//! A member that says who it is and reports whom it hears, and clusters of such members.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_bus::{Endpoints, Guard, Peer, free_addresses};
use understudy_cycle::{Agreement, Input, Machine, Mode, Output, RemoteIoInput, Schedule};
use understudy_seal::{ClusterSecret, FrameKey, Opener, Seal, Title};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Field, Frame, Header, Image, Lineage,
    Member, Moment, ProgramId, Roster, Sample, StationId, StationSet, Step, Time,
};

/// How often each member says something.
pub(crate) const PERIOD: Duration = Duration::from_millis(10);

/// What a member reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub(crate) enum Chat {
    /// It hears this life of another one for the first time.
    Heard { speaker: Member, life: u64 },
    /// It hears another one say its 100th, 200th, … frame, or one of the 99 after that.
    StillHears { speaker: Member, hundreds: u64 },
    /// Its sensors say something for the first time.
    Sensed,
    /// The operator has released its outputs.
    Released,
}

/// Says one frame every period; a remote I/O drives its plant as well.
pub(crate) struct Chatter {
    own: Member,
    life: u64,
    cycle: u64,
    due: Time,
    heard: BTreeSet<Chat>,
    said: VecDeque<Output<Chat>>,
}

impl Chatter {
    pub(crate) fn new(own: Member, life: u64) -> Self {
        Self { own, life, cycle: 0, due: Time(0), heard: BTreeSet::new(), said: VecDeque::new() }
    }

    fn report_once(&mut self, chat: Chat) {
        if self.heard.insert(chat) {
            self.said.push_back(Output::Report(chat));
        }
    }
}

impl Machine for Chatter {
    type Event = Chat;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        match input {
            Input::Wakeup => {
                self.due = now + PERIOD;
                self.cycle += 1;
                let body = match self.own {
                    Member::Station(_) => Body::Sync,
                    Member::RemoteIo(_) => Body::Sample(sample()),
                    Member::Plant(_) | Member::Twin(_) => Body::Field(field()),
                };
                let agreement = agreement();
                self.said.push_back(Output::Send(Arc::new(Frame {
                    header: Header {
                        cluster: agreement.cluster,
                        configuration: agreement.configuration,
                        prepared: None,
                        moment: Moment { epoch: Epoch(self.life), cycle: Cycle(self.cycle) },
                        sender: self.own,
                        alone: false,
                    },
                    body,
                })));
                if matches!(self.own, Member::RemoteIo(_)) {
                    self.said
                        .push_back(Output::Drive { outputs: Image::zero(3), sampled: Some(now) });
                }
            }
            Input::Frame(frame) => {
                let header = frame.header;
                self.report_once(Chat::Heard {
                    speaker: header.sender,
                    life: header.moment.epoch.0,
                });
                self.report_once(Chat::StillHears {
                    speaker: header.sender,
                    hundreds: header.moment.cycle.0 / 100,
                });
            }
            Input::RemoteIo(RemoteIoInput::Field(_)) => self.report_once(Chat::Sensed),
            Input::RemoteIo(RemoteIoInput::Release) => {
                self.said.push_back(Output::Report(Chat::Released));
                self.said.push_back(Output::Obeyed(Ok(())));
            }
            Input::RemoteIo(RemoteIoInput::Unforce(_)) => {
                self.said.push_back(Output::Obeyed(Ok(())));
            }
            Input::RemoteIo(_) | Input::Change(_) => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output<Chat>> {
        self.said.pop_front()
    }

    fn wakeup(&self) -> Time {
        self.due
    }
}

fn sample() -> Sample {
    Sample {
        born: Moment::default(),
        base: Lineage(1),
        before: Lineage(1),
        after: Lineage(2),
        history: [Step::of(Image::zero(3))].into_iter().collect(),
        applied: None,
        excluded: StationSet::EMPTY,
        gone: StationSet::EMPTY,
        drives: true,
        writes: Default::default(),
        pulses: Default::default(),
        unforced: None,
        version: None,
    }
}

fn field() -> Field {
    Field {
        sensors: Image::zero(3),
        handed_over: 0,
        finished: 0,
        plant_faults: 0,
        positions: [].into_iter().collect(),
    }
}

pub(crate) fn agreement() -> Arc<Agreement> {
    Arc::new(Agreement {
        cluster: ClusterHash(7),
        configuration: ConfigurationHash(8),
        schedule: Schedule::new(PERIOD, 2, 1, 1).expect("within the bounds"),
        mode: Mode::Full,
        history: 1,
        flag_after: 1,
        shadow_cycles: 1,
        listen_cycles: 1,
    })
}

pub(crate) fn station(rank: u8) -> Member {
    Member::Station(StationId(rank))
}

pub(crate) fn remote_io(program: u8) -> Member {
    Member::RemoteIo(ProgramId(program))
}

pub(crate) fn plant(program: u8) -> Member {
    Member::Plant(ProgramId(program))
}

/// Gives each member a port that was free a moment ago.
pub(crate) fn peers(members: &[Member]) -> Vec<Peer> {
    let addresses = free_addresses(members.len()).expect("free ports");
    let named = members.iter().zip(addresses);
    named.map(|(&member, address)| Peer::new(member, format!("{member:?}"), address)).collect()
}

/// The key of a member, in a cluster whose secret everybody knows.
pub(crate) fn key(member: Member) -> FrameKey {
    ClusterSecret::new([1; 32]).frame_key(Title {
        cluster: "cell",
        member: &format!("{member:?}"),
        generation: 1,
    })
}

/// Two controllers and an understudy; plant 1 feeds plant 2.
fn roster() -> Roster {
    let feeds = vec![(Member::Plant(ProgramId(0)), Member::Plant(ProgramId(1)))];
    Roster::new(2, 3, feeds)
}

/// The keys of one member in one of its lives.
#[allow(dead_code, reason = "some tests have no keys")]
pub(crate) fn guard(own: Member, life: u64, peers: &[Peer]) -> Guard {
    let roster = roster();
    let heard = peers.iter().map(|peer| peer.member);
    let heard = heard.filter(|&member| roster.is_received(member, own));
    Guard::with_keys(
        Seal::new(own, key(own), life as u32, []),
        Opener::new(own, heard.map(|member| (member, key(member))), [], Arc::default()),
    )
}

pub(crate) fn endpoints(own: Member, peers: &[Peer]) -> Endpoints {
    Endpoints::new(agreement().cluster, own, peers.to_vec(), roster()).expect("own is among them")
}
