//! The log of commands and members on standard error.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::{empty_folder, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";

/// The lines of standard error that are JSON.
fn objects(errors: &str) -> Vec<Value> {
    errors.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

fn of_environment(filter: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("RUST_LOG", filter)
        .env("UNDERSTUDY_LOG_FORMAT", "json")
        .output()
        .expect("the binary is built");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn nothing_is_logged_unless_it_is_asked_for() {
    let plain = understudy(&["check", PRESS_CELL]);
    let off = understudy(&["check", PRESS_CELL, "--log", "off"]);
    assert_eq!(plain.shown(), off.shown());
    assert!(!plain.errors.contains("DEBUG"), "{}", plain.errors);
    let asked = understudy(&["check", PRESS_CELL, "--log", "understudy=debug"]);
    assert_eq!((asked.status, &asked.output), (0, &plain.output));
    assert!(asked.errors.contains("command{command=\"check\"}"), "{}", asked.errors);
    let other = understudy(&["check", PRESS_CELL, "--log", "zenoh=trace"]);
    assert_eq!(other.shown(), plain.shown());
}

#[test]
fn a_wrong_filter_is_refused_and_a_wrong_variable_is_reported() {
    for filter in ["loud", "understudy", "understudy=loud", ""] {
        let refused = understudy(&["check", PRESS_CELL, "--log", filter]);
        assert_eq!(refused.status, 2, "{filter}");
        let says = refused.errors.contains("U0600") && refused.errors.contains("TARGET=LEVEL");
        assert!(says, "{filter}: {}", refused.errors);
    }
    let (status, _, errors) = of_environment("understudy=loud", &["check", PRESS_CELL]);
    assert_eq!(status, Some(0));
    let lines = objects(&errors);
    let message = lines[0]["message"].as_str().expect("a message");
    assert!(message.starts_with("RUST_LOG is ignored"), "{errors}");
}

/// The variable reaches the members of a laboratory, and each of their spans is there.
#[test]
fn the_members_of_a_laboratory_log_their_cycles_and_frames() {
    let out = empty_folder("log_of_a_laboratory");
    let out = out.to_str().expect("text");
    let run = ["lab", PRESS_CELL, "--link", "udp", "--period", "50ms", "--cycles", "5"];
    let arguments = [&run[..], &["--out", out]].concat();
    let (status, _, errors) = of_environment("understudy=trace", &arguments);
    // A busy machine may be too slow for a verdict, not for a line.
    assert!(matches!(status, Some(0 | 3)), "{errors:.2000}");
    let lines = objects(&errors);
    let mut members = BTreeSet::new();
    let mut spans = BTreeSet::new();
    for line in &lines {
        for span in line["spans"].as_array().into_iter().flatten() {
            spans.extend(span["name"].as_str().map(str::to_owned));
            members.extend(span["member"].as_str().map(str::to_owned));
        }
    }
    let names = |text: &str| text.split(' ').map(str::to_owned).collect::<BTreeSet<_>>();
    assert_eq!(spans, names("command member cycle frame"));
    assert_eq!(members, names("robot press understudy robot-io press-io arm ram"));
    let told = |message: &str| lines.iter().any(|line| line["message"] == message);
    assert!(told("sent") && told("received"), "{} lines", lines.len());
    assert!(Path::new(out).exists());
}
