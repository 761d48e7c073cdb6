//! Campaigns in a store: `understudy campaign --forever STORE`, and its merge.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::Ordering;
use std::time::Instant;

use understudy_bus::interruption;
use understudy_campaigns::{Findings, InjectionPlan, Store, StoreError, inject};
use understudy_cluster::Cluster;

use super::{Arguments, kept, threads};
use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::run::simulate::seed_of_the_clock;

/// Runs seeds until there are none left, the budget is over, or Ctrl-C.
pub(super) fn run(
    arguments: &Arguments,
    cluster: &Cluster,
    folder: &Path,
    plan: &InjectionPlan,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let threads = threads(arguments);
    let interrupted = interruption()?;
    let start = Instant::now();
    let salt = seed_of_the_clock() ^ u64::from(process::id()) << 32;
    let mut store = Store::open(folder, cluster, plan, salt).map_err(failed)?;
    let one = |error| failed(vec![error]);
    let end = arguments.seeds.unwrap_or(u64::MAX);
    let is_over = || {
        let in_budget = arguments.budget.is_none_or(|budget| start.elapsed() < budget);
        !in_budget || interrupted.load(Ordering::Relaxed)
    };
    while !is_over()
        && let Some(seed) = store.next_seed(end).map_err(one)?
    {
        let in_time = || !interrupted.load(Ordering::Relaxed);
        let findings = inject(cluster, &store.plan(seed), threads, &in_time)
            .map_err(|error| one(StoreError::NotReady(error)))?;
        // Part of a seed is not kept.
        if findings.runs_made < findings.runs_asked {
            break;
        }
        let (failed, made) = (findings.runs_failed, findings.runs_made);
        console.note(&format!("seed {seed}: {failed} of {made} runs failed"));
        store.keep(findings).map_err(one)?;
    }
    let findings = Store::merged(&[store]).map_err(failed)?;
    kept(&findings, arguments.out.as_deref())
}

/// Merges the stores in these folders.
pub(super) fn merged(folders: &[PathBuf]) -> Result<Findings, Answer> {
    let mut stores = Vec::new();
    let mut errors = Vec::new();
    for folder in folders {
        match Store::read(folder, 0) {
            Ok(store) => stores.push(store),
            Err(error) => errors.push(error),
        }
    }
    let merged = Store::merged(&stores);
    match merged {
        Ok(findings) if errors.is_empty() => Ok(findings),
        merged => {
            errors.extend(merged.err().into_iter().flatten());
            Err(failed(errors))
        }
    }
}

fn failed(errors: Vec<StoreError>) -> Answer {
    errors.into_iter().fold(Answer::done("", ()), |answer, error| {
        let status = match error {
            StoreError::NotReady(_) | StoreError::Unwritable { .. } | StoreError::Busy(_) => {
                Status::Failed
            }
            _ => Status::BadInput,
        };
        answer.and_failure(status, error.code(), error)
    })
}
