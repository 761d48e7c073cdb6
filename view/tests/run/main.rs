//! Runs of the simulator, looked at from their journals alone.

mod diffs;
mod fold;
mod margin;
mod replay;
mod support;
mod why;
