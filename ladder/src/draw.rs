//! Drawings of a program: as text for a terminal and a listing, as SVG for a page.

mod svg;
mod text;

pub use svg::draw_svg;
pub use text::draw_text;
