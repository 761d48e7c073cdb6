//! Headings, texts, networks and charts below each other, as SVG.

use std::fmt::Write as _;

use understudy_text::markup::escaped;

use crate::blocks::{
    self, BARS, BRANCH, BlockPlan, CONTACT_HEAD, CONTACT_ROW, Coil, Contacts, Kind, Network,
};
use crate::chart::{self, Chart, Part};
use crate::{CHARACTER, Place, Point, width};

const STYLE: &str = ".paper { fill: #fff; }\n\
text { font: 13px ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace; fill: #1c2733; white-space: pre; }\n\
.heading { font-weight: bold; font-size: 17px; }\n.title { font-weight: bold; }\n.soft { fill: #51606f; }\n\
.name { fill: #0b4f8a; }\n.wire, .data { stroke: #41505f; stroke-width: 1.5; fill: none; }\n\
.bar { stroke: #1c2733; stroke-width: 2; fill: none; }\n.box { stroke: #1c2733; stroke-width: 1.5; fill: #f3f7fb; }\n\
.field { stroke: #8a98a6; stroke-width: 1; fill: #fff; }\n.live { stroke: #0a7a33; stroke-width: 3.5; fill: none; }\n\
.active { stroke: #0a7a33; stroke-width: 3.5; fill: #d9efdf; }\n.one { fill: #0a7a33; font-weight: bold; }\n.zero { fill: #51606f; }\n\
.idle { opacity: .45; }";

/// The left edge.
const MARGIN: i64 = 20;
/// Height of a line of text.
const LINE: i64 = 18;
/// From the middle of a line to its baseline.
const BASE: i64 = 4;

/// A picture that grows downwards.
#[derive(Debug, Default)]
pub struct Picture {
    body: String,
    right: i64,
    bottom: i64,
    networks: usize,
}

impl Picture {
    /// An empty one.
    pub fn new() -> Self {
        Self { bottom: MARGIN, ..Self::default() }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        self.bottom += LINE / 2;
        self.text("heading", MARGIN, self.bottom, text);
        self.bottom += LINE + LINE / 2;
        self.networks = 0;
    }

    /// A heading of a part.
    pub fn title(&mut self, text: &str) {
        self.bottom += LINE / 2;
        self.text("title", MARGIN, self.bottom, text);
        self.bottom += LINE;
    }

    /// Lines of text.
    pub fn listing(&mut self, text: &str) {
        self.lines("pin", text);
    }

    /// Lines of text that explain.
    pub fn note(&mut self, text: &str) {
        self.lines("soft", text);
    }

    fn lines(&mut self, class: &str, text: &str) {
        if text.is_empty() {
            return;
        }
        for line in text.lines() {
            self.text(class, MARGIN, self.bottom, line);
            self.bottom += LINE;
        }
        self.bottom += LINE / 2;
    }

    /// A network of function blocks; its number is that below the heading.
    pub fn network(&mut self, network: &Network) {
        self.networks += 1;
        let number = self.networks.to_string();
        self.text("soft", MARGIN, self.bottom, &number);
        let plan = blocks::lay_out(network, self.bottom + LINE);
        self.fit(plan.right, plan.bottom);
        let comments = plan.comments;
        for (line, at) in network.comments.iter().zip(0..) {
            self.text("soft", comments.x, comments.y + LINE / 2 + at * LINE, line);
        }
        for wire in &plan.wires {
            let (from, output) = wire.from;
            let value = network.objects[from].outputs[output].value.as_deref();
            self.line(class_of_wire(power(value)), &wire.points);
        }
        for place in 0..network.objects.len() {
            self.object(network, &plan, place);
        }
        self.bottom += LINE / 2;
    }

    fn object(&mut self, network: &Network, plan: &BlockPlan, at: usize) {
        let (object, placed) = (&network.objects[at], &plan.objects[at]);
        let place = placed.place;
        let idle = object.executed == Some(false);
        if idle {
            self.body.push_str("<g class=\"idle\">\n");
        }
        match &object.kind {
            Kind::Value(text) | Kind::Target(text) => {
                self.rectangle("field", place);
                let x = place.x + CHARACTER / 2;
                self.text("name", x, place.y + place.height / 2, text);
                let value = object.outputs.first().and_then(|output| output.value.as_ref());
                if let Some(value) = value {
                    let x = x + width(text) + CHARACTER;
                    self.text(class_of(value), x, place.y + place.height / 2, value);
                }
                self.bubbles(network, plan, at);
            }
            Kind::Contacts(contacts) => {
                let powers = object.inputs.iter().map(|input| {
                    let (from, output) = input.from?;
                    power(network.objects[from].outputs[output].value.as_deref())
                });
                let powers: Vec<Option<bool>> = powers.collect();
                // The rail has power, which is shown where a scan is.
                let is_scan = object.outputs.iter().any(|output| output.value.is_some());
                let (x, y) = (place.x, place.y + CONTACT_HEAD);
                if powers.is_empty() {
                    let ends = [place.y, place.bottom()].map(|y| Point { x, y });
                    self.line("bar", &ends);
                }
                let inputs = Inputs { x, powers };
                self.contacts(contacts, Point { x, y }, is_scan.then_some(true), &inputs);
            }
            Kind::Coil(name, kind) => self.coil(name, *kind, place),
            Kind::Block { of, instance } => {
                self.rectangle("box", place);
                self.centred("title", place.middle(), place.y + LINE / 2 + 1, of);
                if let Some(instance) = instance {
                    self.centred("name", place.middle(), place.y - LINE / 2, instance);
                }
                for (input, row) in object.inputs.iter().zip(&placed.inputs) {
                    self.text("pin", place.x + CHARACTER, place.y + row, &input.name);
                }
                for (output, row) in object.outputs.iter().zip(&placed.outputs) {
                    let x = place.right() - CHARACTER - width(&output.name);
                    self.text("pin", x, place.y + row, &output.name);
                    if let Some(value) = &output.value {
                        let y = place.y + row - LINE / 2 - 1;
                        self.text(class_of(value), place.right() + CHARACTER / 2, y, value);
                    }
                }
                self.bubbles(network, plan, at);
            }
        }
        if idle {
            self.body.push_str("</g>\n");
        }
    }

    /// Contacts behind a point, with the power there; the power behind them.
    fn contacts(
        &mut self,
        contacts: &Contacts,
        from: Point,
        before: Option<bool>,
        inputs: &Inputs,
    ) -> Option<bool> {
        let after = contacts.behind(before, &inputs.powers);
        let to = from.x + contacts.width();
        match contacts {
            Contacts::Power(_) => self.wire(after, from.y, inputs.x, from.x),
            Contacts::Contact { name, negated, value } => {
                let middle = (from.x + to) / 2;
                let (left, right) = (middle - BARS / 2, middle + BARS / 2);
                self.wire(before, from.y, from.x, left);
                self.wire(after, from.y, right, to);
                let is_closed = value.is_some_and(|value| value != *negated);
                let class = if is_closed { "live" } else { "bar" };
                let upright = |x| [-9, 9].map(|down| Point { x, y: from.y + down });
                self.line(class, &upright(left));
                self.line(class, &upright(right));
                if *negated {
                    let [begin, end] =
                        [(left, 9), (right, -9)].map(|(x, down)| Point { x, y: from.y + down });
                    self.line(class, &[begin, end]);
                }
                self.centred("name", middle, from.y - LINE, name);
            }
            Contacts::Series(all) if all.is_empty() => self.wire(before, from.y, from.x, to),
            Contacts::Series(all) => {
                let mut at = (from.x, before);
                for contacts in all {
                    let power = self.contacts(contacts, Point { x: at.0, ..from }, at.1, inputs);
                    at = (at.0 + contacts.width(), power);
                }
            }
            Contacts::Parallel(all) => {
                let is_fed = !contacts.inputs(0).is_empty();
                let (mut row, mut last) = (from.y, from.y);
                for branch in all {
                    let x = from.x + BRANCH;
                    if !is_fed {
                        self.wire(before, row, from.x, x);
                    }
                    let power = self.contacts(branch, Point { x, y: row }, before, inputs);
                    self.wire(power, row, x + branch.width(), to);
                    last = row;
                    row += branch.rows() * CONTACT_ROW;
                }
                let upright = |x| [from.y, last].map(|y| Point { x, y });
                if !is_fed {
                    self.line(class_of_wire(before), &upright(from.x));
                }
                self.line(class_of_wire(after), &upright(to));
            }
        }
        after
    }

    fn wire(&mut self, power: Option<bool>, y: i64, from: i64, to: i64) {
        self.line(class_of_wire(power), &[from, to].map(|x| Point { x, y }));
    }

    fn coil(&mut self, name: &str, kind: Coil, place: Place) {
        let y = place.y + place.height / 2;
        let (left, right) = (place.x, place.x + BARS + 10);
        let (top, bottom) = (y - 9, y + 9);
        let (out, back) = (left - 2, right + 2);
        let (bow_left, bow_right) = (left + 6, right - 6);
        let _ = writeln!(
            self.body,
            r#"<path class="bar" d="M{bow_left} {top}Q{out} {y} {bow_left} {bottom}M{bow_right} {top}Q{back} {y} {bow_right} {bottom}"/>"#
        );
        let sign = match kind {
            Coil::Plain => "",
            Coil::Negated => "/",
            Coil::Set => "S",
            Coil::Reset => "R",
        };
        self.centred("title", (left + right) / 2, y, sign);
        self.text("name", place.x + blocks::COIL, y, name);
    }

    /// The circles of inputs that take the opposite.
    fn bubbles(&mut self, network: &Network, plan: &BlockPlan, at: usize) {
        let (object, placed) = (&network.objects[at], &plan.objects[at]);
        for (input, row) in object.inputs.iter().zip(&placed.inputs) {
            if input.negated {
                let (x, y) = (placed.place.x - 4, placed.place.y + row);
                let _ = writeln!(self.body, r#"<circle class="box" cx="{x}" cy="{y}" r="4"/>"#);
            }
        }
    }

    /// A chart.
    pub fn chart(&mut self, chart: &Chart) {
        let plan = chart::lay_out(chart, self.bottom);
        self.fit(plan.right, plan.bottom);
        for object in &plan.objects {
            for link in &object.inputs {
                self.line("data", &link.points);
            }
        }
        for object in &plan.objects {
            self.part(chart, object.part, object.place);
        }
        self.bottom += LINE;
    }

    fn part(&mut self, chart: &Chart, part: Part, place: Place) {
        let middle = place.y + place.height / 2;
        match part {
            Part::Step(step) => {
                let step = &chart.steps[step];
                let class = if step.active == Some(true) { "active" } else { "box" };
                self.rectangle(class, place);
                if step.is_initial {
                    let inner = Place {
                        x: place.x + 4,
                        y: place.y + 4,
                        width: place.width - 8,
                        height: place.height - 8,
                    };
                    self.rectangle(class, inner);
                }
                self.centred("name", place.middle(), middle, &step.name);
            }
            Part::Actions(step) => self.actions(&chart.steps[step].actions, place),
            Part::Transition(transition) => {
                let ends = [place.x, place.right()].map(|x| Point { x, y: middle });
                let transition = &chart.transitions[transition];
                let (bar, words) = match transition.truth {
                    None => ("bar", "pin"),
                    Some(true) => ("live", "one"),
                    Some(false) => ("bar", "zero"),
                };
                self.line(bar, &ends);
                self.text(words, place.right() + CHARACTER, middle, &transition.condition);
            }
            Part::Jump(step) => {
                let name = &chart.steps[step].name;
                let (x, y) = (place.middle(), place.y);
                let (left, right, below) = (x - 5, x + 5, y + 7);
                let _ = writeln!(
                    self.body,
                    r#"<path class="bar" d="M{left} {y}L{right} {y}L{x} {below}Z"/>"#
                );
                self.centred("name", x, place.y + LINE, name);
            }
            Part::SelectionDivergence | Part::SelectionConvergence => {
                let ends = [place.x, place.right()].map(|x| Point { x, y: middle });
                self.line("bar", &ends);
            }
            Part::SimultaneousDivergence | Part::SimultaneousConvergence => {
                for y in [place.y, place.bottom()] {
                    let ends = [place.x, place.right()].map(|x| Point { x, y });
                    self.line("bar", &ends);
                }
            }
        }
    }

    fn actions(&mut self, actions: &[(String, String)], place: Place) {
        let widest = actions.iter().map(|(when, _)| width(when)).max();
        let column = widest.unwrap_or(0).max(3 * CHARACTER) + CHARACTER;
        let count = i64::try_from(actions.len()).unwrap_or(1).max(1);
        let height = place.height / count;
        for ((when, what), at) in actions.iter().zip(0..) {
            let y = place.y + at * height;
            let row = Place { y, height, ..place };
            self.rectangle("box", row);
            let x = place.x + column;
            let bottom = y + height;
            self.line("data", &[Point { x, y }, Point { x, y: bottom }]);
            let middle = y + height / 2;
            self.text("pin", place.x + CHARACTER / 2, middle, when);
            self.text("name", x + CHARACTER / 2, middle, what);
        }
    }

    fn fit(&mut self, right: i64, bottom: i64) {
        self.right = self.right.max(right);
        self.bottom = self.bottom.max(bottom);
    }

    /// A text whose line has its middle at `y`.
    fn text(&mut self, class: &str, x: i64, y: i64, text: &str) {
        if text.is_empty() {
            return;
        }
        let base = y + BASE;
        let _ = writeln!(
            self.body,
            r#"<text class="{class}" x="{x}" y="{base}">{}</text>"#,
            escaped(text)
        );
        self.fit(x + width(text), y);
    }

    fn centred(&mut self, class: &str, x: i64, y: i64, text: &str) {
        let base = y + BASE;
        let _ = writeln!(
            self.body,
            r#"<text class="{class}" x="{x}" y="{base}" text-anchor="middle">{}</text>"#,
            escaped(text)
        );
    }

    fn rectangle(&mut self, class: &str, place: Place) {
        let Place { x, y, width, height } = place;
        let _ = writeln!(
            self.body,
            r#"<rect class="{class}" x="{x}" y="{y}" width="{width}" height="{height}"/>"#
        );
    }

    fn line(&mut self, class: &str, points: &[Point]) {
        let mut path = String::new();
        for (point, letter) in points.iter().zip(std::iter::once('M').chain(std::iter::repeat('L')))
        {
            let _ = write!(path, "{letter}{} {}", point.x, point.y);
        }
        let _ = writeln!(self.body, r#"<path class="{class}" d="{path}"/>"#);
    }

    /// The picture as a file.
    pub fn svg(self, title: &str) -> String {
        let (width, height) = (self.right + MARGIN, self.bottom + MARGIN);
        format!(
            "<svg class=\"ladder\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
             <title>{}</title>\n<style>\n{STYLE}\n</style>\n<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n{}</svg>\n",
            escaped(title),
            self.body
        )
    }
}

/// What comes into an object of contacts.
struct Inputs {
    /// Where the object begins.
    x: i64,
    powers: Vec<Option<bool>>,
}

fn power(value: Option<&str>) -> Option<bool> {
    match value? {
        "TRUE" => Some(true),
        "FALSE" => Some(false),
        _ => None,
    }
}

fn class_of_wire(power: Option<bool>) -> &'static str {
    match power {
        Some(true) => "live",
        Some(false) => "wire",
        None => "data",
    }
}

fn class_of(value: &str) -> &'static str {
    match value {
        "TRUE" => "one",
        "FALSE" => "zero",
        _ => "title",
    }
}
