//! What is calculated, against high precision, against each other, and against the figures that follow from the models; what is
//! estimated from measurements and simulations, against exact quantiles, and how often intervals contain the truth.

mod cells;
mod chains;
mod enumerated;
mod fits;
mod intervals;
mod outlooks;
mod simulations;
mod support;
mod survival;
mod systems;
