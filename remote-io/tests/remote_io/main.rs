//! A remote I/O among the frames of its stations, without a network.

mod bench;
mod changed;
mod field;
mod forced_writes;
mod gone;
mod pair;
mod points;
mod restart;
mod switching;
