//! Why an output, by its number, or a variable, by its name, has its value.

use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use understudy_view::Why;
use understudy_wire::ProgramId;

use super::Answered;
use super::facts::{When, at_cycle};
use crate::app::App;
use crate::error::Problem;

pub(super) async fn why(
    State(app): State<Arc<App>>,
    signal: Result<Path<(usize, String)>, PathRejection>,
    when: Result<Query<When>, QueryRejection>,
) -> Answered<Json<Why>> {
    let Path((program, output)) = signal?;
    let Query(when) = when?;
    let begins = |letter: char| letter.is_ascii_alphanumeric() || "_%".contains(letter);
    if !output.starts_with(begins) {
        let message = format!("{output:.60}: expected the number of an output, or a name");
        return Err(Problem::bad(message));
    }
    at_cycle(&app, when.cycle, |known, cycle| {
        let program_id = u8::try_from(program).ok().map(ProgramId);
        let controller = program_id.and_then(|it| known.run.points_at(it, Some(cycle)));
        let signal = controller.and_then(|controller| {
            let outputs = &controller.interface.outputs;
            match output.parse::<usize>() {
                Ok(output) => Some((controller, outputs.iter().nth(output)?.name.as_str())),
                Err(_) => Some((controller, output.as_str())),
            }
        });
        let (controller, signal) = signal.ok_or_else(|| {
            Problem::unknown(format!("the cluster has no output {output:.60} of program {program}"))
        })?;
        let name = format!("{}.{signal}", controller.name);
        let why = known.run.why(&name, Some(cycle));
        why.map_err(|error| Problem::of_view(&error))
    })
    .map(Json)
}
