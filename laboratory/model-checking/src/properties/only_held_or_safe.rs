//! What is not true is the last true output, for at most the configured cycles, or the configured fail-safe.

use understudy_simulator::Violation;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "what is not true is held or fail-safe",
    promise: Promise::NothingWrong,
    holds: |_, world| {
        let neither = |violation: &Violation| {
            matches!(violation, Violation::WronglyHeld { .. } | Violation::NotTheFailSafe { .. })
        };
        !world.simulation.violations().iter().any(neither)
    },
};
