//! Which failures a store keeps.

use std::collections::BTreeMap;

use super::super::findings::Failure;
use super::super::kind::Kind;

/// Sets of kinds of faults of which failures are kept, at most: those of the fewest kinds.
const MAXIMUM_SETS: usize = 500;

/// For each set of kinds of faults the failure with the fewest faults, and the one with the fewest cycles. The choice from the choices of two parts
/// is the choice from both, so it does not matter how seeds are put together.
pub(super) fn smallest_and_fastest(failures: Vec<Failure>) -> Vec<Failure> {
    let mut by_kinds: BTreeMap<(usize, Vec<Kind>), Vec<Failure>> = BTreeMap::new();
    for failure in failures {
        by_kinds.entry((failure.kinds.len(), failure.kinds.clone())).or_default().push(failure);
    }
    let chosen = by_kinds.into_values().take(MAXIMUM_SETS).flat_map(|mut same| {
        same.sort_by_key(|it| (it.faults as u64, it.cycles, it.campaign_seed, it.run));
        let smallest = same.first().cloned();
        same.sort_by_key(|it| (it.cycles, it.faults as u64, it.campaign_seed, it.run));
        let fastest = same.into_iter().next().filter(|it| Some(it) != smallest.as_ref());
        smallest.into_iter().chain(fastest)
    });
    chosen.collect()
}
