//! Invariants *The plant decides history* and *Never back*: a program continues only from a state that its own samples led to, never
//! from one before the newest applied output, and starts cold, or asks the operator, only where no living
//! station has its state.

use understudy_simulator::Violation;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "a program never continues behind an applied output",
    promise: Promise::NothingWrong,
    holds: |_, world| {
        let back = |violation: &Violation| {
            matches!(
                violation,
                Violation::UnknownHistory { .. }
                    | Violation::WentBack { .. }
                    | Violation::NeedlessColdStart { .. }
                    | Violation::NeedlessQuestion { .. }
            )
        };
        !world.simulation.violations().iter().any(back)
    },
};
