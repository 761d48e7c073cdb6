//! Automata, their operations, and synthesis.

mod drawing;
mod explanations;
mod families;
mod figures;
#[path = "../reference_models/mod.rs"]
mod models;
mod modular;
mod properties;
mod reading;
mod reduction;
mod symbolic;
