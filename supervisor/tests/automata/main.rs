//! Automata, their operations, and synthesis.

mod drawing;
mod explanations;
mod families;
mod figures;
mod models;
mod modular;
mod properties;
mod reading;
mod symbolic;
