//! TCT's operations, under TCT's names and with its meanings.
//!
//! | operation | what it makes |
//! |---|---|
//! | `Automaton::new` | `create` |
//! | [`selfloop`] | events that pass an automaton by |
//! | [`sync`], [`meet`] | products: private events pass the others by, or are forbidden |
//! | [`trim`] | what is reachable and from where a marked state can be reached |
//! | [`supcon`] | the supremal controllable, nonblocking sublanguage |
//! | [`condat`] | which controllable events a supervisor disables where |
//! | [`supreduce`] | a smaller supervisor with the same effect |
//! | [`fewest_states`] | a number of states that no such supervisor has fewer than |
//! | [`compare_effects`] | where two supervisors have different effects on a plant |
//! | [`minstate`] | the fewest states with the same languages |
//! | [`observer`] | where an automaton may be after what was seen |
//! | [`abstraction`] | what a projection keeps: observer property, control consistency |
//! | [`isomorph`] | whether two automata are one but for the numbers |
//! | [`allevents`], [`mutex`], [`nonconflict`], [`project`] | as their names say |
//!
//! Two traps of TCT are kept, for they are its meanings: `supcon` takes the *meet* with the specification, so an event that the
//! specification does not know is forbidden (lift it with [`allevents`] and [`sync`], or use
//! [`synthesise`](crate::synthesise), which does); and an alphabet holds also the events that only unreachable states have.
//! EMPTY is a legal argument and a legal result everywhere.

mod abstraction;
mod basic;
mod condat;
mod effect;
mod isomorph;
mod minstate;
mod nonconflict;
mod products;
mod project;
mod supcon;
mod supreduce;

pub use abstraction::{Abstraction, Uncontrolled, Unobserved, abstraction};
pub use basic::{AlreadyKnown, allevents, reachable, selfloop, trim};
pub use condat::{ControlData, UncontrollablyDisabled, condat};
pub use effect::{OtherEffect, compare_effects};
pub use isomorph::{Difference, isomorph};
pub use minstate::minstate;
pub use nonconflict::{Conflict, nonconflict};
pub use products::{meet, mutex, sync};
pub use project::{observer, project};
pub(crate) use supcon::explicit_supcon;
pub use supcon::{Explanation, Supcon, Violation, lift, supcon};
pub use supreduce::{Reducing, Reduction, fewest_states, supreduce, supreduce_while};
