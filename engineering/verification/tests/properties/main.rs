//! Properties of circuits: against a checker that lists every state, and on ladders.

mod ladders;
mod naive;
mod random;
mod reading;
mod remarks;
mod replay;
mod smv;
mod timers;
mod warm_starts;
