//! `failover.svg`: the share of lost cycles over the share of lost frames, a line for each contender.

use plotters::prelude::*;

use crate::compare::{Comparison, LOSSES};

const SIZE: (u32, u32) = (820, 460);

/// What was never lost is drawn here, in percent: a logarithmic axis has no zero.
const FLOOR: f64 = 1e-3;

const INK: RGBColor = RGBColor(0x1a, 0x20, 0x2c);
const GRID: RGBColor = RGBColor(0xd5, 0xda, 0xe1);

/// Told apart by lightness too; the cluster is the first.
const COLOURS: [RGBColor; 5] = [
    RGBColor(0x1f, 0x5f, 0xa8),
    RGBColor(0xc0, 0x39, 0x2b),
    RGBColor(0xd6, 0x8a, 0x1e),
    RGBColor(0x7d, 0x5b, 0xa6),
    RGBColor(0x2e, 0x7d, 0x4f),
];

/// The figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the figure could not be drawn: {0}")]
pub struct FigureError(String);

/// The figure as SVG.
///
/// # Errors
/// [`FigureError`] where the plotting library refuses.
pub fn figure(comparison: &Comparison) -> Result<String, FigureError> {
    let mut svg = String::new();
    draw(&mut svg, comparison).map_err(|error| FigureError(error.to_string()))?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    comparison: &Comparison,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let percent = |share: f64| share * 100.0;
    let losses = percent(LOSSES[0])..percent(LOSSES[LOSSES.len() - 1]);
    let title = format!(
        "Cycles lost to lost frames, {} copies of each frame, {} cycles at each point",
        comparison.plan.copies, comparison.plan.cycles
    );
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 16, &INK))
        .margin(14)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(losses.log_scale(), (FLOOR..100.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("frames lost, %")
        .y_desc("cycles lost, % (0.001: none)")
        .x_label_formatter(&|value| format!("{value}"))
        .y_label_formatter(&|value| format!("{value}"))
        .label_style(("sans-serif", 12, &INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .draw()?;
    for (place, contender) in comparison.contenders.iter().enumerate() {
        let colour = COLOURS[place % COLOURS.len()];
        let width = if place == 0 { 3 } else { 2 };
        let points: Vec<(f64, f64)> = contender
            .lost_share
            .iter()
            .map(|point| (percent(point.loss), percent(point.lost).max(FLOOR)))
            .collect();
        chart
            .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(width)))?
            .label(&contender.name)
            .legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(width))
            });
        let dots = points.iter().map(|&point| Circle::new(point, 3, colour.filled()));
        chart.draw_series(dots)?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(("sans-serif", 13, &INK))
        .draw()?;
    area.present()
}
