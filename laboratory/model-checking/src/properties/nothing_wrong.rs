//! Invariant *No guess*, the paper's Theorem 2 without its perfect failure flag: what is driven as true is h(x(t), u(t)) of the
//! reference run.

use understudy_simulator::Violation;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "nothing wrong is driven",
    promise: Promise::NothingWrong,
    holds: |_, world| {
        let wrong = |violation: &Violation| matches!(violation, Violation::Wrong { .. });
        !world.simulation.violations().iter().any(wrong)
    },
};
