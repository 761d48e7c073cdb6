//! What else could be bought, beside the cluster: hot-standby pairs by heartbeat and active-active pairs, one pair for each program.
//!
//! All of them run in the simulator's network in virtual time, with the same programs, plants, schedule, copies of frames, loss and
//! latency, and their boxes are state machines of the same shape ([`understudy_cycle::Machine`]). Invariant: a comparison is a
//! function of the cluster, the plan and its seed.

mod compare;
mod figure;
mod module;
mod pairs;
mod partner;

pub use compare::{
    CompareError, Comparison, ComparisonPlan, Contender, LOSSES, LostShare, RealRun, compare,
};
pub use figure::{FigureError, figure};
pub use partner::Redundancy;
