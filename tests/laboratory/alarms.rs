//! An alarm on a signal of a laboratory: raised by a write, acknowledged and shelved from a terminal, and shown by another process.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::{Value, json};

use super::deaths::{Records, is};
use super::shared::{DEADLINE, answer, empty_folder, some_at_a_time};
use super::{no_orphan, running_with, signal};

const CLUSTER: &str = r#"
[cluster]
name = "alarms"
period = "50ms"

[[controller]]
name = "pump"
ladder = "pump.st"

[[remote_io]]
controller = "pump"

[remote_io.inputs]
start = { operator = "level" }

[[alarm]]
signal = "pump.running"
name = "running"
when = true
on_delay = "200ms"
priority = "high"
text = "The pump runs"
"#;

const PUMP: &str = "
PROGRAM pump
  VAR_INPUT start : BOOL; END_VAR
  VAR_OUTPUT running : BOOL; END_VAR
  running := start;
END_PROGRAM";

fn operate(run: &Path, name: &str, more: &[&str]) -> (i32, Value) {
    let run = run.to_str().expect("text");
    let arguments = [&["operate", run, "--name", name], more].concat();
    let (status, document, _) = answer(&arguments);
    (status, document)
}

fn done(run: &Path, name: &str, more: &[&str]) {
    let (status, document) = operate(run, name, more);
    assert_eq!(status, 0, "{document:#}");
}

/// Waits until `top` shows the alarm in this state.
fn wait_for(run: &Path, state: &str) -> Value {
    let deadline = Instant::now() + DEADLINE;
    loop {
        let (_, document, _) = answer(&["top", run.to_str().expect("text")]);
        let result = &document["result"];
        if result["process_alarms"][0]["state"] == state {
            return result.clone();
        }
        assert!(Instant::now() < deadline, "not {state}: {document:#}");
    }
}

#[test]
fn an_alarm_is_acknowledged_and_shelved_from_another_process() {
    let _one = some_at_a_time();
    let out = empty_folder("alarms");
    let cluster = out.join("cluster.toml");
    fs::write(&cluster, CLUSTER).expect("written");
    fs::write(out.join("pump.st"), PUMP).expect("written");
    let arguments = ["lab", cluster.to_str().expect("text"), "--out"];
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (mut child, _errors) = running_with(&arguments, &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");

    wait_for(&run, "normal");
    let code = |(status, document): (i32, Value)| {
        let code = document["failures"][0]["code"].as_str().map(str::to_owned);
        (status, code.unwrap_or_default())
    };
    let refused = |code: &str| (1, code.to_owned());
    assert_eq!(code(operate(&run, "running", &["acknowledge-alarm"])), refused("U0662"));
    assert_eq!(code(operate(&run, "runnin", &["shelve-alarm"])), refused("U0660"));
    let endless = ["shelve-alarm", "--seconds", "86401"];
    assert_eq!(code(operate(&run, "running", &endless)), refused("U0661"));
    // Each refused order has a record, with the name that does not exist.
    let mut records = Records::of(&run);
    let mut recorded = |to: &str, order: &str, signal: &str, code: &str| {
        let found = records
            .wait_for("a refused order", |record| is(record, "laboratory", "command-refused"));
        let event = &found["event"];
        let why = event["why"].as_str().unwrap_or_default();
        assert_eq!((&event["to"], &event["order"]), (&json!(to), &json!(order)), "{event}");
        assert_eq!(event["signal"], signal, "{event}");
        assert!(why.starts_with(code) && event["owner"] != "", "{event}");
    };
    recorded("running", "acknowledge-alarm", "", "U0662");
    recorded("runnin", "shelve-alarm", "", "U0660");
    recorded("running", "shelve-alarm", "", "U0661");
    let long = "x".repeat(1000);
    let nothing = format!("{long}=1");
    for (to, order, signal, code) in [
        ("pump-io", "write", "nothing=1", "U0640"),
        ("pump-io", "force", "nothing=1", "U0556"),
        ("pump-io", "unforce", "nothing", "U0556"),
        ("nobody", "write", "start=true", "U0605"),
        ("pump-io", "write", nothing.as_str(), "U0640"),
    ] {
        let (status, document) = operate(&run, to, &[order, signal]);
        assert_ne!(status, 0, "{document:#}");
        let signal: String = signal.chars().take(60).collect();
        recorded(to, order, &signal, code);
    }

    done(&run, "pump-io", &["write", "start=true"]);
    let raised = wait_for(&run, "unacknowledged");
    let alarm = &raised["process_alarms"][0]["newest"];
    assert_eq!(alarm["since_before"], false, "{raised:#}");
    assert_eq!(raised["alarms"][0]["name"], "running", "{raised:#}");
    done(&run, "running", &["acknowledge-alarm"]);
    wait_for(&run, "acknowledged");
    done(&run, "running", &["shelve-alarm", "--seconds", "3600", "--reason", "test"]);
    let shelved = wait_for(&run, "shelved");
    let reason = &shelved["process_alarms"][0]["shelved"]["reason"];
    assert_eq!(*reason, "test", "{shelved:#}");
    assert_eq!(shelved["alarms"], serde_json::json!([]), "{shelved:#}");
    done(&run, "running", &["unshelve-alarm"]);
    wait_for(&run, "acknowledged");
    done(&run, "pump-io", &["write", "start=false"]);
    wait_for(&run, "normal");

    signal(child.id(), Signal::SIGINT);
    let mut said = String::new();
    let mut output = child.stdout.take().expect("piped");
    output.read_to_string(&mut said).expect("text");
    child.wait().expect("it ends");
    no_orphan(&runs);
    let line = "alarm running (high): The pump runs; raised once in cycle ";
    assert!(said.contains(line), "{said}");
    let (_, document, _) = answer(&["journal", run.to_str().expect("text")]);
    let lines = document["result"]["lines"].as_array().expect("lines");
    let events: Vec<&str> = lines
        .iter()
        .filter_map(|line| line["event"].as_str())
        .filter(|event| {
            ["alarm-raised", "alarm-over", "acknowledged", "shelved", "unshelved"].contains(event)
        })
        .collect();
    let expected = ["alarm-raised", "acknowledged", "shelved", "unshelved", "alarm-over"];
    assert_eq!(events, expected);
}
