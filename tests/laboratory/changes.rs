//! Online changes on real processes: the program changes between two cycles while stations are killed, goes on with its state, and goes back.

use std::fs;
use std::path::Path;
use std::process::Child;
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::Value;
use understudy_journal::{Command, Commander, OperatorAction};
use understudy_wire::{Member, ProgramId, StationId};

use super::deaths::{Records, is};
use super::shared::{DEADLINE, answer, empty_folder, some_at_a_time};
use super::{no_orphan, running_with, signal};

const CLUSTER: &str = r#"
[cluster]
name = "changes"
period = "50ms"
security = "off"

[[controller]]
name = "counter"
ladder = "counter.st"

[[controller]]
name = "lamp"
ladder = "lamp.st"

[[remote_io]]
controller = "counter"

[[remote_io]]
controller = "lamp"
"#;

const LAMP: &str = "
PROGRAM lamp
  VAR_INPUT go : BOOL; END_VAR
  VAR_OUTPUT on : BOOL; END_VAR
  on := NOT on;
END_PROGRAM";

/// Counts its scans by `step`, in a variable of that type.
fn counter(of: &str, step: u32) -> String {
    format!(
        "
PROGRAM counter
  VAR_INPUT go : BOOL; END_VAR
  VAR_OUTPUT shown : DINT; END_VAR
  VAR count : {of}; END_VAR
  count := count + {step};
  shown := count;
END_PROGRAM"
    )
}

fn write_cluster(folder: &Path, counter: &str) -> String {
    write_cluster_with(folder, counter, "")
}

/// With keys of the controller.
fn write_cluster_with(folder: &Path, counter: &str, keys: &str) -> String {
    let ladder = "ladder = \"counter.st\"";
    write_files(folder, counter, &CLUSTER.replace(ladder, &format!("{ladder}\n{keys}")))
}

/// With settings of the remote I/O of the counter.
fn write_cluster_falling_back(folder: &Path, counter: &str, settings: &str) -> String {
    let remote_io = "[[remote_io]]\ncontroller = \"counter\"";
    write_files(folder, counter, &CLUSTER.replace(remote_io, &format!("{remote_io}\n{settings}")))
}

fn write_files(folder: &Path, counter: &str, cluster: &str) -> String {
    fs::create_dir_all(folder).expect("a folder");
    let file = folder.join("cluster.toml");
    for (name, text) in [("cluster.toml", cluster), ("counter.st", counter), ("lamp.st", LAMP)] {
        fs::write(folder.join(name), text).expect("written");
    }
    file.to_str().expect("text").to_owned()
}

/// What the remote I/O of the counter applied of proved outputs: the cycle and the count.
fn counts(journal: &str) -> Vec<(u64, u64)> {
    let records = journal.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let applied = records.filter(|record| is(record, "counter-io", "applied"));
    let proved = applied.filter(|record| record["event"]["missing"].is_null());
    let count = |record: Value| {
        let event = &record["event"];
        Some((event["moment"]["cycle"].as_u64()?, event["outputs"]["words"][0].as_u64()?))
    };
    proved.filter_map(count).collect()
}

/// By how much the count grew in each cycle after the one before, without repetitions. Outputs that are held in a stall of this machine leave a pair out,
/// and no other step in.
fn steps(counts: &[(u64, u64)]) -> Vec<u64> {
    let pairs = counts.windows(2).filter(|pair| pair[1].0 == pair[0].0 + 1);
    let mut steps: Vec<u64> = pairs.map(|pair| pair[1].1 - pair[0].1).collect();
    steps.dedup();
    steps
}

/// Ends a laboratory: it leaves no process, and nothing was wrong. What the remote I/O of the counter applied, as [`counts`] has it.
fn ended_well(mut laboratory: Child, runs: &Path, run: &Path) -> Vec<(u64, u64)> {
    signal(laboratory.id(), Signal::SIGINT);
    laboratory.wait().expect("it ends");
    no_orphan(runs);
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["violation_count"], 0, "{summary:#}");
    counts(&fs::read_to_string(run.join("journal.jsonl")).expect("a journal"))
}

#[test]
fn a_program_changes_while_stations_are_killed() {
    let _one = some_at_a_time();
    let out = empty_folder("changes");
    let before = write_cluster(&out.join("before"), &counter("INT", 1));
    let after = write_cluster(&out.join("after"), &counter("DINT", 10));
    let other = write_cluster(&out.join("other"), &counter("DINT", 100));
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (child, _errors) = running_with(&["lab", &before, "--out"], &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let commander = Commander::of_run(run.clone());
    let mut records = Records::of(&run);
    let act = |member: Member, command: Command| {
        let action = OperatorAction::Command {
            member,
            command,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
        };
        commander.act_and_wait(&action).expect("it is done");
    };
    let run_text = run.to_str().expect("text");
    let step = |step: &str| answer(&["change", run_text, &after, step]);
    let done = |word: &str| {
        let (exit, document, errors) = step(word);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
    };
    // Nothing is loaded yet.
    let (exit, document, _) = step("switch");
    assert_eq!(
        (exit, &document["failures"][0]["code"]),
        (1, &Value::from("U0632")),
        "{document:#}"
    );
    done("prepare");
    // The new program has the state, and both stations can fail after each other.
    done("switch");
    records.wait_for("the change", |record| is(record, "counter-io", "program-changed"));
    for (station, name) in [(0, "counter"), (2, "understudy")] {
        act(Member::Station(StationId(station)), Command::Kill);
        records.wait_for("its end", |record| is(record, "counter-io", "unprotected"));
        act(Member::Station(StationId(station)), Command::Restart);
        records.wait_for("its state", |record| is(record, name, "synchronised"));
        records.wait_for("protection", |record| is(record, "counter-io", "protected"));
    }
    // An INT does not have all values of a DINT, so this needs a yes.
    let (exit, document, _) = step("cancel");
    assert_eq!(
        (exit, &document["failures"][0]["code"]),
        (2, &Value::from("U0635")),
        "{document:#}"
    );
    let (exit, document, errors) = answer(&["change", run_text, &after, "cancel", "--drop"]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    records.wait_for("the change back", |record| is(record, "counter-io", "program-changed"));
    let (exit, document, errors) = answer(&["change", run_text, &after, "cancel", "--drop"]);
    assert_eq!(exit, 0, "cancelled already: {document:#} {errors}");
    // While another change runs its programs, none that is over can be cancelled again: the old programs do not run.
    for word in ["prepare", "switch"] {
        let (exit, document, errors) = answer(&["change", run_text, &other, word]);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
    }
    records.wait_for("the other change", |record| is(record, "counter-io", "program-changed"));
    for again in [&["cancel", "--drop"][..], &["accept"]] {
        let (exit, document, _) = answer(&[&["change", run_text, &after], again].concat());
        let failure = &document["failures"][0];
        assert_eq!((exit, &failure["code"]), (1, &Value::from("U0632")), "{document:#}");
        let why = failure["message"].as_str().unwrap_or_default();
        assert!(why.contains("another online change is prepared"), "{again:?}: {document:#}");
    }
    let (exit, document, errors) = answer(&["change", run_text, &other, "cancel", "--drop"]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    records.wait_for("the change back", |record| is(record, "counter-io", "program-changed"));
    done("prepare");
    done("accept");
    done("accept");
    records.wait_for("the new change", |record| is(record, "counter-io", "program-changed"));
    // What was accepted is over: nothing loads it again, and nothing takes the program back. So it is for a remote I/O that starts again.
    let remote_io = Member::RemoteIo(ProgramId(0));
    for command in [Command::Kill, Command::Restart] {
        act(remote_io, command);
    }
    records.wait_for("its start", |record| is(record, "counter-io", "adopted-lineage"));
    for again in [&["prepare"][..], &["cancel", "--drop"], &["prepare"]] {
        let given = [&["change", run_text, &after], again].concat();
        let (exit, document, _) = answer(&given);
        let failure = &document["failures"][0];
        assert_eq!((exit, &failure["code"]), (1, &Value::from("U0632")), "{document:#}");
        let why = failure["message"].as_str().unwrap_or_default();
        assert!(why.contains("the change to it is over"), "{again:?}: {document:#}");
    }
    done("accept");
    let counts = ended_well(child, &runs, &run);
    let steps = steps(&counts);
    assert_eq!(steps, [1, 10, 1, 100, 1, 10], "{steps:?}");
}

/// The count has another name in the new program. Members whose pairs are wrong load nothing; the right pair is still in the file of the next change.
#[test]
fn a_renamed_variable_keeps_its_value() {
    let _one = some_at_a_time();
    let out = empty_folder("changes-renamed");
    let before = write_cluster(&out.join("before"), &counter("INT", 1));
    let renamed =
        |step: u32| counter("INT", step).replace("count ", "total ").replace("count;", "total;");
    let pair = "renamed = { count = \"total\" }";
    let wrong =
        write_cluster_with(&out.join("wrong"), &renamed(10), "renamed = { counts = \"total\" }");
    let after = write_cluster_with(&out.join("after"), &renamed(10), pair);
    let next = write_cluster_with(&out.join("next"), &renamed(100), pair);
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (child, _errors) = running_with(&["lab", &before, "--out"], &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let mut records = Records::of(&run);
    let run_text = run.to_str().expect("text");
    let (exit, document, _) = answer(&["change", run_text, &wrong, "prepare"]);
    let codes = document["failures"].as_array().expect("failures").iter();
    assert!(exit == 2 && codes.clone().all(|it| it["code"] == "U0637"), "{document:#}");
    let (exit, document, errors) = answer(&["change", run_text, &after]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    let paths = document["result"]["plan"][0]["paths"].as_array().expect("paths");
    let total = paths.iter().find(|path| path["path"] == "total").expect("it is listed");
    assert_eq!((&total["fate"], &total["renamed_from"]), (&"kept".into(), &"count".into()));
    for word in ["prepare", "switch", "accept"] {
        let (exit, document, errors) = answer(&["change", run_text, &after, word]);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
    }
    records.wait_for("the change", |record| is(record, "counter-io", "program-changed"));
    for word in ["prepare", "accept"] {
        let (exit, document, errors) =
            answer(&["change", &after, &next, word, "--out", runs.to_str().expect("text")]);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
    }
    records.wait_for("the next change", |record| is(record, "counter-io", "program-changed"));
    let counts = ended_well(child, &runs, &run);
    let steps = steps(&counts);
    assert_eq!(steps, [1, 10, 100], "{steps:?}");
    // The run keeps the file with which it began, and a plan from there would be one for members that do not exist.
    for step in [&[][..], &["rehearse"]] {
        let (exit, document, _) = answer(&[&["change", run_text, &after], step].concat());
        assert_eq!((exit, &document["failures"][0]["code"]), (2, &"U0631".into()), "{document:#}");
    }
    // What was driven last is explained by the program of the second change.
    let (exit, document, errors) = answer(&["why", "counter.shown", run_text]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    let read = &document["result"]["because"]["because"][0];
    assert_eq!(read["signal"], "total", "{document:#}");
    assert_eq!(read["statement"], "total := total + 100;", "{document:#}");
}

/// After an acceptance members keep records of the new program, and its text next to them: the next program takes its values over, whichever it is.
#[test]
fn what_is_kept_after_a_change_can_be_taken_over() {
    let _one = some_at_a_time();
    let out = empty_folder("changes-retained");
    let retained = |step: u32| counter("DINT", step).replace("VAR count", "VAR RETAIN count");
    let before = write_cluster(&out.join("before"), &retained(1));
    let after = write_cluster(&out.join("after"), &retained(10).replace("count", "total"));
    let third = write_cluster(&out.join("third"), &retained(100).replace("count", "total"));
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (child, _errors) = running_with(&["lab", &before, "--out"], &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let mut records = Records::of(&run);
    let run_text = run.to_str().expect("text");
    for word in ["prepare", "accept"] {
        let (exit, document, errors) = answer(&["change", run_text, &after, word, "--drop"]);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
        // Each viewer knows where the members are.
        let shown = |document: &Value| {
            let change = &document["result"]["change"];
            let members = change["members"].as_array().into_iter().flatten();
            let places: Vec<&Value> = members.map(|member| &member["place"]).collect();
            let is_prepared = places.len() == 5 && places.iter().all(|it| *it == "prepared");
            if word == "prepare" { is_prepared } else { change.is_null() }
        };
        let deadline = Instant::now() + DEADLINE;
        loop {
            let (_, document, _) = answer(&["top", run_text]);
            if shown(&document) {
                break;
            }
            assert!(Instant::now() < deadline, "{word}: {document:#}");
        }
    }
    records.wait_for("the change", |record| is(record, "counter-io", "program-changed"));
    ended_well(child, &runs, &run);
    let folder = run.join("retained");
    let folder = folder.to_str().expect("text");
    let (exit, document, errors) = answer(&["retained", "show", folder, "--for", &third]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    let members = document["result"]["members"].as_array().expect("members");
    let stations: Vec<&Value> =
        members.iter().filter(|member| !member["program"].is_null()).collect();
    assert_eq!(stations.len(), 2, "{document:#}");
    for station in stations {
        assert_eq!(station["problems"], serde_json::json!([]), "{document:#}");
        let values = station["values"].as_array().expect("values");
        assert!(values.iter().any(|it| it["path"] == "total" && it["fate"] == "kept"));
    }
}

/// A new program that a fault stops in its eighth scan: it is taken back, the plant misses the cycle of the fault, and the change can be cancelled only.
#[test]
fn a_program_fault_takes_a_change_back() {
    let _one = some_at_a_time();
    let out = empty_folder("changes-fault");
    let before = write_cluster(&out.join("before"), &counter("INT", 1));
    let broken = counter("INT", 10)
        .replace("count : INT;", "count : INT; scans : INT; divided : INT;")
        .replace("shown :=", "scans := scans + 1;\n  divided := 1 / (8 - scans);\n  shown :=");
    let after = write_cluster(&out.join("after"), &broken);
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (child, _errors) = running_with(&["lab", &before, "--out"], &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let mut records = Records::of(&run);
    let run_text = run.to_str().expect("text");
    let step = |step: &str| answer(&["change", run_text, &after, step]);
    let done = |word: &str| {
        let (exit, document, errors) = step(word);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
    };
    let wait_for_alarm = |lasts: bool| {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let (_, document, _) = answer(&["top", run_text]);
            let alarms = document["result"]["alarms"].as_array().expect("alarms");
            let alarm = alarms.iter().find(|alarm| alarm["alarm"] == "change-taken-back");
            if alarm.is_some_and(|alarm| alarm["over"].is_null() == lasts) {
                return;
            }
            assert!(Instant::now() < deadline, "{document:#}");
        }
    };
    done("prepare");
    // It waits until the trial is over.
    let (exit, document, _) = step("accept");
    let failure = &document["failures"][0];
    assert_eq!((exit, &failure["code"]), (1, &Value::from("U0632")), "{document:#}");
    let why = failure["message"].as_str().unwrap_or_default();
    assert!(why.contains("a program fault has taken the change back"), "{document:#}");
    records.wait_for("the end", |record| is(record, "counter-io", "change-taken-back"));
    records.wait_for("the change back", |record| is(record, "counter-io", "program-changed"));
    wait_for_alarm(true);
    let (exit, document, _) = step("accept");
    assert_eq!((exit, &document["failures"][0]["code"]), (1, &Value::from("U0632")));
    done("cancel");
    wait_for_alarm(false);
    let counts = ended_well(child, &runs, &run);
    let steps = steps(&counts);
    assert_eq!(steps, [1, 10, 1], "{steps:?}");
    let around = counts.windows(2).find(|pair| pair[1].0 == pair[0].0 + 2);
    let around = around.expect("the fault costs a cycle");
    assert_eq!(around[1].1 - around[0].1, 1, "{around:?}");
}

/// The sources of the outputs of the counter's remote I/O and what they are, in the order of the journal.
fn applied(journal: &str) -> Vec<(String, u64)> {
    let records = journal.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let applied = records.filter(|record| is(record, "counter-io", "applied"));
    let shown = applied.filter_map(|record| {
        let event = &record["event"];
        let source = event["source"].as_str()?.to_owned();
        Some((source, event["outputs"]["words"][0].as_u64()?))
    });
    shown.collect()
}

/// Fail-safe values alone change while a remote I/O is killed in the middle: the new ones are driven where all stations die after the acceptance, and
/// explained as such.
#[test]
fn fail_safe_values_change_while_a_remote_io_is_killed() {
    let _one = some_at_a_time();
    let out = empty_folder("changes-settings");
    let program = counter("DINT", 1);
    let settings = |value: u32| format!("hold_cycles = 2\nfail_safe = {{ shown = {value} }}");
    let before = write_cluster_falling_back(&out.join("before"), &program, &settings(1_000_000));
    let after = write_cluster_falling_back(&out.join("after"), &program, &settings(2_000_000));
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (child, _errors) = running_with(&["lab", &before, "--out"], &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let commander = Commander::of_run(run.clone());
    let mut records = Records::of(&run);
    let act = |member: Member, command: Command| {
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let action = OperatorAction::Command { member, command, owner, reason };
        commander.act_and_wait(&action).expect("it is done");
    };
    let run_text = run.to_str().expect("text");
    let done = |word: &str| {
        let (exit, document, errors) = answer(&["change", run_text, &after, word]);
        assert_eq!(exit, 0, "{word}: {document:#} {errors}");
        document
    };
    let plan = done("plan");
    let setting = &plan["result"]["settings"][0];
    assert_eq!(setting["setting"], "fail_safe.shown", "{plan:#}");
    assert_eq!((&setting["before"], &setting["now"]), (&"1000000".into(), &"2000000".into()));
    done("prepare");
    let remote_io = Member::RemoteIo(ProgramId(0));
    for command in [Command::Kill, Command::Restart] {
        act(remote_io, command);
    }
    records.wait_for("its start", |record| is(record, "counter-io", "adopted-lineage"));
    done("switch");
    done("accept");
    done("accept");
    for command in [Command::Kill, Command::Restart] {
        act(remote_io, command);
    }
    records.wait_for("its start", |record| is(record, "counter-io", "adopted-lineage"));
    for station in [0, 2] {
        act(Member::Station(StationId(station)), Command::Kill);
    }
    let is_new = |record: &Value| {
        let event = &record["event"];
        let is_new = event["outputs"]["words"][0] == 2_000_000;
        is(record, "counter-io", "applied") && event["source"] == "fail-safe" && is_new
    };
    records.wait_for("the new value", is_new);
    let (exit, document, errors) = answer(&["why", "counter.shown", run_text]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    assert!(document["result"]["ramp_to"].is_null(), "{document:#}");
    ended_well(child, &runs, &run);
    let applied = applied(&fs::read_to_string(run.join("journal.jsonl")).expect("a journal"));
    let proved = applied.iter().position(|(source, _)| source == "direct").expect("it ran");
    let last = applied.iter().rposition(|(source, _)| source == "direct").expect("it ran");
    // One that starts drives what it falls back to while it listens: that of its configuration.
    let fallen: Vec<u64> = applied[proved..]
        .iter()
        .filter(|(source, _)| source == "fail-safe")
        .map(|(_, value)| *value)
        .collect();
    assert!(fallen.is_sorted() && fallen.contains(&2_000_000), "{fallen:?}");
    assert!(applied[last..].iter().all(|(_, value)| *value != 1_000_000), "{:?}", &applied[last..]);
}
