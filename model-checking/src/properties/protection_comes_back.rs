//! Once everybody is back and the network delivers, everybody is in step again without help.

use understudy_simulator::{Action, Fault};

use super::Property;

/// Within so many cycles.
const RECOVERY_CYCLES: u64 = 100;

pub(super) const PROPERTY: Property = Property {
    name: "protection comes back",
    holds: |model, world| {
        if !world.is_over(&model.budget) {
            return true;
        }
        let mut simulation = world.simulation.clone();
        for &(party, crashed) in &world.down {
            simulation.schedule(Fault {
                at_cycle: world.place.cycle,
                phase: world.place.phase(),
                party,
                action: if crashed {
                    Action::Restart
                } else {
                    Action::Continue
                },
            });
        }
        let back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        back.is_ok() && simulation.violations().is_empty()
    },
};
