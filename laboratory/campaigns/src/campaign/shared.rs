//! Groups that share spares, in virtual time: the same cluster several times, with as many spares as it has slots.
//!
//! ```text
//!   group 0: Simulation + Lives ─┐
//!   group 1: Simulation + Lives ─┼─(deadlines)─► SpareBeside ─(orders)─► the slot of one group
//!   group 2: Simulation + Lives ─┘
//! ```
//!
//! All groups go on by one period at a time, so a spare sees each of them as it is. The stations of a group live as in the campaign of one cluster;
//! the machine of a spare fails and is repaired after exponential times too. The plant fails with its first group.

use std::cell::{Cell, RefCell};

use rand::SeedableRng;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_reliability::{
    Hours, Interval, Probability, ReliabilityError, SharedSpares, grouped, times_to_failure,
};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::{
    Action, Fault, Network, NotReady, Record, Simulation, SpareBeside, SpareOrder, SpareTimes,
    parts,
};
use understudy_wire::{Member, ProgramId, StationSet, Time};

use super::lives::{Lives, Run, Stage};
use super::question::Planned;
use super::replica::{PATIENCE_CYCLES, carry_out, look};
use super::seen::{Deadlines, Seen};
use super::{CampaignError, CampaignPlan, HOUR_NS, replicas};

/// Confidence of the interval.
const CONFIDENCE: f64 = 0.95;

/// A measurement of groups that share spares, compared with the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedFound {
    /// Groups.
    pub groups: u32,
    /// Spares that they share.
    pub spares: u32,
    /// What was done.
    pub plan: CampaignPlan,
    /// Cycles that were run, of all groups.
    pub cycles: u64,
    /// Failures of the plant.
    pub failures: usize,
    /// Replicas that were given up.
    pub censored: usize,
    /// Times that a spare woke.
    pub woke: u64,
    /// Mean cycles from the order to wake to the first turn of the spare.
    pub joined_cycles: Option<f64>,
    /// Mean cycles that the protocol adds to each repair: detection and taking over.
    pub down_cycles: f64,
    /// MTTF as measured, in hours.
    pub mttf_hours: Interval,
    /// MTTF by the model, with the measured times of the protocol.
    pub model_hours: f64,
    /// MTTF by the model without spares.
    pub without_hours: f64,
    /// Whether the model is in the measured interval.
    pub agrees: bool,
    /// What must never happen and did.
    pub violations: Vec<String>,
}

/// What one replica came to.
struct SharedRun {
    groups: Vec<Run>,
    failed: bool,
    ran_ns: u64,
    woke: u64,
    /// From the order to wake to the first turn.
    joined_ns: Vec<u64>,
}

/// Measures the MTTF of `groups` copies of a cluster that share the spares of its slots, and compares it with the model.
///
/// # Errors
/// [`CampaignError`], and a model that cannot be had.
pub fn measure_shared(
    cluster: &Cluster,
    planned: &Planned,
    groups: u32,
    times: SpareTimes,
    watch: &mut dyn FnMut(u64),
) -> Result<Result<SharedFound, Vec<ReliabilityError>>, CampaignError> {
    let plan = &planned.plan;
    let runs = replicas(plan, watch, &|number| simulated(cluster, plan, groups, times, number))?;
    Ok(compared(cluster, planned, groups, times, runs))
}

fn compared(
    cluster: &Cluster,
    planned: &Planned,
    groups: u32,
    times: SpareTimes,
    runs: Vec<SharedRun>,
) -> Result<SharedFound, Vec<ReliabilityError>> {
    let one = |error| vec![error];
    let plan = planned.plan;
    let period_ns = planned.period_hours * HOUR_NS;
    let plant_hours = |ns: u64| ns as f64 / HOUR_NS * plan.acceleration;
    let (failed, given_up): (Vec<&SharedRun>, Vec<&SharedRun>) =
        runs.iter().partition(|run| run.failed);
    let hours = |runs: &[&SharedRun]| runs.iter().map(|run| plant_hours(run.ran_ns)).collect();
    let (failures, censored): (Vec<f64>, Vec<f64>) = (hours(&failed), hours(&given_up));
    let mttf_hours = times_to_failure(&failures, &censored, CONFIDENCE).map_err(one)?;
    let (mut detection, mut taking_over) = (Stage::default(), Stage::default());
    let mut joined = Stage::default();
    let mut violations = Vec::new();
    for run in &runs {
        joined.finished_ns.extend(&run.joined_ns);
        for group in &run.groups {
            detection.extend(group.detection.clone());
            taking_over.extend(group.taking_over.clone());
            violations.extend(group.violations.iter().cloned());
        }
    }
    let cycles = |stage: &Stage| stage.mean_ns().map(|mean| mean / period_ns);
    let down_cycles = cycles(&detection).unwrap_or(0.0) + cycles(&taking_over).unwrap_or(0.0);
    let joined_cycles = cycles(&joined);
    let accelerated = |cycles: f64| cycles * planned.period_hours * plan.acceleration;
    let time = |hours: f64| Hours::new("the time of the protocol", hours).map_err(one);
    let wake = f64::from(times.spare_after) + joined_cycles.unwrap_or(0.0);
    let spares = u32::try_from(cluster.agreement().schedule.spare_slots().len()).unwrap_or(0);
    let model = SharedSpares {
        groups,
        too_large: 0,
        controllers: planned.options.controllers,
        spares,
        mtbf: planned.options.mtbf,
        mttr: time(planned.options.mttr.get() + accelerated(down_cycles))?,
        wake: time(accelerated(wake))?,
        coverage: Probability::ONE,
    };
    let model_hours = model.mttf()?;
    let without = SharedSpares { spares: 0, ..model };
    let total: u64 = runs.iter().map(|run| run.ran_ns).sum();
    Ok(SharedFound {
        groups,
        spares,
        plan,
        cycles: (total as f64 / period_ns * f64::from(groups)) as u64,
        failures: failed.len(),
        censored: given_up.len(),
        woke: runs.iter().map(|run| run.woke).sum(),
        joined_cycles,
        down_cycles,
        agrees: mttf_hours.covers(model_hours),
        mttf_hours,
        model_hours,
        without_hours: without.mttf()?,
        violations,
    })
}

impl SharedFound {
    /// Whether the model is in the measured interval, and nothing happened that must not.
    pub fn is_met(&self) -> bool {
        self.agrees && self.violations.is_empty()
    }

    /// The same for people.
    pub fn to_text(&self) -> String {
        let plan = &self.plan;
        let number = |number: Option<f64>| number.map_or("unknown".to_owned(), grouped);
        let interval = &self.mttf_hours;
        let inside = if self.agrees { "inside" } else { "OUTSIDE" };
        let mut text = format!(
            "seed {}\n{} of {} failures of {} groups with {} shared spares in {} cycles of the simulator: MTBF {} cycles, MTTR {} cycles\n\n\
             MTTF measured, 95 % interval       {} h ({} to {})\n\
             \x20 calculated for this campaign     {} h, {inside}: a repair takes {:.2} cycles of the protocol more\n\
             \x20 without spares                   {} h\n\
             spares woke                        {} times, and published {} cycles after that\n",
            plan.seed,
            self.failures,
            plan.failures,
            self.groups,
            self.spares,
            grouped(self.cycles as f64),
            grouped(plan.mtbf_cycles),
            grouped(plan.mttr_cycles),
            number(interval.estimate),
            grouped(interval.lower),
            number(interval.upper),
            grouped(self.model_hours),
            self.down_cycles,
            grouped(self.without_hours),
            self.woke,
            self.joined_cycles.map_or("unknown".to_owned(), |cycles| format!("{cycles:.1}")),
        );
        if self.censored > 0 {
            text.push_str(&format!("{} replicas ended before a failure\n", self.censored));
        }
        for violation in self.violations.iter().take(5) {
            text.push_str(&format!("VIOLATION: {violation}\n"));
        }
        text
    }
}

/// A group, and what was seen of it since it was last answered.
struct Group<'a> {
    simulation: Simulation,
    lives: Lives<'a>,
    deadlines: Deadlines,
    origin: Time,
    /// Stations whose lives are those of the spares.
    slots: StationSet,
}

/// A spare with the next failure or the end of the repair of its machine.
struct Machine {
    spare: SpareBeside,
    works: bool,
    /// Time of the next change.
    changes: Time,
    /// The order to wake whose first turn is awaited.
    ordered: Option<Time>,
}

fn simulated(
    cluster: &Cluster,
    plan: &CampaignPlan,
    groups: u32,
    times: SpareTimes,
    number: u64,
) -> Result<SharedRun, NotReady> {
    let agreement = cluster.agreement();
    let period_ns = agreement.schedule.period().as_nanos() as f64;
    let mut random = Pcg64::seed_from_u64(plan.seed ^ number.rotate_left(32));
    let mut draw = |mean_cycles: f64| -> u64 {
        let drawn: f64 = Exp1.sample(&mut random);
        (mean_cycles * drawn * period_ns) as u64
    };
    let mut all = Vec::new();
    for group in 0..u64::from(groups) {
        let mut lives = Lives::new(cluster, plan, number * u64::from(groups) + group);
        let mut simulation = Simulation::new(parts(cluster), Network::default(), lives.draw_seed());
        simulation.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
        lives.begin();
        carry_out(&mut simulation, lives.take_orders());
        let deadlines = Deadlines::new(cluster.controllers().len());
        let origin = simulation.now();
        let slots = agreement.schedule.spare_slots();
        all.push(Group { simulation, lives, deadlines, origin, slots });
    }
    // Each group counts time from its own origin.
    let mut machines: Vec<Machine> = (agreement.schedule.spare_slots().iter())
        .map(|slot| {
            let beside: Vec<_> = (0..groups).map(|_| (&**agreement, slot)).collect();
            let changes = Time(draw(plan.mtbf_cycles));
            Machine { spare: SpareBeside::new(&beside, times), works: true, changes, ordered: None }
        })
        .collect();
    let (mut woke, mut joined_ns) = (0, Vec::new());
    let step = period_ns as u64;
    let end = plan.maximum_cycles.saturating_mul(step);
    let mut now = 0;
    while now < end {
        now += step;
        let mut orders = Vec::new();
        for machine in machines.iter_mut().filter(|it| it.changes.0 <= now) {
            machine.works = !machine.works;
            let mean = if machine.works { plan.mtbf_cycles } else { plan.mttr_cycles };
            machine.changes = Time(now + draw(mean));
            machine.ordered = None;
            orders.extend(machine.spare.works(machine.works));
        }
        for place in 0..all.len() {
            let (found, heard) = all[place].pass(now);
            for (at, seen) in found {
                if let Seen::Lost(since) = seen {
                    let ran_ns = since.0.saturating_sub(all[place].origin.0);
                    let groups = all.into_iter().map(|it| it.lives.end(at, ran_ns, true));
                    let groups = groups.collect();
                    return Ok(SharedRun { groups, failed: true, ran_ns, woke, joined_ns });
                }
                all[place].lives.see(at, seen);
            }
            for (program, event) in heard {
                for machine in &mut machines {
                    let order = machine.spare.see(place, program, &event);
                    if let Some(SpareOrder { action, .. }) = order {
                        let wakes = action == Action::Restart;
                        woke += u64::from(wakes);
                        machine.ordered = wakes.then_some(Time(now));
                    } else if let Some(ordered) =
                        machine.ordered.take_if(|_| machine.spare.publishes())
                    {
                        joined_ns.push(now - ordered.0);
                    }
                    orders.extend(order);
                }
            }
            let group = &mut all[place];
            carry_out(&mut group.simulation, group.lives.take_orders());
        }
        for SpareOrder { group, slot, action } in orders {
            let member = Member::Station(slot);
            all[group].simulation.schedule(Fault { at_cycle: 0, phase: 0.0, member, action });
        }
    }
    let groups = all.into_iter().map(|it| it.lives.end(Time(it.origin.0 + now), now, false));
    Ok(SharedRun { groups: groups.collect(), failed: false, ran_ns: now, woke, joined_ns })
}

/// What a campaign has to answer, and the deadlines that spares follow.
type Passed = (Vec<(Time, Seen)>, Vec<(ProgramId, RemoteIoEvent)>);

impl Group<'_> {
    /// Goes on until a time after its origin.
    fn pass(&mut self, until_ns: u64) -> Passed {
        let until = Time(self.origin.0 + until_ns);
        let found = RefCell::new(Passed::default());
        let last = Cell::new(self.simulation.now());
        let (deadlines, slots) = (&mut self.deadlines, self.slots);
        let mut observe = |now: Time, _: Option<u64>, member: Member, record: Record<'_>| {
            last.set(now);
            let mut found = found.borrow_mut();
            if let (Member::RemoteIo(program) | Member::Twin(program), Record::RemoteIo(event)) =
                (member, record)
                && matches!(event, RemoteIoEvent::Applied { .. })
            {
                found.1.push((program, event.clone()));
            }
            let seen = look(now, member, record, deadlines);
            let is_of_slot = |seen: &Seen| seen.station().is_some_and(|it| slots.contains(it));
            found.0.extend(seen.filter(|it| !is_of_slot(it)).map(|seen| (now, seen)));
        };
        if last.get() < until {
            self.simulation.go_on(u64::MAX, &mut observe, &mut || last.get() >= until);
        }
        found.into_inner()
    }
}
