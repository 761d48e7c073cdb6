//! `figure10.svg`: the run as figure 10 shows it. A panel for each plant, each controller and each understudy, cycles to the right,
//! every signal a line that is high or low; cycles in which a station was off or joining are shaded.
//!
//! Colours are few and fixed, so that a style sheet at the head of the file can turn them for a dark page.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use understudy_cluster::{same_point, value_text};
use understudy_journal::Members;
use understudy_typed::{Elementary, Point, Points};
use understudy_wire::{Image, ProgramId};

use crate::account::{Account, Interval, Presence, Service, TRACED_CYCLES, Trace};
use crate::summary::Summary;

/// Names of a program's signals, and of what moves in its plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signals {
    /// u, bit by bit.
    pub inputs: Vec<String>,
    /// y, bit by bit.
    pub outputs: Vec<String>,
    /// u, point by point.
    pub input_points: Points,
    /// y, point by point: from a cycle on, those of the version of the program that counted. The first ones from 0.
    pub output_points: Vec<(u64, Points)>,
    /// Whether some inputs do not come from the field, so that u is what the remote I/O samples.
    pub sourced: bool,
    /// Moving parts of its simulated plant, in order.
    pub positions: Vec<String>,
}

const WIDTH: u32 = 1100;
const LABELS_WIDTH: i32 = 150;
const LANE_HEIGHT: u32 = 17;
const PANEL_MARGIN: u32 = 58;

/// Lanes of one panel, at most.
const MAXIMUM_LANES: usize = 24;
/// Heights of a number in its lane, more than a screen tells apart: a slow signal is a few steps, and not one for each cycle.
const HEIGHTS: f64 = 32.0;

const INK: RGBColor = RGBColor(0x1a, 0x20, 0x2c);
const GRID: RGBColor = RGBColor(0xd5, 0xda, 0xe1);
const SIGNAL: RGBColor = RGBColor(0x1f, 0x5f, 0xa8);
const POSITION: RGBColor = RGBColor(0x2e, 0x7d, 0x4f);
const OFF: RGBColor = RGBColor(0xf3, 0xc6, 0xc1);
const JOINING: RGBColor = RGBColor(0xf9, 0xe3, 0xb4);

/// Turns the colours above for a dark page; they are written in capitals by the backend.
const STYLE: &str = "<style>\
text{font-family:system-ui,sans-serif}\
@media (prefers-color-scheme:dark){\
[fill=\"#1A202C\"]{fill:#e2e8f0}[stroke=\"#1A202C\"]{stroke:#e2e8f0}\
[stroke=\"#D5DAE1\"]{stroke:#3a4452}\
[stroke=\"#1F5FA8\"]{stroke:#7db4f0}[stroke=\"#2E7D4F\"]{stroke:#7fcf9f}\
[fill=\"#F3C6C1\"]{fill:#6b2f2a}[fill=\"#F9E3B4\"]{fill:#5c4a1c}\
}</style>";

/// The figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the figure could not be drawn: {0}")]
pub struct FigureError(String);

/// A step of a lane: from cycle, to cycle, height from 0 to 1 at the end of it.
type Step = (u64, u64, f64);

struct Lane {
    name: String,
    colour: RGBColor,
    steps: Vec<Step>,
}

struct Panel {
    title: String,
    lanes: Vec<Lane>,
    shades: Vec<(u64, u64, RGBColor)>,
}

impl Panel {
    fn height(&self) -> u32 {
        PANEL_MARGIN + LANE_HEIGHT * self.lanes.len().max(1) as u32
    }
}

/// Draws the figure of a run.
///
/// # Errors
/// [`FigureError`] where the plotting library refuses.
pub fn figure(account: &Account, summary: &Summary) -> Result<String, FigureError> {
    let panels = panels(account, summary);
    let end = summary.cycles_run.clamp(1, TRACED_CYCLES);
    let mut svg = String::new();
    draw(&mut svg, &panels, end).map_err(|error| FigureError(error.to_string()))?;
    // The style sheet belongs behind the opening tag.
    let place = svg.find("<svg").and_then(|tag| Some(tag + svg[tag..].find('>')? + 1));
    if let Some(place) = place {
        svg.insert_str(place, STYLE);
    }
    Ok(svg)
}

fn draw(
    svg: &mut String,
    panels: &[Panel],
    end: u64,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let height = panels.iter().map(Panel::height).sum::<u32>() + 12;
    let backend = SVGBackend::with_string(svg, (WIDTH, height));
    let mut rest = backend.into_drawing_area();
    for panel in panels {
        let (area, below) = rest.split_vertically(panel.height());
        draw_panel(&area, panel, end)?;
        rest = below;
    }
    rest.present()
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw_panel(
    area: &Area<'_>,
    panel: &Panel,
    end: u64,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let lanes = panel.lanes.len().max(1);
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15, &INK))
        .margin_right(16)
        .x_label_area_size(24)
        .y_label_area_size(LABELS_WIDTH)
        .build_cartesian_2d(0.0..end as f64, 0.0..lanes as f64)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .disable_y_axis()
        .y_labels(0)
        .x_labels(11)
        .x_label_formatter(&|cycle| format!("{cycle:.0}"))
        .label_style(("sans-serif", 11, &INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .draw()?;
    let shades = panel.shades.iter().map(|(from, to, colour)| {
        let corners = [(*from as f64, 0.0), ((*to).min(end) as f64, lanes as f64)];
        Rectangle::new(corners, colour.filled())
    });
    chart.draw_series(shades)?;
    let (left, top) = area.get_base_pixel();
    for (index, lane) in panel.lanes.iter().enumerate() {
        let base = (lanes - 1 - index) as f64;
        draw_lane(&mut chart, lane, base)?;
        let (_, y) = chart.backend_coord(&(0.0, base + 0.42));
        let style = TextStyle::from(("sans-serif", 11).into_font()).color(&INK).pos(
            plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Right,
                plotters::style::text_anchor::VPos::Center,
            ),
        );
        let place = (LABELS_WIDTH - 8 - left + left, y - top);
        area.draw_text(&lane.name, &style, place)?;
    }
    Ok(())
}

fn draw_lane<'a>(
    chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
    lane: &Lane,
    base: f64,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    let mut known_up_to = None;
    let mut lines = Vec::new();
    for &(from, to, height) in &lane.steps {
        if known_up_to != Some(from) {
            lines.push(std::mem::take(&mut line));
        }
        let y = base + 0.12 + 0.66 * height;
        line.extend([(from as f64, y), (to as f64, y)]);
        known_up_to = Some(to);
    }
    lines.push(line);
    let style = lane.colour.stroke_width(1);
    chart.draw_series(
        lines.into_iter().filter(|line| !line.is_empty()).map(|line| PathElement::new(line, style)),
    )?;
    Ok(())
}

// ── what is in the panels ────────────────────────────────────────────────────────────────────────────────────────────

fn panels(account: &Account, summary: &Summary) -> Vec<Panel> {
    let terms = &account.terms;
    let mut panels = Vec::new();
    let letters = (0..).map(|index: usize| {
        // a to z, then by number.
        u8::try_from(index)
            .ok()
            .filter(|index| *index < 26)
            .map_or_else(|| (index + 1).to_string(), |index| char::from(b'a' + index).to_string())
    });
    let mut letters = letters;
    let mut letter = || letters.next().unwrap_or_default();
    for (program, plant_name) in terms.members.plants() {
        let trace = &account.traces.plants[program.index()];
        let mut lanes = Vec::new();
        let mut shown = "sensors";
        if let Some(signals) = terms.signals.get(program.index()) {
            if !signals.positions.is_empty() {
                shown = "positions and sensors";
            }
            if signals.sourced {
                shown = "inputs";
            }
            lanes.extend(position_lanes(&trace.positions, &signals.positions));
            let points = [(0, signals.input_points.clone())];
            let unit = |name: &str| unit_of(&terms.members, program, name);
            lanes.extend(point_lanes(&trace.sensors, &points, unit));
        }
        let summary = summary.plants.iter().find(|plant| plant.name == plant_name);
        panels.push(Panel {
            title: format!("({}) plant {plant_name}: {shown}", letter()),
            lanes: bounded(lanes),
            shades: summary.map_or_else(Vec::new, |plant| service_shades(&plant.intervals)),
        });
    }
    for (station, name) in terms.members.stations() {
        let trace = &account.traces.stations[station.index()];
        let understudy = terms.agreement.schedule.is_understudy(station);
        let width = trace.spans().map(|(_, _, image)| image.width()).max();
        let lanes = if understudy {
            let bits = 1..=width.unwrap_or(0);
            let names: Vec<String> = bits.map(|bit| format!("parity {bit}")).collect();
            bit_lanes(trace, &names)
        } else {
            let signals = terms.signals.get(station.index());
            let unit = |name: &str| unit_of(&terms.members, ProgramId(station.0), name);
            signals.map_or_else(Vec::new, |own| point_lanes(trace, &own.output_points, unit))
        };
        let kind = if understudy { "understudy" } else { "controller" };
        let what = if understudy { "parity outputs" } else { "outputs" };
        panels.push(Panel {
            title: if name == kind {
                format!("({}) {name}: {what}", letter())
            } else {
                format!("({}) {kind} {name}: {what}", letter())
            },
            lanes: bounded(lanes),
            shades: summary
                .stations
                .get(station.index())
                .map_or_else(Vec::new, |station| presence_shades(&station.intervals)),
        });
    }
    panels
}

/// A panel stays readable: the lanes past the bound are left out, and the last one says how many.
fn bounded(mut lanes: Vec<Lane>) -> Vec<Lane> {
    if lanes.len() > MAXIMUM_LANES {
        let left_out = lanes.len() - MAXIMUM_LANES + 1;
        lanes.truncate(MAXIMUM_LANES - 1);
        lanes.push(Lane { name: format!("({left_out} more)"), colour: SIGNAL, steps: Vec::new() });
    }
    lanes
}

fn bit_lanes(trace: &Trace<Image>, names: &[String]) -> Vec<Lane> {
    names
        .iter()
        .enumerate()
        .map(|(bit, name)| Lane {
            name: name.clone(),
            colour: SIGNAL,
            steps: joined(
                trace
                    .spans()
                    .map(|(from, to, image)| (from, to, if image.get(bit) { 1.0 } else { 0.0 })),
            ),
        })
        .collect()
}

/// The stored values of a point, where the program had it by name and type.
fn values_of<'a>(
    trace: &'a Trace<Image>,
    stretches: &'a [(u64, Points)],
    point: &'a Point,
) -> impl Iterator<Item = (u64, u64, u64)> + 'a {
    let ends = stretches.iter().skip(1).map(|(from, _)| *from).chain([u64::MAX]);
    let own = stretches.iter().zip(ends).filter_map(move |((begin, points), end)| {
        Some((*begin, end, points.width(), same_point(point, points)?))
    });
    own.flat_map(|(begin, end, width, own)| {
        let spans = trace.spans().filter(move |(.., image)| image.width() >= width);
        let within = spans.map(move |(from, to, image)| (from.max(begin), to.min(end), image));
        let within = within.filter(|(from, to, _)| from < to);
        within.map(move |(from, to, image)| (from, to, own.get(image.words())))
    })
}

/// A lane for each point that the program had: high and low for a BOOL; a number lies between its least and its greatest value, which stand behind its name.
fn point_lanes(
    trace: &Trace<Image>,
    stretches: &[(u64, Points)],
    unit: impl Fn(&str) -> String,
) -> Vec<Lane> {
    let mut all: Vec<&Point> = Vec::new();
    for (place, (_, points)) in stretches.iter().enumerate() {
        let is_new = |point: &&Point| {
            stretches[..place].iter().all(|(_, before)| same_point(point, before).is_none())
        };
        all.extend(points.iter().filter(is_new));
    }
    let lanes = all.into_iter().map(|point| {
        let values = || values_of(trace, stretches, point);
        let ends = ends(point, values().map(|(.., stored)| stored));
        let (name, share): (String, Box<dyn Fn(f64) -> f64>) = match ends {
            _ if point.of == Elementary::Bool => (point.name.clone(), Box::new(|value| value)),
            Some((low, high)) if point.of.number(low) < point.of.number(high) => {
                let (least, most) = (text(point, low), text(point, high));
                let name = format!("{} {least} … {most}{}", point.name, unit(&point.name));
                let (low, high) = (point.of.number(low), point.of.number(high));
                let share =
                    move |value: f64| ((value - low) / (high - low) * HEIGHTS).round() / HEIGHTS;
                (name, Box::new(share))
            }
            Some((low, _)) => {
                let name = format!("{} {}{}", point.name, text(point, low), unit(&point.name));
                (name, Box::new(|_| 0.5))
            }
            None => (point.name.clone(), Box::new(|_| 0.5)),
        };
        let values = values().map(|(from, to, stored)| (from, to, point.of.number(stored)));
        let known = values.filter(|(.., value)| value.is_finite());
        Lane {
            name,
            colour: SIGNAL,
            steps: joined(known.map(|(from, to, value)| (from, to, share(value)))),
        }
    });
    lanes.collect()
}

/// The unit of an input or output, as it stands behind a value.
fn unit_of(members: &Members, program: ProgramId, name: &str) -> String {
    let mut signals = members.inputs(program).chain(members.outputs(program));
    let signal = signals.find(|signal| signal.name == name);
    signal.map_or_else(String::new, |signal| signal.card.with_unit(String::new()))
}

/// The least and the greatest of these stored values; nothing where none is a number.
fn ends(point: &Point, stored: impl Iterator<Item = u64>) -> Option<(u64, u64)> {
    let finite = stored.filter(|value| point.of.number(*value).is_finite());
    finite.fold(None, |ends: Option<(u64, u64)>, value| {
        let (low, high) = ends.unwrap_or((value, value));
        let low = if point.of.number(value) < point.of.number(low) { value } else { low };
        let high = if point.of.number(value) > point.of.number(high) { value } else { high };
        Some((low, high))
    })
}

/// A stored value as every view has it; a real with at most four significant digits.
fn text(point: &Point, stored: u64) -> String {
    match point.of.is_real() {
        true => short(point.of.number(stored)),
        // A file has some of them in quotes.
        false => value_text(&point.declared(), stored).replace('"', ""),
    }
}

/// At most four significant digits.
fn short(value: f64) -> String {
    let whole = value.abs().log10().floor().max(0.0) as usize;
    let text = format!("{value:.*}", 3_usize.saturating_sub(whole));
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn position_lanes(trace: &Trace<Vec<u16>>, names: &[String]) -> Vec<Lane> {
    names
        .iter()
        .enumerate()
        .map(|(index, name)| Lane {
            name: name.clone(),
            colour: POSITION,
            steps: joined(trace.spans().map(|(from, to, positions)| {
                let position = positions.get(index).copied().unwrap_or_default();
                (from, to, f64::from(position) / 1000.0)
            })),
        })
        .collect()
}

/// Neighbours of equal height become one step.
fn joined(steps: impl Iterator<Item = Step>) -> Vec<Step> {
    let mut joined: Vec<Step> = Vec::new();
    for (from, to, height) in steps {
        match joined.last_mut() {
            Some((_, end, last)) if *end == from && (*last - height).abs() < f64::EPSILON => {
                *end = to
            }
            _ => joined.push((from, to, height)),
        }
    }
    joined
}

fn presence_shades(intervals: &[Interval<Presence>]) -> Vec<(u64, u64, RGBColor)> {
    intervals
        .iter()
        .filter_map(|interval| {
            let colour = match interval.state {
                Presence::On => return None,
                Presence::Off => OFF,
                Presence::Joining => JOINING,
            };
            Some((interval.from, interval.to, colour))
        })
        .collect()
}

fn service_shades(intervals: &[Interval<Service>]) -> Vec<(u64, u64, RGBColor)> {
    intervals
        .iter()
        .filter_map(|interval| {
            let colour = match interval.state {
                Service::Functional => return None,
                Service::Held => JOINING,
                Service::FailSafe | Service::Wrong | Service::Missed => OFF,
            };
            Some((interval.from, interval.to, colour))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point that stays is one lane, at whichever place it is; the lane of any other one begins or ends with the points.
    #[test]
    fn a_lane_has_the_values_of_its_point_wherever_that_is() {
        let points = |all: &[(&str, Elementary)]| {
            let mut points = Points::default();
            all.iter().for_each(|(name, of)| points.push(*name, *of, 0));
            points
        };
        let [bool, int] = [Elementary::Bool, Elementary::Int];
        let before = points(&[("stays", bool), ("goes", bool), ("retyped", bool)]);
        let after = points(&[("comes", int), ("retyped", int), ("stays", bool)]);
        let image = |points: &Points, values: &[(&str, u64)]| {
            let mut image = Image::zero(points.width());
            for (name, value) in values {
                let point = points.find(name).expect("a point");
                point.set(image.words_mut(), *value);
            }
            image
        };
        let mut trace = Trace::default();
        trace.push(0, &image(&before, &[("stays", 0), ("goes", 1), ("retyped", 1)]));
        trace.push(1, &image(&before, &[("stays", 1), ("goes", 1), ("retyped", 0)]));
        trace.push(2, &image(&after, &[("stays", 1), ("comes", 5), ("retyped", 7)]));
        trace.push(3, &image(&after, &[("stays", 0), ("comes", 9), ("retyped", 7)]));
        let lanes = point_lanes(&trace, &[(0, before), (2, after)], |_| String::new());
        let found: Vec<(&str, &[Step])> =
            lanes.iter().map(|lane| (lane.name.as_str(), &lane.steps[..])).collect();
        let expected: [(&str, &[Step]); 5] = [
            ("stays", &[(0, 1, 0.0), (1, 3, 1.0), (3, 4, 0.0)]),
            ("goes", &[(0, 2, 1.0)]),
            ("retyped", &[(0, 1, 1.0), (1, 2, 0.0)]),
            ("comes 5 … 9", &[(2, 3, 0.0), (3, 4, 1.0)]),
            ("retyped 7", &[(2, 4, 0.5)]),
        ];
        assert_eq!(found, expected);
    }
}
