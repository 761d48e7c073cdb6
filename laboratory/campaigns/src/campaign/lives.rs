//! Who lives: the stations of a replica as the model sees them, and what chance does to them next.
//!
//! A station is *up* from the moment at which it holds every state that it has to hold, and down from its failure on. Between them
//! lie its detection (θ = 1 at any member), its repair, and its return: it starts, listens, and takes over the states. In the paper's
//! mode nobody counts on a station before it speaks, so there it is up once every copy has proved itself (or as many cycles before as the
//! outputs are held). In the full mode the
//! state is what the system needs, and a copy in shadow has it: if all others die, it proves itself and speaks.
//!
//! The same lives serve both worlds. They get what was seen, with its time, and give orders; who carries them out, and by
//! which clock, is not known here. What different processes say may be read a little out of order: what would have taken less than
//! no time has taken none.

use rand::RngExt;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_simulator::Action;
use understudy_wire::{Member, ProgramId, ProgramSet, StationId, StationSet, Time};

use super::CampaignPlan;
use super::seen::Seen;

/// What one replica came to; times in nanoseconds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Run {
    /// Until the system failed, or the replica was given up.
    pub(super) ran_ns: u64,
    /// What brought the failure about; nothing where the replica was given up.
    pub(super) cause: Option<String>,
    /// Failures of stations that the redundancy left should have masked.
    pub(super) asked: u64,
    /// Those of them that it did not.
    pub(super) unmasked: u64,
    /// Those that a stall of the host explains; they are not counted at all.
    pub(super) excused: u64,
    /// From failures to their detection.
    pub(super) detection: Stage,
    /// From detections to restarts.
    pub(super) repair: Stage,
    /// From restarts to holding every state again.
    pub(super) taking_over: Stage,
    /// From there to speaking: the shadow. The station is up meanwhile, but in the paper's mode.
    pub(super) shadow: Stage,
    pub(super) violations: Vec<String>,
}

/// How long something took, each time that it came to its end; and how long it had lasted where the replica ended first.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Stage {
    pub(super) finished_ns: Vec<u64>,
    pub(super) unfinished_ns: Vec<u64>,
}

impl Stage {
    pub(super) fn extend(&mut self, other: Self) {
        self.finished_ns.extend(other.finished_ns);
        self.unfinished_ns.extend(other.unfinished_ns);
    }

    /// All its time over the number of its ends: the estimate that counts what was cut off. Nothing where it never ended.
    pub(super) fn mean_ns(&self) -> Option<f64> {
        let total: u64 = self.finished_ns.iter().chain(&self.unfinished_ns).sum();
        let ends = self.finished_ns.len();
        (ends > 0).then(|| total as f64 / ends as f64)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Life {
    /// It speaks.
    Synchronised,
    /// It is gone, and nobody has noticed.
    Undetected { since: Time },
    /// θ = 1.
    Repaired { since: Time },
    /// It runs again, and lacks states.
    TakingOver { since: Time, lacks: ProgramSet },
    /// It holds every state; some copies have not proved themselves.
    Shadow { since: Time, unproved: ProgramSet },
}

/// Cycles before and after a stall whose deadlines it explains.
const STALL_CYCLES: u64 = 10;

/// What is to be done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Order {
    /// So many cycles from now on.
    Do { member: Member, action: Action, after_cycles: f64 },
    /// What was ordered to this member and is not done yet is not to be done.
    Forget(Member),
}

/// The newest failure of a station.
#[derive(Debug)]
struct Newest {
    station: StationId,
    /// Who was down when it came.
    before: Vec<StationId>,
    /// Whether it should have been masked, and no deadline has shown yet that it was not.
    counts_as_masked: bool,
}

pub(super) struct Lives<'a> {
    cluster: &'a Cluster,
    plan: &'a CampaignPlan,
    random: Pcg64,
    lives: Vec<Life>,
    /// Whom some member takes for failed.
    flagged: StationSet,
    newest: Option<Newest>,
    /// The last stall of the host.
    stalled: Option<Time>,
    /// The last failure that was not masked, by the deadline that showed it.
    missed: Option<Time>,
    orders: Vec<Order>,
    run: Run,
}

impl<'a> Lives<'a> {
    /// All synchronised. `number` is that of the replica, which has a stream of chance of its own.
    pub(super) fn new(cluster: &'a Cluster, plan: &'a CampaignPlan, number: u64) -> Self {
        Self {
            cluster,
            plan,
            random: Pcg64::new(u128::from(plan.seed), u128::from(number)),
            lives: vec![Life::Synchronised; cluster.agreement().schedule.stations()],
            flagged: StationSet::EMPTY,
            newest: None,
            stalled: None,
            missed: None,
            orders: Vec::new(),
            run: Run::default(),
        }
    }

    /// A number for the world's own chance.
    pub(super) fn draw_seed(&mut self) -> u64 {
        self.random.random()
    }

    /// Everybody is synchronised: from now on they fail.
    pub(super) fn begin(&mut self) {
        for station in self.ranks() {
            self.order(station, Action::Crash);
        }
    }

    /// The orders since the last call.
    pub(super) fn take_orders(&mut self) -> Vec<Order> {
        std::mem::take(&mut self.orders)
    }

    /// Draws when `action` comes to `station`.
    fn order(&mut self, station: StationId, action: Action) {
        let mean = match action {
            Action::Crash => self.plan.mtbf_cycles,
            _ => self.plan.mttr_cycles,
        };
        let drawn: f64 = Exp1.sample(&mut self.random);
        let member = Member::Station(station);
        self.orders.push(Order::Do { member, action, after_cycles: mean * drawn });
    }

    /// Whom the crews work on from now on, where there are fewer of them than boxes to repair: any of these is as likely as any other.
    /// Exponential repairs have no memory, so what was begun may be drawn anew.
    fn assign_crews(&mut self, newly: Option<StationId>) {
        let mut down: Vec<StationId> = self
            .ranks()
            .filter(|rank| matches!(self.lives[rank.index()], Life::Repaired { .. }))
            .collect();
        let crews = self.plan.crews.map_or(usize::MAX, |crews| crews as usize);
        // Nobody waited before this one either.
        if down.len() <= crews && (newly.is_some() || down.len() < crews) {
            if let Some(station) = newly {
                self.order(station, Action::Restart);
            }
            return;
        }
        for &station in &down {
            self.orders.push(Order::Forget(Member::Station(station)));
        }
        for _ in 0..crews.min(down.len()) {
            let drawn = self.random.random_range(0..down.len());
            let station = down.swap_remove(drawn);
            self.order(station, Action::Restart);
        }
    }

    /// All stations; the slots of spares stay empty.
    fn ranks(&self) -> impl Iterator<Item = StationId> + use<> {
        let slots = self.cluster.agreement().schedule.spare_slots();
        (0..self.lives.len() as u8).map(StationId).filter(move |rank| !slots.contains(*rank))
    }

    /// Programs whose states a station holds.
    fn duty(&self, station: StationId) -> ProgramSet {
        let programs = self.cluster.controllers().len();
        if station.index() < programs {
            ProgramSet::only(station.controlled())
        } else {
            ProgramSet::first(programs)
        }
    }

    /// Answers what was seen at `now`; gives orders by it.
    pub(super) fn see(&mut self, now: Time, seen: Seen) {
        match seen {
            Seen::Crashed(station) => self.crashed(now, station),
            Seen::Restarted(station) => self.restarted(now, station),
            Seen::Flagged(station) => {
                self.flagged.insert(station);
                self.detected(now, station);
            }
            Seen::Cleared(station) => self.flagged.remove(station),
            Seen::Adopted(station, program) => self.adopted(now, station, program),
            Seen::Synchronised(station, program) => self.proved(now, station, program),
            Seen::Missed => self.deadline_missed(now),
            Seen::Stalled => {
                self.stalled = Some(now);
                let missed = self.missed.take();
                if self.near(missed, now) {
                    self.run.unmasked -= 1;
                    self.excuse();
                }
            }
            Seen::Violation(what) => self.run.violations.push(what),
            // The replica has ended with it.
            Seen::Lost(_) => {}
            // These are no stations.
            Seen::Gone(_) | Seen::Back(_) | Seen::Part(..) | Seen::Network(..) => {}
        }
    }

    fn deadline_missed(&mut self, now: Time) {
        let should_be_masked = !self.has_failed();
        let Some(newest) = &mut self.newest else {
            return;
        };
        if !should_be_masked || !std::mem::take(&mut newest.counts_as_masked) {
            return;
        }
        if self.near(self.stalled, now) {
            self.excuse();
        } else {
            self.run.unmasked += 1;
            self.missed = Some(now);
        }
    }

    fn excuse(&mut self) {
        self.run.asked -= 1;
        self.run.excused += 1;
    }

    fn near(&self, then: Option<Time>, now: Time) -> bool {
        let period = self.cluster.agreement().schedule.period().as_nanos() as u64;
        then.is_some_and(|then| now.0.abs_diff(then.0) <= STALL_CYCLES * period)
    }

    fn crashed(&mut self, now: Time, station: StationId) {
        let before = self.down();
        let was_up = self.is_up(station);
        if let Life::Shadow { since, .. } = self.lives[station.index()] {
            self.run.shadow.unfinished_ns.push(now.0.saturating_sub(since.0));
        }
        self.lives[station.index()] = Life::Undetected { since: now };
        // A shadow does not speak yet, so it masks nothing yet.
        let speaking = !self
            .ranks()
            .any(|rank| rank != station && matches!(self.lives[rank.index()], Life::Shadow { .. }));
        let counts_as_masked = was_up && speaking && !self.has_failed();
        self.run.asked += u64::from(counts_as_masked);
        self.newest = Some(Newest { station, before, counts_as_masked });
        // One that has not published since its return still counts as failed; nobody flags it once more.
        if self.flagged.contains(station) {
            self.detected(now, station);
        }
    }

    fn detected(&mut self, now: Time, station: StationId) {
        if let Life::Undetected { since } = self.lives[station.index()] {
            self.run.detection.finished_ns.push(now.0.saturating_sub(since.0));
            self.lives[station.index()] = Life::Repaired { since: now };
            self.assign_crews(Some(station));
        }
    }

    fn restarted(&mut self, now: Time, station: StationId) {
        let Life::Repaired { since } = self.lives[station.index()] else {
            return;
        };
        self.run.repair.finished_ns.push(now.0.saturating_sub(since.0));
        self.lives[station.index()] = Life::TakingOver { since: now, lacks: self.duty(station) };
        if self.plan.crews.is_some() {
            self.assign_crews(None);
        }
    }

    fn adopted(&mut self, now: Time, station: StationId, program: ProgramId) {
        let Life::TakingOver { since, lacks } = self.lives[station.index()] else {
            return;
        };
        let lacks = lacks.without(ProgramSet::only(program));
        self.lives[station.index()] = if lacks.is_empty() {
            self.run.taking_over.finished_ns.push(now.0.saturating_sub(since.0));
            if self.mode() == Mode::Full {
                self.order(station, Action::Crash);
            }
            Life::Shadow { since: now, unproved: self.duty(station) }
        } else {
            Life::TakingOver { since, lacks }
        };
    }

    fn proved(&mut self, now: Time, station: StationId, program: ProgramId) {
        let Life::Shadow { since, unproved } = self.lives[station.index()] else {
            return;
        };
        let unproved = unproved.without(ProgramSet::only(program));
        self.lives[station.index()] = if unproved.is_empty() {
            self.run.shadow.finished_ns.push(now.0.saturating_sub(since.0));
            if self.mode() == Mode::Paper {
                self.order(station, Action::Crash);
            }
            Life::Synchronised
        } else {
            Life::Shadow { since, unproved }
        };
    }

    /// The system failed at `since`, as its remote I/Os tell, after `ran_ns`; or it was given up, without a time.
    pub(super) fn end(mut self, now: Time, ran_ns: u64, failed: bool) -> Run {
        self.run.ran_ns = ran_ns;
        self.run.cause = failed.then(|| self.cause());
        for life in &self.lives {
            let (stage, since) = match *life {
                Life::Synchronised => continue,
                Life::Undetected { since } => (&mut self.run.detection, since),
                Life::Repaired { since } => (&mut self.run.repair, since),
                Life::TakingOver { since, .. } => (&mut self.run.taking_over, since),
                Life::Shadow { since, .. } => (&mut self.run.shadow, since),
            };
            stage.unfinished_ns.push(now.0.saturating_sub(since.0));
        }
        self.run
    }

    fn mode(&self) -> Mode {
        self.cluster.agreement().mode
    }

    fn is_up(&self, station: StationId) -> bool {
        match self.lives[station.index()] {
            Life::Synchronised => true,
            Life::Shadow { .. } => self.mode() == Mode::Full,
            Life::Undetected { .. } | Life::Repaired { .. } | Life::TakingOver { .. } => false,
        }
    }

    fn down(&self) -> Vec<StationId> {
        self.ranks().filter(|&rank| !self.is_up(rank)).collect()
    }

    /// Whether the system has failed by its definition, going by who is up.
    pub(super) fn has_failed(&self) -> bool {
        let programs = self.cluster.controllers().len();
        let down = self.down();
        let understudies = down.iter().filter(|rank| rank.index() >= programs).count();
        match self.mode() {
            Mode::Paper => down.len() > 1,
            Mode::Full => {
                understudies == self.cluster.lasting_understudies() && down.len() > understudies
            }
        }
    }

    /// Such as `robot after understudy`.
    fn cause(&self) -> String {
        let name = |station: &StationId| {
            let name = self.cluster.member_name(Member::Station(*station));
            name.unwrap_or_default().to_owned()
        };
        let Some(newest) = &self.newest else {
            return "with all stations synchronised".to_owned();
        };
        let before: Vec<String> = newest.before.iter().map(name).collect();
        if before.is_empty() {
            format!("{} alone", name(&newest.station))
        } else {
            format!("{} after {}", name(&newest.station), before.join(" and "))
        }
    }
}
