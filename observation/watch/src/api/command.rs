//! A command to a member of the laboratory.

use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Extension, State};
use serde::Deserialize;
use serde_json::{Value, json};
use understudy_bus::RefusedOrder;
use understudy_cluster::Cluster;
use understudy_journal::{
    Command, Done, PointsInEffect, Refusal, RequestedValue, WriteRequest, force_value, new_write,
};
use understudy_typed::Point;
use understudy_wire::{
    Force, MAXIMUM_OWNER_LENGTH, MAXIMUM_REASON_LENGTH, Member, PointValue, PointsHash, Role,
    SignalPlace, StateChoice, Unforce,
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
    /// Hash of the version of the program whose points the caller knows; needed where the command names a signal by its place.
    #[serde(default)]
    points: Option<String>,
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
        value: AskedValue,
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

/// Value of a force.
#[derive(Deserialize)]
#[serde(untagged)]
enum AskedValue {
    Stored(PointValue),
    /// As a person types it.
    Typed(String),
}

impl AskedValue {
    /// The value for a signal of the program of `member`.
    fn of(self, cluster: &Cluster, member: Member, signal: SignalPlace) -> Answered<PointValue> {
        let text = match self {
            Self::Stored(value) => return Ok(value),
            Self::Typed(text) => text,
        };
        let code = "U0556";
        let point = point_of(cluster, member, signal).ok_or_else(|| {
            let name = cluster.member_name(member).unwrap_or_default();
            Problem::invalid(code, format!("`{name}` has no such signal"))
        })?;
        force_value(&text, &point.declared()).map_err(|message| Problem::invalid(code, message))
    }
}

/// The signal of a remote I/O that begins at a place.
fn point_of(cluster: &Cluster, member: Member, signal: SignalPlace) -> Option<&Point> {
    let program = member.sampled_program()?;
    let interface = &cluster.controllers().get(program.index())?.interface;
    let points = match signal {
        SignalPlace::Input(_) => &interface.inputs,
        SignalPlace::Output(_) => &interface.outputs,
    };
    let first = u32::from(signal.first_bit());
    points.iter().find(|point| point.bit == first)
}

pub(super) async fn command(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    body: Result<Json<Asked>, JsonRejection>,
) -> Answered<Json<Value>> {
    let Json(asked) = body?;
    let order = asked.order(&person);
    let Ordered { member, command, owner, reason } = match ordered(&app, &person, asked) {
        Ok(ordered) => ordered,
        Err(problem) => {
            let order = RefusedOrder { why: problem.words(), ..order };
            app.commanding.record_refused(Some(order)).await;
            return Err(problem);
        }
    };
    let done: Result<Done, Refusal> = match command {
        Command::Write(write) => app.writes.write(member, write).await,
        command => {
            let commander = &app.commanding.commander;
            commander.give(member, command, owner, reason).await
        }
    };
    let done = done.map_err(|refusal| Problem::refused(&refusal.to_string()))?;
    let Some(cycle) = done.cycle else {
        return Ok(Json(json!({})));
    };
    let model = app.model();
    let known = model.known();
    let run_cycle = known.and_then(|known| known.run.cycle_of(member, cycle));
    Ok(Json(json!({ "cycle": cycle, "run_cycle": run_cycle })))
}

/// A command that may be given.
struct Ordered {
    member: Member,
    command: Command,
    owner: String,
    reason: String,
}

/// Whether a person may give a command, and what it is.
fn ordered(app: &App, person: &Person, asked: Asked) -> Answered<Ordered> {
    let is_write = matches!(asked.command, AskedCommand::Write { .. });
    let why = if is_write { app.why_not_write(person) } else { app.why_not(person) };
    if let Some(why) = why {
        return Err(Problem::forbidden(why));
    }
    let owner = named(person, asked.owner)?;
    let reason = readable(asked.reason, MAXIMUM_REASON_LENGTH, "the reason")?;
    let model = app.model();
    let member = model.member(&asked.member);
    let member = member.ok_or_else(|| {
        Problem::unknown(format!("the cluster has no member {:.60}", asked.member))
    })?;
    let started = || Problem::unknown("the run has not started");
    let points = model.known().ok_or_else(started)?.run.present().points();
    let cluster = points.cluster();
    if asked.points.is_none() && asked.command.names_a_place() {
        let message = "a force and its end name a signal by its place: they need `points`, which `/api/run` has for each program";
        return Err(Problem::bad(message));
    }
    fits(asked.points.as_deref(), points, member)?;
    let by = By { role: person.role, owner: &owner, reason: &reason };
    let command = asked.command.given(cluster, member, by)?;
    Ok(Ordered { member, command, owner, reason })
}

impl Asked {
    /// As an order that is refused; only why is not known yet.
    fn order(&self, person: &Person) -> RefusedOrder {
        let (order, signal) = self.command.words();
        let owner = if person.name.is_empty() { &self.owner } else { &person.name };
        RefusedOrder::new(order, &self.member, owner, "").with(&signal, &self.reason)
    }
}

/// Whether a caller names signals by the points that count: a place of others is another signal.
fn fits(theirs: Option<&str>, points: &PointsInEffect, member: Member) -> Answered<()> {
    let program = member.sampled_program();
    let counts = program.and_then(|program| points.versions().get(program.index()));
    match (theirs, counts) {
        (Some(theirs), Some(counts)) if theirs != counts.to_string() => {
            let message = "an online change has replaced the inputs and outputs of the program since the page was read";
            Err(Problem::invalid("U0588", message))
        }
        _ => Ok(()),
    }
}

/// Person who gives a command.
struct By<'a> {
    role: Role,
    owner: &'a str,
    reason: &'a str,
}

impl AskedCommand {
    /// Its word, and its signal where it has one.
    fn words(&self) -> (&'static str, String) {
        let place = |signal: &SignalPlace| match signal {
            SignalPlace::Input(place) => format!("input {place}"),
            SignalPlace::Output(place) => format!("output {place}"),
        };
        match self {
            Self::Kill => ("kill", String::new()),
            Self::Restart => ("restart", String::new()),
            Self::Stop => ("stop", String::new()),
            Self::Continue => ("continue", String::new()),
            Self::Release => ("release", String::new()),
            Self::Choose { .. } => ("choose", String::new()),
            Self::Isolate => ("isolate", String::new()),
            Self::Rejoin => ("rejoin", String::new()),
            Self::Force { signal, .. } => ("force", place(signal)),
            Self::Unforce { signal } => ("unforce", place(signal)),
            Self::Write { input, .. } => ("write", input.clone()),
        }
    }

    /// Whether its signal is named by a place, which is of another signal after an online change of the points.
    fn names_a_place(&self) -> bool {
        matches!(self, Self::Force { .. } | Self::Unforce { .. })
    }

    /// The command to a member of the cluster.
    fn given(self, cluster: &Cluster, member: Member, by: By<'_>) -> Answered<Command> {
        let (owner, reason) = (by.owner.to_owned(), by.reason.to_owned());
        Ok(match self {
            Self::Kill => Command::Kill,
            Self::Restart => Command::Restart,
            Self::Stop => Command::Stop,
            Self::Continue => Command::Continue,
            Self::Release => Command::Release,
            Self::Choose { choice } => Command::Choose { choice },
            Self::Isolate => Command::Isolate,
            Self::Rejoin => Command::Rejoin,
            Self::Unforce { signal } => {
                Command::Unforce(Unforce { signal, points: points(cluster, member) })
            }
            Self::Write { input, value } => {
                let request = WriteRequest {
                    input: &input,
                    value: RequestedValue::Text(&value),
                    role: by.role,
                    owner: by.owner,
                    reason: by.reason,
                };
                let write = new_write(cluster, member, &request).map_err(|problem| {
                    let code = problem.code();
                    let message = problem.to_string();
                    let words = message.strip_prefix(&format!("{code}: "));
                    Problem::invalid(code, words.unwrap_or(&message))
                })?;
                Command::Write(write)
            }
            Self::Force { signal, value, seconds } => Command::Force(Force {
                signal,
                value: value.of(cluster, member, signal)?,
                seconds,
                owner,
                reason,
                points: points(cluster, member),
            }),
        })
    }
}

/// Identifies the points by which the page shows the signals of a remote I/O.
fn points(cluster: &Cluster, member: Member) -> Option<PointsHash> {
    cluster.points_hash(member.sampled_program()?)
}

/// The person who is logged in, or whose keys the page uses; otherwise the name in the request.
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
        Err(Problem::bad(format!("{what} needs 1 to {most} printable characters")))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    fn shuttles() -> Cluster {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/two-shuttles");
        let text = |name: &str| fs::read_to_string(folder.join(name));
        let file = text("cluster.toml").expect("an example");
        let mut open = |name: &str| text(name).map_err(|error| error.to_string());
        let loaded = understudy_cluster::read("cluster.toml", &file, &mut open);
        loaded.cluster.expect("no errors")
    }

    /// What a request to a member becomes; the code of the problem otherwise.
    fn given(member: &str, request: Value) -> Result<Command, String> {
        let cluster = shuttles();
        let member = cluster
            .members()
            .find(|found| cluster.member_name(*found) == Some(member))
            .expect("a member");
        let by = By { role: Role::Operator, owner: "anna", reason: "a test" };
        let asked: AskedCommand = serde_json::from_value(request).expect("a request");
        asked.given(&cluster, member, by).map_err(|problem| format!("{problem:?}"))
    }

    fn write(member: &str, input: &str, value: &str) -> Result<Command, String> {
        given(member, json!({ "command": "write", "input": input, "value": value }))
    }

    fn has(found: Result<Command, String>, wanted: &[&str]) {
        let problem = found.expect_err("a problem");
        for text in wanted {
            assert!(problem.contains(text), "{problem}");
        }
    }

    #[test]
    fn a_write_has_the_role_of_its_person_and_is_checked() {
        let Ok(Command::Write(found)) = write("left-io", "speed", "120.5") else {
            panic!("no write");
        };
        assert_eq!(found.role, Role::Operator);
        assert_eq!((&*found.owner, &*found.reason), ("anna", "a test"));
        assert_eq!(found.value, PointValue::new(32, u64::from(120.5f32.to_bits())));
        has(write("left-io", "speed", "201"), &["U0642", "from 0.0 to 200.0"]);
        has(write("left-io", "speed", "fast"), &["U0641", "fast"]);
        has(write("left-io", "start", "2"), &["U0641"]);
        has(write("left-io", "stard", "true"), &["U0640", "start"]);
        // A signal of another program, a wire, and a member without inputs.
        has(write("left-io", "right_wants", "true"), &["U0640"]);
        has(write("left-io", "position", "1.0"), &["U0640"]);
        has(write("left", "start", "true"), &["U0640"]);
    }

    #[test]
    fn a_force_takes_a_number_as_a_person_types_it() {
        let force = |member: &str, signal: Value, value: Value| {
            given(
                member,
                json!({ "command": "force", "signal": signal, "value": value, "seconds": 5 }),
            )
        };
        let value = |found: Result<Command, String>| match found {
            Ok(Command::Force(force)) => force.value,
            other => panic!("{other:?}"),
        };
        let speed = || json!({ "input": 64 });
        let stored = PointValue::new(32, u64::from(12.5f32.to_bits()));
        assert_eq!(value(force("left-io", speed(), json!("12.5"))), stored);
        assert_eq!(value(force("left-io", speed(), json!(stored))), stored);
        let start = json!({ "input": 32 });
        assert_eq!(value(force("left-io", start.clone(), json!("1"))), PointValue::Bit(true));
        has(force("left-io", speed(), json!("fast")), &["U0556", "finite number"]);
        has(force("left-io", start, json!("12.5")), &["U0556"]);
        let nothing = json!({ "output": 7000 });
        has(force("left-io", nothing, json!("1")), &["U0556", "no such signal"]);
        has(force("left", speed(), json!("1")), &["U0556"]);
    }
}
