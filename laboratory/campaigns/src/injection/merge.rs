//! The shards of a campaign as one.

use understudy_simulator::{Shard, ShardError};

use super::MAXIMUM_FAILURES;
use super::findings::Findings;

/// Makes one of all shards, each with a name for messages. All errors are found in one go.
///
/// # Errors
/// [`ShardError`]s where they are not all shards of one campaign, each once.
pub fn merge(shards: Vec<(String, Findings)>) -> Result<Findings, Vec<ShardError>> {
    let errors = Shard::obstacles(&shards, |findings| findings.plan.shard, difference);
    let Some((_, first)) = shards.first().filter(|_| errors.is_empty()) else {
        return Err(errors);
    };
    let mut whole = first.emptied();
    whole.plan.shard = Shard::WHOLE;
    shards.into_iter().for_each(|(_, findings)| whole.add(findings));
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
        ("the seed", one.seed == two.seed && first.seeds == other.seeds),
        ("the cycles of a run", one.cycles == two.cycles),
        ("the property", one.property == two.property),
        ("the kinds of faults", one.kinds == two.kinds),
        ("the time after which spares wake", one.spare_after == two.spare_after),
    ];
    same.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}
