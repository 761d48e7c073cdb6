//! Campaigns of failures: stations fail and are repaired by chance until a program is lost, again and again.
//!
//! Each replica starts whole. A station fails after an exponential time of being up; its repair takes an exponential time from its
//! detection on (θ = 1 at any member), and then it takes over its states by the protocol, in as many cycles as that takes. The *system*
//! fails where a remote I/O has come to its fail-safe: nobody has held its program's state since the first deadline with nothing true to
//! apply, which is the time of the failure. Invariant: a replica in virtual time is a function of the cluster, the plan and its own
//! number, so that the campaign is the same on any number of processors.

mod found;
mod lives;
mod parts;
mod question;
mod real;
mod replica;
mod seen;
mod shared;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;

use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_reliability::{Campaign, SystemFailure};
use understudy_simulator::NotReady;

pub use found::{Found, hold_against_model};
pub use parts::{PartTimes, PartsFound};
pub use question::{
    Planned, Question, QuestionError, Speed, options_of, plan_campaign, set_unequal,
};
pub use real::{RealCampaign, RealCampaignRun, run_real_campaign};
pub use shared::{SharedFound, measure_shared};

use lives::{Run, Stage};
use replica::simulated;

/// Nanoseconds of an hour.
const HOUR_NS: f64 = 3.6e12;

/// What a campaign does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CampaignPlan {
    /// Mean cycles from a station's being up to its failure.
    pub mtbf_cycles: f64,
    /// Mean cycles from the detection of a failure to the restart, while a crew is at it.
    pub mttr_cycles: f64,
    /// Stations that are repaired at the same time, at most; nothing: a crew for each.
    pub crews: Option<u32>,
    /// How many times faster than the plant.
    pub acceleration: f64,
    /// Failures of the system: replicas that are run.
    pub failures: u64,
    /// Of all chance.
    pub seed: u64,
    /// Cycles after which a replica is given up, censored.
    pub maximum_cycles: u64,
    /// Processors that are used.
    pub threads: usize,
    /// Times of a remote I/O; nothing: they do not fail.
    pub remote_io: Option<PartTimes>,
    /// Times of a network; nothing: they do not fail.
    pub network: Option<PartTimes>,
}

/// What a campaign found, beside what the model is asked about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// For the assessment.
    pub campaign: Campaign,
    /// Cycles that were run.
    pub cycles: u64,
    /// How long the protocol's own part of being down takes, and the shadow after it.
    pub own: OwnTime,
    /// Failures of stations after which a deadline had nothing true to apply, although the redundancy that was left should have masked them.
    pub unmasked: u64,
    /// Remote I/Os and networks.
    pub parts: PartsFound,
    /// What must never happen and did, in words.
    pub violations: Vec<String>,
    /// What a reader has to know of the run besides.
    pub remarks: Vec<String>,
}

/// Mean cycles that the protocol takes, however fast the campaign is; nothing where it never came to an end of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OwnTime {
    /// From a failure of a station to its detection.
    pub detection_cycles: Option<f64>,
    /// From a restart to holding every state that the station has to hold.
    pub taking_over_cycles: Option<f64>,
    /// From there to speaking again.
    pub shadow_cycles: Option<f64>,
    /// Of all these, how long the system has to do without the station.
    pub down_cycles: f64,
}

/// A campaign that could not be run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CampaignError {
    /// The cluster never came into step.
    #[error(transparent)]
    NotInStep(#[from] NotReady),
    /// A thread of the campaign ended before its work did.
    #[error("a replica of the campaign ended early")]
    Lost,
}

/// Runs `plan` on `cluster` in virtual time. `watch` is told how many replicas are done.
///
/// # Errors
/// [`CampaignError`] of the first replica that could not be run.
pub fn run_campaign(
    cluster: &Cluster,
    plan: &CampaignPlan,
    watch: &mut dyn FnMut(u64),
) -> Result<Measured, CampaignError> {
    let runs = replicas(plan, watch, &|number| simulated(cluster, plan, number))?;
    let mut parts = PartsFound::default();
    let runs = runs.into_iter().map(|(run, found)| {
        parts.add(&found);
        run
    });
    let measured = gathered(cluster, plan, "simulator", runs);
    Ok(Measured { parts, ..measured })
}

/// All replicas of a plan, in the order of their numbers.
fn replicas<R: Send>(
    plan: &CampaignPlan,
    watch: &mut dyn FnMut(u64),
    simulated: &(dyn Fn(u64) -> Result<R, NotReady> + Sync),
) -> Result<Vec<R>, CampaignError> {
    let next = AtomicU64::new(0);
    let (sender, receiver) = channel();
    let mut runs = Vec::new();
    std::thread::scope(|scope| {
        for _ in 0..plan.threads.max(1) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    // One that cannot be run ends the campaign; nobody listens then.
                    if number >= plan.failures || sender.send((number, simulated(number))).is_err()
                    {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (number, run) in receiver {
            runs.push((number, run?));
            watch(runs.len() as u64);
        }
        Ok::<(), CampaignError>(())
    })?;
    if runs.len() as u64 != plan.failures {
        return Err(CampaignError::Lost);
    }
    runs.sort_by_key(|(number, _)| *number);
    Ok(runs.into_iter().map(|(_, run)| run).collect())
}

fn gathered(
    cluster: &Cluster,
    plan: &CampaignPlan,
    world: &str,
    runs: impl Iterator<Item = Run>,
) -> Measured {
    let period_ns = cluster.agreement().schedule.period().as_nanos() as f64;
    let plant_hours = |ns: u64| ns as f64 / HOUR_NS * plan.acceleration;
    let mut campaign = Campaign {
        world: world.to_owned(),
        seed: plan.seed,
        acceleration: plan.acceleration,
        failures: Vec::new(),
        censored_hours: Vec::new(),
        box_failures: 0,
        masked: 0,
        detection_hours: Vec::new(),
        repair_hours: Vec::new(),
        unfinished_repair_hours: Vec::new(),
    };
    let mut detection = Stage::default();
    let mut taking_over = Stage::default();
    let mut shadow = Stage::default();
    let (mut total_ns, mut violations) = (0, Vec::new());
    for run in runs {
        total_ns += run.ran_ns;
        match run.cause {
            Some(cause) => {
                campaign.failures.push(SystemFailure { hours: plant_hours(run.ran_ns), cause })
            }
            None => campaign.censored_hours.push(plant_hours(run.ran_ns)),
        }
        campaign.box_failures += run.asked;
        campaign.masked += run.asked - run.unmasked;
        let hours = |times: Vec<u64>| times.into_iter().map(plant_hours);
        campaign.repair_hours.extend(hours(run.repair.finished_ns));
        campaign.unfinished_repair_hours.extend(hours(run.repair.unfinished_ns));
        detection.extend(run.detection);
        taking_over.extend(run.taking_over);
        shadow.extend(run.shadow);
        violations.extend(run.violations);
    }
    let detected = detection.finished_ns.iter();
    campaign.detection_hours = detected.map(|&ns| ns as f64 / HOUR_NS).collect();
    let mean_cycles = |stage: &Stage| stage.mean_ns().map(|mean| mean / period_ns);
    let mut own = OwnTime {
        detection_cycles: mean_cycles(&detection),
        taking_over_cycles: mean_cycles(&taking_over),
        shadow_cycles: mean_cycles(&shadow),
        down_cycles: 0.0,
    };
    own.down_cycles = own.detection_cycles.unwrap_or(0.0)
        + own.taking_over_cycles.unwrap_or(0.0)
        + shadow_that_counts(cluster, own.shadow_cycles.unwrap_or(0.0));
    Measured {
        unmasked: campaign.box_failures - campaign.masked,
        campaign,
        cycles: (total_ns as f64 / period_ns) as u64,
        own,
        parts: PartsFound::default(),
        violations,
        remarks: Vec::new(),
    }
}

/// How much of a shadow the system has to do without the station: in the full mode nothing of it, since the states are there; in the
/// paper's mode what is longer than the outputs are held.
fn shadow_that_counts(cluster: &Cluster, shadow_cycles: f64) -> f64 {
    match cluster.agreement().mode {
        Mode::Full => 0.0,
        Mode::Paper => {
            let held = cluster.remote_ios().iter().map(|place| place.fallback.hold_cycles);
            (shadow_cycles - f64::from(held.min().unwrap_or(0))).max(0.0)
        }
    }
}

#[cfg(test)]
mod tests;
