//! A film as SVG. CSS moves it: pages that show pictures run no script, and a reader who asks for less motion sees a still.

mod signs;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use understudy_journal::source_word;
use understudy_text::markup::escaped;
use understudy_wire::Source;

use super::{Applied, Film, Level, Output};
use crate::timeline::Span;
use signs::{Sign, of_source, of_state};

const WIDTH: f64 = 860.0;
/// The traces, from left to right.
const PLOT: (f64, f64) = (150.0, 836.0);
const STATIONS_TOP: f64 = 74.0;
/// Of a station and of the remote I/O.
const FRAME_HEIGHT: f64 = 46.0;
const REMOTE_IO_TOP: f64 = 172.0;
const REMOTE_IO_WIDTH: f64 = 380.0;
const BAND_TOP: f64 = 262.0;
const BAND_HEIGHT: f64 = 18.0;
const LANE_HEIGHT: f64 = 27.0;
/// The height of a 1 above a 0, and of the greatest value above the least one.
const STEP_HEIGHT: f64 = 15.0;
/// The width of a letter of a value at its trace, in units of the picture.
const LETTER_WIDTH: f64 = 7.0;

/// Of one turn, in seconds, and the share of it in which the cursor moves; then the whole picture stays.
const TURN_S: f64 = 14.0;
const MOVING: f64 = 0.86;

const STYLE: &str = "\
text{font:13px system-ui,-apple-system,'Segoe UI',sans-serif;fill:#1b2530}
.title{font-size:18px;font-weight:bold}.note{font-size:12px;fill:#51606f}.name{font-weight:bold}.state{font-weight:bold;text-anchor:end}
.on-colour{fill:#fff;font-size:12px;font-weight:bold}.number{font-size:12px;fill:#51606f;text-anchor:middle}
.zero{stroke:#c3ccd6;stroke-width:1}.tick{stroke:#51606f}.trace{fill:none;stroke-width:2.5}
.fault{stroke:#a8220e;stroke-width:1.5;stroke-dasharray:4 3}.fault-words{font-size:12px;fill:#a8220e;font-weight:bold}.end{text-anchor:end}
";

impl Film {
    /// Draws it.
    pub fn to_svg(&self) -> String {
        let mut drawing = Drawing::new(self);
        drawing.heading();
        drawing.stations();
        drawing.remote_io();
        drawing.band();
        drawing.lanes();
        drawing.faults();
        drawing.axis();
        drawing.cursor();
        drawing.finish()
    }

    /// Where `cycle` is drawn: distance from the left edge of the picture, in its units.
    fn x(&self, cycle: i64) -> f64 {
        PLOT.0 + (PLOT.1 - PLOT.0) * self.share(cycle)
    }

    /// When the cursor is there, in percent of a turn.
    fn percent(&self, cycle: i64) -> f64 {
        100.0 * MOVING * self.share(cycle)
    }

    fn share(&self, cycle: i64) -> f64 {
        let (from, to) = self.cycles;
        (cycle - from) as f64 / (to - from) as f64
    }

    /// The cycle that a still shows: the middle of the first outputs that were not direct, or the last.
    fn still(&self) -> i64 {
        let mut spans = self.sources.iter();
        let other = spans.find(|span| span.value.source != Source::Direct);
        other.map_or(self.cycles.1 - 1, |span| span.from + (span.to - span.from) / 2)
    }
}

struct Drawing<'f> {
    film: &'f Film,
    style: String,
    body: String,
    /// Animations so far.
    count: usize,
}

impl<'f> Drawing<'f> {
    fn new(film: &'f Film) -> Self {
        Self { film, style: String::new(), body: String::new(), count: 0 }
    }

    fn bottom(&self) -> f64 {
        BAND_TOP + BAND_HEIGHT + 10.0 + LANE_HEIGHT * self.film.outputs.len() as f64
    }

    fn text(&mut self, (x, y): (f64, f64), class: &str, text: &str) {
        let text = escaped(text);
        let _ =
            writeln!(self.body, "<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{text}</text>");
    }

    fn upright(&mut self, x: f64, (top, bottom): (f64, f64), class: &str) {
        let _ = writeln!(
            self.body,
            "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\" class=\"{class}\"/>"
        );
    }

    /// What `draw` draws is seen while the cursor is within `spans`.
    fn during(&mut self, spans: &[(i64, i64)], draw: impl FnOnce(&mut Self)) {
        let (from, to) = self.film.cycles;
        if spans == [(from, to)] {
            return draw(self);
        }
        let name = format!("k{}", self.count);
        self.count += 1;
        let begins_later = spans.first().is_some_and(|&(begin, _)| begin > from);
        let mut frames = String::from(if begins_later { "0%{opacity:0}" } else { "" });
        for &(begin, end) in spans {
            let _ = write!(frames, "{:.2}%{{opacity:1}}", self.film.percent(begin));
            if end < to {
                let _ = write!(frames, "{:.2}%{{opacity:0}}", self.film.percent(end));
            }
        }
        let still = self.film.still();
        let mut ranges = spans.iter();
        let opacity = u8::from(ranges.any(|&(begin, end)| (begin..end).contains(&still)));
        let _ = writeln!(
            self.style,
            ".{name}{{opacity:{opacity};animation:{name} {TURN_S}s step-end infinite}}@keyframes {name}{{{frames}}}"
        );
        let _ = writeln!(self.body, "<g class=\"{name}\">");
        draw(self);
        self.body.push_str("</g>\n");
    }

    fn heading(&mut self) {
        let film = self.film;
        let (from, last) = film.cycles();
        let period_ms = film.period_us as f64 / 1000.0;
        let title = format!("The outputs of {} in a recorded run", film.program);
        self.text((24.0, 30.0), "title", &title);
        let recorded = (last + 1 - from) as f64 * period_ms / 1000.0;
        let shown = TURN_S * MOVING;
        let words = format!(
            "{}: cycles {from} to {last} of {period_ms} ms each; {recorded:.1} s, shown in {shown:.0} s{}",
            film.cluster,
            match film.further {
                0 => String::new(),
                further => format!("; {further} more outputs are not shown"),
            }
        );
        self.text((24.0, 50.0), "note", &words);
    }

    /// A frame with a sign and a word at its right.
    fn frame(&mut self, (x, y, width): (f64, f64, f64), sign: &Sign, word: &str) {
        let (colour, dashes) = (sign.colour, sign.dashes);
        let _ = writeln!(
            self.body,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{FRAME_HEIGHT}\" rx=\"6\" fill=\"#fff\" \
             stroke=\"{colour}\" stroke-width=\"2.5\" stroke-dasharray=\"{dashes}\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" class=\"state\" style=\"fill:{colour}\">{} {word}</text>",
            x + width - 12.0,
            y + 28.0,
            sign.sign
        );
    }

    fn name(&mut self, (x, y): (f64, f64), name: &str, kind: &str) {
        self.text((x + 12.0, y + 20.0), "name", name);
        self.text((x + 12.0, y + 37.0), "note", kind);
    }

    /// Left edge and width of a station's frame.
    fn place(&self, station: usize) -> (f64, f64) {
        let width = (WIDTH - 24.0) / self.film.stations.len().max(1) as f64;
        (24.0 + width * station as f64, width - 24.0)
    }

    fn stations(&mut self) {
        let film = self.film;
        for (place, station) in film.stations.iter().enumerate() {
            let (x, width) = self.place(place);
            for (state, spans) in by_value(&station.states) {
                self.during(&spans, |drawing| {
                    drawing.frame((x, STATIONS_TOP, width), &of_state(state), state.text());
                });
            }
            let kind = match station.understudy {
                true => "generated station",
                false => "controller",
            };
            self.name((x, STATIONS_TOP), &station.name, kind);
        }
    }

    fn remote_io(&mut self) {
        let film = self.film;
        let x = (WIDTH - REMOTE_IO_WIDTH) / 2.0;
        for (applied, spans) in by_value(&film.sources) {
            self.during(&spans, |drawing| {
                drawing.flow(applied);
                let sign = of_source(applied.source);
                let word = source_word(applied.source);
                drawing.frame((x, REMOTE_IO_TOP, REMOTE_IO_WIDTH), &sign, word);
            });
        }
        self.name((x, REMOTE_IO_TOP), &film.remote_io, "remote I/O, drives the outputs");
    }

    /// From the station whose frame the outputs come from to the remote I/O.
    fn flow(&mut self, applied: Applied) {
        let Some(sender) = applied.sender else {
            return;
        };
        let sign = of_source(applied.source);
        let (left, width) = self.place(sender);
        let (from, middle) = (left + width / 2.0, WIDTH / 2.0);
        let (top, bottom) = (STATIONS_TOP + FRAME_HEIGHT, REMOTE_IO_TOP);
        let bend = (top + bottom) / 2.0;
        let _ = writeln!(
            self.body,
            "<path d=\"M{from:.1} {top}V{bend}H{middle}V{bottom}\" fill=\"none\" stroke=\"{}\" stroke-width=\"4\" stroke-dasharray=\"{}\"/>",
            sign.colour, sign.dashes
        );
    }

    fn band(&mut self) {
        let film = self.film;
        self.text((24.0, BAND_TOP + 13.0), "lane", "source");
        for span in &film.sources {
            let sign = of_source(span.value.source);
            let (left, right) = (film.x(span.from), film.x(span.to));
            let width = right - left;
            let _ = writeln!(
                self.body,
                "<rect x=\"{left:.1}\" y=\"{BAND_TOP}\" width=\"{width:.1}\" height=\"{BAND_HEIGHT}\" fill=\"{}\"/>",
                sign.colour
            );
            let words = format!("{} {}", sign.sign, source_word(span.value.source));
            if width > 8.0 * words.chars().count() as f64 {
                self.text((left + 6.0, BAND_TOP + 13.0), "on-colour", &words);
            }
        }
    }

    fn lanes(&mut self) {
        let film = self.film;
        for (place, output) in film.outputs.iter().enumerate() {
            let zero = BAND_TOP + BAND_HEIGHT + 4.0 + LANE_HEIGHT * (place + 1) as f64;
            self.text((24.0, zero), "lane", &output.name);
            self.values(zero, output);
            let _ = writeln!(
                self.body,
                "<line x1=\"{}\" x2=\"{}\" y1=\"{zero:.1}\" y2=\"{zero:.1}\" class=\"zero\"/>",
                PLOT.0, PLOT.1
            );
            for source in &film.sources {
                let path = self.trace(&output.values, source, zero);
                let colour = of_source(source.value.source).colour;
                let _ =
                    writeln!(self.body, "<path d=\"{path}\" class=\"trace\" stroke=\"{colour}\"/>");
            }
        }
    }

    /// The values of a number where there is room, above the trace in the lower half and below it in the upper one; where there is not for each
    /// of them, their range above the name.
    fn values(&mut self, zero: f64, output: &Output) {
        let Some((least, most)) = &output.range else {
            return;
        };
        let mut shown = BTreeSet::new();
        for span in &output.values {
            let Level { share, text } = &span.value;
            let Some(text) = text else {
                continue;
            };
            let (left, right) = (self.film.x(span.from), self.film.x(span.to));
            if right - left > LETTER_WIDTH * (text.chars().count() + 1) as f64 {
                let y = zero - STEP_HEIGHT * share + if *share < 0.5 { -4.0 } else { 11.0 };
                self.text((left + 3.0, y), "note", text);
                shown.insert(text);
            }
        }
        let mut texts = output.values.iter().filter_map(|span| span.value.text.as_ref());
        let range = format!("{least} to {most}");
        let fits = LETTER_WIDTH * range.chars().count() as f64 <= PLOT.0 - 24.0;
        if fits && texts.any(|text| !shown.contains(text)) {
            self.text((24.0, zero - 13.0), "note", &range);
        }
    }

    /// The values while they had one source.
    fn trace(&self, values: &[Span<Level>], source: &Span<Applied>, zero: f64) -> String {
        let mut path = String::new();
        for value in values {
            let (from, to) = (value.from.max(source.from), value.to.min(source.to));
            if from >= to {
                continue;
            }
            let y = zero - STEP_HEIGHT * value.value.share;
            let (left, right) = (self.film.x(from), self.film.x(to));
            let _ = match path.is_empty() {
                true => write!(path, "M{left:.1} {y:.1}H{right:.1}"),
                false => write!(path, "V{y:.1}H{right:.1}"),
            };
        }
        path
    }

    fn faults(&mut self) {
        let film = self.film;
        let bottom = self.bottom();
        for (cycle, text) in &film.faults {
            let x = film.x(*cycle);
            self.upright(x, (BAND_TOP - 8.0, bottom), "fault");
            let class = match x > PLOT.1 - 160.0 {
                true => "fault-words end",
                false => "fault-words",
            };
            self.text((x, BAND_TOP - 13.0), class, text);
        }
    }

    fn axis(&mut self) {
        let film = self.film;
        let bottom = self.bottom();
        let (from, to) = film.cycles;
        let mut steps = [10, 20, 50, 100, 200, 500].into_iter();
        let step = steps.find(|step| (to - from) / step <= 10).unwrap_or(1000);
        let first = from + (-from).rem_euclid(step);
        self.text((24.0, bottom + 20.0), "lane", "cycle");
        let mut cycle = first;
        while cycle < to {
            let x = film.x(cycle);
            self.upright(x, (bottom, bottom + 5.0), "tick");
            self.text((x, bottom + 20.0), "number", &cycle.to_string());
            cycle += step;
        }
    }

    /// A veil over what is still to come, and its edge.
    fn cursor(&mut self) {
        let (left, width) = (PLOT.0, PLOT.1 - PLOT.0);
        let (top, bottom) = (BAND_TOP - 28.0, self.bottom());
        let height = bottom - top;
        let _ = writeln!(
            self.style,
            ".veil{{opacity:0;animation:veil {TURN_S}s linear infinite}}\
             @keyframes veil{{0%{{transform:translateX(0);opacity:1}}{:.2}%,100%{{transform:translateX({width}px);opacity:1}}}}",
            100.0 * MOVING
        );
        let _ = writeln!(
            self.body,
            "<clipPath id=\"plot\"><rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height:.1}\"/></clipPath>\n\
             <g clip-path=\"url(#plot)\"><g class=\"veil\">\
             <rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height:.1}\" fill=\"#f6f8fa\" fill-opacity=\".86\"/>\
             <line x1=\"{left}\" x2=\"{left}\" y1=\"{top}\" y2=\"{bottom:.1}\" stroke=\"#1b2530\" stroke-width=\"3\"/></g></g>"
        );
    }

    fn finish(self) -> String {
        let height = self.bottom() + 34.0;
        let label = escaped(&format!(
            "The stations and the remote I/O, and the outputs of {} below, while a cursor passes over the cycles",
            self.film.program
        ));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\">\n\
             <style>\n{STYLE}{}@media (prefers-reduced-motion:reduce){{*{{animation:none!important}}}}\n</style>\n\
             <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#f6f8fa\"/>\n{}</svg>\n",
            self.style, self.body
        )
    }
}

/// The ranges of cycles of each value, in the order in which values come.
fn by_value<T: Copy + PartialEq>(spans: &[Span<T>]) -> Vec<(T, Vec<(i64, i64)>)> {
    let mut found: Vec<(T, Vec<(i64, i64)>)> = Vec::new();
    for span in spans {
        let range = (span.from, span.to);
        match found.iter_mut().find(|(value, _)| *value == span.value) {
            Some((_, ranges)) => ranges.push(range),
            None => found.push((span.value, vec![range])),
        }
    }
    found
}
