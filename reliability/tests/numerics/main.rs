//! What is calculated, against high precision, against each other, and against the figures that follow from the models.

mod chains;
mod closed_forms;
mod support;
mod survival;
mod systems;
