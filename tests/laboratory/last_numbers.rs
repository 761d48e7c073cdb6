//! Members whose cycles and frames have numbers close to their end: the next epoch and the next life follow, and no output is missed for it.

use std::fs;
use std::process::Command;

use serde_json::Value;

use super::shared::{empty_folder, some_at_a_time};
use super::{PERIOD, PRESS_CELL, TOLERATED_CYCLES, is_conclusive, no_orphan};

/// Cycles before the last one of the first epoch, and frames before the first life ends: both end while the scenario runs. A further life is asked
/// for 4096 frames before the end.
const NUMBERS: [u64; 3] = [1 << 60, u64::MAX - 120, u64::MAX - 4_200];

const SCENARIO: &str = "\
title = \"A controller fails while cycles and frames are numbered anew\"
cycles = 200

[[step]]
at = 60
station = \"robot\"
action = \"crash\"

[[step]]
at = 130
station = \"robot\"
action = \"restart\"
";

#[test]
fn the_next_epoch_and_the_next_life_follow_the_last_numbers() {
    let _one = some_at_a_time();
    let out = empty_folder("last_numbers");
    let scenario = out.join("scenario.toml");
    fs::write(&scenario, SCENARIO).expect("written");
    let [epoch, cycle, frame] = NUMBERS;
    let output = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(["lab", PRESS_CELL, "--link", "udp", "--period", PERIOD, "--json", "--scenario"])
        .arg(&scenario)
        .arg("--out")
        .arg(&out)
        .env("UNDERSTUDY_FIRST_NUMBERS", format!("{epoch}:{cycle}:{frame}"))
        .output()
        .expect("the binary is built");
    no_orphan(&out);
    let errors = String::from_utf8_lossy(&output.stderr);
    let document: Value = serde_json::from_slice(&output.stdout).expect("a document");
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    assert_eq!(summary["cycles_run"], 200, "{document:#}\n{errors}");

    let journal = fs::read_to_string(out.join("latest/journal.jsonl")).expect("a journal");
    let events: Vec<Value> = journal
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .map(|record| record["event"].clone())
        .collect();
    let mut epochs: Vec<u64> = events
        .iter()
        .filter(|event| event["event"] == "applied")
        .filter_map(|event| event["moment"]["epoch"].as_u64())
        .filter(|&found| found >= epoch)
        .collect();
    epochs.sort_unstable();
    epochs.dedup();
    assert_eq!(epochs, [epoch, epoch + 1], "{summary:#}");
    let began = events.iter().filter(|event| event["event"] == "new-life").count();
    assert!(began >= 4, "each member that runs on begins a further life: {began}, {summary:#}");
    let missed: u64 = ["held", "fail-safe"].iter().map(|source| total(summary, source)).sum();
    if is_conclusive(summary) {
        assert!(missed <= TOLERATED_CYCLES, "{missed} missed: {summary:#}");
    }
}

fn total(summary: &Value, source: &str) -> u64 {
    let remote_ios = summary["remote_ios"].as_array().expect("a list").iter();
    remote_ios.filter_map(|remote_io| remote_io["counts"][source].as_u64()).sum()
}

/// The variable is for tests: a member that cannot read it does not start.
#[test]
fn other_numbers_are_refused() {
    let _one = some_at_a_time();
    let out = empty_folder("other_numbers");
    let output = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(["lab", PRESS_CELL, "--link", "udp", "--scenario", "scenarios/kill-each.toml"])
        .arg("--out")
        .arg(&out)
        .env("UNDERSTUDY_FIRST_NUMBERS", "1:2")
        .output()
        .expect("the binary is built");
    no_orphan(&out);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("error[U0600]") && errors.contains("EPOCH:CYCLE:FRAME"), "{errors}");
}
