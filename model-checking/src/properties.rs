//! What must hold in every state. Each is a file that names the rule; wrong outputs are what the simulator's referee says.

mod history_is_the_plants;
mod nothing_wrong;
mod one_station_costs_nothing;
mod only_held_or_safe;
mod protection_comes_back;

use crate::world::{Model, World};

/// One property.
#[derive(Debug, Clone, Copy)]
pub struct Property {
    /// As a counterexample names it.
    pub name: &'static str,
    pub(crate) holds: fn(&Model, &World) -> bool,
}

/// All of them.
pub const ALL: [Property; 5] = [
    nothing_wrong::PROPERTY,
    only_held_or_safe::PROPERTY,
    history_is_the_plants::PROPERTY,
    one_station_costs_nothing::PROPERTY,
    protection_comes_back::PROPERTY,
];
