//! A ladder as text with box characters, like a printed listing.

use std::fmt::Write;

use crate::layout::{Frame, Shape, rung};
use crate::program::{Program, Signal};

/// The listing of a program: its signals, then its rungs between their rails.
pub fn draw_text(program: &Program) -> String {
    let mut text = String::new();
    for comment in &program.comments {
        let _ = writeln!(text, "{}", format!("-- {comment}").trim_end());
    }
    let _ = write!(text, "program {}", program.name);
    if let Some(description) = &program.description {
        let _ = write!(text, "  -- {description}");
    }
    text.push('\n');
    signals(&mut text, "inputs", &program.inputs);
    signals(&mut text, "outputs", &program.outputs);
    signals(&mut text, "memory", &program.memory);
    let frame = Frame::of(program);
    for (place, content) in program.rungs.iter().enumerate() {
        let title = content.title.as_deref().unwrap_or("");
        let heading = format!("{}  {title}", place + 1);
        let _ = writeln!(text, "\n{}", heading.trim_end());
        for comment in &content.comments {
            let _ = writeln!(text, "{}", format!("   -- {comment}").trim_end());
        }
        let piece = rung(content, frame);
        let mut canvas = Canvas::new(piece.width, piece.above, piece.below);
        for shape in &piece.shapes {
            canvas.paint(shape);
        }
        canvas.write(&mut text);
    }
    text
}

fn signals(text: &mut String, heading: &str, signals: &[Signal]) {
    if signals.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n{heading}");
    let names = signals.iter().map(|signal| signal.name.chars().count());
    let name_width = names.max().unwrap_or(0);
    let addresses = signals.iter().map(|signal| address(signal).len());
    let address_width = addresses.max().unwrap_or(0);
    for signal in signals {
        let line = format!(
            "   {:name_width$}  {:address_width$}  {}  {}",
            signal.name.as_str(),
            address(signal),
            signal
                .initial
                .map_or("   ", |initial| if initial { "= 1" } else { "= 0" }),
            signal.description.as_deref().unwrap_or(""),
        );
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

fn address(signal: &Signal) -> String {
    signal
        .address
        .as_ref()
        .map(ToString::to_string)
        .unwrap_or_default()
}

/// Directions in which a wire leaves a cell.
const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const UP: u8 = 4;
const DOWN: u8 = 8;

/// The box character for each set of directions.
const WIRES: [char; 16] = [
    ' ', '─', '─', '─', '│', '┘', '└', '┴', '│', '┐', '┌', '┬', '│', '┤', '├', '┼',
];

struct Canvas {
    width: usize,
    above: i32,
    directions: Vec<u8>,
    characters: Vec<Option<char>>,
}

impl Canvas {
    fn new(width: i32, above: i32, below: i32) -> Self {
        let width = usize::try_from(width).unwrap_or(0);
        let cells = width * usize::try_from(above + below + 1).unwrap_or(0);
        Self {
            width,
            above,
            directions: vec![0; cells],
            characters: vec![None; cells],
        }
    }

    fn cell(&self, column: i32, row: i32) -> usize {
        let row = usize::try_from(row + self.above).unwrap_or(0);
        row * self.width + usize::try_from(column).unwrap_or(0)
    }

    fn connect(&mut self, column: i32, row: i32, directions: u8) {
        let cell = self.cell(column, row);
        self.directions[cell] |= directions;
    }

    fn write_at(&mut self, column: i32, row: i32, text: &str) {
        for (column, character) in (column..).zip(text.chars()) {
            let cell = self.cell(column, row);
            self.characters[cell] = Some(character);
        }
    }

    fn across(&mut self, left: i32, right: i32, row: i32) {
        for column in left..right {
            self.connect(column, row, RIGHT);
            self.connect(column + 1, row, LEFT);
        }
    }

    fn along(&mut self, column: i32, top: i32, bottom: i32) {
        for row in top..bottom {
            self.connect(column, row, DOWN);
            self.connect(column, row + 1, UP);
        }
    }

    fn paint(&mut self, shape: &Shape) {
        match shape {
            Shape::Wire { left, right, row } => self.across(*left, *right, *row),
            Shape::Riser {
                column,
                top,
                bottom,
            } => self.along(*column, *top, *bottom),
            Shape::Rail {
                column,
                top,
                bottom,
            } => {
                for row in *top..=*bottom {
                    self.connect(*column, row, UP | DOWN);
                }
            }
            Shape::Contact {
                left, row, sign, ..
            } => {
                self.write_at(*left, *row, &format!("┤{sign}├"));
            }
            Shape::Coil { left, row, sign } => self.write_at(*left, *row, &format!("({sign})")),
            Shape::Outline {
                left,
                right,
                top,
                bottom,
            } => {
                self.across(*left, *right, *top);
                self.across(*left, *right, *bottom);
                self.along(*left, *top, *bottom);
                self.along(*right, *top, *bottom);
            }
            Shape::Label {
                column, row, text, ..
            } => self.write_at(*column, *row, text),
        }
    }

    fn write(&self, text: &mut String) {
        if self.width == 0 {
            return;
        }
        let rows = self
            .directions
            .chunks(self.width)
            .zip(self.characters.chunks(self.width));
        for (directions, characters) in rows {
            let line: String = directions
                .iter()
                .zip(characters)
                .map(|(&directions, character)| character.unwrap_or(WIRES[usize::from(directions)]))
                .collect();
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
}
