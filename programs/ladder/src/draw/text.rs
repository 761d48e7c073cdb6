//! A ladder as text with box characters, like a printed listing.

use std::fmt::Write;

use crate::flow::Evaluation;
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
    let rungs: Vec<usize> = (0..program.rungs.len()).collect();
    text + &draw_text_rungs(program, &rungs, None)
}

/// Some rungs, in this order and by their place from 0; wires with power are heavy lines. Those that the program does not have are left out.
pub fn draw_text_rungs(
    program: &Program,
    rungs: &[usize],
    evaluation: Option<&Evaluation>,
) -> String {
    let mut text = String::new();
    let frame = Frame::of(program, evaluation);
    for &place in rungs {
        let Some(content) = program.rungs.get(place) else {
            continue;
        };
        let title = content.title.as_deref().unwrap_or("");
        let heading = format!("{}  {title}", place + 1);
        let _ = writeln!(text, "\n{}", heading.trim_end());
        for comment in &content.comments {
            let _ = writeln!(text, "{}", format!("   -- {comment}").trim_end());
        }
        let flow = evaluation.and_then(|evaluation| evaluation.rungs.get(place));
        let piece = rung(content, flow, frame);
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
            signal.initial.map_or("   ", |initial| if initial { "= 1" } else { "= 0" }),
            signal.description.as_deref().unwrap_or(""),
        );
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

fn address(signal: &Signal) -> String {
    signal.address.as_ref().map(ToString::to_string).unwrap_or_default()
}

/// Directions in which a wire leaves a cell, each the value of a digit of base 3.
const LEFT: usize = 27;
const RIGHT: usize = 9;
const UP: usize = 3;
const DOWN: usize = 1;

/// The box character for the weights of the directions: 0 for no wire, 1 for a wire, 2 for one with power.
const WIRES: &str = " │┃││╽┃╿┃\
─┌┎└├┟┖┞┠\
━┍┏┕┝┢┗┡┣\
─┐┒┘┤┧┚┦┨\
─┬┰┴┼╁┸╀╂\
╼┮┲┶┾╆┺╄╊\
━┑┓┙┥┪┛┩┫\
╾┭┱┵┽╅┹╃╉\
━┯┳┷┿╈┻╇╋";

struct Canvas {
    width: usize,
    above: i32,
    weights: Vec<usize>,
    characters: Vec<Option<char>>,
}

impl Canvas {
    fn new(width: i32, above: i32, below: i32) -> Self {
        let width = usize::try_from(width).unwrap_or(0);
        let cells = width * usize::try_from(above + below + 1).unwrap_or(0);
        Self { width, above, weights: vec![0; cells], characters: vec![None; cells] }
    }

    fn cell(&self, column: i32, row: i32) -> usize {
        let row = usize::try_from(row + self.above).unwrap_or(0);
        row * self.width + usize::try_from(column).unwrap_or(0)
    }

    /// What is heavy stays heavy.
    fn connect(&mut self, column: i32, row: i32, direction: usize, live: bool) {
        let cell = self.cell(column, row);
        let weight = self.weights[cell] / direction % 3;
        let wanted = weight.max(1 + usize::from(live));
        self.weights[cell] += (wanted - weight) * direction;
    }

    fn write_at(&mut self, column: i32, row: i32, text: &str) {
        for (column, character) in (column..).zip(text.chars()) {
            let cell = self.cell(column, row);
            self.characters[cell] = Some(character);
        }
    }

    fn across(&mut self, left: i32, right: i32, row: i32, live: bool) {
        for column in left..right {
            self.connect(column, row, RIGHT, live);
            self.connect(column + 1, row, LEFT, live);
        }
    }

    fn along(&mut self, column: i32, top: i32, bottom: i32, live: bool) {
        for row in top..bottom {
            self.connect(column, row, DOWN, live);
            self.connect(column, row + 1, UP, live);
        }
    }

    fn paint(&mut self, shape: &Shape) {
        match shape {
            Shape::Wire { left, right, row, live } => self.across(*left, *right, *row, *live),
            Shape::Riser { column, top, bottom, live } => self.along(*column, *top, *bottom, *live),
            Shape::Rail { column, top, bottom } => {
                for row in *top..=*bottom {
                    self.connect(*column, row, UP, false);
                    self.connect(*column, row, DOWN, false);
                }
            }
            Shape::Contact { left, row, sign, closed, .. } => {
                let (before, behind) = if *closed { ('┫', '┣') } else { ('┤', '├') };
                self.write_at(*left, *row, &format!("{before}{sign}{behind}"));
            }
            Shape::Coil { left, row, sign, .. } => self.write_at(*left, *row, &format!("({sign})")),
            Shape::Outline { left, right, top, bottom } => {
                self.across(*left, *right, *top, false);
                self.across(*left, *right, *bottom, false);
                self.along(*left, *top, *bottom, false);
                self.along(*right, *top, *bottom, false);
            }
            Shape::Label { column, row, text, value, .. } => {
                self.write_at(*column, *row, &format!("{text}{value}"))
            }
        }
    }

    fn write(&self, text: &mut String) {
        if self.width == 0 {
            return;
        }
        let wires: Vec<char> = WIRES.chars().collect();
        let rows = self.weights.chunks(self.width).zip(self.characters.chunks(self.width));
        for (weights, characters) in rows {
            let line: String = weights
                .iter()
                .zip(characters)
                .map(|(&weights, character)| character.unwrap_or(wires[weights]))
                .collect();
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
}
