//! Comparison with another run of the same directory.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use serde::{Deserialize, Serialize};
use understudy_view::{Bounds, Differing, Run, RunDiff, diff};

use super::Answered;
use super::facts::known;
use crate::app::App;
use crate::error::Problem;

/// Runs that are listed, at most: the newest.
const MAXIMUM_OTHERS: usize = 50;

/// Differences in one answer, at most.
const MAXIMUM_DIFFERENCES: usize = 500;

#[derive(Debug, Deserialize)]
pub(super) struct With {
    with: String,
}

#[derive(Debug, Serialize)]
pub(super) struct Compared {
    words: String,
    differences: Vec<Line>,
}

#[derive(Debug, Serialize)]
struct Line {
    cycle: i64,
    what: String,
    here: String,
    there: String,
}

/// The names of other runs, newest first.
pub(super) fn others(run: &Path) -> Vec<String> {
    let Ok(run) = fs::canonicalize(run) else {
        return Vec::new();
    };
    let entries = run.parent().and_then(|runs| fs::read_dir(runs).ok());
    let entries = entries.into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .map(|entry| entry.path())
        .filter(|path| *path != run && path.join("cluster").is_dir())
        .filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()))
        .collect();
    names.sort_unstable_by(|one, other| other.cmp(one));
    names.truncate(MAXIMUM_OTHERS);
    names
}

pub(super) async fn compare(
    State(app): State<Arc<App>>,
    with: Result<Query<With>, QueryRejection>,
) -> Answered<Json<Compared>> {
    let Query(With { with }) = with?;
    // Only listed names are accepted: a name is not a path.
    if !others(&app.run).contains(&with) {
        return Err(Problem::unknown(format!(
            "the directory of this run has no other run {with:.80}"
        )));
    }
    let Ok(_turn) = app.reader.try_acquire() else {
        return Err(Problem::too_many("another comparison is in progress: try again later"));
    };
    tokio::task::block_in_place(|| read_and_compare(&app, &with)).map(Json)
}

fn read_and_compare(app: &App, with: &str) -> Answered<Compared> {
    let unread = |error: &dyn std::fmt::Display| Problem::unrecorded(format!("{with}: {error}"));
    let here = fs::canonicalize(&app.run).map_err(|error| unread(&error))?;
    let runs = here.parent().ok_or_else(|| unread(&"it has no parent directory"))?;
    let other = Run::open(&runs.join(with)).map_err(|error| unread(&error))?;
    let other = other.read(Bounds::default()).map_err(|error| unread(&error))?;
    let found = {
        let model = app.model();
        diff(&known(&model)?.run, &other)
    };
    Ok(Compared {
        words: in_words(&found),
        differences: found
            .differences
            .iter()
            .take(MAXIMUM_DIFFERENCES)
            .map(|difference| {
                let what = match difference.what {
                    Differing::Inputs => "inputs",
                    Differing::Outputs => "outputs",
                    Differing::Source => "source",
                    Differing::Events => "events",
                };
                Line {
                    cycle: difference.cycle,
                    what: format!("{} of {}, {} times", what, difference.name, difference.count),
                    here: difference.left.clone(),
                    there: difference.right.clone(),
                }
            })
            .collect(),
    })
}

fn in_words(found: &RunDiff) -> String {
    let programs = if found.same_configuration {
        "the same configuration"
    } else {
        "a different configuration"
    };
    let first = match found.differences.first() {
        Some(first) => format!("first difference in cycle {}", first.cycle),
        None => "no differences".to_owned(),
    };
    format!("{programs}; {} cycles compared; {first}", found.compared)
}
