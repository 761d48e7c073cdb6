//! Fault injection campaigns in virtual time: runs with faults by chance, in search of one in which a property does not hold.
//!
//! Every run starts from a copy of the cluster synchronised. Invariant: a run is a function of the cluster, the seed of the campaign and the
//! number of the run, and everything in [`Findings`] is a sum over runs or sorted by their numbers. So the findings are the
//! same, byte for byte, on any number of threads, and in shards that are merged again.

mod coverage;
mod draw;
mod faultload;
mod findings;
mod kind;
mod merge;
mod minimise;
mod picture;
mod property;
mod seeds;
mod store;
mod trial;

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use rand::RngExt;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use understudy_cluster::Cluster;
use understudy_simulator::{NotReady, Shard};

pub use coverage::CoverageRow;
pub use findings::{Deadlines, Failure, Findings, FindingsError};
pub use kind::{Kind, Phase, Role};
pub use merge::merge;
pub use picture::{PictureError, picture};
pub use property::Property;
pub use seeds::Seeds;
pub use store::{Store, StoreError};

use coverage::Coverage;
use draw::{Target, draw};
use faultload::Faultload;
use minimise::{Violating, minimise};
use property::RECOVERY_CYCLES;
use trial::{Bench, FIRST_CYCLE, Symptom};

/// Cycles of one run, at least: some before the first fault, some after the last, and some between.
pub const MINIMUM_RUN_CYCLES: u64 = 150;

/// Cycles of one run, at most.
pub const MAXIMUM_RUN_CYCLES: u64 = 100_000;

/// Failures that are minimised and kept, at most: those with the lowest numbers. All are counted.
pub const MAXIMUM_FAILURES: usize = 100;

/// Seeds stay whole numbers in every reader of JSON and TOML.
const SEED_BITS: u32 = 52;

/// What a campaign does.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InjectionPlan {
    /// Runs of the whole campaign.
    pub runs: u64,
    /// Of all chance.
    pub seed: u64,
    /// Cycles of each run, from [`MINIMUM_RUN_CYCLES`] on.
    pub cycles: u64,
    /// What is hunted for.
    pub property: Property,
    /// What is injected.
    pub kinds: Vec<Kind>,
    /// The part of the campaign that is run here.
    pub shard: Shard,
    /// Cycles for which a station must be flagged before the spares of the cluster wake, and for which the cluster must be complete before they
    /// retire; nothing where they do not wake.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spare_after: Option<u32>,
}

impl InjectionPlan {
    /// The cycles in which something may be injected.
    fn window(&self) -> Range<u64> {
        let end = match self.property {
            Property::Unprotected => self.cycles.saturating_sub(RECOVERY_CYCLES),
            _ => self.cycles,
        };
        FIRST_CYCLE..end.max(FIRST_CYCLE + 1)
    }

    /// The faultload and the seed of a run.
    fn draw(&self, target: &Target<'_>, run: u64) -> (Faultload, u64) {
        // A stream of its own for each run.
        let mut random = Pcg64::new(u128::from(self.seed), u128::from(run));
        let seed = random.random::<u64>() >> (u64::BITS - SEED_BITS);
        let kinds = target.kinds(&self.kinds);
        let faultload = draw(&mut random, target, &kinds, &self.window());
        (faultload, seed)
    }
}

/// What one thread has counted.
struct Count {
    runs: u64,
    failed: u64,
    deadlines: Deadlines,
    coverage: Coverage,
    /// The lowest-numbered failed runs, in ascending order.
    failures: Vec<(u64, Symptom)>,
}

/// Runs the plan's shard on `threads` threads. `watch` is called after each run, on the thread that made it; where it
/// answers false, no further run is begun.
///
/// # Errors
/// [`NotReady`] where the undisturbed cluster does not come into step.
pub fn inject(
    cluster: &Cluster,
    plan: &InjectionPlan,
    threads: usize,
    watch: &(dyn Fn() -> bool + Sync),
) -> Result<Findings, NotReady> {
    let bench = Bench::new(cluster, plan.spare_after)?;
    let target = Target::of(cluster);
    let plan = &InjectionPlan { kinds: target.kinds(&plan.kinds), ..plan.clone() };
    let next = AtomicU64::new(0);
    let total = Mutex::new(Count::new(plan));
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                let count = count_runs(&bench, &target, plan, &next, watch);
                if let Ok(mut total) = total.lock() {
                    total.add(count);
                }
            });
        }
    });
    let total = total.into_inner().unwrap_or_else(|_| Count::new(plan));
    let failures = minimised(cluster, &bench, plan, threads, &total.failures);
    Ok(Findings::new(cluster, plan, total, failures))
}

fn count_runs(
    bench: &Bench,
    target: &Target<'_>,
    plan: &InjectionPlan,
    next: &AtomicU64,
    watch: &(dyn Fn() -> bool + Sync),
) -> Count {
    let mut count = Count::new(plan);
    loop {
        // Runs are begun in ascending order and finished once begun: what is done is always a range from the first one on.
        let place = next.fetch_add(1, Ordering::Relaxed);
        let Some(run) = plan.shard.item(place, plan.runs) else {
            return count;
        };
        let (faultload, seed) = plan.draw(target, run);
        let outcome = bench.run(&faultload, plan.cycles, seed, plan.property);
        count.runs += 1;
        count.coverage.count(&faultload, target.schedule);
        for tally in &outcome.tallies {
            count.deadlines.count(tally);
        }
        if let Some(symptom) = outcome.symptom {
            count.failed += 1;
            if count.failures.len() < MAXIMUM_FAILURES {
                count.failures.push((run, symptom));
            }
        }
        if !watch() {
            next.store(u64::MAX / 2, Ordering::Relaxed);
        }
    }
}

impl Count {
    fn new(plan: &InjectionPlan) -> Self {
        Self {
            runs: 0,
            failed: 0,
            deadlines: Deadlines::default(),
            coverage: Coverage::of(&plan.kinds),
            failures: Vec::new(),
        }
    }

    fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.failed += other.failed;
        self.deadlines.add(&other.deadlines);
        self.coverage.add(other.coverage.rows());
        self.failures.extend(other.failures);
        self.failures.sort_by_key(|(run, _)| *run);
        self.failures.truncate(MAXIMUM_FAILURES);
    }
}

/// Each failure as small as it is found to be, in the order of their runs.
fn minimised(
    cluster: &Cluster,
    bench: &Bench,
    plan: &InjectionPlan,
    threads: usize,
    failures: &[(u64, Symptom)],
) -> Vec<Failure> {
    let next = AtomicU64::new(0);
    let found = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, failures.len().max(1)) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed) as usize;
                    let Some((run, symptom)) = failures.get(place) else {
                        return;
                    };
                    let failure = small(cluster, bench, plan, *run, symptom);
                    if let Ok(mut found) = found.lock() {
                        found.push(failure);
                    }
                }
            });
        }
    });
    let mut found: Vec<Failure> = found.into_inner().unwrap_or_default();
    found.sort_by_key(|failure| failure.run);
    found
}

fn small(
    cluster: &Cluster,
    bench: &Bench,
    plan: &InjectionPlan,
    run: u64,
    symptom: &Symptom,
) -> Failure {
    let target = Target::of(cluster);
    let schedule = target.schedule;
    let (faultload, seed) = plan.draw(&target, run);
    let drawn = faultload.size().0;
    let found = Violating { faultload, cycles: plan.cycles, seed, symptom: symptom.clone() };
    let judges_at_end = plan.property == Property::Unprotected;
    let mut attempt = |faultload: &Faultload, cycles: u64, seed: u64| {
        bench.run(faultload, cycles, seed, plan.property).symptom
    };
    let small = minimise(found, schedule, judges_at_end, &mut attempt);
    Failure::new(cluster, plan, run, drawn, &small)
}

#[cfg(test)]
mod tests;
