//! Runs of the simulator, looked at from their journals alone.

mod diffs;
mod directory;
mod fold;
mod hostile;
mod margin;
mod replay;
mod screen;
mod support;
mod why;
