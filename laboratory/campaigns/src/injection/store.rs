//! A campaign without an end, in a folder that any number of processes and machines share.
//!
//! ```text
//! STORE/store.json          what every seed is run with, and by which program
//! STORE/seeds-207-207.json  findings of all runs of one seed
//! STORE/seeds-100-199.json  findings of a hundred seeds: their files are removed
//! ```
//!
//! There is no scheduler, no lock and no clock: a process runs a seed that is drawn from the lowest ones without findings, and writes the findings as
//! one file. Invariant: the content of a file is a function of its name and of `store.json`. So it does not matter which process writes
//! it, or whether two do; a process that is killed loses the seed that it was running; and stores of equal `store.json` are merged by copying
//! their files into one folder.

mod error;
mod files;
mod kept;

use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use understudy_cluster::Cluster;
use understudy_simulator::Shard;

pub use error::StoreError;

use super::draw::Target;
use super::findings::{Deadlines, Findings};
use super::seeds::Seeds;
use super::{InjectionPlan, MINIMUM_RUN_CYCLES, inject};
use files::{
    STORE_FILE, entries, is_occupied, part_name, parts, read_part, remove_part, replace, text,
};
use kept::smallest_and_fastest;

/// Version of the files of a store.
const FORMAT: u32 = 1;

/// Files that become one.
const BLOCK: u64 = 100;

/// Seeds among which the next one is drawn: processes that draw at one time seldom draw the same.
const CANDIDATES: usize = 1000;

/// Attempts to read all files of a store while other processes replace some of them.
const ATTEMPTS: usize = 100;

/// Runs whose deadlines show that two programs behave equally.
const PROBED_RUNS: u64 = 20;

/// Cycles of a seed, times members: about a minute on one processor.
const MEMBER_CYCLES_OF_A_SEED: u64 = 12_000_000;

/// What every seed of a store is run with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Header {
    format: u32,
    /// Version of the program.
    version: String,
    /// Without any run.
    campaign: Findings,
    /// Outputs in the first runs of the campaign: a program that behaves otherwise counts others.
    behaviour: Deadlines,
}

/// A folder with the findings of seeds.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    header: Header,
    random: Pcg64Mcg,
}

impl Store {
    /// The store in a folder, for runs of `cluster` by `plan`; made if the folder has none. Seed and shard of the plan do not count. `salt` differs
    /// between processes, so that they seldom run the same seed.
    ///
    /// # Errors
    /// Everything in which the store differs from the plan, the cluster or this program; [`StoreError`] if it cannot be read or written, or if
    /// the cluster does not synchronise.
    pub fn open(
        folder: &Path,
        cluster: &Cluster,
        plan: &InjectionPlan,
        salt: u64,
    ) -> Result<Self, Vec<StoreError>> {
        let expected = Header::new(cluster, plan).map_err(|error| vec![error])?;
        let path = folder.join(STORE_FILE);
        if !path.exists() {
            let made = match is_occupied(folder) {
                Ok(true) => Err(StoreError::Occupied(folder.to_owned())),
                Ok(false) => replace(folder, STORE_FILE, &json(&expected)),
                Err(error) => Err(error),
            };
            made.map_err(|error| vec![error])?;
        }
        let store = Self::read(folder, salt).map_err(|error| vec![error])?;
        let errors = store.header.differences(folder, &expected);
        if errors.is_empty() { Ok(store) } else { Err(errors) }
    }

    /// The store in a folder, to be read.
    ///
    /// # Errors
    /// [`StoreError`] if the folder is not a store of this version.
    pub fn read(folder: &Path, salt: u64) -> Result<Self, StoreError> {
        let path = folder.join(STORE_FILE);
        let text = text(&path)?;
        let damaged = |reason: String| StoreError::Damaged { path: path.clone(), reason };
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        match value["format"].as_u64() {
            Some(format) if format == u64::from(FORMAT) => {}
            Some(format) => {
                return Err(StoreError::Other {
                    store: folder.to_owned(),
                    what: "the format",
                    found: format.to_string(),
                    expected: FORMAT.to_string(),
                });
            }
            None => return Err(damaged("it has no format".to_owned())),
        }
        let header = serde_json::from_value(value).map_err(|error| damaged(error.to_string()))?;
        Ok(Self { folder: folder.to_owned(), header, random: Pcg64Mcg::seed_from_u64(salt) })
    }

    /// Whether a folder is a store.
    pub fn is_in(folder: &Path) -> bool {
        folder.join(STORE_FILE).exists()
    }

    /// Runs of one seed that take about a minute on one processor; a function of the cluster and the cycles of a run alone, so that stores
    /// which are made on different machines can be merged.
    pub fn usual_runs(cluster: &Cluster, cycles: u64) -> u64 {
        let runs =
            MEMBER_CYCLES_OF_A_SEED / (cycles.max(1) * cluster.members().count().max(1) as u64);
        let magnitude = 10_u64.pow(runs.max(1).ilog10());
        // One digit is enough.
        runs.max(1) / magnitude * magnitude
    }

    /// The plan of a seed.
    pub fn plan(&self, seed: u64) -> InjectionPlan {
        InjectionPlan { seed, ..self.header.campaign.plan.clone() }
    }

    /// A seed without findings, below `end`, drawn from the lowest ones; nothing if all have findings.
    ///
    /// # Errors
    /// [`StoreError`] if the folder cannot be read.
    pub fn next_seed(&mut self, end: u64) -> Result<Option<u64>, StoreError> {
        let mut done = Seeds::default();
        entries(&self.folder)?.iter().for_each(|part| done.add(part));
        let candidates: Vec<u64> =
            done.absent().take_while(|seed| *seed < end).take(CANDIDATES).collect();
        let place = self.random.random_range(0..candidates.len().max(1));
        Ok(candidates.get(place).copied())
    }

    /// Keeps the findings of all runs of a seed.
    ///
    /// # Errors
    /// [`StoreError`] if they cannot be written.
    pub fn keep(&self, mut findings: Findings) -> Result<(), StoreError> {
        findings.failures = smallest_and_fastest(findings.failures);
        findings.plan.seed = 0;
        let Some(seed) = findings.seeds.first() else {
            return Ok(());
        };
        replace(&self.folder, &part_name(&findings.seeds), &json(&findings))?;
        let mut size = 1_u64;
        while self.join_block(seed, size)? {
            size = size.saturating_mul(BLOCK);
        }
        Ok(())
    }

    /// Makes one file of those of `size` seeds in the block around `seed`, if all are there.
    fn join_block(&self, seed: u64, size: u64) -> Result<bool, StoreError> {
        let Some(whole) = size.checked_mul(BLOCK) else {
            return Ok(false);
        };
        let first = seed - seed % whole;
        let block = Seeds::range(first, first + (whole - 1));
        let listed = entries(&self.folder)?;
        let own: Vec<&Seeds> =
            listed.iter().filter(|part| part.count() == size && block.has_all(part)).collect();
        if own.len() as u64 != BLOCK {
            return Ok(false);
        }
        let mut joined = self.header.campaign.clone();
        for part in &own {
            match self.part(part)? {
                Some(findings) => joined.add(findings),
                // Another process has joined the block.
                None => return Ok(false),
            }
        }
        joined.failures = smallest_and_fastest(joined.failures);
        replace(&self.folder, &part_name(&block), &json(&joined))?;
        own.iter().try_for_each(|part| remove_part(&self.folder, part))?;
        Ok(true)
    }

    /// The findings in one file, if it is there.
    fn part(&self, seeds: &Seeds) -> Result<Option<Findings>, StoreError> {
        let Some(findings) = read_part(&self.folder, seeds)? else {
            return Ok(None);
        };
        let damaged = |reason: &str| StoreError::Damaged {
            path: self.folder.join(part_name(seeds)),
            reason: reason.to_owned(),
        };
        if findings.emptied() != self.header.campaign {
            return Err(damaged("it is of another campaign than its store"));
        }
        let runs = self.header.campaign.plan.runs.saturating_mul(seeds.count());
        if findings.seeds != *seeds || findings.runs_made != runs || findings.runs_asked != runs {
            return Err(damaged("it does not have all runs of its seeds"));
        }
        Ok(Some(findings))
    }

    /// All files that count, each with its seeds: those of a block count as its file.
    fn all_parts(&self) -> Result<Vec<(Seeds, Findings)>, StoreError> {
        let mut attempt = 0;
        'again: loop {
            let mut found = Vec::new();
            for seeds in parts(&self.folder)? {
                match self.part(&seeds)? {
                    Some(findings) => found.push((seeds, findings)),
                    None if attempt < ATTEMPTS => {
                        attempt += 1;
                        continue 'again;
                    }
                    None => return Err(StoreError::Busy(self.folder.clone())),
                }
            }
            return Ok(found);
        }
    }

    /// The findings of all seeds of several stores of one campaign. Equal files count once.
    ///
    /// # Errors
    /// All differences between the stores; [`StoreError`] if a file cannot be read, and if two stores have different findings of one seed.
    pub fn merged(stores: &[Self]) -> Result<Findings, Vec<StoreError>> {
        let Some(first) = stores.first() else {
            return Err(Vec::new());
        };
        let mut errors = Vec::new();
        let mut all: Vec<(Seeds, Findings, &Path)> = Vec::new();
        for store in stores {
            errors.extend(store.header.differences(&store.folder, &first.header));
            match store.all_parts() {
                Ok(parts) => {
                    let named = parts.into_iter();
                    all.extend(named.map(|(seeds, part)| (seeds, part, store.folder.as_path())));
                }
                Err(error) => errors.push(error),
            }
        }
        // Blocks come before their parts, equal parts after each other.
        all.sort_by_key(|(seeds, ..)| (std::cmp::Reverse(seeds.count()), seeds.first()));
        let mut merged = first.header.campaign.clone();
        let mut last: Option<(Seeds, Findings, &Path)> = None;
        for (seeds, findings, folder) in all {
            if let Some((_, one, other)) = last.as_ref().filter(|(other, ..)| *other == seeds) {
                if *one != findings {
                    let (one, two) = ((*other).to_owned(), folder.to_owned());
                    errors.push(StoreError::Differ { seeds, one, two });
                }
                continue;
            }
            if merged.seeds.has_all(&seeds) {
                continue;
            }
            merged.add(findings.clone());
            last = Some((seeds, findings, folder));
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        merged.failures = smallest_and_fastest(merged.failures);
        Ok(merged)
    }
}

impl Header {
    fn new(cluster: &Cluster, plan: &InjectionPlan) -> Result<Self, StoreError> {
        let kinds = Target::of(cluster).kinds(&plan.kinds);
        let plan = InjectionPlan { seed: 0, shard: Shard::WHOLE, kinds, ..plan.clone() };
        let probe = InjectionPlan { runs: PROBED_RUNS, cycles: MINIMUM_RUN_CYCLES, ..plan.clone() };
        let probed = inject(cluster, &probe, 1, &|| true)?;
        Ok(Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            behaviour: probed.deadlines,
            campaign: Findings { plan, ..probed }.emptied(),
        })
    }

    /// Everything in which the header of `store` is not the expected one.
    fn differences(&self, store: &Path, expected: &Self) -> Vec<StoreError> {
        let (one, two) = (&self.campaign, &expected.campaign);
        let spares = |findings: &Findings| {
            findings.plan.spare_after.map_or("never".to_owned(), |cycles| cycles.to_string())
        };
        let kinds = |findings: &Findings| {
            let words: Vec<&str> = findings.plan.kinds.iter().map(|kind| kind.word()).collect();
            words.join(",")
        };
        let compared = [
            ("the version", self.version.clone(), expected.version.clone()),
            ("the cluster", one.cluster.clone(), two.cluster.clone()),
            ("the configuration", one.configuration.clone(), two.configuration.clone()),
            ("the mode", one.mode.clone(), two.mode.clone()),
            ("--runs", one.plan.runs.to_string(), two.plan.runs.to_string()),
            ("--cycles", one.plan.cycles.to_string(), two.plan.cycles.to_string()),
            (
                "--property",
                one.plan.property.word().to_owned(),
                two.plan.property.word().to_owned(),
            ),
            ("--faults", kinds(one), kinds(two)),
            ("--spare-after", spares(one), spares(two)),
        ];
        let differing = compared.into_iter().filter(|(_, found, expected)| found != expected);
        let mut errors: Vec<StoreError> = differing
            .map(|(what, found, expected)| StoreError::Other {
                store: store.to_owned(),
                what,
                found,
                expected,
            })
            .collect();
        if errors.is_empty() && self.behaviour != expected.behaviour {
            errors.push(StoreError::Behaviour(store.to_owned()));
        }
        errors
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).unwrap_or_default() + "\n"
}

#[cfg(test)]
mod tests;
