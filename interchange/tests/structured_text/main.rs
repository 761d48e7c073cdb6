//! Structured Text, from outside.

mod errors;
mod lowering;
mod round_trip;
mod support;
mod vectors;
