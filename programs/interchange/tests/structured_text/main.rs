//! Structured Text, from outside.

mod errors;
mod execution;
mod hostile;
mod lowering;
mod random;
mod restart;
mod round_trip;
mod support;
mod vectors;
