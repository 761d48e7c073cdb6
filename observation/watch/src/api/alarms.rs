//! Acknowledgement and shelving of alarms.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Extension, State};
use serde::Deserialize;
use serde_json::{Value, json};
use understudy_bus::RefusedOrder;
use understudy_journal::{OperatorAction, Refusal, Shelving, Unshelving};

use super::{Answered, command::named};
use crate::app::App;
use crate::error::Problem;
use crate::login::Person;
use crate::model::Known;

/// Alarms that are acknowledged at once, at most.
const MOST_ACKNOWLEDGED: usize = 1000;

/// Alarms that a person has seen.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Acknowledged {
    /// Numbers of the alarms.
    alarms: Vec<u64>,
    owner: String,
}

pub(super) async fn acknowledge(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    body: Result<Json<Acknowledged>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Json(Acknowledged { alarms, owner }) = body?;
    let owner = named(&person, owner)?;
    if alarms.len() > MOST_ACKNOWLEDGED {
        let problem = format!("at most {MOST_ACKNOWLEDGED} alarms are acknowledged at once");
        return Err(Problem::bad(problem));
    }
    let refused = |what: &str, why: &str| RefusedOrder::new("acknowledge-alarm", what, &owner, why);
    if let Some(why) = App::why_not_act(&person) {
        let numbers: Vec<String> = alarms.iter().map(u64::to_string).collect();
        let what = format!("alarm {}", numbers.join(", "));
        app.commanding.record_refused(Some(refused(&what, why))).await;
        return Err(Problem::forbidden(why));
    }
    if let Some((from, percent)) = app.model().known().and_then(Known::past) {
        return Err(Problem::reading(format!(
            "the alarms before cycle {from} are being read ({percent} %): try again in some seconds"
        )));
    }
    let mut seen = Vec::new();
    for number in alarms {
        let Some(alarm) = app.alarm(number)? else {
            let problem = Problem::unknown(format!("the run has no alarm {number}"));
            let what = format!("alarm {number}");
            app.commanding.record_refused(Some(refused(&what, &problem.words()))).await;
            return Err(problem);
        };
        seen.push(alarm.acknowledgement(owner.clone(), unix_seconds()));
    }
    for seen in seen {
        // It is shown as acknowledged once the journal contains it.
        let done = app.commanding.commander.acknowledge(seen).await;
        done.map_err(|refusal| Problem::refused(&refusal.to_string()))?;
    }
    Ok(Json(json!({})))
}

/// An alarm on a signal that is shelved.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shelved {
    /// Name of the alarm.
    name: String,
    seconds: u64,
    owner: String,
    reason: String,
}

/// An alarm on a signal that is shelved no more.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Unshelved {
    /// Name of the alarm.
    name: String,
    owner: String,
    reason: String,
}

pub(super) async fn shelve(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    body: Result<Json<Shelved>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Json(asked) = body?;
    let shelving = Shelving {
        name: asked.name,
        seconds: asked.seconds,
        owner: named(&person, asked.owner)?,
        reason: asked.reason,
        at_unix_s: unix_seconds(),
    };
    act(&app, &person, OperatorAction::Shelve(shelving)).await
}

pub(super) async fn unshelve(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    body: Result<Json<Unshelved>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Json(asked) = body?;
    let unshelving = Unshelving {
        name: asked.name,
        owner: named(&person, asked.owner)?,
        reason: asked.reason,
        at_unix_s: unix_seconds(),
    };
    act(&app, &person, OperatorAction::Unshelve(unshelving)).await
}

/// Does what a person wants with an alarm; it is shown once the journal contains it.
async fn act(app: &App, person: &Person, action: OperatorAction) -> Answered<Json<Value>> {
    if let Some(why) = App::why_not_act(person) {
        let refusal = Refusal::Said(why.to_owned());
        app.commanding.record_refused(action.refused(&refusal)).await;
        return Err(Problem::forbidden(why));
    }
    let alarms = {
        let model = app.model();
        let cluster = model.cluster();
        let unknown = || Problem::unknown("the run has not started".to_owned());
        Arc::clone(cluster.ok_or_else(unknown)?.alarms())
    };
    if let Err(refusal) = action.alarm_event(&alarms) {
        app.commanding.record_refused(action.refused(&refusal)).await;
        return Err(Problem::bad(refusal.to_string()));
    }
    let done = app.commanding.commander.act(action).await;
    done.map_err(|refusal| Problem::refused(&refusal.to_string()))?;
    Ok(Json(json!({})))
}

/// For the journal.
#[allow(clippy::disallowed_methods, reason = "people live by the calendar")]
fn unix_seconds() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}
