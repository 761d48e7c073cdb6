//! What a run came to, as files of its directory.

use understudy_journal::{RunDirectory, RunDirectoryError};

use crate::account::Account;
use crate::figure::{FigureError, figure};
use crate::report::{ReportError, report};
use crate::summary::Summary;

/// Some results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// A file.
    #[error(transparent)]
    Directory(#[from] RunDirectoryError),
    /// The figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The summary.
    #[error("the summary cannot be written as JSON: {0}")]
    Summary(#[from] serde_json::Error),
}

/// Writes the summary, the figure and the report.
///
/// # Errors
/// The first that failed; the others are tried all the same.
pub fn write_results(
    directory: &RunDirectory,
    summary: &Summary,
    account: &Account,
) -> Result<(), ResultsError> {
    let json = serde_json::to_string_pretty(summary)? + "\n";
    let summary_written = directory.write("summary.json", &json);
    let figure = figure(account, summary)?;
    let figure_written = directory.write("figure10.svg", &figure);
    let report_written = directory.write("report.html", &report(summary, &figure)?);
    Ok(summary_written.and(figure_written).and(report_written)?)
}
