//! Where the parts of a rung stand, in cells of one character; both drawings paint it.
//!
//! A [`Piece`] enters at cell 0 of its wire row and leaves into the cell behind its last one, so that pieces join by standing
//! side by side. Row 0 is the wire; what stands above it has negative rows. Wires run from cell centre to cell centre.

use std::ops::RangeInclusive;

use crate::print::{series_text, time_text};
use crate::program::{Block, CoilKind, ContactKind, Element, Program, Rung, Series};

/// Something to paint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A wire along a row, from `left` to `right`.
    Wire { left: i32, right: i32, row: i32 },
    /// A wire along a column, from `top` to `bottom`.
    Riser { column: i32, top: i32, bottom: i32 },
    /// A power rail along a column; reaches half a cell past both ends.
    Rail { column: i32, top: i32, bottom: i32 },
    /// A contact with its sign between two bars; `left` and `right` are the cells of the bars.
    Contact {
        left: i32,
        right: i32,
        row: i32,
        sign: String,
    },
    /// A coil with its sign between two arcs; three cells from `left`.
    Coil {
        left: i32,
        row: i32,
        sign: &'static str,
    },
    /// The outline of a block, its corners in cells.
    Outline {
        left: i32,
        right: i32,
        top: i32,
        bottom: i32,
    },
    /// A text from `column` on; `signal` where it is the name of something to be looked up.
    Label {
        column: i32,
        row: i32,
        text: String,
        signal: bool,
    },
}

impl Shape {
    fn moved(mut self, columns: i32, rows: i32) -> Self {
        match &mut self {
            Self::Wire { left, right, row }
            | Self::Contact {
                left, right, row, ..
            } => {
                *left += columns;
                *right += columns;
                *row += rows;
            }
            Self::Riser {
                column,
                top,
                bottom,
            }
            | Self::Rail {
                column,
                top,
                bottom,
            } => {
                *column += columns;
                *top += rows;
                *bottom += rows;
            }
            Self::Coil { left, row, .. } => {
                *left += columns;
                *row += rows;
            }
            Self::Outline {
                left,
                right,
                top,
                bottom,
            } => {
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
        self.shapes
            .extend(shapes.map(|shape| shape.moved(column, row)));
        self.above = self.above.max(other.above - row);
        self.below = self.below.max(other.below + row);
    }
}

fn length(text: &str) -> i32 {
    i32::try_from(text.chars().count()).unwrap_or(i32::MAX / 4)
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
    pub(crate) fn of(program: &Program) -> Self {
        let coils = program.rungs.iter().map(coils_width);
        let coils = coils
            .filter(|coils| *coils <= WIDEST_COMMON_COIL)
            .max()
            .unwrap_or(0);
        let rungs = program.rungs.iter();
        let rights =
            rungs.map(|rung| series(&rung.network).width + coils.max(coils_width(rung)) + 5);
        let right = rights.filter(|right| RIGHT_RAIL.contains(right)).max();
        Self {
            right: right.unwrap_or(*RIGHT_RAIL.start()),
            coils,
        }
    }
}

/// A whole rung between its rails.
pub(crate) fn rung(rung: &Rung, frame: Frame) -> Piece {
    let network = series(&rung.network);
    let coils_width = coils_width(rung).max(frame.coils);
    let right = frame.right.max(network.width + coils_width + 5);
    let mut piece = Piece::default();
    let end = 2 + network.width;
    piece.shapes.push(Shape::Wire {
        left: 0,
        right: 2,
        row: 0,
    });
    piece.place(network, 2, 0);
    let junction = right - coils_width - 1;
    if !rung.coils.is_empty() {
        piece.shapes.push(Shape::Wire {
            left: end,
            right: junction,
            row: 0,
        });
    }
    let mut row = 0;
    for (place, coil) in rung.coils.iter().enumerate() {
        row = 2 * i32::try_from(place).unwrap_or(0);
        let label = coil.target.to_string();
        let middle = junction + 1 + coils_width / 2;
        let left = middle - 1;
        piece.shapes.extend([
            Shape::Wire {
                left: junction,
                right: left,
                row,
            },
            Shape::Coil {
                left,
                row,
                sign: coil_sign(coil.kind),
            },
            Shape::Wire {
                left: left + 2,
                right,
                row,
            },
            Shape::Label {
                column: middle - length(&label) / 2,
                row: row - 1,
                text: label,
                signal: true,
            },
        ]);
    }
    if row > 0 {
        piece.shapes.push(Shape::Riser {
            column: junction,
            top: 0,
            bottom: row,
        });
    }
    piece.above = piece.above.max(1);
    piece.below = piece.below.max(row);
    for column in [0, right] {
        piece.shapes.push(Shape::Rail {
            column,
            top: -piece.above,
            bottom: piece.below,
        });
    }
    piece.width = right + 1;
    piece
}

fn coils_width(rung: &Rung) -> i32 {
    let widths = rung
        .coils
        .iter()
        .map(|coil| length(&coil.target).max(3) + 3);
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

fn series(series: &Series) -> Piece {
    let mut whole = Piece::default();
    for element in series {
        let piece = match element {
            Element::Contact(contact) => {
                let sign = match contact.kind {
                    ContactKind::NormallyOpen => " ",
                    ContactKind::NormallyClosed => "/",
                    ContactKind::Rising => "P",
                    ContactKind::Falling => "N",
                };
                contact_piece(contact.operand.to_string(), sign.into())
            }
            Element::Comparison(comparison) => contact_piece(
                format!("{}.CV", comparison.counter),
                format!("{}{}", comparison.relation.sign(), comparison.value),
            ),
            Element::Branches(branches) => branches_piece(branches),
            Element::Block(block) => block_piece(block),
        };
        let column = whole.width;
        whole.width += piece.width;
        whole.place(piece, column, 0);
    }
    whole
}

fn contact_piece(label: String, sign: String) -> Piece {
    let symbol = length(&sign) + 2;
    let width = length(&label).max(symbol) + 3;
    let left = (width - symbol) / 2 + 1;
    let right = left + symbol - 1;
    Piece {
        width,
        above: 1,
        below: 0,
        shapes: vec![
            Shape::Wire {
                left: 0,
                right: left,
                row: 0,
            },
            Shape::Wire {
                left: right,
                right: width,
                row: 0,
            },
            Shape::Label {
                column: (width - length(&label)) / 2 + 1,
                row: -1,
                text: label,
                signal: true,
            },
            Shape::Contact {
                left,
                right,
                row: 0,
                sign,
            },
        ],
    }
}

fn branches_piece(branches: &[Series]) -> Piece {
    let pieces: Vec<Piece> = branches.iter().map(series).collect();
    let inner = pieces.iter().map(|piece| piece.width).max().unwrap_or(0);
    let mut whole = Piece {
        width: inner + 2,
        ..Piece::default()
    };
    let mut row = 0;
    for (place, piece) in pieces.into_iter().enumerate() {
        if place > 0 {
            row = whole.below + piece.above + 1;
        }
        let end = 1 + piece.width;
        whole.shapes.push(Shape::Wire {
            left: 0,
            right: 1,
            row,
        });
        whole.place(piece, 1, row);
        whole.shapes.push(Shape::Wire {
            left: end,
            right: inner + 1,
            row,
        });
    }
    whole.below = whole.below.max(row);
    whole.shapes.push(Shape::Wire {
        left: inner + 1,
        right: inner + 2,
        row: 0,
    });
    for column in [0, inner + 1] {
        whole.shapes.push(Shape::Riser {
            column,
            top: 0,
            bottom: row,
        });
    }
    whole
}

/// ```text
///      parts
///    ┌────────┐
/// ───┤CU CTU Q├───
///    │PV 5    │
///    │R reset │
///    └────────┘
/// ```
fn block_piece(block: &Block) -> Piece {
    let outputs = block.kind.outputs();
    let mut rows = Vec::new();
    rows.extend(
        block
            .kind
            .preset_time()
            .map(|time| format!("PT {}", time_text(time))),
    );
    rows.extend(block.kind.preset_value().map(|value| format!("PV {value}")));
    for feed in &block.pins {
        rows.push(format!("{} {}", feed.pin, series_text(&feed.network)));
    }
    let (input, word) = (block.kind.wire_input(), block.kind.word());
    let head = length(input) + length(word) + length(outputs[0]) + 2;
    let second = outputs.get(1).copied().unwrap_or("");
    let widths = rows.iter().enumerate().map(|(place, row)| {
        let beside = if place == 0 && !second.is_empty() {
            length(second) + 1
        } else {
            0
        };
        length(row) + beside
    });
    let inner = widths.max().unwrap_or(0).max(head).max(length(&block.name));
    let latest = inner - length(outputs[0]) - 1 - length(word);
    let word_column = ((inner - length(word)) / 2).clamp(length(input) + 1, latest);
    let (left, right) = (2, 3 + inner);
    let bottom = i32::try_from(rows.len()).unwrap_or(0) + 1;
    let label = |column, row, text: &str| Shape::Label {
        column,
        row,
        text: text.to_owned(),
        signal: false,
    };
    let mut shapes = vec![
        Shape::Outline {
            left,
            right,
            top: -1,
            bottom,
        },
        Shape::Wire {
            left: 0,
            right: left,
            row: 0,
        },
        Shape::Wire {
            left: right,
            right: right + 2,
            row: 0,
        },
        label(
            left + 1 + (inner - length(&block.name)) / 2,
            -2,
            &block.name,
        ),
        label(left + 1, 0, input),
        label(left + 1 + word_column, 0, word),
        label(right - length(outputs[0]), 0, outputs[0]),
        label(right - length(second), 1, second),
    ];
    let mut row = 0;
    for text in &rows {
        row += 1;
        shapes.push(label(left + 1, row, text));
    }
    Piece {
        width: right + 2,
        above: 2,
        below: bottom,
        shapes,
    }
}
