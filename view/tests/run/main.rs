//! Runs of the simulator, looked at from their journals alone.

mod diffs;
mod directory;
mod fold;
mod hostile;
mod margin;
mod protection;
mod replay;
mod screen;
mod support;
mod why;
