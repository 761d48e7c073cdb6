//! Commands of the page against a real laboratory: each is done or refused with a reason, and each is in the journal.

use std::fs;
use std::path::Path;
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::time::{ClockId, clock_gettime};
use nix::unistd::Pid;
use serde_json::{Value, json};

use crate::{Page, empty_folder, member, one_at_a_time, understudy};

const PERIOD: &str = "50ms";

fn started(name: &str) -> (Page, std::path::PathBuf) {
    started_with(name, &[])
}

fn started_with(name: &str, arguments: &[&str]) -> (Page, std::path::PathBuf) {
    let command = [&["examples/press-cell/cluster.toml"], arguments].concat();
    started_of(name, &command, &["robot", "press", "understudy"])
}

fn started_of(name: &str, watched: &[&str], stations: &[&str]) -> (Page, std::path::PathBuf) {
    let runs = empty_folder(name);
    let mut command = understudy(&["watch"]);
    command
        .args(watched)
        .args(["--address", "127.0.0.1:0", "--allow-commands"])
        .args(["--link", "udp", "--period", PERIOD])
        .arg("--out")
        .arg(&runs);
    let page = Page::start(command);
    page.wait_for("a cluster synchronised", |state| {
        let publishing = |name: &&str| member(state, name)["state"] == "publishing";
        stations.iter().all(publishing)
    });
    (page, runs)
}

/// A signal is named as the page does it: by its place in the inputs and outputs that count.
pub(crate) fn give(page: &Page, name: &str, command: &Value) -> (u16, String) {
    let mut body =
        json!({ "member": name, "command": command, "owner": "anna", "reason": "a test" });
    if command["signal"].is_object() {
        let programs = page.get("/api/run").json()["programs"].clone();
        let mut programs = programs.as_array().expect("programs").iter();
        let own = programs.find(|program| program["remote_io"] == name).expect("its program");
        body["points"] = own["points"].clone();
    }
    let answer = page.post("/api/command", &body.to_string());
    let code = if answer.status == 200 { String::new() } else { answer.code() };
    (answer.status, code)
}

/// For how long the page is suspended: some 60 cycles.
const SUSPENDED: Duration = Duration::from_secs(3);

/// Cycles that a busy machine may cost; a suspended network costs all.
const TOLERATED_CYCLES: usize = 5;

fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::CLOCK_MONOTONIC).expect("a clock");
    let nanoseconds = now.tv_sec() * 1_000_000_000 + now.tv_nsec();
    u64::try_from(nanoseconds).expect("a time since the start")
}

#[test]
fn a_page_that_is_suspended_stops_nothing() {
    let _turn = one_at_a_time();
    check_suspended(started("suspended"));
}

/// The proxy of the links is a process of its own.
#[test]
fn a_page_that_is_suspended_stops_no_impaired_link() {
    let _turn = one_at_a_time();
    check_suspended(started_with("suspended-impaired", &["--delay", "1ms"]));
}

fn check_suspended((page, runs): (Page, std::path::PathBuf)) {
    let cycles = i64::try_from(SUSPENDED.as_millis() / 50).expect("a few");
    let newest = page.wait_for("a state", |state| state["cycle"].is_i64());
    let before = newest["cycle"].as_i64().expect("a cycle");
    let from = monotonic_ns();
    page.signal(Signal::SIGSTOP);
    std::thread::sleep(SUSPENDED);
    let to = monotonic_ns();
    page.signal(Signal::SIGCONT);
    // What the members reported meanwhile is read now.
    page.wait_for("the cycles of that time", |state| {
        state["cycle"].as_i64() > Some(before + cycles + 10)
    });
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    assert_eq!(page.end(), 0);
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let records =
        journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("a record"));
    let within = |record: &Value| {
        let at = record["at_ns"].as_u64().expect("a time");
        (from..to).contains(&at) && record["event"]["event"] == "applied"
    };
    let sources: Vec<String> = records
        .filter(within)
        .map(|record| record["event"]["source"].as_str().expect("text").to_owned())
        .collect();
    // Of both remote I/Os; a busy machine may skip some deadlines.
    assert!(sources.len() as i64 > cycles, "{}", sources.len());
    let not_true = sources.iter().filter(|source| ["held", "fail-safe"].contains(&source.as_str()));
    assert!(not_true.count() <= TOLERATED_CYCLES, "{sources:?}");
}

/// The process of a member, as its newest `ready` record says it.
fn process_of(runs: &Path, name: &str) -> Pid {
    let journal = fs::read_to_string(runs.join("latest/journal.jsonl")).expect("a journal");
    let whole = journal.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let process = whole
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("a record"))
        .filter(|record| record["name"] == name && record["event"]["event"] == "ready")
        .filter_map(|record| record["event"]["process"].as_i64())
        .next_back();
    let process = process.expect("it is ready");
    Pid::from_raw(i32::try_from(process).expect("a process id"))
}

#[test]
fn the_page_shows_what_is_killed_from_outside_and_starts_it_again() {
    let _turn = one_at_a_time();
    let (page, runs) = started("outside");
    for name in ["robot", "press-io"] {
        kill(process_of(&runs, name), Signal::SIGKILL).expect("it runs");
        let state = page.wait_for("its end", |state| member(state, name)["state"] == "ended");
        assert_eq!(member(&state, name)["down"], true);
        let restart = json!({ "command": "restart" });
        assert_eq!(give(&page, name, &restart), (200, String::new()));
        page.wait_for("its return", |state| {
            ["publishing", "serving"]
                .contains(&member(state, name)["state"].as_str().expect("text"))
        });
    }
    let alarms = page.get("/api/events").json().to_string();
    assert!(alarms.contains("robot ended unexpectedly"), "{alarms:.2000}");
    assert_eq!(page.end(), 0);
}

#[test]
fn every_command_is_done_or_refused_and_is_in_the_journal() {
    let _turn = one_at_a_time();
    let (page, runs) = started("commands");
    let done = (200, String::new());
    let refused = |code: &str| (409, code.to_owned());
    let simple = |command: &str| json!({ "command": command });

    assert_eq!(give(&page, "robot", &simple("kill")), done);
    page.wait_for("its end", |state| {
        member(state, "robot")["state"] == "killed"
            && state["programs"][0]["source"] == "reconstructed"
    });
    assert_eq!(give(&page, "robot", &simple("kill")), refused("U0551"));
    assert_eq!(give(&page, "robot", &simple("restart")), done);
    assert_eq!(give(&page, "robot", &simple("restart")), refused("U0552"));
    page.wait_for("its return", |state| member(state, "robot")["state"] == "publishing");

    assert_eq!(give(&page, "press", &simple("continue")), refused("U0553"));
    assert_eq!(give(&page, "press", &simple("stop")), done);
    page.wait_for("its silence", |state| member(state, "press")["state"] == "suspended");
    assert_eq!(give(&page, "press", &simple("continue")), done);
    page.wait_for("its return", |state| member(state, "press")["state"] == "publishing");

    assert_eq!(give(&page, "press", &simple("isolate")), done);
    page.wait_for("a reconstructed press", |state| {
        state["programs"][1]["source"] == "reconstructed"
    });
    assert_eq!(give(&page, "press", &simple("rejoin")), done);
    page.wait_for("its return", |state| member(state, "press")["state"] == "publishing");

    assert_eq!(give(&page, "robot", &simple("release")), refused("U0554"));
    assert_eq!(give(&page, "nobody", &simple("kill")), (404, "U0681".to_owned()));
    let force = |signal: Value, seconds: u32| json!({ "command": "force", "signal": signal, "value": true, "seconds": seconds });
    assert_eq!(give(&page, "robot-io", &force(json!({ "input": 900 }), 5)), refused("U0556"));
    assert_eq!(give(&page, "robot-io", &force(json!({ "output": 0 }), 0)), refused("U0556"));
    assert_eq!(give(&page, "robot-io", &force(json!({ "output": 0 }), 3600)), done);
    page.wait_for("a forced output", |state| state["programs"][0]["forced"][0]["owner"] == "anna");
    let unforce = json!({ "command": "unforce", "signal": { "output": 0 } });
    assert_eq!(give(&page, "robot-io", &unforce), done);
    page.wait_for("a free output", |state| {
        state["programs"][0]["forced"].as_array().is_some_and(Vec::is_empty)
    });

    // A place without its inputs and outputs may be that of another signal, also when the change is over.
    for command in [force(json!({ "output": 0 }), 5), unforce] {
        let body = json!({ "member": "robot-io", "command": command, "owner": "anna", "reason": "a test" });
        let answer = page.post("/api/command", &body.to_string());
        assert_eq!((answer.status, answer.code().as_str()), (400, "U0682"), "{}", answer.body);
        assert!(answer.body.contains("`points`"), "{}", answer.body);
    }

    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    assert_eq!(page.end(), 0);
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let events = |name: &str| -> Vec<Value> {
        let records =
            journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("a record"));
        let events = records.map(|record| record["event"].clone());
        events.filter(|event| event["event"] == name).collect()
    };
    let commanded = events("commanded");
    assert_eq!(commanded.len(), 14, "{commanded:?}");
    assert!(commanded.iter().all(|event| event["owner"] == "anna" && event["reason"] == "a test"));
    let refused = commanded.iter().filter(|event| event["refused"].is_string());
    assert_eq!(refused.count(), 6);
    // By its remote I/O, which knows its signals.
    assert_eq!(events("force-refused").len(), 1);
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    let wrong = |remote_io: &Value| remote_io["counts"]["wrong"] == 0;
    let remote_ios = summary["remote_ios"].as_array().expect("a list");
    assert!(!remote_ios.is_empty() && remote_ios.iter().all(wrong), "{remote_ios:?}");
}

/// Waits until the page counts cycles from the origin of the run: before, they have other numbers.
fn origin_is_known(page: &Page) {
    page.wait_for("the origin", |_| {
        let found = page.get("/api/events?find=origin").json();
        found["events"].as_array().is_some_and(|all| !all.is_empty())
    });
    let shown = page.wait_for("a state", |_| true);
    page.wait_for("a newer state", |state| state["cycle"] != shown["cycle"]);
}

#[test]
fn a_write_is_answered_with_its_cycle_or_a_code() {
    let _turn = one_at_a_time();
    let cluster = "examples/two-shuttles/cluster.toml";
    let (page, _) = started_of("writes", &[cluster], &["left", "right", "understudy"]);
    origin_is_known(&page);
    let facts = page.get("/api/run").json();
    assert!(facts["commands"]["write_why"].is_null(), "{facts:#}");
    let inputs = facts["programs"][0]["inputs"].as_array().expect("inputs");
    let place = |name: &str| {
        let found = inputs.iter().position(|input| input["name"] == name);
        found.expect("an input")
    };
    let speed = &inputs[place("speed")];
    assert_eq!(speed["unit"], "mm/s");
    assert_eq!(
        speed["operator"],
        json!({ "kind": "setpoint", "title": "Speed", "confirm": false, "low": 0.0, "high": 200.0, "why": null })
    );
    let from = &inputs[place("right_wants")]["from"];
    assert_eq!(from, &json!({ "program": 1, "output": "wants" }));

    let write =
        |input: &str, value: &str| json!({ "command": "write", "input": input, "value": value });
    let refused = |code: &str| (400, code.to_owned());
    let left = "left-io";
    assert_eq!(give(&page, left, &write("speed", "250")), refused("U0642"));
    assert_eq!(give(&page, left, &write("speed", "fast")), refused("U0641"));
    assert_eq!(give(&page, left, &write("spead", "1")), refused("U0640"));
    let force =
        json!({ "command": "force", "signal": { "input": 64 }, "value": "fast", "seconds": 5 });
    assert_eq!(give(&page, left, &force), refused("U0556"));

    let body = json!({ "member": left, "command": write("speed", "180"), "owner": "anna", "reason": "a test" });
    let answer = page.post("/api/command", &body.to_string());
    assert_eq!(answer.status, 200, "{}", answer.body);
    let answer = answer.json();
    let cycle = answer["run_cycle"].as_i64().expect("a cycle");
    assert!(answer["cycle"].as_i64() >= Some(cycle), "{answer}");
    let at = |cycle: i64| {
        let found = page.get(&format!("/api/state?cycle={cycle}"));
        assert_eq!(found.status, 200, "{answer}: {:.300}", found.body);
        found.json()["programs"][0]["input_values"][place("speed")].as_f64()
    };
    page.wait_for("the cycle of the write", |state| state["cycle"].as_i64() >= Some(cycle));
    assert_eq!(at(cycle), Some(180.0));
    assert_ne!(at(cycle - 1), Some(180.0));
    page.wait_for("valid signals", |state| {
        let signals = state["programs"][0]["signals"].as_array();
        signals.is_some_and(|all| all.len() == 2 && all.iter().all(|one| one["valid"] == true))
    });
    let events = page.get("/api/events?find=speed").json().to_string();
    assert!(events.contains("anna writes 180.0 mm/s to input speed: a test"), "{events:.2000}");
    assert!(events.contains("speed = 180.0 mm/s of anna is in effect"));
    assert!(events.contains("anna commands write speed = 180.0 mm/s of left-io"));
    assert_eq!(page.end(), 0);
}
