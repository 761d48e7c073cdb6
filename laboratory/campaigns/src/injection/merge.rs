//! The shards of a campaign as one.

use std::collections::BTreeMap;

use super::MAXIMUM_FAILURES;
use super::coverage::Coverage;
use super::findings::Findings;
use super::shard::Shard;

/// Findings that do not belong together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Nothing to merge.
    #[error("there is nothing to merge")]
    Nothing,
    /// Parts of different campaigns.
    #[error("{name} is of another campaign than {first}: {what} differs")]
    Other {
        /// The first one.
        first: String,
        /// The one that differs from it.
        name: String,
        /// What differs.
        what: &'static str,
    },
    /// One shard twice.
    #[error("{name} and {other} are both shard {shard}")]
    Twice {
        /// Which shard.
        shard: Shard,
        /// The one.
        name: String,
        /// The other.
        other: String,
    },
    /// Shards that nobody gave.
    #[error("{} of {of} shards are missing: {}", missing.len(), list(missing))]
    Missing {
        /// Their numbers.
        missing: Vec<u64>,
        /// How many there are in all.
        of: u64,
    },
}

/// The first few of many.
fn list(numbers: &[u64]) -> String {
    let shown: Vec<String> = numbers.iter().take(20).map(u64::to_string).collect();
    let more = if numbers.len() > shown.len() { ", ..." } else { "" };
    shown.join(", ") + more
}

/// Makes one of all shards, each with a name for messages. All errors are found in one go.
///
/// # Errors
/// [`MergeError`]s where they are not all shards of one campaign, each once.
pub fn merge(shards: Vec<(String, Findings)>) -> Result<Findings, Vec<MergeError>> {
    let Some((first_name, first)) = shards.first().cloned() else {
        return Err(vec![MergeError::Nothing]);
    };
    let of = first.plan.shard.of();
    let mut errors = Vec::new();
    let mut by_number: BTreeMap<u64, &str> = BTreeMap::new();
    for (name, findings) in &shards {
        if let Some(what) = difference(&first, findings) {
            errors.push(MergeError::Other { first: first_name.clone(), name: name.clone(), what });
            continue;
        }
        let shard = findings.plan.shard;
        if let Some(other) = by_number.insert(shard.number(), name) {
            errors.push(MergeError::Twice { shard, name: other.to_owned(), other: name.clone() });
        }
    }
    let missing: Vec<u64> = (1..=of).filter(|number| !by_number.contains_key(number)).collect();
    if !missing.is_empty() {
        errors.push(MergeError::Missing { missing, of });
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let mut coverage = Coverage::of(&first.plan.kinds);
    let mut whole = Findings {
        runs_asked: 0,
        runs_made: 0,
        runs_failed: 0,
        deadlines: Default::default(),
        failures: Vec::new(),
        ..first
    };
    whole.plan.shard = Shard::WHOLE;
    for (_, findings) in shards {
        whole.runs_asked += findings.runs_asked;
        whole.runs_made += findings.runs_made;
        whole.runs_failed += findings.runs_failed;
        whole.deadlines.add(&findings.deadlines);
        coverage.add(&findings.coverage);
        whole.failures.extend(findings.failures);
    }
    whole.coverage = coverage.into_rows();
    whole.failures.sort_by_key(|failure| failure.run);
    whole.failures.truncate(MAXIMUM_FAILURES);
    Ok(whole)
}

/// What makes two findings parts of different campaigns.
fn difference(first: &Findings, other: &Findings) -> Option<&'static str> {
    let (one, two) = (&first.plan, &other.plan);
    let same = [
        ("the cluster", first.cluster == other.cluster),
        ("the configuration", first.configuration == other.configuration),
        ("the number of runs", one.runs == two.runs),
        ("the seed", one.seed == two.seed),
        ("the cycles of a run", one.cycles == two.cycles),
        ("the property", one.property == two.property),
        ("the kinds of faults", one.kinds == two.kinds),
        ("the number of shards", one.shard.of() == two.shard.of()),
    ];
    same.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}
