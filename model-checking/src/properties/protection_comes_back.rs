//! Once everybody is back and the network delivers, everybody is in step again without help.

use crate::step::revivals;

use super::{Promise, Property};

/// Within so many cycles.
pub(crate) const RECOVERY_CYCLES: u64 = 100;

pub(super) const PROPERTY: Property = Property {
    name: "protection comes back",
    promise: Promise::Protected,
    holds: |model, world| {
        if world.place.cycle < model.last_cycle() {
            return true;
        }
        let mut simulation = world.simulation.clone();
        for fault in revivals(&world.down, world.place) {
            simulation.schedule(fault);
        }
        let back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        back.is_ok() && simulation.violations().is_empty()
    },
};
