//! Every schedule of a few faults over a few cycles, for the very state machines of stations and remote I/Os.
//!
//! A state is a whole [`understudy_simulator::Simulation`] between two slots of the schedule; a step waits for the next slot, or does one thing to a
//! link or to a member first. So time is discrete, nothing is drawn, and all schedules within a [`Budget`] are tried, those that
//! lead to one state only once. A run begins synchronised, or with members that have just restarted or stood still ([`Start`]). Each property stands in a file of its own under `properties/`; what is wrong is said by the
//! simulator's referee. The faults that lead to a broken property are a schedule that the simulator replays.
//!
//! ```text
//! 0.025    0.075     0.125     0.175     0.225                0.675   0.725       0.975    T
//! ├ samples ┼ turn 1 ┼ turn 2 ┼ understudy ┼ late turns, deadline ┼ joins ┼ transfers ┼ Sync ┤
//! ```
//!
//! The network takes T/20 for a frame, so that what answers to what is a slot of its own.

mod checker;
mod properties;
mod start;
mod step;
mod world;

pub use checker::{Counterexample, Verdict, check};
pub use properties::{ALL, Promise, Property};
pub use start::{Changed, Start};
pub use step::{Budget, Step};
/// A part of all runs, and what keeps parts from being all of them.
pub use understudy_simulator::{Shard, ShardError};
pub use world::{Model, World};
