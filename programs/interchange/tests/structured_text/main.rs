//! Structured Text, from outside.

mod errors;
mod hostile;
mod lowering;
mod random;
mod round_trip;
mod support;
mod vectors;
