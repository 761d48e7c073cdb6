//! A ladder as one self-contained SVG picture, light and dark as the reader's screen is.

use std::collections::HashMap;
use std::fmt::Write;
use understudy_text::markup::escaped;

use crate::flow::Evaluation;
use crate::layout::{Frame, Shape, rung};
use crate::program::{Program, Signal};

/// A cell of the layout in pixels.
const CELL_WIDTH: f64 = 8.0;
const CELL_HEIGHT: f64 = 19.0;
const MARGIN: f64 = 24.0;
/// Height of a line of text outside of the rungs.
const LINE_HEIGHT: f64 = 19.0;

/// Every selector begins at the picture's own class, so that a page can hold several pictures.
const STYLE: &str = "\
.ladder{--paper:#fff;--ink:#1c2733;--soft:#667788;--wire:#41505f;--rail:#1f5fa8;--name:#0b4f8a;--fill:#f3f7fb}
@media(prefers-color-scheme:dark){
.ladder{--paper:#12181f;--ink:#e4eaf0;--soft:#93a3b3;--wire:#a9b8c6;--rail:#6db1ff;--name:#9accff;--fill:#1b242e}}
.ladder .paper{fill:var(--paper)}
.ladder text{font:13px ui-monospace,'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:var(--ink);white-space:pre}
.ladder .heading{font-weight:bold;font-size:17px}
.ladder .title{font-weight:bold}
.ladder .soft{fill:var(--soft)}
.ladder .name{fill:var(--name)}
.ladder .wire{stroke:var(--wire);stroke-width:1.5;fill:none;stroke-linecap:square}
.ladder .bar{stroke:var(--ink);stroke-width:2;fill:none}
.ladder .box{stroke:var(--ink);stroke-width:1.5;fill:var(--fill)}
.ladder .rail{stroke:var(--rail);stroke-width:3}";

/// What a scan adds: power by thickness and colour, a closed contact by its filling, values as text.
const FLOW_STYLE: &str = "
.ladder{--live:#0a7a33}
@media(prefers-color-scheme:dark){.ladder{--live:#52d984}}
.ladder .live{stroke:var(--live);stroke-width:4.5;fill:none;stroke-linecap:square}
.ladder .closed{fill:var(--live);fill-opacity:.3}
.ladder .one{fill:var(--live);font-weight:bold}
.ladder .zero{fill:var(--soft)}";

/// The picture of a program: its signals, then its rungs between their rails. Signals show address and comment on hover.
pub fn draw_svg(program: &Program) -> String {
    let mut picture = Picture::new(program);
    picture.header(program);
    let rungs: Vec<usize> = (0..program.rungs.len()).collect();
    picture.rungs(program, &rungs, None);
    picture.finish(program)
}

/// Some rungs only, in this order and by their place from 0, without the list of signals; those that the program does not have are left out.
pub fn draw_svg_rungs(
    program: &Program,
    rungs: &[usize],
    evaluation: Option<&Evaluation>,
) -> String {
    let mut picture = Picture::new(program);
    picture.rungs(program, rungs, evaluation);
    picture.finish(program)
}

struct Picture {
    body: String,
    /// What a name means, for hovering.
    meanings: HashMap<String, String>,
    /// The next line's row, or the wire of the rung being painted, in pixels.
    top: f64,
    width: f64,
    /// A scan is drawn.
    flows: bool,
}

impl Picture {
    fn new(program: &Program) -> Self {
        let signals = program.inputs.iter().chain(program.writable());
        let meanings = signals.map(|signal| (signal.name.to_string(), meaning(signal)));
        Self {
            body: String::new(),
            meanings: meanings.filter(|(_, meaning)| !meaning.is_empty()).collect(),
            top: MARGIN,
            width: 0.0,
            flows: false,
        }
    }

    fn rungs(&mut self, program: &Program, rungs: &[usize], evaluation: Option<&Evaluation>) {
        let frame = Frame::of(program, evaluation);
        self.flows = evaluation.is_some();
        for &place in rungs {
            let Some(content) = program.rungs.get(place) else {
                continue;
            };
            self.top += LINE_HEIGHT * 0.6;
            let number = (place + 1).to_string();
            self.text(MARGIN, "soft", &number);
            if let Some(title) = &content.title {
                self.text(MARGIN + CELL_WIDTH * 4.0, "title", title);
            }
            self.top += LINE_HEIGHT;
            for comment in &content.comments {
                self.text(MARGIN + CELL_WIDTH * 4.0, "soft", comment);
                self.top += LINE_HEIGHT;
            }
            let flow = evaluation.and_then(|evaluation| evaluation.rungs.get(place));
            let piece = rung(content, flow, frame);
            self.top += CELL_HEIGHT * f64::from(piece.above);
            // Thick lines last, so that no thin one crosses them.
            let (live, other): (Vec<&Shape>, Vec<&Shape>) =
                piece.shapes.iter().partition(|shape| {
                    matches!(
                        shape,
                        Shape::Wire { live: true, .. } | Shape::Riser { live: true, .. }
                    )
                });
            for shape in other.into_iter().chain(live) {
                self.paint(shape);
            }
            self.fit(MARGIN + CELL_WIDTH * f64::from(piece.width));
            self.top += CELL_HEIGHT * f64::from(piece.below + 1);
        }
    }

    fn fit(&mut self, right: f64) {
        self.width = self.width.max(right);
    }

    fn header(&mut self, program: &Program) {
        self.text(MARGIN, "heading", &program.name);
        self.top += LINE_HEIGHT * 1.3;
        let lines = program.description.iter().chain(&program.comments);
        for line in lines {
            self.text(MARGIN, "soft", line);
            self.top += LINE_HEIGHT;
        }
        let groups = [
            ("inputs", &program.inputs),
            ("outputs", &program.outputs),
            ("memory", &program.memory),
        ];
        let signals = groups.iter().flat_map(|(_, signals)| signals.iter());
        let widest = signals.map(|signal| signal.name.chars().count()).max();
        let column = MARGIN
            + CELL_WIDTH * (4.0 + f64::from(u32::try_from(widest.unwrap_or(0)).unwrap_or(0)));
        for (heading, signals) in groups {
            if signals.is_empty() {
                continue;
            }
            self.top += LINE_HEIGHT * 0.5;
            self.text(MARGIN, "title", heading);
            self.top += LINE_HEIGHT;
            for signal in signals {
                self.text(MARGIN + CELL_WIDTH * 2.0, "name", &signal.name);
                self.text(column, "soft", &meaning(signal));
                self.top += LINE_HEIGHT;
            }
        }
    }

    fn text(&mut self, left: f64, class: &str, text: &str) {
        if text.is_empty() {
            return;
        }
        let baseline = self.top + 4.5;
        let _ = writeln!(
            self.body,
            r#"<text class="{class}" x="{left:.1}" y="{baseline:.1}">{}</text>"#,
            escaped(text)
        );
        let length = u32::try_from(text.chars().count()).unwrap_or(0);
        self.fit(left + CELL_WIDTH * f64::from(length));
    }

    fn across(column: i32) -> f64 {
        MARGIN + CELL_WIDTH * (f64::from(column) + 0.5)
    }

    fn down(&self, row: i32) -> f64 {
        self.top + CELL_HEIGHT * f64::from(row)
    }

    fn line(&mut self, class: &str, [x1, y1, x2, y2]: [f64; 4]) {
        if (x1, y1) == (x2, y2) {
            return;
        }
        let _ =
            writeln!(self.body, r#"<path class="{class}" d="M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}"/>"#);
    }

    /// The inside of a contact or coil whose wire is at `y`.
    fn filled(&mut self, left: f64, y: f64, width: f64) {
        let top = y - 8.0;
        let _ = writeln!(
            self.body,
            r#"<rect class="closed" x="{left:.1}" y="{top:.1}" width="{width:.1}" height="16.0"/>"#
        );
    }

    fn centred(&mut self, middle: f64, row: i32, text: &str) {
        let baseline = self.down(row) + 4.5;
        let _ = writeln!(
            self.body,
            r#"<text x="{middle:.1}" y="{baseline:.1}" text-anchor="middle">{}</text>"#,
            escaped(text)
        );
    }

    fn paint(&mut self, shape: &Shape) {
        match shape {
            Shape::Wire { left, right, row, live } => {
                let y = self.down(*row);
                self.line(wire_class(*live), [Self::across(*left), y, Self::across(*right), y]);
            }
            Shape::Riser { column, top, bottom, live } => {
                let x = Self::across(*column);
                self.line(wire_class(*live), [x, self.down(*top), x, self.down(*bottom)]);
            }
            Shape::Rail { column, top, bottom } => {
                let x = Self::across(*column);
                let half = CELL_HEIGHT / 2.0;
                let ends = [x, self.down(*top) - half, x, self.down(*bottom) + half];
                self.line("rail", ends);
            }
            Shape::Contact { left, right, row, sign, closed } => {
                let (x1, x2, y) = (Self::across(*left), Self::across(*right), self.down(*row));
                if *closed {
                    self.filled(x1, y, x2 - x1);
                }
                self.line("bar", [x1, y - 8.0, x1, y + 8.0]);
                self.line("bar", [x2, y - 8.0, x2, y + 8.0]);
                match sign.as_str() {
                    " " => {}
                    "/" => self.line("bar", [x1 - 2.0, y + 8.0, x2 + 2.0, y - 8.0]),
                    _ => self.centred((x1 + x2) / 2.0, *row, sign),
                }
            }
            Shape::Coil { left, row, sign, on } => {
                let (x1, x2, y) = (Self::across(*left), Self::across(left + 2), self.down(*row));
                if *on {
                    self.filled(x1 + 1.0, y, x2 - x1 - 2.0);
                }
                let (top, bottom) = (y - 8.0, y + 8.0);
                let _ = writeln!(
                    self.body,
                    r#"<path class="bar" d="M{a:.1} {top:.1}Q{p:.1} {y:.1} {a:.1} {bottom:.1}M{b:.1} {top:.1}Q{q:.1} {y:.1} {b:.1} {bottom:.1}"/>"#,
                    a = x1 + 3.0,
                    b = x2 - 3.0,
                    p = x1 - 3.0,
                    q = x2 + 3.0,
                );
                self.centred((x1 + x2) / 2.0, *row, sign.trim());
            }
            Shape::Outline { left, right, top, bottom } => {
                let (x, y) = (Self::across(*left), self.down(*top));
                let _ = writeln!(
                    self.body,
                    r#"<rect class="box" x="{x:.1}" y="{y:.1}" width="{:.1}" height="{:.1}" rx="3"/>"#,
                    Self::across(*right) - x,
                    self.down(*bottom) - y,
                );
            }
            Shape::Label { text, .. } if text.is_empty() => {}
            Shape::Label { column, row, text, value, signal } => {
                let x = MARGIN + CELL_WIDTH * f64::from(*column);
                let baseline = self.down(*row) + 4.5;
                let class = if *signal { "name" } else { "pin" };
                let meaning = self.meanings.get(text).filter(|_| *signal);
                let title = meaning.map_or(String::new(), |meaning| {
                    format!("<title>{}</title>", escaped(meaning))
                });
                let characters = text.chars().count() + value.chars().count();
                let length = CELL_WIDTH * f64::from(u32::try_from(characters).unwrap_or(0));
                let value = match value.as_str() {
                    "" => String::new(),
                    "=0" => r#"<tspan class="zero">=0</tspan>"#.to_owned(),
                    other => format!(r#"<tspan class="one">{}</tspan>"#, escaped(other)),
                };
                let _ = writeln!(
                    self.body,
                    r#"<text class="{class}" x="{x:.1}" y="{baseline:.1}" textLength="{length:.1}">{title}{}{value}</text>"#,
                    escaped(text)
                );
            }
        }
    }

    fn finish(self, program: &Program) -> String {
        let (width, height) = (self.width + MARGIN, self.top + MARGIN);
        let flow_style = if self.flows { FLOW_STYLE } else { "" };
        format!(
            "<svg class=\"ladder\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
             <title>{}</title>\n<style>\n{STYLE}{flow_style}\n</style>\n\
             <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n{}</svg>\n",
            escaped(&program.name),
            self.body
        )
    }
}

fn wire_class(live: bool) -> &'static str {
    if live { "live" } else { "wire" }
}

/// Address, initial value and comment of a signal on one line.
fn meaning(signal: &Signal) -> String {
    let address = signal.address.as_ref().map(ToString::to_string);
    let initial = signal.initial.map(|initial| format!("= {}", u8::from(initial)));
    let parts = [address, initial, signal.description.clone()];
    parts.into_iter().flatten().collect::<Vec<_>>().join("  ")
}
