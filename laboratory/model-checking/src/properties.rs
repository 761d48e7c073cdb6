//! What must hold in every state. Each is a file that names the rule; wrong outputs are what the simulator's referee says.

mod never_back;
mod nothing_wrong;
mod one_author;
mod one_station_costs_nothing;
mod only_held_or_safe;
mod protection_comes_back;

use crate::world::{Model, World};

pub(crate) use protection_comes_back::RECOVERY_CYCLES;

/// What a run must come to where a property holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Promise {
    /// Nothing wrong is driven.
    NothingWrong,
    /// And no cycle is held or fail-safe.
    NothingHeld,
    /// And everybody is synchronised at the end.
    Protected,
}

/// One property.
#[derive(Debug, Clone, Copy)]
pub struct Property {
    /// As a counterexample names it.
    pub name: &'static str,
    /// What it promises of a run.
    pub promise: Promise,
    pub(crate) holds: fn(&Model, &World) -> bool,
}

/// All of them.
pub const ALL: [Property; 6] = [
    nothing_wrong::PROPERTY,
    only_held_or_safe::PROPERTY,
    never_back::PROPERTY,
    one_author::PROPERTY,
    one_station_costs_nothing::PROPERTY,
    protection_comes_back::PROPERTY,
];
