//! The comparison: equal failures and equal loss for each contender.

use std::fmt;
use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_cycle::{Agreement, Schedule, ScheduleError};
use understudy_simulator::{Action, Fault, Network, NotReady, Parts, Simulation, parts};
use understudy_wire::{Member, StationId};

use crate::pairs::{Account, Pairs};
use crate::partner::Redundancy;

/// Shares of lost frames at which the lost cycles are counted.
pub const LOSSES: [f64; 8] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];

/// The share of lost frames at which false take-overs are counted.
const TAKE_OVER_LOSS: f64 = 0.01;

/// From one failure to the next, and from a failure to the repair, in cycles.
const FAILURE_EVERY: u64 = 60;
const REPAIR_AFTER: u64 = 20;

/// Cycles that the cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 10_000;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ComparisonPlan {
    /// Failures of a box that drives, at random phases, for each contender.
    pub failures: u64,
    /// Cycles at each share of lost frames.
    pub cycles: u64,
    /// How often each cyclic frame is sent, by everybody.
    pub copies: u32,
    /// Of all chance.
    pub seed: u64,
}

/// Lost cycles at one share of lost frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LostShare {
    /// Share of frames that do not arrive.
    pub loss: f64,
    /// Share of deadlines with nothing true of this cycle.
    pub lost: f64,
}

/// What one contender did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contender {
    /// Such as `hot standby, 3 misses`.
    pub name: String,
    /// Controllers that have to be bought.
    pub boxes: usize,
    /// Mean cycles without an output of their own, for one failure of a box that drives; on a quiet network.
    pub lost_per_failure: f64,
    /// The most for one failure.
    pub lost_worst: u64,
    /// Mean samples that were acted upon, and that no state holds any more after the failure.
    pub forgotten_per_failure: f64,
    /// Take-overs while the other box worked, at 1 % loss.
    pub false_take_overs: u64,
    /// Cycles in which two boxes drove as the only master, at 1 % loss.
    pub two_masters: u64,
    /// Cycles in which two boxes drove different things, at 1 % loss.
    pub differing: u64,
    /// Outputs that were not those of the program's own history, over everything that was run; nothing where nobody can tell.
    pub wrong: Option<u64>,
    /// Frames in one undisturbed cycle, one for each receiver.
    pub frames_per_cycle: f64,
    /// Their bytes.
    pub bytes_per_cycle: f64,
    /// For each of [`LOSSES`].
    pub lost_share: Vec<LostShare>,
}

/// The cluster on real processes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RealRun {
    /// What carried the frames.
    pub link: String,
    /// Stations that were killed.
    pub kills: u64,
    /// Cycles held or fail-safe.
    pub lost: u64,
    /// The same, while the host itself stood still.
    pub lost_by_stall: u64,
    /// Wrong outputs.
    pub wrong: u64,
    /// What went wrong with the run itself.
    pub failure: Option<String>,
}

/// All contenders.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What was measured.
    pub plan: ComparisonPlan,
    /// The cluster first.
    pub contenders: Vec<Contender>,
    /// The cluster on real processes; empty where that was not asked for.
    pub real: Vec<RealRun>,
}

/// A comparison that cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// No such number of copies.
    #[error(transparent)]
    Schedule(#[from] ScheduleError),
    /// The cluster does not come into step, such as under heavy loss with one copy.
    #[error(transparent)]
    NotReady(#[from] NotReady),
}

/// Runs every contender on the programs and plants of `cluster`.
///
/// # Errors
/// [`CompareError`] where the number of copies is out of bounds or the cluster never comes into step.
pub fn compare(cluster: &Cluster, plan: &ComparisonPlan) -> Result<Comparison, CompareError> {
    let own = cluster.agreement();
    let schedule = Schedule::new(
        own.schedule.period(),
        own.schedule.controllers(),
        own.schedule.understudies(),
        plan.copies,
    )?;
    let agreement = Arc::new(Agreement { schedule, ..Agreement::clone(own) });
    let standby = |misses| Redundancy::HotStandby { misses };
    let pairs = [standby(1), standby(3), standby(5), Redundancy::ActiveActive];
    let mut contenders = vec![of_cluster(cluster, &agreement, plan)?];
    contenders.extend(pairs.map(|redundancy| of_pairs(cluster, &agreement, plan, redundancy)));
    Ok(Comparison { plan: *plan, contenders, real: Vec::new() })
}

fn lossy(loss: f64) -> Network {
    Network { loss, ..Network::default() }
}

fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

// ── the cluster ─────────────────────────────────────────────────────────────────────────────────────────────────────

fn of_cluster(
    cluster: &Cluster,
    agreement: &Arc<Agreement>,
    plan: &ComparisonPlan,
) -> Result<Contender, NotReady> {
    let parts = with_agreement(parts(cluster), agreement);
    let mut wrong = 0;
    let (lost_per_failure, lost_worst) = cluster_failures(&parts, agreement, plan, &mut wrong)?;
    let mut lost_share = Vec::new();
    for loss in LOSSES {
        let mut simulation = Simulation::new(parts.clone(), lossy(loss), plan.seed);
        simulation.run(plan.cycles, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
        let (lost, deadlines) = lost(&simulation);
        wrong += simulation.violations().len() as u64;
        lost_share.push(LostShare { loss, lost: share(lost, deadlines) });
    }
    let mut simulation = Simulation::new(parts, Network::default(), plan.seed);
    simulation.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
    simulation.meter();
    simulation.go_on(plan.cycles, &mut |_, _, _, _| {}, &mut || false);
    let metered = simulation.metered();
    Ok(Contender {
        name: "this cluster".to_owned(),
        boxes: agreement.schedule.stations(),
        lost_per_failure,
        lost_worst,
        forgotten_per_failure: 0.0,
        false_take_overs: 0,
        two_masters: 0,
        differing: 0,
        wrong: Some(wrong),
        frames_per_cycle: share(metered.frames, plan.cycles),
        bytes_per_cycle: share(metered.bytes, plan.cycles),
        lost_share,
    })
}

fn with_agreement(mut parts: Parts, agreement: &Arc<Agreement>) -> Parts {
    for settings in &mut parts.stations {
        settings.agreement = Arc::clone(agreement);
    }
    for settings in &mut parts.remote_ios {
        settings.agreement = Arc::clone(agreement);
    }
    parts
}

/// Deadlines with nothing true, and all.
fn lost(simulation: &Simulation) -> (u64, u64) {
    let tallies = simulation.tallies().iter();
    tallies.fold((0, 0), |(lost, all), tally| {
        (lost + tally.held + tally.fail_safe, all + tally.deadlines())
    })
}

/// Mean and most lost cycles of a failure.
fn cluster_failures(
    parts: &Parts,
    agreement: &Agreement,
    plan: &ComparisonPlan,
    wrong: &mut u64,
) -> Result<(f64, u64), NotReady> {
    let mut random = Pcg64Mcg::seed_from_u64(plan.seed);
    let mut simulation = Simulation::new(parts.clone(), Network::default(), plan.seed);
    simulation.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
    let controllers = agreement.schedule.controllers() as u64;
    let (mut total, mut worst) = (0, 0);
    for failure in 0..plan.failures {
        let member = Member::Station(StationId((failure % controllers) as u8));
        let at_cycle = FAILURE_EVERY * failure + 1;
        let phase = random.random();
        let repaired = at_cycle + REPAIR_AFTER;
        for (at_cycle, action) in [(at_cycle, Action::Crash), (repaired, Action::Restart)] {
            simulation.schedule(Fault { at_cycle, phase, member, action });
        }
        let (before, _) = lost(&simulation);
        let end = FAILURE_EVERY * (failure + 1);
        simulation.go_on(end, &mut |_, _, _, _| {}, &mut || false);
        let (after, _) = lost(&simulation);
        total += after - before;
        worst = worst.max(after - before);
    }
    *wrong += simulation.violations().len() as u64;
    Ok((share(total, plan.failures), worst))
}

// ── the pairs ───────────────────────────────────────────────────────────────────────────────────────────────────────

fn of_pairs(
    cluster: &Cluster,
    agreement: &Arc<Agreement>,
    plan: &ComparisonPlan,
    redundancy: Redundancy,
) -> Contender {
    let new = |network| Pairs::new(cluster, agreement, redundancy, network, plan.seed);
    let mut quiet = new(Network::default());
    let boxes = quiet.boxes();
    quiet.run(FAILURE_EVERY as f64);
    quiet.take_account();
    quiet.run(plan.cycles as f64);
    let undisturbed = quiet.take_account();
    let mut random = Pcg64Mcg::seed_from_u64(plan.seed);
    let (mut lost, mut worst, mut forgotten) = (0, 0, 0);
    let programs = agreement.schedule.controllers() as u64;
    for failure in 0..plan.failures {
        let cell = (failure % programs) as usize;
        let phase: f64 = random.random();
        quiet.run(phase);
        let rank = quiet.crash_a_driver(cell);
        quiet.run(REPAIR_AFTER as f64);
        quiet.repair(cell, rank);
        quiet.run((FAILURE_EVERY - REPAIR_AFTER) as f64 - phase);
        let account = quiet.take_account();
        lost += account.lost;
        worst = worst.max(account.lost);
        forgotten += account.forgotten;
    }
    let at = |loss: f64| {
        let mut pairs = new(Network::default());
        pairs.run(FAILURE_EVERY as f64);
        pairs.take_account();
        pairs.set_network(lossy(loss));
        pairs.run(plan.cycles as f64);
        pairs.take_account()
    };
    let at_one_percent: Account = at(TAKE_OVER_LOSS);
    Contender {
        name: match redundancy {
            Redundancy::HotStandby { misses: 1 } => "hot standby, 1 miss".to_owned(),
            Redundancy::HotStandby { misses } => format!("hot standby, {misses} misses"),
            Redundancy::ActiveActive => "active-active".to_owned(),
        },
        boxes,
        lost_per_failure: share(lost, plan.failures),
        lost_worst: worst,
        forgotten_per_failure: share(forgotten, plan.failures),
        false_take_overs: at_one_percent.false_take_overs,
        two_masters: at_one_percent.two_masters,
        differing: at_one_percent.differing,
        wrong: None,
        frames_per_cycle: share(undisturbed.frames, plan.cycles),
        bytes_per_cycle: share(undisturbed.bytes, plan.cycles),
        lost_share: LOSSES
            .into_iter()
            .map(|loss| {
                let account = at(loss);
                LostShare { loss, lost: share(account.lost, account.deadlines) }
            })
            .collect(),
    }
}

// ── for people ──────────────────────────────────────────────────────────────────────────────────────────────────────

impl fmt::Display for Comparison {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plan = &self.plan;
        writeln!(
            formatter,
            "In the simulator: {} failures of a box that drives, {} cycles at each loss, {} copies of each frame, seed {}\n",
            plan.failures, plan.cycles, plan.copies, plan.seed
        )?;
        writeln!(
            formatter,
            "{:24}{:>6}{:>10}{:>7}{:>13}{:>13}{:>9}{:>8}{:>9}{:>9}",
            "",
            "boxes",
            "lost per",
            "most",
            "forgotten",
            "false take-",
            "two",
            "differ",
            "frames",
            "bytes"
        )?;
        writeln!(
            formatter,
            "{:24}{:>6}{:>10}{:>7}{:>13}{:>13}{:>9}{:>8}{:>9}{:>9}",
            "", "", "failure", "", "per failure", "overs", "masters", "", "a cycle", "a cycle"
        )?;
        for contender in &self.contenders {
            writeln!(
                formatter,
                "{:24}{:>6}{:>10.3}{:>7}{:>13.3}{:>13}{:>9}{:>8}{:>9.1}{:>9.0}",
                contender.name,
                contender.boxes,
                contender.lost_per_failure,
                contender.lost_worst,
                contender.forgotten_per_failure,
                contender.false_take_overs,
                contender.two_masters,
                contender.differing,
                contender.frames_per_cycle,
                contender.bytes_per_cycle
            )?;
        }
        write!(formatter, "\n{:24}", "lost cycles at a loss of")?;
        for loss in LOSSES {
            write!(formatter, "{:>10}", format!("{} %", loss * 100.0))?;
        }
        writeln!(formatter)?;
        for contender in &self.contenders {
            write!(formatter, "{:24}", contender.name)?;
            for point in &contender.lost_share {
                write!(formatter, "{:>10}", format!("{:.3} %", point.lost * 100.0))?;
            }
            writeln!(formatter)?;
        }
        for contender in &self.contenders {
            if let Some(wrong) = contender.wrong {
                writeln!(formatter, "\n{}: {wrong} wrong outputs in all of it", contender.name)?;
            }
        }
        if !self.real.is_empty() {
            writeln!(formatter, "\nThis cluster on real processes:\n")?;
        }
        for run in &self.real {
            writeln!(
                formatter,
                "{:24}{} kills, {} cycles lost, {} more while the host stood still, {} wrong{}",
                run.link,
                run.kills,
                run.lost,
                run.lost_by_stall,
                run.wrong,
                run.failure.as_deref().map_or(String::new(), |why| format!("; {why}"))
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
