//! Where the parts of a rung stand, in cells of one character; both drawings paint it.
//!
//! A [`Piece`] enters at cell 0 of its wire row and leaves into the cell behind its last one, so that pieces join by standing
//! side by side. Row 0 is the wire; rows above it are negative. Wires run from cell centre to cell centre.
//!
//! Where a scan is drawn too, wires with power are `live`, and names have their values behind them.

mod block;

use std::ops::RangeInclusive;

use self::block::block_piece;
use crate::flow::{ElementFlow, Evaluation, Flows, Reading, RungFlow};
use crate::program::{Coil, CoilKind, ContactKind, Element, Program, Rung, Series};

/// Something to paint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A wire along a row, from `left` to `right`.
    Wire { left: i32, right: i32, row: i32, live: bool },
    /// A wire along a column, from `top` to `bottom`.
    Riser { column: i32, top: i32, bottom: i32, live: bool },
    /// A power rail along a column; reaches half a cell past both ends.
    Rail { column: i32, top: i32, bottom: i32 },
    /// A contact with its sign between two bars; `left` and `right` are the cells of the bars. `closed` where it passes power.
    Contact { left: i32, right: i32, row: i32, sign: String, closed: bool },
    /// A coil with its sign between two arcs; three cells from `left`. `on` where its target is 1.
    Coil { left: i32, row: i32, sign: &'static str, on: bool },
    /// The outline of a block, its corners in cells.
    Outline { left: i32, right: i32, top: i32, bottom: i32 },
    /// A text from `column` on; `signal` where it is the name of something to be looked up.
    Label {
        column: i32,
        row: i32,
        text: String,
        /// Its value such as `=1`, right behind the text; empty where no scan is drawn.
        value: String,
        signal: bool,
    },
}

impl Shape {
    fn moved(mut self, columns: i32, rows: i32) -> Self {
        match &mut self {
            Self::Wire { left, right, row, .. } | Self::Contact { left, right, row, .. } => {
                *left += columns;
                *right += columns;
                *row += rows;
            }
            Self::Riser { column, top, bottom, .. } | Self::Rail { column, top, bottom } => {
                *column += columns;
                *top += rows;
                *bottom += rows;
            }
            Self::Coil { left, row, .. } => {
                *left += columns;
                *row += rows;
            }
            Self::Outline { left, right, top, bottom } => {
                *left += columns;
                *right += columns;
                *top += rows;
                *bottom += rows;
            }
            Self::Label { column, row, .. } => {
                *column += columns;
                *row += rows;
            }
        }
        self
    }
}

/// A part of a rung with its extent around its wire.
#[derive(Debug, Clone, Default)]
pub(crate) struct Piece {
    pub(crate) width: i32,
    /// Rows above the wire.
    pub(crate) above: i32,
    /// Rows below the wire.
    pub(crate) below: i32,
    pub(crate) shapes: Vec<Shape>,
}

impl Piece {
    fn place(&mut self, other: Self, column: i32, row: i32) {
        let shapes = other.shapes.into_iter();
        self.shapes.extend(shapes.map(|shape| shape.moved(column, row)));
        self.above = self.above.max(other.above - row);
        self.below = self.below.max(other.below + row);
    }
}

fn length(text: &str) -> i32 {
    i32::try_from(text.chars().count()).unwrap_or(i32::MAX / 4)
}

fn wire(left: i32, right: i32, row: i32, live: bool) -> Shape {
    Shape::Wire { left, right, row, live }
}

/// `=1`
fn value_of(bit: bool) -> String {
    format!("={}", u8::from(bit))
}

/// What the rungs of one drawing share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    /// The cell of the right rail; a rung that does not fit has its own further out.
    right: i32,
    /// Cells of the coils.
    coils: i32,
}

/// Cells at which the right rail is common to all rungs that fit.
const RIGHT_RAIL: RangeInclusive<i32> = 60..=140;

/// The widest coil that the coils of all rungs line up with.
const WIDEST_COMMON_COIL: i32 = 32;

impl Frame {
    pub(crate) fn of(program: &Program, evaluation: Option<&Evaluation>) -> Self {
        let flow_of = |place: usize| evaluation.and_then(|evaluation| evaluation.rungs.get(place));
        let rungs = || program.rungs.iter().enumerate();
        let coils = rungs().map(|(place, rung)| coils_width(rung, flow_of(place)));
        let coils = coils.filter(|coils| *coils <= WIDEST_COMMON_COIL).max().unwrap_or(0);
        let rights = rungs().map(|(place, rung)| {
            let flow = flow_of(place);
            let (network, _) = series(&rung.network, &mut Flows::of(flow));
            network.width + coils.max(coils_width(rung, flow)) + 5
        });
        let right = rights.filter(|right| RIGHT_RAIL.contains(right)).max();
        Self { right: right.unwrap_or(*RIGHT_RAIL.start()), coils }
    }
}

/// A whole rung between its rails, with what the power does in it where a scan is drawn.
pub(crate) fn rung(rung: &Rung, flow: Option<&RungFlow>, frame: Frame) -> Piece {
    let (network, _) = series(&rung.network, &mut Flows::of(flow));
    let power = flow.is_some_and(|flow| flow.power);
    let coils_width = coils_width(rung, flow).max(frame.coils);
    let right = frame.right.max(network.width + coils_width + 5);
    let mut piece = Piece::default();
    let end = 2 + network.width;
    piece.shapes.push(wire(0, 2, 0, flow.is_some()));
    piece.place(network, 2, 0);
    let junction = right - coils_width - 1;
    if !rung.coils.is_empty() {
        piece.shapes.push(wire(end, junction, 0, power));
    }
    let mut row = 0;
    for (place, coil) in rung.coils.iter().enumerate() {
        row = 2 * i32::try_from(place).unwrap_or(0);
        let (label, value) = coil_label(coil, place, flow);
        let middle = junction + 1 + coils_width / 2;
        let left = middle - 1;
        piece.shapes.extend([
            wire(junction, left, row, power),
            Shape::Coil { left, row, sign: coil_sign(coil.kind), on: value == "=1" },
            wire(left + 2, right, row, power),
            Shape::Label {
                column: middle - (length(&label) + length(&value)) / 2,
                row: row - 1,
                text: label,
                value,
                signal: true,
            },
        ]);
    }
    if row > 0 {
        piece.shapes.push(Shape::Riser { column: junction, top: 0, bottom: row, live: power });
    }
    piece.above = piece.above.max(1);
    piece.below = piece.below.max(row);
    for column in [0, right] {
        piece.shapes.push(Shape::Rail { column, top: -piece.above, bottom: piece.below });
    }
    piece.width = right + 1;
    piece
}

fn coil_label(coil: &Coil, place: usize, flow: Option<&RungFlow>) -> (String, String) {
    let value = flow.and_then(|flow| flow.coils.get(place));
    let value = value.map_or(String::new(), |&bit| value_of(bit));
    (coil.target.to_string(), value)
}

fn coils_width(rung: &Rung, flow: Option<&RungFlow>) -> i32 {
    let widths = rung.coils.iter().enumerate().map(|(place, coil)| {
        let (label, value) = coil_label(coil, place, flow);
        (length(&label) + length(&value)).max(3) + 3
    });
    widths.max().unwrap_or(0)
}

fn coil_sign(kind: CoilKind) -> &'static str {
    match kind {
        CoilKind::Plain => " ",
        CoilKind::Rising => "P",
        CoilKind::Falling => "N",
        other => other.sign(),
    }
}

/// The elements side by side, and the power behind the last one; nothing without elements or without a scan.
fn series(series: &Series, flows: &mut Flows<'_>) -> (Piece, Option<bool>) {
    let mut whole = Piece::default();
    let mut power = None;
    for element in series {
        let (piece, flow) = match element {
            Element::Contact(contact) => {
                let sign = match contact.kind {
                    ContactKind::NormallyOpen => " ",
                    ContactKind::NormallyClosed => "/",
                    ContactKind::Rising => "P",
                    ContactKind::Falling => "N",
                };
                let flow = flows.next();
                let label = contact.operand.to_string();
                (contact_piece(label, sign.into(), flow), flow)
            }
            Element::Comparison(comparison) => {
                let sign = format!("{}{}", comparison.relation.sign(), comparison.value);
                let flow = flows.next();
                let label = format!("{}.CV", comparison.counter);
                (contact_piece(label, sign, flow), flow)
            }
            Element::Branches(branches) => branches_piece(branches, flows),
            Element::Block(block) => block_piece(block, flows),
        };
        power = flow.map(|flow| flow.leaves);
        let column = whole.width;
        whole.width += piece.width;
        whole.place(piece, column, 0);
    }
    (whole, power)
}

fn contact_piece(label: String, sign: String, flow: Option<&ElementFlow>) -> Piece {
    let value = match flow.map(|flow| flow.reading) {
        Some(Reading::Bit(bit)) => value_of(bit),
        Some(Reading::Number(number)) => format!("={number}"),
        _ => String::new(),
    };
    let labelled = length(&label) + length(&value);
    let symbol = length(&sign) + 2;
    let width = labelled.max(symbol) + 3;
    let left = (width - symbol) / 2 + 1;
    let right = left + symbol - 1;
    Piece {
        width,
        above: 1,
        below: 0,
        shapes: vec![
            wire(0, left, 0, flow.is_some_and(|flow| flow.enters)),
            wire(right, width, 0, flow.is_some_and(|flow| flow.leaves)),
            Shape::Label {
                column: (width - labelled) / 2 + 1,
                row: -1,
                text: label,
                value,
                signal: true,
            },
            Shape::Contact {
                left,
                right,
                row: 0,
                sign,
                closed: flow.is_some_and(|flow| flow.passes),
            },
        ],
    }
}

fn branches_piece<'e>(
    branches: &[Series],
    flows: &mut Flows<'e>,
) -> (Piece, Option<&'e ElementFlow>) {
    let pieces = branches.iter().map(|branch| series(branch, flows));
    let pieces: Vec<(Piece, Option<bool>)> = pieces.collect();
    let flow = flows.next();
    let enters = flow.is_some_and(|flow| flow.enters);
    let widths = pieces.iter().map(|(piece, _)| piece.width);
    let inner = widths.max().unwrap_or(0);
    let mut whole = Piece { width: inner + 2, ..Piece::default() };
    let mut row = 0;
    let mut lowest_live = 0;
    for (place, (piece, power)) in pieces.into_iter().enumerate() {
        if place > 0 {
            row = whole.below + piece.above + 1;
        }
        let end = 1 + piece.width;
        let live = power.unwrap_or(enters);
        if live {
            lowest_live = row;
        }
        whole.shapes.push(wire(0, 1, row, enters));
        whole.place(piece, 1, row);
        whole.shapes.push(wire(end, inner + 1, row, live));
    }
    whole.below = whole.below.max(row);
    let leaves = flow.is_some_and(|flow| flow.leaves);
    whole.shapes.push(wire(inner + 1, inner + 2, 0, leaves));
    // Behind the branches power runs from those that have it to the wire, and not down to the others.
    let risers = [
        (0, 0, row, enters),
        (inner + 1, lowest_live, row, false),
        (inner + 1, 0, lowest_live, leaves),
    ];
    for (column, top, bottom, live) in risers {
        if top < bottom {
            whole.shapes.push(Shape::Riser { column, top, bottom, live });
        }
    }
    (whole, flow)
}
