//! The power fails: every process is killed, and the program goes on with its retentive values.

use std::fmt::Write;
use std::fs;

use serde_json::Value;
use understudy_testing::COUNTER;

use super::shared::{answer, empty_folder, some_at_a_time};
use super::{PERIOD, no_orphan};

const CLUSTER: &str = r#"
[cluster]
name = "power"

[[controller]]
name = "counter"
ladder = "counter.st"

[[understudy]]
name = "understudy"

[[remote_io]]
controller = "counter"
"#;

/// Cycles between two failures.
const BETWEEN: u64 = 60;
const FAILURES: u64 = 4;

/// Every member is killed, each in another phase of the cycle, and they come back in another order each time.
fn scenario() -> String {
    let cycles = BETWEEN * (FAILURES + 1);
    let mut text = format!("title = \"the power fails\"\ncycles = {cycles}\n");
    let mut step = |at: u64, phase: f64, action: &str, station: &str| {
        write!(
            text,
            "\n[[step]]\nat = {at}\nphase = {phase}\naction = \"{action}\"\nstation = \"{station}\"\n"
        )
        .expect("a string takes everything");
    };
    let members = ["counter", "understudy", "counter-io"];
    for failure in 0..FAILURES {
        let at = BETWEEN * (failure + 1);
        for (place, member) in (0..).zip(members) {
            let phase = ((failure * 3 + place * 2) % 10) as f64 / 10.0;
            step(at, phase, "crash", member);
        }
        for (place, member) in (0..).zip(members) {
            step(at + 10 + 2 * ((failure + place) % 3), 0.0, "restart", member);
        }
    }
    text
}

/// Both counters of the outputs.
fn counters(event: &Value) -> (u64, u64) {
    let word = event["outputs"]["words"][0].as_u64().expect("an image");
    (word & 0xffff_ffff, word >> 32)
}

#[test]
fn a_counter_never_goes_back_when_every_process_is_killed() {
    let _one = some_at_a_time();
    let out = empty_folder("power");
    let file = |name: &str, text: &str| {
        let path = out.join(name);
        fs::write(&path, text).expect("a file");
        path
    };
    let cluster = file("cluster.toml", CLUSTER);
    file("counter.st", COUNTER);
    let scenario = file("scenario.toml", &scenario());
    let [cluster, scenario, runs] = [&cluster, &scenario, &out.join("runs")]
        .map(|path| path.to_str().expect("text").to_owned());
    let (exit, document, errors) = answer(&[
        "lab",
        &cluster,
        "--scenario",
        &scenario,
        "--period",
        PERIOD,
        "--link",
        "udp",
        "--out",
        &runs,
    ]);
    assert_eq!(exit, 0, "{errors} {document:.2000}");
    let journal = out.join("runs/latest/journal.jsonl");
    let journal = fs::read_to_string(journal).expect("a journal");
    let records = journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let events: Vec<Value> = records.map(|record| record["event"].clone()).collect();
    let of = |kind: &'static str| events.iter().filter(move |event| event["event"] == kind);
    let proved = of("applied")
        .filter(|event| event["source"] == "direct" || event["source"] == "reconstructed");
    let counted: Vec<(u64, u64)> = proved.map(counters).collect();
    assert!(counted.is_sorted_by_key(|(total, _)| *total), "{counted:?}");
    // A first start is cold; no other one is, and a person was asked nothing, unless a process was killed before it could write what it proved last.
    assert_eq!(of("started-cold").count(), 1);
    let asked = of("state-lost").count() as u64;
    let warm = of("started-warm").count() as u64;
    assert!(warm + asked >= FAILURES && warm > 0, "{warm} warm starts, {asked} questions");
    for event in of("started-warm") {
        assert_eq!(event["lost"], 0, "{event}");
    }
    let last = counted.last().expect("it ran");
    assert!(asked > 0 || last.0 > last.1, "only what is retentive is kept: {last:?}");
    no_orphan(&out);
}
