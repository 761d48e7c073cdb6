//! A campaign of failures in virtual time: stations fail and are repaired by chance until a program is lost, again and again.
//!
//! Each replica starts whole. A station fails after an exponential time in step; its repair takes an exponential time from its
//! detection on (θ = 1 at any party), and then it re-enters by the protocol, in as many cycles as that takes. The *system* fails where a
//! remote I/O has come to its fail-safe: nobody has held its program's state since the first deadline with nothing true to apply,
//! which is the time of the failure. Invariant: a replica is a function of the cluster, the plan and its own number, so that the
//! campaign is the same on any number of processors.

mod replica;

use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_reliability::{Campaign, SystemFailure};
use understudy_simulator::NotReady;

use replica::{Replica, Run};

/// Nanoseconds of an hour.
const HOUR_NS: f64 = 3.6e12;

/// What a campaign does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CampaignPlan {
    /// Mean cycles from a station's being in step to its failure.
    pub mtbf_cycles: f64,
    /// Mean cycles from the detection of a failure to the restart.
    pub mttr_cycles: f64,
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
}

/// What a campaign found, beside what the model is asked about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// For the assessment.
    pub campaign: Campaign,
    /// Cycles that were run.
    pub cycles: u64,
    /// Mean cycles from a failure of a station to its detection; nothing where none was detected.
    pub detection_cycles: Option<f64>,
    /// Mean cycles from a restart to being in step again.
    pub reentry_cycles: Option<f64>,
    /// Failures of stations after which a deadline had nothing true to apply, although the redundancy that was left should have masked them.
    pub unmasked: u64,
    /// What must never happen and did, in words.
    pub violations: Vec<String>,
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

/// Runs `plan` on `cluster`.
///
/// # Errors
/// [`CampaignError`] of the first replica that could not be run.
pub fn run_campaign(cluster: &Cluster, plan: &CampaignPlan) -> Result<Measured, CampaignError> {
    let next = AtomicU64::new(0);
    let work = || -> Result<Vec<(u64, Run)>, CampaignError> {
        let mut runs = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= plan.failures {
                return Ok(runs);
            }
            runs.push((number, Replica::new(cluster, plan, number).run()?));
        }
    };
    let mut runs = Vec::new();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..plan.threads.max(1))
            .map(|_| scope.spawn(work))
            .collect();
        for worker in workers {
            runs.extend(worker.join().map_err(|_| CampaignError::Lost)??);
        }
        Ok::<(), CampaignError>(())
    })?;
    runs.sort_by_key(|(number, _)| *number);
    Ok(gathered(
        cluster,
        plan,
        runs.into_iter().map(|(_, run)| run),
    ))
}

fn gathered(cluster: &Cluster, plan: &CampaignPlan, runs: impl Iterator<Item = Run>) -> Measured {
    let period_ns = cluster.agreement().schedule.period().as_nanos() as f64;
    let plant_hours = |ns: u64| ns as f64 / HOUR_NS * plan.acceleration;
    let mut campaign = Campaign {
        world: "simulator".to_owned(),
        seed: plan.seed,
        acceleration: plan.acceleration,
        failures: Vec::new(),
        censored_hours: Vec::new(),
        box_failures: 0,
        masked: 0,
        detection_hours: Vec::new(),
        repair_hours: Vec::new(),
    };
    let (mut detections, mut reentries) = (Vec::new(), Vec::new());
    let (mut total_ns, mut violations) = (0, Vec::new());
    for run in runs {
        total_ns += run.ran_ns;
        match run.cause {
            Some(cause) => campaign.failures.push(SystemFailure {
                hours: plant_hours(run.ran_ns),
                cause,
            }),
            None => campaign.censored_hours.push(plant_hours(run.ran_ns)),
        }
        campaign.box_failures += run.asked;
        campaign.masked += run.asked - run.unmasked;
        campaign
            .repair_hours
            .extend(run.repairs_ns.iter().map(|&ns| plant_hours(ns)));
        detections.extend(run.detections_ns);
        reentries.extend(run.reentries_ns);
        violations.extend(run.violations);
    }
    campaign.detection_hours = detections.iter().map(|&ns| ns as f64 / HOUR_NS).collect();
    let mean_cycles = |times: &[u64]| {
        let total: u64 = times.iter().sum();
        (!times.is_empty()).then(|| total as f64 / times.len() as f64 / period_ns)
    };
    Measured {
        unmasked: campaign.box_failures - campaign.masked,
        campaign,
        cycles: (total_ns as f64 / period_ns) as u64,
        detection_cycles: mean_cycles(&detections),
        reentry_cycles: mean_cycles(&reentries),
        violations,
    }
}

#[cfg(test)]
mod tests;
