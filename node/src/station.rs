//! The station: a controller or an understudy in the cycle.
//!
//! ```text
//!            any frame of a later cycle, or its own turn to pace
//!        ┌───────────────────────────────────────────────────────┐
//!        ▼                                                       │
//!   samples come: copies follow ──► its turn: words ──► rest: asks for what it lacks, gives what others lack
//! ```
//!
//! It speaks when it knows its outputs and its predecessor has published or its own slot starts, whichever is first; at the last
//! call it speaks whatever it knows; and only with copies that are proven (invariant *Synchronised or silent*). It decides nothing
//! for others: what is applied is decided by each remote I/O for itself (*No election*).

mod pacing;
mod relay;
mod repair;
mod turn;

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use smallvec::SmallVec;
use understudy_cycle::{
    Admission, Arrival, Attendance, Copies, CycleClock, Input, Machine, Output, Reception, Waking,
};
use understudy_logic::Scratch;
use understudy_wire::{
    Body, ConfigurationHash, Digest, Frame, Header, Holding, Image, Lineage, Member, Moment,
    ProgramId, ProgramSet, Recalled, Sample, StationId, StationSet, Time,
};

use crate::event::Event;
use crate::replica::{Followed, Replica, Standing};
use crate::settings::Settings;

/// One controller or understudy. See [`Machine`] for how it is driven.
#[derive(Debug, Clone)]
pub struct Station {
    settings: Settings,
    reception: Reception,
    clock: CycleClock,
    attendance: Attendance,
    replicas: SmallVec<[Replica; 2]>,
    scratch: Scratch,
    copies: Copies,
    outbox: VecDeque<Output<Event>>,
    cycle: CycleNotes,
    started: Time,
    waking: Waking,
    /// Whether this station starts the cycles.
    is_cycle_master: bool,
    wanted: ProgramSet,
    /// Stations that asked to join in the last cycle; they pace only when nobody who speaks does.
    joining: StationSet,
    /// Whose states differed in the last cycle.
    differed: SmallVec<[(ProgramId, StationId); 1]>,
    /// Programs whose samples any other station lacked in the last cycle.
    lacked: ProgramSet,
    /// Those of them whose samples this station had.
    awaited: ProgramSet,
}

/// What a station remembers of the current cycle only.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
struct CycleNotes {
    published: bool,
    asked: bool,
    /// The turns of controllers that said their outputs.
    said: SmallVec<[Said; 2]>,
    /// Whose states differ from equal ones of this station.
    differs: SmallVec<[(ProgramId, StationId); 1]>,
    /// Programs that a station of lower rank can give the state of.
    others_have: ProgramSet,
    /// Who asked to join.
    joiners: StationSet,
    /// The samples of this cycle, from their remote I/Os or relayed.
    samples: SmallVec<[Arc<Frame>; 2]>,
    /// Programs whose samples came from their remote I/Os.
    direct: ProgramSet,
    /// Programs whose samples other stations lack.
    lacked: ProgramSet,
    /// Programs whose samples a station has relayed.
    relayed: ProgramSet,
}

/// What a controller has said of its own program.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Said {
    program: ProgramId,
    lineage: Lineage,
    digest: Digest,
    outputs: Image,
}

impl Station {
    /// A station that has just started: it listens first.
    pub fn new(now: Time, settings: Settings) -> Self {
        let agreement = &settings.agreement;
        let replicas = settings
            .runs()
            .map(|id| Replica::new(id, &settings.programs[id.index()], agreement.history))
            .collect();
        let mut station = Self {
            reception: Reception::new(Member::Station(settings.station), agreement),
            clock: CycleClock::default(),
            attendance: Attendance::new(agreement.schedule.stations(), agreement.flag_after),
            replicas,
            scratch: Scratch::default(),
            copies: Copies::default(),
            outbox: VecDeque::new(),
            cycle: CycleNotes::default(),
            started: now,
            waking: Waking::default(),
            is_cycle_master: false,
            wanted: ProgramSet::EMPTY,
            joining: StationSet::EMPTY,
            differed: SmallVec::new(),
            lacked: ProgramSet::EMPTY,
            awaited: ProgramSet::EMPTY,
            settings,
        };
        station.waking.ask(station.next_wakeup());
        station
    }

    /// Flips one bit of x(i), counted round its width, as a fault of the memory does. Nothing where it holds no x(i).
    pub fn flip_state(&mut self, program: ProgramId, bit: usize) {
        if let Some(replica) = self.replicas.iter_mut().find(|it| it.id() == program) {
            replica.flip_state(bit);
        }
    }

    /// The configuration that it runs; it refuses members with another one.
    pub fn configuration(&self) -> ConfigurationHash {
        self.settings.agreement.configuration
    }

    /// The state of a program that it holds, with its lineage; it may be behind the newest sample.
    pub fn state_of(&self, program: ProgramId) -> Option<(Lineage, &Image)> {
        self.replicas
            .iter()
            .find(|replica| replica.id() == program)?
            .state()
    }

    fn own(&self) -> StationId {
        self.settings.station
    }

    fn is_understudy(&self) -> bool {
        self.settings.agreement.schedule.is_understudy(self.own())
    }

    fn speaks(&self) -> bool {
        self.replicas
            .iter()
            .any(|replica| replica.standing() == Standing::Proven)
    }

    fn report(&mut self, event: Event) {
        self.outbox.push_back(Output::Report(event));
    }

    fn frame(&self, body: Body) -> Frame {
        let agreement = &self.settings.agreement;
        Frame {
            header: Header {
                cluster: agreement.cluster,
                configuration: agreement.configuration,
                moment: self.clock.moment().unwrap_or_default(),
                sender: Member::Station(self.own()),
                alone: self.clock.alone(),
            },
            body,
        }
    }

    fn send(&mut self, body: Body) -> Arc<Frame> {
        let frame = Arc::new(self.frame(body));
        self.outbox.push_back(Output::Send(Arc::clone(&frame)));
        frame
    }

    fn send_cyclic(&mut self, now: Time, body: Body) {
        let frame = self.send(body);
        self.copies
            .sent(now, &frame, &self.settings.agreement.schedule);
    }

    fn receive(&mut self, now: Time, frame: &Arc<Frame>) {
        if matches!(frame.body, Body::Field(_) | Body::Actuation(_)) {
            return;
        }
        match self.reception.admit(&frame.header) {
            Admission::Admitted => {}
            Admission::Dropped => return,
            Admission::Refused { theirs } => {
                return self.report(Event::Refused {
                    member: frame.header.sender,
                    theirs,
                    ours: self.settings.agreement.configuration,
                });
            }
        }
        match self
            .clock
            .arrival(now, frame, self.settings.agreement.schedule.period())
        {
            Arrival::Stale => return,
            Arrival::Present => {}
            Arrival::Begins(anchor) => {
                self.close_cycle();
                self.clock.begin(now, frame.header.moment, anchor);
                let pacer = matches!(frame.body, Body::Sync);
                self.is_cycle_master &= !pacer;
            }
        }
        match (&frame.body, frame.header.sender) {
            (Body::Sample(sample), Member::RemoteIo(program)) => {
                self.cycle.direct.insert(program);
                self.follow(program, frame, sample);
            }
            (Body::Turn(turn), Member::Station(station)) => {
                self.hear_turn(station, turn);
                self.hear_relayed(&frame.header, turn);
            }
            (Body::Join(join), Member::Station(station)) => self.hear_join(station, join),
            (Body::Transfer(transfer), Member::Station(station)) => self.adopt(station, transfer),
            _ => {}
        }
        self.speak_if_it_is_time(now);
    }

    fn follow(&mut self, program: ProgramId, frame: &Arc<Frame>, sample: &Sample) {
        self.keep_sample(frame);
        let excluded = sample.excluded.contains(self.own());
        let moment = frame.header.moment;
        let Some(replica) = self
            .replicas
            .iter_mut()
            .find(|replica| replica.id() == program)
        else {
            return;
        };
        replica.hear(&self.settings.programs[program.index()], moment, sample);
        if replica.set_excluded(excluded) {
            self.outbox.push_back(Output::Report(if excluded {
                Event::Excluded { moment, program }
            } else {
                Event::Readmitted { moment, program }
            }));
        }
        let followed = replica.follow(
            &self.settings.programs[program.index()],
            &mut self.scratch,
            frame,
            self.settings.agreement.shadow_cycles,
        );
        if let Followed::FromGenesis(lineage) = followed {
            self.report(Event::Adopted {
                moment,
                program,
                lineage,
                from: None,
            });
        }
    }

    fn holdings(&self) -> SmallVec<[Holding; 2]> {
        self.replicas.iter().filter_map(Replica::holding).collect()
    }

    /// For remote I/Os that say nothing in this cycle.
    fn recalled(&self, moment: Moment) -> Vec<Recalled> {
        let recalled = self.replicas.iter().filter_map(|it| it.recalled(moment));
        recalled.cloned().collect()
    }

    fn is_told(&mut self, recalled: &[Recalled]) {
        for one in recalled {
            if let Some(replica) = self.replicas.iter_mut().find(|it| it.id() == one.program) {
                replica.is_told(&self.settings.programs[one.program.index()], one);
            }
        }
    }

    fn next_wakeup(&self) -> Time {
        let others = [self.copies.wakeup(), self.speaks_at(), self.asks_at()];
        let first = others.into_iter().flatten().fold(Time(u64::MAX), Time::min);
        // Nobody paces before the cycle is over.
        let end = self.clock.anchor() + self.settings.agreement.schedule.period();
        if self.clock.moment().is_some() && first <= end {
            return first;
        }
        first.min(self.paces_at())
    }

    fn wake(&mut self, now: Time) {
        while let Some(frame) = self.copies.take_due(now, &self.settings.agreement.schedule) {
            self.outbox.push_back(Output::Send(frame));
        }
        self.speak_if_it_is_time(now);
        if self.asks_at().is_some_and(|due| due <= now) {
            self.ask();
        }
        let planned = self.paces_at();
        if planned <= now {
            self.pace(now, planned);
        }
    }
}

/// Two stations of equal settings that are drained and hash alike go on alike.
impl Hash for Station {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            settings: _,
            reception,
            clock,
            attendance,
            replicas,
            scratch: _,
            copies,
            outbox: _,
            cycle,
            started,
            waking,
            is_cycle_master,
            wanted,
            joining,
            differed,
            lacked,
            awaited,
        } = self;
        (reception, clock, attendance, replicas, copies).hash(hasher);
        (cycle, started, waking, is_cycle_master, wanted).hash(hasher);
        (joining, differed, lacked, awaited).hash(hasher);
    }
}

impl Machine for Station {
    type Event = Event;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        if let Some(late) = self.waking.stall(now, &self.settings.agreement.schedule) {
            let moment = self.clock.moment().unwrap_or_default();
            self.report(Event::Stalled { moment, late });
        }
        match input {
            Input::Wakeup => self.wake(now),
            Input::Frame(frame) => self.receive(now, frame),
            Input::Field(_)
            | Input::FieldLost
            | Input::Release
            | Input::Choose(_)
            | Input::Force(_)
            | Input::Unforce(_) => {}
        }
        self.waking.ask(self.next_wakeup());
    }

    fn poll_output(&mut self) -> Option<Output<Event>> {
        self.outbox.pop_front()
    }

    fn wakeup(&self) -> Time {
        self.waking.asked()
    }
}
