//! A point is what its author declared while a cell runs: forces and writes from a terminal, and the Python client of the Zenoh gateway. The table of
//! finished runs is in `tests/commands/points.rs`.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::Value;
use understudy_testing::points::{DECLARED, POINTS, Row, cluster_file, statements};

use super::gates::{Gateway, Laboratory, python};
use super::shared::{DEADLINE, answer, empty_folder, some_at_a_time};
use super::{PERIOD, running_with};

/// The order was taken by the remote I/O.
fn operate(run: &str, what: &str, text: &str, more: &[&str]) -> Value {
    let order = ["operate", run, "--name", "one-io", what, text, "--reason", "a test"];
    let (status, document, _) = answer(&[&order[..], more].concat());
    assert_eq!(status, 0, "{what} {text}: {document:#}");
    document["result"].clone()
}

/// The program in `top`, once all inputs and outputs have these values.
fn wait_for(run: &str, inputs: &dyn Fn(&Row) -> Value, outputs: &dyn Fn(&Row) -> Value) -> Value {
    let deadline = Instant::now() + DEADLINE;
    loop {
        let (_, document, _) = answer(&["top", run]);
        let program = &document["result"]["programs"][0];
        let differs = POINTS.iter().find(|row| {
            let values = &program["values"];
            let output = &values[format!("q{}", row.name)];
            values[row.name] != inputs(row) || *output != outputs(row)
        });
        let Some(row) = differs else {
            return program.clone();
        };
        assert!(Instant::now() < deadline, "{}: {program:#}", row.name);
    }
}

/// A text of a cluster file as a person types it.
fn typed(text: &str) -> String {
    text.replace('"', "")
}

#[test]
fn forces_and_live_writes_are_of_the_declared_type() {
    let _one = some_at_a_time();
    let out = empty_folder("live_points");
    let program = format!("{DECLARED}{}END_PROGRAM\n", statements());
    fs::write(out.join("one.st"), program).expect("written");
    let cluster = out.join("cell.toml");
    fs::write(&cluster, cluster_file("one.st")).expect("written");
    let runs = out.join("runs");
    let arguments = ["lab", cluster.to_str().expect("text"), "--period", PERIOD, "--out"];
    let more = ["--cycles", "1000000", "--allow-commands"];
    let (child, errors) = running_with(&arguments, &runs, &more, "synchronised: ");
    let laboratory = Laboratory(child);
    // It says more, and must not wait for a reader.
    std::thread::spawn(move || std::io::copy(&mut { errors }, &mut std::io::sink()));
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let run = run.to_str().expect("text");
    wait_for(run, &Row::told_at_first, &Row::told_at_first);
    for row in &POINTS {
        let done = operate(run, "write", &format!("{}={}", row.name, typed(row.file)), &[]);
        assert!(done["cycle"].is_i64(), "{}: {done}", row.name);
    }
    wait_for(run, &Row::told, &Row::told);
    // Inputs stay what they are, outputs become the least values.
    for row in &POINTS {
        let text = format!("q{}={}", row.name, typed(row.safe));
        operate(run, "force", &text, &["--seconds", "600"]);
    }
    let program = wait_for(run, &Row::told, &Row::told_at_first);
    let forced = program["forced"].as_array().expect("a list");
    assert_eq!(forced.len(), POINTS.len(), "{program:#}");
    for row in &POINTS {
        operate(run, "unforce", &format!("q{}", row.name), &[]);
    }
    wait_for(run, &Row::told, &Row::told);
    // A force of an input is sampled.
    for row in &POINTS {
        let text = format!("{}={}", row.name, typed(row.safe));
        operate(run, "force", &text, &["--seconds", "600"]);
    }
    wait_for(run, &Row::told_at_first, &Row::told_at_first);
    for row in &POINTS {
        operate(run, "unforce", row.name, &[]);
    }
    wait_for(run, &Row::told, &Row::told);
    by_python(run);
    laboratory.end(&runs);
    in_the_journal(run);
}

/// The client reads each value as one of its declaration, and writes what it has read.
fn by_python(run: &str) {
    let Some(python) = python("zenoh") else {
        return;
    };
    let gateway = Gateway::of("zenoh", Path::new(run));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/laboratory/points_client.py");
    let mut client = Command::new(python)
        .arg(script)
        .arg(&gateway.address)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it ran a moment ago");
    let least = POINTS.iter().map(|row| (row.name.to_owned(), row.told_at_first()));
    let least: serde_json::Map<String, Value> = least.collect();
    let mut input = client.stdin.take().expect("piped");
    writeln!(input, "{}", Value::from(least)).expect("it reads");
    drop(input);
    let output = client.wait_with_output().expect("it ends");
    assert!(output.status.success());
    let read: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (seen, expected) in
        [("before", Row::told as fn(&Row) -> Value), ("after", Row::told_at_first)]
    {
        for row in &POINTS {
            let of_input = &read[seen]["inputs"][row.name];
            let of_output = &read[seen]["outputs"][format!("q{}", row.name)];
            let of_both = [of_input, of_output];
            assert_eq!(of_both, [&expected(row); 2], "{seen} {}: {read:#}", row.name);
        }
    }
    // What is no value of the declaration is refused with the code of the terminal.
    let refused = read["refused"].as_array().expect("a list");
    assert_eq!(refused.len(), POINTS.len(), "{read:#}");
    assert!(refused.iter().all(|of_input| of_input[1] == "U0641"), "{read:#}");
}

/// The journal has each order in the words of its declaration.
fn in_the_journal(run: &str) {
    let listed = |event: &str| {
        let (status, document, _) = answer(&["journal", run, "--event", event]);
        assert_eq!(status, 0, "{document:#}");
        let lines = document["result"]["lines"].as_array().expect("a list").clone();
        lines.iter().map(|line| line["text"].as_str().unwrap_or_default().to_owned()).collect()
    };
    let (written, forced): (Vec<String>, Vec<String>) = (listed("written"), listed("forced"));
    for row in &POINTS {
        let least = row.safe_shown();
        let lines = [
            (&written, format!(" writes {} to input {}: a test", row.shown, row.name)),
            (&forced, format!("output q{} is forced to {least} for 600 s by ", row.name)),
            (&forced, format!("input {} is forced to {least} for 600 s by ", row.name)),
        ];
        for (listed, wanted) in lines {
            assert!(listed.iter().any(|line| line.contains(&wanted)), "{wanted}: {listed:#?}");
        }
    }
}
