//! Runs of the simulator, looked at from their journals alone.

#![allow(
    clippy::disallowed_methods,
    reason = "the age of what is shown is counted on the real clock"
)]

mod causes;
mod changed;
mod complete;
mod diffs;
mod directory;
mod drawings;
mod fold;
mod forced;
mod hostile;
mod input_modules;
mod losses;
mod margin;
mod networks;
mod numbers;
mod overview;
mod past;
mod points;
mod process_alarms;
mod protection;
mod renamed;
mod replay;
mod screen;
mod state_signals;
mod support;
mod times;
mod twins;
mod why;
mod writes;
