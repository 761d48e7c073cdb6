//! Invariant *The plant decides history*: a program goes on only from a state that its own samples led to.

use understudy_simulator::Violation;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "a program goes on from what its plant has seen",
    promise: Promise::NothingWrong,
    holds: |_, world| {
        let unknown = |violation: &Violation| matches!(violation, Violation::UnknownHistory { .. });
        !world.simulation.violations().iter().any(unknown)
    },
};
