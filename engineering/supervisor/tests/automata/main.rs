//! Automata, their operations, and synthesis.

mod abstractions;
mod drawing;
mod explanations;
mod families;
mod figures;
mod foreign;
#[path = "../reference_models/mod.rs"]
mod models;
mod modular;
mod properties;
mod reading;
mod reduction;
mod symbolic;
