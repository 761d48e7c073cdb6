//! Programs with numbers in clusters of the simulator.

mod ramps;
mod tennessee_eastman;
