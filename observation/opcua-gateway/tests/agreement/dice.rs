//! Random journals of the press cell: members start, die and report, in one epoch.

use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_bus::HostEvent;
use understudy_cluster::Cluster;
use understudy_journal::{Action, Happening, Members, Process, Record, RunEvent};
use understudy_node::Event as StationEvent;
use understudy_plant::{Event as PlantEvent, Pace};
use understudy_remote_io::{
    Event as RemoteIoEvent, ForceEnd, Lacking, LackingReason, Missing, ValueFault,
};
use understudy_wire::{
    ConfigurationHash, Cycle, Epoch, Field, Force, Image, Lineage, Member, Moment, ProgramId,
    ProgramSet, SignalPlace, Source, StationId, StationSet, Word,
};

/// A record, with the cycle that it takes effect in as it was numbered when it was written.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) record: Record,
    pub(crate) at: i64,
}

/// The cycle of the cluster in which a journal begins.
const FIRST: u64 = 5;

/// A journal, as it is written.
pub(crate) struct Dice<'c> {
    chance: Pcg64Mcg,
    cluster: &'c Cluster,
    members: Members,
    down: Vec<Member>,
    suspended: Vec<Member>,
    /// The number of the cycle, which counts idle deadlines too.
    number: i64,
    /// The newest number with a deadline.
    latest: Option<i64>,
    /// By program: the newest number with a deadline.
    reported: Vec<Option<i64>>,
    moment: Moment,
    has_origin: bool,
    entries: Vec<Entry>,
}

/// A journal of so many cycles.
pub(crate) fn journal(cluster: &Cluster, seed: u64, cycles: usize) -> Vec<Entry> {
    let mut dice = Dice {
        chance: Pcg64Mcg::seed_from_u64(seed),
        cluster,
        members: Members::of(cluster),
        down: Vec::new(),
        suspended: Vec::new(),
        number: FIRST as i64 - 1,
        latest: None,
        reported: vec![None; cluster.controllers().len()],
        moment: Moment { epoch: Epoch(1), cycle: Cycle(FIRST - 1) },
        has_origin: false,
        entries: Vec::new(),
    };
    for _ in 0..cycles {
        dice.cycle();
    }
    dice.entries
}

impl Dice<'_> {
    fn one_in(&mut self, many: u32) -> bool {
        self.chance.random_range(0..many) == 0
    }

    fn programs(&self) -> impl Iterator<Item = ProgramId> + use<> {
        (0..self.cluster.controllers().len() as u8).map(ProgramId)
    }

    fn stations(&self) -> impl Iterator<Item = StationId> + use<> {
        (0..self.cluster.agreement().schedule.stations() as u8).map(StationId)
    }

    fn station(&mut self) -> StationId {
        let stations: Vec<StationId> = self.stations().collect();
        stations[self.chance.random_range(0..stations.len())]
    }

    fn member(&mut self) -> Member {
        let members: Vec<Member> = self.members.iter().map(|(member, _)| member).collect();
        members[self.chance.random_range(0..members.len())]
    }

    fn works(&self, member: Member) -> bool {
        !self.down.contains(&member) && !self.suspended.contains(&member)
    }

    fn write(&mut self, member: Option<Member>, event: Happening, at: i64) {
        let at_ns = self.entries.len() as u64 * 1000;
        let record = match (member, event) {
            (Some(member), event) => Record::of_member(at_ns, member, &self.members, event),
            (None, Happening::Run(event)) => Record::of_run(at_ns, event),
            (None, _) => unreachable!("members report"),
        };
        self.entries.push(Entry { record, at });
    }

    fn of_run(&mut self, event: RunEvent) {
        let felt = self.latest.map_or(0, |latest| latest + 1);
        self.write(None, Happening::Run(event), felt);
    }

    fn cycle(&mut self) {
        let all_work = {
            let mut remote_ios = self.programs().map(Member::RemoteIo);
            remote_ios.all(|member| self.works(member))
        };
        let was_whole = self.reported.iter().all(|at| *at == Some(self.number));
        self.number += 1;
        if all_work && was_whole && self.one_in(12) {
            self.idle();
            return;
        }
        self.moment.cycle.0 += 1;
        let published = self.turns();
        let mut remote_ios: Vec<ProgramId> = self.programs().collect();
        if self.one_in(2) {
            remote_ios.reverse();
        }
        for program in remote_ios {
            if self.works(Member::RemoteIo(program)) {
                self.deadline(program, published);
                self.of_remote_io(program);
            }
            if self.one_in(6) {
                self.fault();
            }
        }
        // Published words of this cycle follow the first deadline, so that every moment has its number.
        for station in self.stations() {
            if self.works(Member::Station(station)) {
                self.of_station(station, published.contains(station));
            }
        }
        for program in self.programs() {
            if self.works(Member::Plant(program)) && self.one_in(2) {
                self.of_plant(program);
            }
        }
        if !self.has_origin && self.latest.is_some() && self.one_in(15) {
            self.has_origin = true;
            let moment = self.moment;
            let at = self.latest.unwrap_or_default();
            if at == self.number {
                let event = RunEvent::Origin { moment, cycle: 0 };
                self.write(None, Happening::Run(event), at);
            } else {
                self.has_origin = false;
            }
        }
    }

    /// No station starts the cycle.
    fn idle(&mut self) {
        for program in self.programs() {
            let applied = self.applied(program, StationSet::EMPTY, Some(Missing::NoCycle));
            self.has_reported(program);
            self.write(Some(Member::RemoteIo(program)), applied, self.number);
        }
    }

    fn has_reported(&mut self, program: ProgramId) {
        self.latest = Some(self.number);
        self.reported[program.index()] = self.latest;
    }

    fn turns(&mut self) -> StationSet {
        let stations: Vec<StationId> = self.stations().collect();
        let works = stations.into_iter().filter(|station| {
            let member = Member::Station(*station);
            self.works(member) && self.chance.random_range(0..8) > 0
        });
        works.collect()
    }

    fn deadline(&mut self, program: ProgramId, published: StationSet) {
        let heard: StationSet =
            published.iter().filter(|_| self.chance.random_range(0..8) > 0).collect();
        let reasons = [
            Missing::TooLate,
            Missing::BadQuality,
            Missing::NoHistory,
            Missing::StateLost,
            Missing::NotReleased,
            Missing::ValueFault,
            Missing::NotSynchronised,
            Missing::TwoErasures,
            Missing::SecondFailure,
        ];
        let reason = reasons[self.chance.random_range(0..reasons.len())];
        let missing = self.one_in(4).then_some(reason);
        let applied = self.applied(program, heard, missing);
        self.has_reported(program);
        self.write(Some(Member::RemoteIo(program)), applied, self.number);
    }

    fn image(&mut self, width: usize) -> Image {
        Image::from_bits((0..width).map(|_| self.chance.random_range(0..2) == 1))
    }

    fn applied(
        &mut self,
        program: ProgramId,
        heard: StationSet,
        missing: Option<Missing>,
    ) -> Happening {
        let interface = &self.cluster.controllers()[program.index()].interface;
        let (inputs, outputs) = (interface.inputs.width(), interface.outputs.width());
        let source = match (missing, self.one_in(2)) {
            (None, true) => Source::Direct,
            (None, false) => Source::Reconstructed,
            (Some(_), true) => Source::Held,
            (Some(_), false) => Source::FailSafe,
        };
        let is_sampled = missing != Some(Missing::NoCycle) && !self.one_in(5);
        let sampled = is_sampled.then(|| self.image(inputs));
        let proved = self.image(outputs);
        // In some cycles the first output is forced to the other value.
        let is_forced = self.moment.cycle.0.is_multiple_of(3);
        let mut driven = proved.clone();
        driven.set(0, !proved.get(0));
        Happening::RemoteIo(RemoteIoEvent::Applied {
            moment: self.moment,
            sampled,
            outputs: proved,
            driven: Some(driven).filter(|_| is_forced),
            source,
            word_of: (source == Source::Reconstructed).then(|| self.station()),
            missing,
            points: None,
            heard,
        })
    }

    fn of_remote_io(&mut self, program: ProgramId) {
        let moment = self.moment;
        let station = self.station();
        let stations = StationSet::only(station);
        let signal = SignalPlace::Output(self.chance.random_range(0..2));
        let event = match self.chance.random_range(0..40) {
            0 => RemoteIoEvent::Flagged { moment, station },
            1 => RemoteIoEvent::Cleared { moment, station },
            2 => RemoteIoEvent::Forced {
                moment,
                force: Force {
                    signal,
                    value: true.into(),
                    seconds: 9,
                    owner: "anna".to_owned(),
                    reason: "a test".to_owned(),
                    points: None,
                },
            },
            3 => RemoteIoEvent::Unforced { moment, signal, by: ForceEnd::Operator },
            4 => RemoteIoEvent::Protected { moment },
            5 => RemoteIoEvent::Unprotected {
                moment,
                since: moment,
                lacking: [Lacking { station, reason: LackingReason::NotReceived }]
                    .into_iter()
                    .collect(),
            },
            6 => RemoteIoEvent::StateLost {
                moment,
                applied: Some(moment),
                newest: Some(moment),
                holder: Some(station),
                asks: true,
                reason: Default::default(),
                inputs: None,
            },
            7 => RemoteIoEvent::StateRecovered { moment, from: Some(station) },
            8 => RemoteIoEvent::StartedCold { born: moment, awaits_release: true, lost: None },
            9 => RemoteIoEvent::Released { moment },
            10 => RemoteIoEvent::ValueFault {
                moment,
                accused: stations,
                located: self.one_in(2),
                answer: ValueFault::Hold,
            },
            11 => RemoteIoEvent::RecalledExclusion { moment, stations },
            12 => RemoteIoEvent::Refused {
                member: Member::Station(station),
                theirs: ConfigurationHash::default(),
                ours: ConfigurationHash::default(),
            },
            13 => RemoteIoEvent::Stalled { moment, late: Duration::from_millis(7) },
            _ => return,
        };
        let event = Happening::RemoteIo(event);
        self.write(Some(Member::RemoteIo(program)), event, self.number);
    }

    fn of_station(&mut self, station: StationId, publishes: bool) {
        let moment = self.moment;
        let at = self.number;
        // A moment has its number from the first deadline of its cycle on.
        if self.latest != Some(at) {
            return;
        }
        let member = Some(Member::Station(station));
        if publishes {
            let own = ProgramSet::only(station.controlled());
            let schedule = &self.cluster.agreement().schedule;
            let mask = if schedule.is_understudy(station) {
                ProgramSet::first(schedule.controllers())
            } else {
                own
            };
            let word = Word { mask, sum: self.image(3) };
            let event = StationEvent::Published { moment, words: std::iter::once(word).collect() };
            self.write(member, Happening::Station(event), at);
        }
        let program = ProgramId(self.chance.random_range(0..2));
        let event = match self.chance.random_range(0..40) {
            0 => StationEvent::Joins { moment, wants: ProgramSet::only(program) },
            1 => StationEvent::Adopted {
                moment,
                program,
                lineage: Lineage(7),
                from: self.one_in(2).then_some(StationId(0)),
            },
            2 => StationEvent::Synchronised { moment, program },
            3 => StationEvent::BecameCycleMaster { moment },
            4 => StationEvent::Excluded { moment, program },
            5 => StationEvent::Readmitted { moment, program },
            6 => StationEvent::Stalled { moment, late: Duration::from_millis(3) },
            _ => return,
        };
        self.write(member, Happening::Station(event), at);
    }

    fn of_plant(&mut self, program: ProgramId) {
        if self.latest != Some(self.number) {
            return;
        }
        let event = PlantEvent::Stepped {
            moment: self.moment,
            pace: Pace::Driven,
            outputs: self.image(2),
            field: Field {
                sensors: self.image(2),
                handed_over: 0,
                finished: self.number as u64 / 10,
                plant_faults: self.number as u64 / 25,
                positions: std::iter::empty().collect(),
            },
        };
        let member = Some(Member::Plant(program));
        self.write(member, Happening::Plant(event), self.number);
    }

    fn fault(&mut self) {
        let member = self.member();
        let fault = |action| RunEvent::Fault { action, member, asked: 0 };
        let to = self.member();
        let works = self.works(member);
        let event = match self.chance.random_range(0..10) {
            0 if works => fault(Action::Crash),
            1 if works => fault(Action::Stop),
            2 if works => {
                RunEvent::Ended { member, how: "signal: 9 (SIGKILL)".to_owned(), said: Vec::new() }
            }
            3 => fault(Action::Cut { to }),
            4 => fault(Action::Heal { to }),
            5 => RunEvent::Detached { member, reason: "a test".to_owned() },
            6 => RunEvent::Attached { member },
            7 if works => {
                let lost = HostEvent::JournalLost { records: 3 };
                let at = self.latest.unwrap_or(0);
                self.write(Some(member), Happening::Host(lost), at);
                return;
            }
            8 if self.one_in(8) => RunEvent::ScenarioOver { verdict: "passed".to_owned() },
            _ if self.suspended.contains(&member) => fault(Action::Continue),
            _ if self.down.contains(&member) && self.one_in(2) => fault(Action::Restart),
            _ if self.down.contains(&member) => RunEvent::Started { member },
            _ => return,
        };
        let process = match &event {
            RunEvent::Started { .. } => Some(Process::Running),
            RunEvent::Ended { .. } => Some(Process::Ended),
            RunEvent::Fault { action, .. } => Process::after(*action),
            _ => None,
        };
        if let Some(process) = process {
            self.down.retain(|other| *other != member);
            self.suspended.retain(|other| *other != member);
            match process {
                Process::Running => {}
                Process::Suspended => self.suspended.push(member),
                Process::Killed | Process::Ended => self.down.push(member),
            }
        }
        self.of_run(event);
    }
}
