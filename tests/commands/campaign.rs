//! Campaigns from outside: shards that are merged are the whole, and each failure is a scenario that fails again.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::{Answer, empty_folder, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";

fn campaign(out: &Path, more: &[&str]) -> Answer {
    let out = out.to_str().expect("text");
    let fixed = ["campaign", PRESS_CELL, "--seed", "5", "--cycles", "150", "--out", out];
    understudy(&[&fixed, more].concat())
}

#[test]
fn nothing_wrong_is_found() {
    let folder = empty_folder("campaign");
    let answer = campaign(&folder, &["--runs", "60"]);
    assert_eq!(answer.status, 0, "{}{}", answer.output, answer.errors);
    assert!(answer.output.contains("wrong: 0 of 60 runs"), "{}", answer.output);
    let page = fs::read_to_string(folder.join("campaign.html")).expect("a page");
    assert!(page.contains("one-way-cut"));
}

#[test]
fn merged_shards_are_the_whole_and_failures_fail_again() {
    let folder = empty_folder("campaign_shards");
    let asked = ["--runs", "8", "--property", "held", "--faults", "isolation,slow"];
    let whole = folder.join("whole");
    let answer = campaign(&whole, &[&asked[..], &["--jobs", "1"]].concat());
    assert_eq!(answer.status, 4, "{}{}", answer.output, answer.errors);
    let shards = ["1/2", "2/2"].map(|shard| {
        let out = folder.join(shard.replace('/', "-of-"));
        campaign(&out, &[&asked[..], &["--jobs", "3", "--shard", shard]].concat());
        out.to_str().expect("text").to_owned()
    });
    let merged = folder.join("merged");
    let out = merged.to_str().expect("text");
    let answer = understudy(&["campaign", "merge", &shards[1], &shards[0], "--out", out, "--json"]);
    assert_eq!(answer.status, 4, "{}", answer.errors);
    let text = |folder: &Path| fs::read_to_string(folder.join("campaign.json")).expect("findings");
    assert_eq!(text(&merged), text(&whole));
    let scenarios = answer.json()["result"]["scenarios"].clone();
    let scenarios = scenarios.as_array().expect("a list").clone();
    assert!(!scenarios.is_empty());
    for scenario in &scenarios {
        let path = scenario.as_str().expect("a path");
        let again = understudy(&["simulate", PRESS_CELL, "--scenario", path]);
        assert_eq!(again.status, 1, "{path}: {}", again.output);
        assert!(again.output.contains("NOT MET: no cycles held"), "{}", again.output);
    }
}

/// Whether a process holds SIGINT back, as a campaign does once it can be interrupted; while its log starts, all signals are held back.
fn holds_back_sigint(pid: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigBlk:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let holds_back = |mask: u64, signal: Signal| mask >> (signal as u32 - 1) & 1 == 1;
    mask.is_some_and(|mask| holds_back(mask, Signal::SIGINT) && !holds_back(mask, Signal::SIGUSR1))
}

#[test]
fn what_was_found_is_kept_when_it_is_interrupted() {
    let folder = empty_folder("campaign_interrupted");
    let mut child = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(["campaign", PRESS_CELL, "--seed", "5", "--cycles", "150"])
        .args(["--runs", "1000000000", "--out"])
        .arg(&folder)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary is built");
    let start = Instant::now();
    while !holds_back_sigint(child.id()) {
        let ended = child.try_wait().expect("a status");
        assert!(ended.is_none(), "it has ended by itself: {ended:?}");
        assert!(start.elapsed() < Duration::from_secs(60), "it never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).expect("it runs");
    let answer = child.wait_with_output().expect("it ends");
    let output = String::from_utf8(answer.stdout).expect("text");
    assert_eq!(answer.status.code(), Some(1), "{output}");
    assert!(output.contains("partial findings"), "{output}");
    let kept = fs::read_to_string(folder.join("campaign.json")).expect("findings");
    let kept: serde_json::Value = serde_json::from_str(&kept).expect("JSON");
    assert_eq!(kept["runs_failed"], 0, "{output}");
    assert!(kept["runs_made"].as_u64() < kept["runs_asked"].as_u64());
}

#[test]
fn what_is_wrong_with_the_arguments_is_said() {
    let check = |arguments: &[&str], expected: &str| {
        let answer = understudy(&[&["campaign"], arguments].concat());
        assert_eq!(answer.status, 2, "{arguments:?}");
        assert!(answer.errors.contains(expected), "{arguments:?}: {}", answer.errors);
    };
    check(&[], "CLUSTER.toml");
    check(&[PRESS_CELL, "--shard", "9/8"], "from 1 to N");
    // Parts of different seeds are not those of one campaign.
    check(&[PRESS_CELL, "--shard", "1/2"], "--seed <N>");
    check(&[PRESS_CELL, "--faults", "crush"], "unknown fault");
    check(&[PRESS_CELL, "--budget", "10"], "invalid duration `10`");
    check(&[PRESS_CELL, "--cycles", "3"], "150");
    check(&["merge", "nowhere", "neither"], "neither");
    let folder = empty_folder("campaign_other");
    fs::write(folder.join("campaign.json"), "{}").expect("it is written");
    let path = folder.to_str().expect("text");
    check(&["merge", path], "error[U0610]");
}
