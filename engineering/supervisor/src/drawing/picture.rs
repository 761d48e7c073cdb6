//! Shapes, arrows and texts as SVG.

use std::fmt::Write as _;
use understudy_text::markup::escaped;

use super::labels::{Area, Label, Spot, on_curves};
use super::layout::Point;

/// Pixels that a letter and a line of text take.
const LETTER: f64 = 7.0;
pub(crate) const LINE: f64 = 15.0;

/// On how many parts of an arrow a label is kept from covering it.
const SAMPLES: u8 = 40;

/// The width and height of lines of text.
pub(crate) fn text_size(lines: &[String]) -> Point {
    let letters = lines.iter().map(|line| line.chars().count()).max();
    let width = letters.unwrap_or(0) as f64 * LETTER;
    (width, lines.len() as f64 * LINE)
}

/// How an arrow is drawn.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Style {
    pub(crate) dashed: bool,
    /// A circle in place of the head.
    pub(crate) round: bool,
}

/// What a legend explains.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Sign {
    Initial,
    Marked,
    Arrow(Style),
}

/// The edge of a node: what an arrow meets.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Shape {
    /// By half its width and half its height.
    Ellipse(f64, f64),
    Rectangle(f64, f64),
}

impl Shape {
    /// The point of the edge around `centre` towards `other`.
    fn edge(self, centre: Point, other: Point) -> Point {
        let (dx, dy) = (other.0 - centre.0, other.1 - centre.1);
        let scale = match self {
            Self::Ellipse(rx, ry) => (dx / rx).hypot(dy / ry),
            Self::Rectangle(rx, ry) => (dx / rx).abs().max((dy / ry).abs()),
        };
        if scale < 1e-6 {
            return centre;
        }
        (centre.0 + dx / scale, centre.1 + dy / scale)
    }
}

/// What has been drawn, and how far it reaches.
pub(crate) struct Picture {
    shapes: String,
    /// Labels of arrows, placed after all arrows.
    labels: Vec<Label>,
    /// Areas without labels.
    taken: Vec<Area>,
    /// Points of arrows.
    spots: Vec<Spot>,
    arrows: usize,
    legend: Vec<(Sign, &'static str)>,
    low: Point,
    high: Point,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            shapes: String::new(),
            labels: Vec::new(),
            taken: Vec::new(),
            spots: Vec::new(),
            arrows: 0,
            legend: Vec::new(),
            low: (f64::INFINITY, f64::INFINITY),
            high: (f64::NEG_INFINITY, f64::NEG_INFINITY),
        }
    }
}

impl Picture {
    fn reach(&mut self, (x, y): Point, (dx, dy): Point) {
        self.low = (self.low.0.min(x - dx), self.low.1.min(y - dy));
        self.high = (self.high.0.max(x + dx), self.high.1.max(y + dy));
    }

    /// Minimum distance of a label from a point.
    pub(crate) fn keep_free(&mut self, centre: Point, half: Point) {
        self.taken.push(Area { centre, half });
    }

    pub(crate) fn shape(&mut self, (x, y): Point, shape: Shape, fill: &str) {
        let (Shape::Ellipse(rx, ry) | Shape::Rectangle(rx, ry)) = shape;
        let _ = match shape {
            Shape::Ellipse(..) => writeln!(
                self.shapes,
                "<ellipse cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{rx:.1}\" ry=\"{ry:.1}\" fill=\"{fill}\" stroke=\"black\"/>"
            ),
            Shape::Rectangle(..) => writeln!(
                self.shapes,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\" stroke=\"black\"/>",
                x - rx,
                y - ry,
                2.0 * rx,
                2.0 * ry
            ),
        };
        self.reach((x, y), (rx + 8.0, ry + 8.0));
    }

    /// Lines of text around a point.
    pub(crate) fn text(&mut self, (x, y): Point, lines: &[String]) {
        let (width, height) = text_size(lines);
        for (number, line) in lines.iter().enumerate() {
            let line = escaped(line);
            let y = y - height / 2.0 + LINE * number as f64 + LINE / 2.0 + 4.0;
            let _ = writeln!(self.shapes, "<text x=\"{x:.1}\" y=\"{y:.1}\">{line}</text>");
        }
        self.reach((x, y), (width / 2.0 + 6.0, height / 2.0 + 6.0));
    }

    /// Lines of text at the first of some points where they cover no arrow, or else where they cover the least.
    pub(crate) fn note(&mut self, places: &[Point], lines: &[String]) {
        self.labels.push(Label::at(places, lines));
    }

    /// A smooth arrow from one shape by some points to another, with its label at the middle of it, or near where that is free.
    pub(crate) fn arrow(
        &mut self,
        (from, from_shape): (Point, Shape),
        bends: &[Point],
        (to, to_shape): (Point, Shape),
        style: Style,
        label: &[String],
    ) {
        let first = bends.first().copied().unwrap_or(to);
        let last = bends.last().copied().unwrap_or(from);
        let start = from_shape.edge(from, first);
        let end = to_shape.edge(to, last);
        let mut path = format!("M {}", point(start));
        // Through the middles between the bends, each bend a control point; a lone bend is passed by half.
        let mut pieces = Vec::new();
        let mut at = start;
        for (number, &bend) in bends.iter().enumerate() {
            let next = bends.get(number + 1);
            let stop = next.map_or(end, |next| middle(bend, *next));
            let _ = write!(path, " Q {} {}", point(bend), point(stop));
            pieces.push((at, bend, stop));
            at = stop;
        }
        if bends.is_empty() {
            let _ = write!(path, " L {}", point(end));
            pieces.push((start, middle(start, end), end));
        }
        self.line(&path, style);
        let arrow = self.arrows;
        self.arrows += 1;
        for step in 0..=SAMPLES {
            let place = on_curves(&pieces, f64::from(step) / f64::from(SAMPLES));
            self.spots.push(Spot { place, arrow, is_head: step == SAMPLES });
        }
        self.labels.push(Label::along(arrow, &pieces, label));
        for place in bends.iter().chain([&start]) {
            self.reach(*place, (8.0, 8.0));
        }
    }

    /// An arrow from the top of a shape to itself; `rise` is how far it goes up.
    pub(crate) fn self_loop(
        &mut self,
        (x, y): Point,
        half_height: f64,
        rise: f64,
        style: Style,
        label: &[String],
    ) {
        let bottom = y - half_height + 2.0;
        let top = bottom - rise * 4.0 / 3.0;
        let path = format!(
            "M {} C {} {} {}",
            point((x - 9.0, bottom)),
            point((x - 24.0, top)),
            point((x + 24.0, top)),
            point((x + 9.0, bottom))
        );
        self.line(&path, style);
        let (width, height) = text_size(label);
        let above = bottom - rise - height / 2.0 + 4.0;
        let beside = width / 2.0 + 20.0;
        let places = [(x, above), (x + beside, above + height), (x - beside, above + height)];
        self.labels.push(Label::at(&places, label));
    }

    /// Says below the picture what its signs mean.
    pub(crate) fn legend(&mut self, entries: impl IntoIterator<Item = (Sign, &'static str)>) {
        self.legend.extend(entries);
    }

    fn draw_legend(&mut self) {
        let (left, mut y) = (self.low.0 + 12.0, self.high.1 + LINE);
        for (sign, text) in std::mem::take(&mut self.legend) {
            let (middle, right) = (left + 18.0, left + 36.0);
            let ring = |radius: f64, fill: &str| {
                format!(
                    "<circle cx=\"{middle:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"black\"/>\n"
                )
            };
            match sign {
                Sign::Initial => {
                    let path = format!("M {} L {}", point((left, y)), point((middle - 6.0, y)));
                    self.line(&path, Style::default());
                    self.shapes.push_str(&ring(6.0, "lightblue"));
                }
                Sign::Marked => self.shapes.push_str(&(ring(6.0, "white") + &ring(3.5, "white"))),
                Sign::Arrow(style) => {
                    let path = format!("M {} L {}", point((left, y)), point((right, y)));
                    self.line(&path, style);
                }
            }
            let (width, _) = text_size(&[text.to_owned()]);
            let (x, base) = (right + 10.0, y + 4.0);
            let _ = writeln!(
                self.shapes,
                "<text x=\"{x:.1}\" y=\"{base:.1}\" style=\"text-anchor: start\">{text}</text>"
            );
            self.reach((x + width, y), (6.0, LINE / 2.0 + 4.0));
            y += LINE + 4.0;
        }
    }

    fn line(&mut self, path: &str, style: Style) {
        let dash = if style.dashed { " stroke-dasharray=\"5 3\"" } else { "" };
        let head = if style.round { "circle" } else { "arrow" };
        let _ = writeln!(
            self.shapes,
            "<path d=\"{path}\" fill=\"none\" stroke=\"black\"{dash} marker-end=\"url(#{head})\"/>"
        );
    }

    /// Labels come last, so that no line crosses them: first those with the fewest possible positions.
    fn place_labels(&mut self) {
        let mut labels = std::mem::take(&mut self.labels);
        labels.sort_by_key(|label| label.places.len());
        for label in labels {
            let (width, height) = text_size(&label.lines);
            let half = (width / 2.0, height / 2.0);
            let place = label.free_place(half, &self.taken, &self.spots);
            self.keep_free(place, half);
            if !label.lines.is_empty() {
                // A letter is narrower on average than the room that is kept for it.
                let (width, height) = (0.85 * width, height - 3.0);
                let (left, top) = (place.0 - width / 2.0, place.1 - height / 2.0);
                let _ = writeln!(
                    self.shapes,
                    "<path d=\"M {left:.1} {top:.1} h {width:.1} v {height:.1} h -{width:.1} z\" fill=\"white\"/>"
                );
            }
            self.text(place, &label.lines);
        }
    }

    pub(crate) fn finish(mut self) -> String {
        self.place_labels();
        self.draw_legend();
        if self.low.0 > self.high.0 {
            self.reach((0.0, 0.0), (40.0, 40.0));
        }
        let (width, height) = (self.high.0 - self.low.0, self.high.1 - self.low.1);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"{:.1} {:.1} {width:.1} {height:.1}\">\n\
             <defs><marker id=\"arrow\" markerWidth=\"9\" markerHeight=\"7\" refX=\"8\" refY=\"3.5\" orient=\"auto\"><path d=\"M 0 0 L 9 3.5 L 0 7 z\"/></marker>\n\
             <marker id=\"circle\" markerWidth=\"9\" markerHeight=\"9\" refX=\"8\" refY=\"4.5\" orient=\"auto\"><circle cx=\"4.5\" cy=\"4.5\" r=\"3.5\" fill=\"white\" stroke=\"black\"/></marker></defs>\n\
             <rect x=\"{:.1}\" y=\"{:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"white\"/>\n\
             <style>text {{ font: 12px sans-serif; text-anchor: middle; paint-order: stroke; stroke: white; stroke-width: 4px; stroke-linejoin: round; }}</style>\n\
             {}</svg>\n",
            self.low.0, self.low.1, self.low.0, self.low.1, self.shapes
        )
    }
}

pub(crate) fn middle(one: Point, other: Point) -> Point {
    ((one.0 + other.0) / 2.0, (one.1 + other.1) / 2.0)
}

fn point((x, y): Point) -> String {
    format!("{x:.1} {y:.1}")
}
