//! What is estimated from measurements and simulations: intervals against exact quantiles, and how often they hold the truth.

mod fits;
mod intervals;
mod outlooks;
mod simulations;
