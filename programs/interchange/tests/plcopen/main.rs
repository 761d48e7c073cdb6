//! PLCopen XML, from outside.

mod ablation;
mod bad_input;
mod instruction_lists;
mod jumps;
mod meaning;
mod public_ladders;
#[path = "../../../ladder/tests/ladder/random.rs"]
#[allow(dead_code, reason = "the generator of the ladder's own tests")]
mod random;
#[path = "../shared/reading.rs"]
mod reading;
mod round_trip;
mod schema;
mod support;
