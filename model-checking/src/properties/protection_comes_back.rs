//! Once all members are back and the network delivers, all are synchronised again: without help, or after the operator's choice where
//! the state of a program was lost.

use understudy_simulator::{Action, Fault};
use understudy_wire::{Party, StateChoice};

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
        let mut back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        let asking = simulation.asking();
        if back.is_err() && !asking.is_empty() {
            // A cold start where no state is left; refused otherwise.
            let choices = [StateChoice::Newest { cycle: None }, StateChoice::Cold];
            for (program, choice) in asking.iter().flat_map(|it| choices.map(|one| (it, one))) {
                simulation.schedule(Fault {
                    at_cycle: 0,
                    phase: 0.0,
                    party: Party::RemoteIo(program),
                    action: Action::Choose { choice },
                });
            }
            back = simulation.run(1, RECOVERY_CYCLES, &mut |_, _, _, _| {});
        }
        back.is_ok() && simulation.violations().is_empty()
    },
};
