//! Structured Text, from outside.

mod errors;
mod execution;
mod hostile;
mod lowering;
mod random;
mod round_trip;
mod support;
mod vectors;
