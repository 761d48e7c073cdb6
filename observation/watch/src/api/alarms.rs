//! Acknowledgement of an alarm.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

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
    if let Some(why) = App::why_not_act(&person) {
        return Err(Problem::forbidden(why));
    }
    let alarm = app
        .alarm(number)?
        .ok_or_else(|| Problem::unknown(format!("the run has no alarm {number}")))?;
    let seen = alarm.acknowledgement(owner, unix_seconds());
    // It is shown as acknowledged once the journal contains it.
    let done = app.commanding.commander.acknowledge(seen).await;
    done.map_err(|refusal| Problem::refused(&refusal.to_string()))?;
    Ok(Json(json!({})))
}

/// For the journal.
#[allow(clippy::disallowed_methods, reason = "people live by the calendar")]
fn unix_seconds() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}
