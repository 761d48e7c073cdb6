//! Bodies as pictures: straight-line statements as networks of function blocks, charts as sequential function charts.

mod chart;
mod network;
mod picture;

pub(crate) use chart::chart;
pub(crate) use network::{Style, Widths, networks};
pub use picture::{DrawnBody, DrawnUnit, draw_typed, drawn_units, listing};
