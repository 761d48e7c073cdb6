//! Function block diagrams and sequential function charts: where their parts are, and pictures of them.
//!
//! [`blocks::Network`] and [`chart::Chart`] say what is drawn, [`blocks::lay_out`] and [`chart::lay_out`] where it is. Files of other
//! tools take the places from there, and [`Picture`] paints them as SVG. No two parts overlap, and no wire crosses a block, a variable,
//! a step, an action or a condition.

pub mod blocks;
pub mod chart;
mod picture;

pub use picture::Picture;

/// A corner or a bend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Point {
    /// From the left edge.
    pub x: i64,
    /// From the upper edge.
    pub y: i64,
}

/// The place of a part.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Place {
    /// The left edge.
    pub x: i64,
    /// The upper edge.
    pub y: i64,
    /// From the left edge to the right one.
    pub width: i64,
    /// From the upper edge to the lower one.
    pub height: i64,
}

impl Place {
    /// The right edge.
    pub fn right(&self) -> i64 {
        self.x + self.width
    }

    /// The lower edge.
    pub fn bottom(&self) -> i64 {
        self.y + self.height
    }

    /// The middle between the left edge and the right one.
    pub fn middle(&self) -> i64 {
        self.x + self.width / 2
    }

    /// Whether the two have an area in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }
}

/// Width of a character of a name.
pub(crate) const CHARACTER: i64 = 8;

/// Width of a text.
pub(crate) fn width(text: &str) -> i64 {
    i64::try_from(text.chars().count()).unwrap_or(i64::MAX / 64) * CHARACTER
}
