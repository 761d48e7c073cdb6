//! Why an output is as it is.

use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use understudy_view::Why;

use super::Answered;
use super::facts::{When, at_cycle};
use crate::app::App;
use crate::error::Problem;

pub(super) async fn why(
    State(app): State<Arc<App>>,
    signal: Result<Path<(usize, usize)>, PathRejection>,
    when: Result<Query<When>, QueryRejection>,
) -> Answered<Json<Why>> {
    let Path((program, output)) = signal?;
    let Query(when) = when?;
    at_cycle(&app, when.cycle, |known, cycle| {
        let controller = known.run.cluster().controllers().get(program);
        let signal = controller.and_then(|controller| {
            Some((controller, controller.interface.outputs.iter().nth(output)?))
        });
        let (controller, signal) = signal.ok_or_else(|| {
            Problem::unknown(format!(
                "the cluster has no output {output} of program {program}"
            ))
        })?;
        let name = format!("{}.{}", controller.name, signal.name);
        let why = known.run.why(&name, Some(cycle));
        why.map_err(|error| Problem::of_view(&error))
    })
    .map(Json)
}
