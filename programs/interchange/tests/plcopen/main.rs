//! PLCopen XML, from outside.

mod ablation;
mod applications;
mod bad_input;
mod drawings;
mod execution;
mod instruction_lists;
mod jumps;
mod meaning;
mod modifiers;
mod networks;
mod numbers;
mod order;
mod public_ladders;
#[path = "../shared/reading.rs"]
mod reading;
mod round_trip;
mod rungs;
mod support;
