//! Once all members are back and the network delivers, all are synchronised again: without help, or after the operator's choice where
//! the state of a program was lost.

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
        for fault in model.revivals(&world.failed, world.place) {
            simulation.schedule(fault);
        }
        let mut back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        if back.is_err() && !simulation.asking().is_empty() {
            simulation.let_operator_choose();
            back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        }
        back.is_ok() && simulation.violations().is_empty()
    },
};
