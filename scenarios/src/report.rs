//! `report.html`: the whole run in one file, for reading, printing and keeping.

use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use understudy_bus::Quantiles;

use crate::account::Counts;
use crate::summary::Summary;
use crate::table::Table;

const TEMPLATE: &str = include_str!("report.html");

/// The report could not be made.
#[derive(Debug, thiserror::Error)]
#[error("the report could not be made: {0}")]
pub struct ReportError(#[from] minijinja::Error);

/// Makes the report of a run; `figure` is an SVG.
///
/// # Errors
/// [`ReportError`] where the template and the summary do not fit each other.
pub fn report(summary: &Summary, figure: &str) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.add_template("report.html", TEMPLATE)?;
    let template = environment.get_template("report.html")?;
    let count = |counts: &Counts| {
        [
            counts.direct,
            counts.reconstructed,
            counts.held,
            counts.held_by_stall,
            counts.fail_safe + counts.fail_safe_by_stall,
            counts.missed,
            counts.wrong,
        ]
    };
    let counts: Vec<_> = summary
        .remote_ios
        .iter()
        .map(|remote_io| (remote_io.name.clone(), count(&remote_io.counts)))
        .collect();
    let times = |quantiles: &Quantiles| {
        let Quantiles { p50_ns, p99_ns, p999_ns, maximum_ns, .. } = *quantiles;
        [p50_ns, p99_ns, p999_ns, maximum_ns].map(|ns| format!("{:.3}", ns as f64 / 1e6))
    };
    let timed = summary.remote_ios.iter().filter_map(|remote_io| {
        let (taken, late) = (remote_io.sample_to_output.as_ref()?, remote_io.wakeups.as_ref()?);
        Some((remote_io.name.clone(), taken.count, [times(taken), times(late)].concat()))
    });
    let timed: Vec<_> = timed.collect();
    let outages: Vec<String> = summary.outages.iter().map(ToString::to_string).collect();
    Ok(template.render(context! {
        summary => Value::from(Serde(summary)),
        table => Value::from(Serde(Table::new(summary))),
        counts => counts,
        timed => timed,
        outages => outages,
        period_ms => summary.circumstances.period_us as f64 / 1000.0,
        // The figure is this program's own and must not be escaped.
        figure => Value::from_safe_string(figure.to_owned()),
    })?)
}
