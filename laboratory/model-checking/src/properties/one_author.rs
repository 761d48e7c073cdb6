//! Invariant *One author*: the two remote I/Os of a program never drive its outputs at one time; where both are wired to the plant, the modules of the other
//! one drive what the author has driven lately, and of a number that both drive no more than its value.

use understudy_simulator::Violation;

use super::{Promise, Property};

pub(super) const PROPERTY: Property = Property {
    name: "one remote I/O at a time drives the outputs of a program",
    promise: Promise::NothingWrong,
    holds: |_, world| {
        let two = |violation: &Violation| {
            matches!(
                violation,
                Violation::TwoWriters { .. }
                    | Violation::NotFollowed { .. }
                    | Violation::TooMuch { .. }
            )
        };
        !world.simulation.violations().iter().any(two)
    },
};
