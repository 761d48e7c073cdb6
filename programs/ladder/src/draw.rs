//! Drawings of a program: as text for a terminal and a listing, as SVG for a page.

mod svg;
mod text;

pub use svg::{draw_svg, draw_svg_rungs};
pub use text::{draw_text, draw_text_rungs};
