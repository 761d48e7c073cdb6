//! A command to a member of the laboratory.

use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Extension, State};
use serde::Deserialize;
use serde_json::{Value, json};
use understudy_journal::{Command, Done, Refusal, RequestedValue, WriteRequest, new_write};
use understudy_wire::{
    Force, MAXIMUM_OWNER_LENGTH, MAXIMUM_REASON_LENGTH, PointValue, SignalPlace, StateChoice,
};

use super::Answered;
use crate::app::App;
use crate::error::Problem;
use crate::login::Person;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    /// The member's name.
    member: String,
    command: AskedCommand,
    owner: String,
    reason: String,
}

/// As [`Command`]; owner and reason of a force are those of the request.
#[derive(Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case", deny_unknown_fields)]
enum AskedCommand {
    Kill,
    Restart,
    Stop,
    Continue,
    Release,
    Choose {
        choice: StateChoice,
    },
    Isolate,
    Rejoin,
    Force {
        signal: SignalPlace,
        value: PointValue,
        seconds: u32,
    },
    Unforce {
        signal: SignalPlace,
    },
    /// A value for an operator input, both as a person types them.
    Write {
        input: String,
        value: String,
    },
}

pub(super) async fn command(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    body: Result<Json<Asked>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Json(asked) = body?;
    let is_write = matches!(asked.command, AskedCommand::Write { .. });
    let why = if is_write {
        app.why_not_write(&person)
    } else {
        app.why_not(&person)
    };
    if let Some(why) = why {
        return Err(Problem::forbidden(why));
    }
    let owner = named(&person, asked.owner)?;
    let reason = readable(asked.reason, MAXIMUM_REASON_LENGTH, "the reason")?;
    let member = app.model().member(&asked.member);
    let member = member.ok_or_else(|| {
        Problem::unknown(format!("the cluster has no member {:.60}", asked.member))
    })?;
    let command = match asked.command {
        AskedCommand::Kill => Command::Kill,
        AskedCommand::Restart => Command::Restart,
        AskedCommand::Stop => Command::Stop,
        AskedCommand::Continue => Command::Continue,
        AskedCommand::Release => Command::Release,
        AskedCommand::Choose { choice } => Command::Choose { choice },
        AskedCommand::Isolate => Command::Isolate,
        AskedCommand::Rejoin => Command::Rejoin,
        AskedCommand::Unforce { signal } => Command::Unforce { signal },
        AskedCommand::Write { input, value } => {
            let request = WriteRequest {
                input: &input,
                value: RequestedValue::Text(&value),
                role: person.role,
                owner: &owner,
                reason: &reason,
            };
            let unknown = || Problem::unknown("the run has not started".to_owned());
            let write = {
                let model = app.model();
                new_write(model.cluster().ok_or_else(unknown)?, member, &request)
            };
            let write = write.map_err(|problem| Problem::bad(problem.to_string()))?;
            return answered(app.writes.write(member, write).await);
        }
        AskedCommand::Force {
            signal,
            value,
            seconds,
        } => Command::Force(Force {
            signal,
            value,
            seconds,
            owner: owner.clone(),
            reason: reason.clone(),
        }),
    };
    let commander = &app.commanding.commander;
    answered(commander.give(member, command, owner, reason).await)
}

fn answered(done: Result<Done, Refusal>) -> Answered<Json<Value>> {
    let done = done.map_err(|refusal| Problem::refused(&refusal.to_string()))?;
    Ok(Json(match done.cycle {
        Some(cycle) => json!({ "cycle": cycle }),
        None => json!({}),
    }))
}

/// The person who is logged in; otherwise the name in the request.
pub(super) fn named(person: &Person, said: String) -> Answered<String> {
    if person.name.is_empty() {
        readable(said, MAXIMUM_OWNER_LENGTH, "the name of the operator")
    } else {
        Ok(person.name.clone())
    }
}

fn readable(text: String, most: usize, what: &str) -> Answered<String> {
    let length = text.chars().count();
    let fits = (1..=most).contains(&length) && !text.trim().is_empty();
    if fits && !text.chars().any(char::is_control) {
        Ok(text)
    } else {
        Err(Problem::bad(format!(
            "{what} needs 1 to {most} printable characters"
        )))
    }
}
