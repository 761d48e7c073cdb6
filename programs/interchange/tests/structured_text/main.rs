//! Structured Text, from outside.

mod errors;
mod hostile;
mod lowering;
mod random;
/// The ladder crate's own random programs.
#[path = "../../../ladder/tests/ladder/random.rs"]
#[allow(dead_code, reason = "its own tests use the rest")]
mod random_ladder;
mod round_trip;
mod support;
mod vectors;
