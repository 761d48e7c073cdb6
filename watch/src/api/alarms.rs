//! Somebody has seen an alarm.

use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::{JsonRejection, PathRejection};
use axum::extract::{Extension, Path, State};
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Answered, command::named};
use crate::app::App;
use crate::error::Problem;
use crate::login::Person;

#[derive(Deserialize)]
pub(super) struct Acknowledged {
    owner: String,
}

pub(super) async fn acknowledge(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    number: Result<Path<u64>, PathRejection>,
    body: Result<Json<Acknowledged>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Path(number) = number?;
    let Json(Acknowledged { owner }) = body?;
    let owner = named(&person, owner)?;
    if !app.acknowledge(number, owner) {
        return Err(Problem::unknown(format!("the run has no alarm {number}")));
    }
    Ok(Json(json!({})))
}
