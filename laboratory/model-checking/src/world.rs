//! The states of the model and the steps between them.

use std::fmt;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher, Hash, Hasher};
use std::time::Duration;

use stateright::Property as Checked;
use understudy_simulator::{Fault, Network, NotReady, Parts, Shard, Simulation};
use understudy_wire::{Member, ProgramId, StationId, StationSet};

use crate::properties::{Property, RECOVERY_CYCLES};
use crate::start::Start;
use crate::step::{Budget, Failed, LATE_PER_MILLE, Place, Step, faults};

/// A prime above the number of faults that can be done at one place, so that the shards share those of each place.
const FIRST_FAULTS_OF_A_PLACE: u64 = 1009;

/// Cycles that the undisturbed cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 200;

/// A cluster that has come into step once, what may be done to it, and what must hold all the same.
pub struct Model {
    /// Where nothing has been done yet that the start asks for.
    origin: Simulation,
    pub(crate) start: Start,
    pub(crate) members: Vec<Member>,
    /// Slots of spares: empty until they wake, at any time and for any reason.
    slots: StationSet,
    /// Remote I/Os with a direct link to their twins.
    linked: Vec<Member>,
    period: Duration,
    pub(crate) budget: Budget,
    properties: Vec<Property>,
    /// The first faults that are tried.
    shard: Shard,
}

/// A cluster between two slots.
#[derive(Clone)]
pub struct World {
    pub(crate) simulation: Simulation,
    pub(crate) place: Place,
    /// What has been done so far.
    pub(crate) used: Budget,
    pub(crate) failed: Failed,
    /// Who has been down.
    pub(crate) was_down: Vec<Member>,
    /// The last step since the slot began: things that are done at one time are done in one order only.
    last: Option<Step>,
}

impl Model {
    /// A cluster of these parts, once it has come into step on a quiet network, and `start` has happened to it; [`Start::properties`] are checked.
    ///
    /// # Errors
    /// [`NotReady`] where it does not come into step.
    pub fn new(parts: Parts, start: Start, budget: Budget) -> Result<Self, NotReady> {
        let stations = (0..parts.stations.len()).map(|rank| Member::Station(StationId(rank as u8)));
        let programs = 0..parts.remote_ios.len();
        let remote_ios = programs.map(|program| Member::RemoteIo(ProgramId(program as u8)));
        let paired = parts.remote_ios.iter().filter(|settings| settings.pair.is_some());
        let twins = paired.map(|settings| Member::Twin(settings.program));
        let members = stations.chain(remote_ios).chain(twins).collect();
        let schedule = &parts.stations[0].agreement.schedule;
        let (period, slots) = (schedule.period(), schedule.spare_slots());
        let linked = parts.direct_links.iter().map(Member::RemoteIo).collect();
        let mut origin = Simulation::new(parts, Self::network(period), 0);
        origin.run(1, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
        let properties = start.properties();
        let shard = Shard::WHOLE;
        Ok(Self { origin, start, members, slots, linked, period, budget, properties, shard })
    }

    /// The part of the model whose runs begin with every N-th fault that can be the first one. All shards together have all runs; the runs without
    /// any fault are in each.
    #[must_use]
    pub fn of_shard(self, shard: Shard) -> Self {
        Self { shard, ..self }
    }

    /// On which each frame takes T/20, and nothing is left to chance.
    pub fn network(period: Duration) -> Network {
        Network { latency: period / 20, ..Network::default() }
    }

    /// A run from the same start in which `faults` are done.
    pub fn replay(&self, faults: &[Fault]) -> Simulation {
        let mut simulation = self.origin.clone();
        for &fault in faults {
            simulation.schedule(fault);
        }
        simulation
    }

    /// Who is down where the run begins, and whether it has crashed.
    fn down(&self) -> Vec<(Member, bool)> {
        let slots = self.slots.iter().map(Member::Station);
        self.start.down.iter().copied().chain(slots).map(|member| (member, true)).collect()
    }

    /// What brings back all that has failed at a place; an empty slot is in order.
    pub(crate) fn revivals(&self, failed: &Failed, place: Place) -> Vec<Fault> {
        let is_slot = |member| matches!(member, Member::Station(it) if self.slots.contains(it));
        let steps = failed.revivals(|member| !is_slot(member));
        steps.flat_map(|step| faults(step, place, &self.members, self.period)).collect()
    }

    /// Where the first thing is done.
    fn first(&self) -> Place {
        self.start.first()
    }

    /// The faults that a path of steps is, in the order in which they have to be scheduled.
    pub fn faults(&self, steps: &[Step]) -> Vec<Fault> {
        let mut place = self.first();
        let mut all = self.start.faults();
        let mut failed = Failed::new(self.down());
        for &step in steps {
            all.extend(faults(step, place, &self.members, self.period));
            failed.note(step);
            if step == Step::Wait {
                place = place.next();
            }
        }
        // Who is still down where the run is over comes back, as for the property that protection does.
        if place.cycle >= self.last_cycle() {
            all.extend(self.revivals(&failed, place));
        }
        all
    }

    /// Cycles of a run that has all of a path in it, and the time to come into step again.
    pub fn cycles(&self) -> u64 {
        self.last_cycle() + RECOVERY_CYCLES
    }

    /// From which on nothing more is done.
    pub(crate) fn last_cycle(&self) -> u64 {
        self.first().cycle + self.budget.cycles
    }

    /// Members that send anything in the slot that begins here if nothing is done.
    fn senders(&self, world: &World) -> Vec<Member> {
        let mut ahead = world.simulation.clone();
        let next = world.place.next();
        ahead.go_to(next.cycle, next.phase(), &mut |_, _, _, _| {});
        let sends =
            |member: &&Member| ahead.sent_frames(**member) > world.simulation.sent_frames(**member);
        self.members.iter().filter(sends).copied().collect()
    }
}

impl World {
    fn spend(&mut self, step: Step) {
        let used = &mut self.used;
        let spent = match step {
            Step::Lose { .. } | Step::Mute { .. } => &mut used.losses,
            Step::Late { .. } => &mut used.delays,
            Step::Twice { .. } => &mut used.duplicates,
            Step::Crash(_) => &mut used.crashes,
            Step::Stop(_) => &mut used.stops,
            Step::Cut { .. } => &mut used.cuts,
            Step::Pull(_) => &mut used.links,
            Step::Restart(_)
            | Step::Continue(_)
            | Step::Heal { .. }
            | Step::Plug(_)
            | Step::Wait => return,
        };
        *spent += 1;
        used.total += 1;
    }
}

impl stateright::Model for Model {
    type State = World;
    type Action = Step;

    fn init_states(&self) -> Vec<World> {
        let place = self.first();
        let mut simulation = self.replay(&self.start.faults());
        simulation.go_to(place.cycle, place.phase(), &mut |_, _, _, _| {});
        vec![World {
            simulation,
            place,
            used: Budget::default(),
            failed: Failed::new(self.down()),
            was_down: self.start.members().collect(),
            last: None,
        }]
    }

    fn actions(&self, world: &World, steps: &mut Vec<Step>) {
        let (budget, used) = (&self.budget, &world.used);
        if world.place.cycle >= self.last_cycle() {
            return;
        }
        let failed = &world.failed;
        let is_down = |member: Member| failed.down.iter().any(|&(down, _)| down == member);
        steps.extend(failed.revivals(|_| true));
        let before_faults = steps.len();
        if used.total < budget.total {
            let senders = self.senders(world);
            for &from in &senders {
                for &to in self.members.iter().filter(|&&to| to != from) {
                    if used.losses < budget.losses {
                        steps.push(Step::Lose { from, to });
                    }
                    if used.delays < budget.delays {
                        steps.extend(LATE_PER_MILLE.map(|per_mille| Step::Late {
                            from,
                            to,
                            per_mille,
                        }));
                    }
                }
                if used.losses < budget.losses {
                    steps.push(Step::Mute { from });
                }
            }
            if used.duplicates < budget.duplicates {
                steps.extend(self.members.iter().map(|&from| Step::Twice { from }));
            }
            if used.cuts < budget.cuts && failed.cut.is_none() {
                // A side and the other one are one cut.
                let sides = 1..1_u32 << (self.members.len() - 1);
                steps.extend(sides.map(|side| Step::Cut { side }));
            }
            if used.links < budget.links {
                let whole = self.linked.iter().filter(|member| !failed.pulled.contains(member));
                steps.extend(whole.copied().map(Step::Pull));
            }
            for &member in self.members.iter().filter(|&&member| !is_down(member)) {
                if used.crashes < budget.crashes {
                    steps.push(Step::Crash(member));
                }
                if used.stops < budget.stops {
                    steps.push(Step::Stop(member));
                }
            }
        }
        if used.total == 0 {
            let first = world.place.number().wrapping_mul(FIRST_FAULTS_OF_A_PLACE);
            let faults = steps.split_off(before_faults).into_iter().enumerate();
            let own = faults.filter(|(index, _)| self.shard.has(first.wrapping_add(*index as u64)));
            steps.extend(own.map(|(_, step)| step));
        }
        steps.retain(|&step| world.last.is_none_or(|last| step > last));
        steps.push(Step::Wait);
    }

    fn next_state(&self, world: &World, step: Step) -> Option<World> {
        let mut next = world.clone();
        next.spend(step);
        next.last = Some(step);
        for fault in faults(step, world.place, &self.members, self.period) {
            next.simulation.schedule(fault);
        }
        next.failed.note(step);
        match step {
            Step::Crash(member) | Step::Stop(member) => next.was_down.push(member),
            Step::Wait => {
                next.last = None;
                next.place = world.place.next();
                let Place { cycle, .. } = next.place;
                next.simulation.go_to(cycle, next.place.phase(), &mut |_, _, _, _| {});
            }
            _ => {}
        }
        Some(next)
    }

    fn properties(&self) -> Vec<Checked<Self>> {
        let properties = self.properties.iter();
        properties.map(|property| Checked::always(property.name, property.holds)).collect()
    }
}

impl Hash for World {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self { simulation, place, used, failed, was_down, last } = self;
        (simulation, place, used, failed, was_down, last).hash(hasher);
        let untrue = |tally: &understudy_simulator::Tally| tally.held + tally.fail_safe > 0;
        simulation.tallies().iter().any(untrue).hash(hasher);
    }
}

/// As far as 64 bits of their hashes tell.
impl PartialEq for World {
    fn eq(&self, other: &Self) -> bool {
        let hasher = BuildHasherDefault::<DefaultHasher>::default();
        hasher.hash_one(self) == hasher.hash_one(other)
    }
}

impl fmt::Debug for World {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("World")
            .field("place", &self.place)
            .field("used", &self.used)
            .field("down", &self.failed.down)
            .field("violations", &self.simulation.violations())
            .finish_non_exhaustive()
    }
}
