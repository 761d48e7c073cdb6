//! A ladder as the paper's digraphs, and as its XML (Ngalamou and Myers, *An Exploratory Method for Effective Deployment of PLCs*, section 3.1
//! and appendix 1).
//!
//! Each rung is one directed graph: every element is an edge, every connection between elements is a vertex, and power flows from
//! vertex 0, the left rail, along the edges whose elements pass it.
//!
//! ```text
//!      V1        V2        V3      (NO VENT)
//!  0 ──/──▶ 24 ──/──▶ 25 ──/──▶ 26 ────▶ 27
//! ```
//!
//! The paper's XML has normally open and normally closed contacts and outputs. The other elements of a ladder have edges of further
//! types here, and what the paper leaves out (declarations, titles, comments) is in elements and attributes that its readers
//! pass over; `docs/reference/digraph-xml.md` lists all of it. Any acyclic digraph is read: one that is series and parallel becomes one network,
//! and in any other each vertex becomes a memory bit.

mod draw;
mod graph;
mod infer;
mod network;
mod read;
mod write;

use understudy_ladder::Program;
use understudy_text::Diagnostic;

pub use self::draw::draw_svg;
pub use self::graph::{Digraph, Edge, Label, Vertex, digraphs};
pub use self::write::write;

/// What was read.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The program, where there are no errors.
    pub program: Option<Program>,
    /// Everything that was found, in the order of its place.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads the XML. Nothing is lost in silence: what is not understood is an error or a warning, with its place.
pub fn read(text: &str) -> Reading {
    read::read(text)
}
