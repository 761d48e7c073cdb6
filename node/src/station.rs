//! The station: a controller or an understudy in the cycle.
//!
//! ```text
//!            any frame of a later cycle, or this station starts it
//!        ┌───────────────────────────────────────────────────────┐
//!        ▼                                                       │
//!   samples: replicas follow ──► its turn: words ──► rest: asks for the states that it lacks, transfers those that others lack
//! ```
//!
//! It publishes when it knows its outputs and its predecessor has published or its own slot starts, whichever is first;
//! at the last call it publishes the outputs that it knows; and only those of synchronised replicas (invariant
//! *Synchronised or silent*). Each remote I/O decides by itself which outputs it applies (*No election*).

mod cycle_master;
mod machine;
mod relay;
mod repair;
#[cfg(test)]
mod tests;
mod turn;

use std::hash::{Hash, Hasher};
use std::sync::Arc;
pub use turn::STATES_EVERY;

use smallvec::SmallVec;
use understudy_cycle::{Arrival, ChangeOrder, OnlineChange, Output, Participant};
use understudy_executable::Scratch;
use understudy_wire::{
    Body, Configurations, Digest, Frame, Holding, Image, Lineage, Member, Moment, ProgramHash,
    ProgramId, ProgramSet, Recalled, RetainedRun, Sample, SamplesReceived, StationId, StationSet,
    Time,
};

use relay::Relay;

use crate::event::Event;
use crate::replica::{Followed, Replica, Standing};
use crate::settings::Settings;

/// One controller or understudy. See [`understudy_cycle::Machine`] for how it is driven.
#[derive(Debug, Clone)]
pub struct Station {
    settings: Settings,
    member: Participant<Event>,
    /// The replicas that this station computes, in the order of programs.
    replicas: SmallVec<[Replica; 2]>,
    scratch: Scratch,
    cycle: CycleNotes,
    /// The cycle that ended last.
    closed: Option<Moment>,
    /// The members that it received in the last two cycles in which it received any, the last one first.
    company: [Company; 2],
    started: Time,
    role: Role,
    wanted: ProgramSet,
    /// Stations that asked to join in the last cycle; they start cycles only when no publishing station does.
    joining: StationSet,
    /// Programs and stations whose states differed in the last cycle.
    differed: SmallVec<[(ProgramId, StationId); 1]>,
    relay: Relay,
    /// Cycles in a row without a sample, for each replica; reported at a bound, and without effect on the cycle.
    unsampled: SmallVec<[u32; 2]>,
    /// When the last cycle began that was looked at for samples.
    looked_at: Time,
    /// Programs that histories have changed to, and that are not loaded; reported once each, and without effect on the cycle.
    lacks_program: SmallVec<[(ProgramId, ProgramHash); 1]>,
}

/// Who starts the cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Role {
    /// Not known yet: the station has just started and is in no cycle.
    Listening,
    /// Another station.
    Following,
    /// This station, until it receives the Sync of another one.
    CycleMaster,
}

/// The token of the current cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
enum Token {
    /// This station has not published in this cycle.
    #[default]
    Awaited,
    /// This station has published its turn.
    Passed,
}

/// The rest of the current cycle, in which stations ask for states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
enum Rest {
    /// It has not begun.
    #[default]
    Ahead,
    /// It has begun: this station has asked for the states that it lacks.
    Begun,
}

/// What a station remembers of the current cycle only.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
struct CycleNotes {
    /// Segments of wide states that it has sent.
    segments: usize,
    /// It has sent the Sync of this cycle as well.
    has_repeated_sync: bool,
    token: Token,
    rest: Rest,
    /// Outputs that controllers published of their own programs.
    controller_turns: SmallVec<[ControllerTurn; 2]>,
    /// Programs and stations whose digests differ from those of this station at equal lineages.
    differs: SmallVec<[(ProgramId, StationId); 1]>,
    /// Programs whose state a station of lower rank can transfer.
    others_have: ProgramSet,
    /// Stations that asked to join.
    joiners: StationSet,
    /// Another station was received.
    receives_station: bool,
}

/// The members that a station received.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
struct Company {
    remote_ios: ProgramSet,
    stations: bool,
}

impl Company {
    fn is_none(self) -> bool {
        self == Self::default()
    }

    fn or(self, other: Self) -> Self {
        Self {
            remote_ios: self.remote_ios.or(other.remote_ios),
            stations: self.stations || other.stations,
        }
    }

    /// Whether it is more than the remote I/O of `program`.
    fn exceeds(self, program: ProgramId) -> bool {
        self.stations || !self.remote_ios.without(ProgramSet::only(program)).is_empty()
    }
}

/// Outputs that a controller published of its own program, with the state that they are computed from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct ControllerTurn {
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
            member: Participant::new(Member::Station(settings.station), agreement),
            replicas,
            scratch: Scratch::default(),
            cycle: CycleNotes::default(),
            closed: None,
            company: [Company::default(); 2],
            started: now,
            role: Role::Listening,
            wanted: ProgramSet::EMPTY,
            joining: StationSet::EMPTY,
            differed: SmallVec::new(),
            relay: Relay::default(),
            unsampled: settings.runs().map(|_| 0).collect(),
            looked_at: now,
            lacks_program: SmallVec::new(),
            settings,
        };
        station.member.wake_at(station.next_wakeup());
        station
    }

    /// Keeps the states of programs with retentive variables: whole after every `every` steps, and each step in between
    /// ([`Output::Retain`]). It starts with what it has kept before, `runs`, of this program or
    /// taken over from another one.
    #[must_use]
    pub fn retaining(mut self, every: u32, runs: &[RetainedRun]) -> Self {
        let cluster = self.settings.agreement.cluster;
        for replica in &mut self.replicas {
            let id = replica.id();
            let versions = self.settings.versions(&self.member, id);
            if !versions.all().any(|program| program.executable.is_retentive()) {
                continue;
            }
            replica.retain(cluster, every);
            let own = |run: &&RetainedRun| {
                run.state.cluster == cluster && run.state.program == replica.id()
            };
            let mut own: Vec<_> = runs.iter().filter(own).collect();
            own.sort_by_key(|run| run.state.number);
            for run in own {
                replica.find_retained(versions, &mut self.scratch, run);
            }
        }
        self
    }

    /// Flips one bit of x(i), modulo its width, as a memory fault does; no effect without x(i).
    pub fn flip_state(&mut self, program: ProgramId, bit: usize) {
        if let Some(replica) = replica_mut(&mut self.replicas, program) {
            replica.flip_state(bit);
        }
    }

    /// It had loaded a change before it was started, with these configurations; before [`Self::retaining`]. Without effect where the change is not of
    /// its configuration.
    #[must_use]
    pub fn changed(mut self, change: &Arc<OnlineChange>, configurations: Configurations) -> Self {
        let restored = self.member.restore_change(Arc::clone(change), configurations);
        if restored.is_ok() && configurations.prepared.is_none() {
            self.settings.adopt(change, configurations.own);
        }
        self
    }

    /// The configuration that it runs, and the one that it has loaded beside it; it refuses members with none of them.
    pub fn configurations(&self) -> Configurations {
        self.member.changing().configurations()
    }

    /// State of a program that it holds, with its lineage; it may be older than the newest sample.
    pub fn state_of(&self, program: ProgramId) -> Option<(Lineage, &Image)> {
        self.replica(program)?.state()
    }

    fn replica(&self, program: ProgramId) -> Option<&Replica> {
        let place = place_of(&self.replicas, program)?;
        Some(&self.replicas[place])
    }

    fn own(&self) -> StationId {
        self.settings.station
    }

    fn is_understudy(&self) -> bool {
        self.settings.agreement.schedule.is_understudy(self.own())
    }

    fn publishes(&self) -> bool {
        self.replicas.iter().any(|replica| replica.standing() == Standing::Proven)
    }

    fn report(&mut self, event: Event) {
        self.member.report(event);
    }

    fn receive(&mut self, now: Time, frame: &Arc<Frame>) {
        if matches!(frame.body, Body::Field(_) | Body::Actuation(_) | Body::Pair(_)) {
            return;
        }
        match self.member.arrival(now, frame) {
            Arrival::Stale => return,
            Arrival::Present => {}
            Arrival::Begins(anchor) => {
                self.close_cycle();
                self.member.clock.begin(now, frame.header.moment, anchor);
                if self.role == Role::Listening || frame.body == Body::Sync {
                    self.role = Role::Following;
                }
            }
        }
        match (&frame.body, frame.header.sender) {
            (Body::Sample(sample), Member::RemoteIo(program) | Member::Twin(program)) => {
                self.relay.receive(program);
                self.follow(program, frame, sample);
            }
            (Body::Turn(turn), Member::Station(station)) => {
                self.receive_turn(station, turn);
                self.receive_relayed(&frame.header, turn);
            }
            (Body::Join(join), Member::Station(station)) => self.receive_join(station, join),
            (Body::Transfer(transfer), Member::Station(station)) => self.adopt(station, transfer),
            _ => {}
        }
        self.publish_if_due(now);
    }

    fn follow(&mut self, program: ProgramId, frame: &Arc<Frame>, sample: &Sample) {
        self.relay.keep(frame);
        let excluded = sample.excluded.contains(self.own());
        let moment = frame.header.moment;
        let Some(replica) = replica_mut(&mut self.replicas, program) else {
            return;
        };
        let (clock, schedule) = (&self.member.clock, &self.settings.agreement.schedule);
        let received = match clock.anchor().since(self.started) >= schedule.period() {
            true => SamplesReceived::Later,
            false => SamplesReceived::First,
        };
        let versions = self.settings.versions(&self.member, program);
        replica.remember(versions, moment, sample, received);
        if replica.set_excluded(excluded) {
            self.member.report(if excluded {
                Event::Excluded { moment, program }
            } else {
                Event::Readmitted { moment, program }
            });
        }
        let versions = self.settings.versions(&self.member, program);
        let followed = replica.follow(
            versions,
            &mut self.scratch,
            frame,
            self.settings.agreement.shadow_cycles,
        );
        self.hand_over_retained(program);
        let adopted = match followed {
            Followed::FromGenesis(lineage) => Some((lineage, None)),
            Followed::CaughtUp(from) => Some((sample.after, Some(from))),
            Followed::NotPrepared(missing) => {
                self.miss_program(moment, program, missing);
                None
            }
            Followed::Synchronised | Followed::Lost | Followed::Changed => None,
        };
        if let Some((lineage, from)) = adopted {
            self.report(Event::Adopted { moment, program, lineage, from });
        }
    }

    /// Reports once that a program is not loaded that a history changes to.
    fn miss_program(&mut self, moment: Moment, program: ProgramId, missing: ProgramHash) {
        let lack = (program, missing);
        if !self.lacks_program.contains(&lack) {
            self.lacks_program.retain(|(known, _)| *known != program);
            self.lacks_program.push(lack);
            self.report(Event::NotPrepared { moment, program, missing });
        }
    }

    /// Moves an online change on. What this station computes is decided by the histories alone: it forgets a program when none of its replicas needs it.
    fn take_change(&mut self, now: Time, order: &ChangeOrder) {
        let changing = self.member.changing();
        let own = |replica: &Replica| {
            let id = replica.id();
            changing.hash_of(id, self.settings.programs[id.index()].hash)
        };
        let may_forget = self.replicas.iter().all(|replica| replica.is_of(own(replica)));
        let before = changing.change().cloned();
        self.member.take_change(now, order, may_forget);
        let changing = self.member.changing();
        if let (Some(change), None) = (before, changing.change()) {
            self.settings.adopt(&change, changing.configurations().own);
        }
    }

    /// Hands over what a program keeps of the steps that it has just taken, before their outputs are published.
    fn hand_over_retained(&mut self, program: ProgramId) {
        if let Some(replica) = replica_mut(&mut self.replicas, program) {
            for record in replica.take_records() {
                self.member.put(Output::Retain(Box::new(record)));
            }
        }
    }

    fn holdings(&self) -> SmallVec<[Holding; 2]> {
        let held = self.replicas.iter().filter_map(|replica| {
            let versions = self.settings.versions(&self.member, replica.id());
            Some(Holding { version: replica.version(versions), ..replica.holding()? })
        });
        held.collect()
    }

    /// What it recalls of the programs whose samples it has not received in this cycle.
    fn recalled(&self, moment: Moment) -> Vec<Recalled> {
        let recalled = self.replicas.iter().filter_map(|it| it.recalled(moment));
        recalled.cloned().collect()
    }

    fn take_recalled(&mut self, recalled: &[Recalled]) {
        for one in recalled {
            if let Some(replica) = replica_mut(&mut self.replicas, one.program) {
                replica.take_recalled(self.settings.versions(&self.member, one.program), one);
            }
        }
    }

    fn next_wakeup(&self) -> Time {
        let never = Time(u64::MAX);
        let copies = self.member.copies_at().unwrap_or(never);
        let publishes = self.publishes_at().unwrap_or(never);
        let first = [self.asks_at(), self.repeats_sync_at()].into_iter().flatten();
        let first = first.fold(copies.min(publishes), Time::min);
        // No station starts the next cycle before the current one is over.
        let end = self.member.clock.anchor() + self.settings.agreement.schedule.period();
        if self.role != Role::Listening && first <= end {
            return first;
        }
        first.min(self.starts_cycle_at())
    }

    /// Counts the stations with its configuration: itself, those that publish, and those that ask to join.
    fn count_votes(&mut self, now: Time) {
        let all = StationSet::first(self.settings.agreement.schedule.stations());
        let own = all.without(self.member.flagged()).or(self.joining).or(self.cycle.joiners);
        let stations = own.or(StationSet::only(self.own())).len();
        self.member.count_votes(now, stations, !self.publishes());
    }

    fn wake(&mut self, now: Time) {
        self.count_votes(now);
        self.member.send_copies(now);
        self.repeat_sync_if_due(now);
        self.publish_if_due(now);
        if self.asks_at().is_some_and(|due| due <= now) {
            self.ask();
        }
        let planned = self.starts_cycle_at();
        if planned <= now {
            self.start_cycle(now, planned);
        }
    }
}

fn replica_mut(replicas: &mut [Replica], program: ProgramId) -> Option<&mut Replica> {
    let place = place_of(replicas, program)?;
    Some(&mut replicas[place])
}

fn place_of(replicas: &[Replica], program: ProgramId) -> Option<usize> {
    let place = replicas.binary_search_by_key(&program, Replica::id);
    place.ok()
}

/// Two stations of equal settings that are drained and hash alike behave alike.
impl Hash for Station {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            settings: _,
            member,
            replicas,
            scratch: _,
            cycle,
            closed,
            company,
            started,
            role,
            wanted,
            joining,
            differed,
            relay,
            // Only reported.
            unsampled: _,
            looked_at: _,
            lacks_program: _,
        } = self;
        (member, replicas).hash(hasher);
        (cycle, closed, company, started, role, wanted).hash(hasher);
        (joining, differed, relay).hash(hasher);
    }
}
