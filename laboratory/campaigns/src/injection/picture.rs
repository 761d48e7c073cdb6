//! `campaign.html`: the coverage as a heat picture, and what was found.

use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

use super::findings::Findings;
use super::kind::Phase;

const TEMPLATE: &str = include_str!("campaign.html");

/// The page could not be made.
#[derive(Debug, thiserror::Error)]
#[error("the page could not be made: {0}")]
pub struct PictureError(#[from] minijinja::Error);

#[derive(Serialize)]
struct Row<'a> {
    kind: &'a str,
    role: &'a str,
    cells: Vec<Cell>,
}

/// One number, and how dark it is drawn.
#[derive(Serialize)]
struct Cell {
    count: u64,
    /// 0 to 100.
    heat: u64,
}

/// The page as HTML, complete in itself.
///
/// # Errors
/// [`PictureError`] where the template fails.
pub fn picture(findings: &Findings) -> Result<String, PictureError> {
    let counts = findings.coverage.iter().flat_map(|row| row.counts);
    // Roots spread the few and the many over one scale.
    let most = (counts.max().unwrap_or(0).max(1) as f64).sqrt();
    let rows: Vec<Row<'_>> = findings
        .coverage
        .iter()
        .map(|row| Row {
            kind: row.kind.word(),
            role: row.role.word(),
            cells: row
                .counts
                .into_iter()
                .map(|count| Cell { count, heat: ((count as f64).sqrt() / most * 100.0) as u64 })
                .collect(),
        })
        .collect();
    let mut environment = Environment::new();
    environment.add_template("campaign.html", TEMPLATE)?;
    let template = environment.get_template("campaign.html")?;
    Ok(template.render(context! {
        findings => Value::from(Serde(findings)),
        rows => Value::from(Serde(rows)),
        phases => Phase::ALL.map(Phase::word),
        property => findings.plan.property.word(),
    })?)
}
