//! A whole cluster in one process, in virtual time, with seeded faults.
//!
//! The very state machines of `node` and `remote-io` run here, beside the plants' models, over a network that loses,
//! duplicates, delays and reorders as its seed says. Equal parts, faults and seed give equal runs, bit for bit. A
//! [`Referee`] for each remote I/O recomputes what was true from the samples alone.

mod disk;
mod fault;
mod field;
mod input_reports;
mod links;
mod modules;
mod network;
mod pace;
mod parts;
mod queue;
mod referee;
mod shard;
mod signals;
mod simulation;
mod slot;
mod spares;
mod stranger;
mod tally;
mod wakeups;

pub use fault::{Action, ChangeStep, Fault};
pub use links::Metered;
pub use network::{Disturbance, Network};
pub use parts::{Parts, parts};
pub use referee::{Referee, Violation};
pub use shard::{NoShard, Shard, ShardError};
pub use simulation::{NotReady, Observe, Record, Simulation};
pub use spares::{SpareBeside, SpareOrder, SpareTimes};
pub use tally::Tally;
