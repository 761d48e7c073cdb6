//! Theorem 1 in time: with one station down at a time, whenever it goes and comes, and a network that delivers, no cycle is held; not
//! even where one link was broken until then.

use understudy_simulator::Tally;
use understudy_wire::Member;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "one lost station costs no cycle",
    promise: Promise::NothingHeld,
    holds: |model, world| {
        let used = &world.used;
        let quiet = used.losses + used.delays + used.duplicates + used.cuts == 0;
        let one_station = matches!(world.was_down.as_slice(), [] | [Member::Station(_)]);
        let untrue = |tally: &Tally| tally.held + tally.fail_safe > 0;
        let links = model.start.broken.len() <= 1;
        !(quiet && links && one_station && world.simulation.tallies().iter().any(untrue))
    },
};
