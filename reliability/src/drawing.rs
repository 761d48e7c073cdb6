//! Curves and bars as SVG. Colours are few and fixed, so that a style sheet at the head of a page can turn them for a dark one.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::ReliabilityError;

const WIDTH: u32 = 760;
const HEIGHT: u32 = 380;

const INK: RGBColor = RGBColor(0x1a, 0x20, 0x2c);
const GRID: RGBColor = RGBColor(0xd5, 0xda, 0xe1);
const BAND: RGBColor = RGBColor(0xc9, 0xdc, 0xf2);
const COLOURS: [RGBColor; 5] = [
    RGBColor(0x1f, 0x5f, 0xa8),
    RGBColor(0xb4, 0x3c, 0x2e),
    RGBColor(0x2e, 0x7d, 0x4f),
    RGBColor(0x8a, 0x5a, 0x00),
    RGBColor(0x6b, 0x4b, 0x9a),
];

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Logarithmic,
}

/// An axis.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    pub(crate) name: &'static str,
    pub(crate) scale: Scale,
}

/// Where nothing is drawn, so that the legend fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Legend {
    TopRight,
    BottomRight,
    BottomLeft,
}

impl From<Legend> for SeriesLabelPosition {
    fn from(legend: Legend) -> Self {
        match legend {
            Legend::TopRight => Self::UpperRight,
            Legend::BottomRight => Self::LowerRight,
            Legend::BottomLeft => Self::LowerLeft,
        }
    }
}

/// A line through points.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A shaded band: abscissa, lower and upper end.
pub(crate) type Band = Vec<(f64, f64, f64)>;

type Refused = DrawingAreaErrorKind<std::io::Error>;

fn refused(error: impl std::fmt::Display) -> ReliabilityError {
    ReliabilityError::Report { why: error.to_string() }
}

/// Curves over one abscissa, with an optional band behind them.
pub(crate) fn curves(
    x: &Axis,
    y: &Axis,
    curves: &[Curve],
    band: &Band,
    legend: Legend,
) -> Result<String, ReliabilityError> {
    let points = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    let ends = band.iter().flat_map(|&(x, low, high)| [(x, low), (x, high)]);
    let all: Vec<(f64, f64)> = points().chain(ends).collect();
    let (left, right) = bounds(all.iter().map(|point| point.0), x.scale, true);
    let (bottom, top) = bounds(all.iter().map(|point| point.1), y.scale, false);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, HEIGHT)).into_drawing_area();
        let drawn = match (x.scale, y.scale) {
            (Scale::Linear, Scale::Linear) => {
                plot(&area, left..right, bottom..top, (x, y), curves, band, legend)
            }
            (Scale::Linear, Scale::Logarithmic) => {
                plot(&area, left..right, (bottom..top).log_scale(), (x, y), curves, band, legend)
            }
            (Scale::Logarithmic, Scale::Linear) => {
                plot(&area, (left..right).log_scale(), bottom..top, (x, y), curves, band, legend)
            }
            (Scale::Logarithmic, Scale::Logarithmic) => plot(
                &area,
                (left..right).log_scale(),
                (bottom..top).log_scale(),
                (x, y),
                curves,
                band,
                legend,
            ),
        };
        drawn.and_then(|()| area.present()).map_err(refused)?;
    }
    Ok(svg)
}

/// The range of an axis, a little wider than what is on it.
fn bounds(values: impl Iterator<Item = f64>, scale: Scale, tight: bool) -> (f64, f64) {
    let usable =
        values.filter(|value| value.is_finite() && (scale == Scale::Linear || *value > 0.0));
    let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (1.0, 10.0);
    }
    match scale {
        _ if tight && high > low => (low, high),
        Scale::Logarithmic => (low / 1.3, high * 1.3),
        Scale::Linear => (low.min(0.0), if high > 0.0 { high * 1.05 } else { 1.0 }),
    }
}

fn plot<X, Y>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    x_range: X,
    y_range: Y,
    (x, y): (&Axis, &Axis),
    curves: &[Curve],
    band: &Band,
    legend: Legend,
) -> Result<(), Refused>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(x_range, y_range)?;
    chart
        .configure_mesh()
        .x_desc(x.name)
        .y_desc(y.name)
        .x_labels(9)
        .y_labels(8)
        .x_label_formatter(&|value| label(*value))
        .y_label_formatter(&|value| label(*value))
        .label_style(("sans-serif", 12, &INK))
        .axis_desc_style(("sans-serif", 13, &INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .draw()?;
    if !band.is_empty() {
        let upper = band.iter().map(|&(x, _, high)| (x, high));
        let lower = band.iter().rev().map(|&(x, low, _)| (x, low));
        let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
        chart.draw_series([Polygon::new(outline, BAND.filled())])?;
    }
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let style = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(curve.points.iter().copied(), style))?
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], style));
    }
    if curves.len() > 1 || !band.is_empty() {
        chart
            .configure_series_labels()
            .position(legend.into())
            .label_font(("sans-serif", 13, &INK))
            .legend_area_size(28)
            .margin(4)
            .draw()?;
    }
    Ok(())
}

/// A number on an axis, short.
fn label(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-2..1e6).contains(&magnitude) {
        crate::quantity::grouped((value * 1e6).round() / 1e6)
    } else {
        let text = format!("{value:.1e}");
        text.replace(".0e", "e")
    }
}

/// One bar of a tornado: name, and the values at its two ends.
pub(crate) type Bar = (String, f64, f64);

/// Width of the names of a tornado diagram, in pixels.
const NAMES: i32 = 260;

/// Bars around `centre`; on a logarithmic axis where they reach far.
pub(crate) fn tornado(
    x: &'static str,
    centre: f64,
    bars: &[Bar],
) -> Result<String, ReliabilityError> {
    let height = 64 + 34 * bars.len().max(1) as u32;
    let ends = || bars.iter().flat_map(|(_, low, high)| [*low, *high]).chain([centre]);
    let (left, right) = bounds(ends(), Scale::Logarithmic, false);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let drawn = if right / left > 30.0 {
            plot_bars(&area, (left..right).log_scale(), (x, centre), bars)
        } else {
            let (left, right) = bounds(ends(), Scale::Linear, false);
            plot_bars(&area, left..right, (x, centre), bars)
        };
        drawn.and_then(|()| area.present()).map_err(refused)?;
    }
    Ok(svg)
}

fn plot_bars<X>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    range: X,
    (x, centre): (&'static str, f64),
    bars: &[Bar],
) -> Result<(), Refused>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
{
    let rows = bars.len().max(1) as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(44)
        .margin_left(NAMES as u32)
        .build_cartesian_2d(range, 0.0..rows)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .disable_y_axis()
        .x_desc(x)
        .x_labels(7)
        .x_label_formatter(&|value| label(*value))
        .label_style(("sans-serif", 12, &INK))
        .axis_desc_style(("sans-serif", 13, &INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .draw()?;
    let style = TextStyle::from(("sans-serif", 13).into_font())
        .color(&INK)
        .pos(Pos::new(HPos::Right, VPos::Center));
    for (place, (name, halved, doubled)) in bars.iter().enumerate() {
        let base = rows - 1.0 - place as f64;
        for (value, colour) in [(halved, COLOURS[1]), (doubled, COLOURS[0])] {
            let corners = [(centre, base + 0.2), (*value, base + 0.8)];
            chart.draw_series([Rectangle::new(corners, colour.filled())])?;
        }
        let (_, y) = chart.backend_coord(&(centre, base + 0.5));
        area.draw_text(name, &style, (NAMES - 10, y))?;
    }
    let line = [(centre, 0.0), (centre, rows)];
    chart.draw_series(LineSeries::new(line, INK.stroke_width(1)))?;
    Ok(())
}
