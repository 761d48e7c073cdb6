//! The benchmarks run and find nothing wrong. Speed is measured on quiet machines and by no test.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Long compared with the delays of a busy machine.
const PERIOD: &str = "50ms";

/// An empty folder for one test.
fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("benchmarks").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("the folder of an old run is removed");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Runs a benchmark: its exit status and its answer.
fn answer(arguments: &[&str]) -> (Option<i32>, Value) {
    let output = Command::new(env!("CARGO_BIN_EXE_understudy-bench"))
        .args(arguments)
        .arg("--json")
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .output()
        .expect("the binary is built");
    let errors = String::from_utf8_lossy(&output.stderr);
    let document = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {errors:.2000}"));
    (output.status.code(), document)
}

/// Runs a benchmark on processes; its result.
fn on_processes(name: &str, arguments: &[&str]) -> Value {
    let out = empty_folder(name);
    let out = out.to_str().expect("text");
    let common = ["--link", "udp", "--period", PERIOD, "--out", out];
    let (_, document) = answer(&[arguments, &common].concat());
    let left = fs::read_dir("/proc").expect("a Linux").filter_map(Result::ok);
    let mut left = left.filter_map(|folder| fs::read(folder.path().join("cmdline")).ok());
    assert!(!left.any(|line| String::from_utf8_lossy(&line).contains(out)));
    assert!(document["result"].is_array(), "{document:#}");
    document["result"].clone()
}

#[test]
fn the_cluster_is_compared_with_pairs() {
    let figure = empty_folder("failover").join("failover.svg");
    let path = figure.to_str().expect("text");
    let (status, document) = answer(&[
        "failover",
        "--failures",
        "4",
        "--loss-cycles",
        "200",
        "--kills",
        "0",
        "--figure",
        path,
    ]);
    assert_eq!(status, Some(0), "{document:#}");
    let contenders = &document["result"]["contenders"];
    assert_eq!(contenders.as_array().map(Vec::len), Some(5));
    assert_eq!(contenders[0]["wrong"], 0);
    assert_eq!(contenders[0]["lost_worst"], 0);
    let drawn = fs::read_to_string(&figure).expect("a figure");
    assert!(drawn.starts_with("<svg"));
}

#[test]
fn a_long_run_needs_no_more_memory() {
    let (status, document) = answer(&["memory", "--cycles", "5000"]);
    assert_eq!(status, Some(0), "{document:#}");
}

#[test]
fn the_scan_of_a_program_is_measured() {
    let (_, document) = answer(&["scan", "examples/press-cell/robot.ladder"]);
    let result = &document["result"];
    assert_eq!(result["runs"], 64, "{document:#}");
    assert!(result["nanoseconds_per_scan"].as_f64() > Some(0.0), "{document:#}");
}

#[test]
fn the_log_costs_every_station_something() {
    let rows = on_processes("log", &["log", "--cycles", "60"]);
    let rows = rows.as_array().expect("stations");
    assert_eq!(rows.len(), 3, "{rows:?}");
    for row in rows {
        // At least a Sync and the turns of the other stations are received, and a turn is sent.
        assert!(row["places_per_cycle"].as_f64() > Some(5.0), "{row}");
        assert!(row["processor_us_per_cycle"].as_f64() > Some(0.0), "{row}");
        assert!(row["nanoseconds_per_place"].as_f64() > Some(0.0), "{row}");
    }
}

#[test]
fn each_carrier_completes_its_exchanges() {
    let (_, document) = answer(&["exchange", "--cycles", "20", "--no-real-time"]);
    let carriers = document["result"].as_array().unwrap_or_else(|| panic!("{document:#}"));
    assert_eq!(carriers.len(), 3, "{document:#}");
    for carrier in carriers {
        assert!(carrier["p50_us"].as_f64() > Some(0.0), "{document:#}");
    }
}

#[test]
fn clusters_are_timed_with_each_schedule() {
    let arguments = ["--controllers", "2", "--period", "20ms", "--seconds", "1", "--no-real-time"];
    let (status, document) = answer(&[&["timing"], &arguments[..]].concat());
    assert_eq!(status, Some(0), "{document:#}");
    let result = &document["result"];
    assert!(result["machine"]["wakeups"]["count"].as_u64() > Some(0), "{document:#}");
    let clusters = result["clusters"].as_array().unwrap_or_else(|| panic!("{document:#}"));
    let schedules: Vec<&Value> = clusters.iter().map(|cluster| &cluster["schedule"]).collect();
    assert_eq!(schedules, ["token", "parallel"]);
    for cluster in clusters {
        assert_eq!((&cluster["members"], &cluster["of_members"]), (&5.into(), &5.into()));
        // All remote I/Os decide once in a period, whatever the machine lets them prove.
        assert!(cluster["deadlines"].as_u64() > Some(20), "{document:#}");
        assert!(cluster["wakeups"]["count"].as_u64() > Some(20), "{document:#}");
    }
}

#[test]
fn stations_join_where_a_tenth_of_all_frames_is_lost() {
    let links = on_processes("join", &["join", "--trials", "2"]);
    assert_eq!(links.as_array().map(Vec::len), Some(1), "one link");
    for trial in links[0]["each"].as_array().expect("trials") {
        assert_eq!(trial["wrong"], 0, "{links:#}");
        // The time is measured where nothing else runs.
        assert!(trial["start"].is_u64(), "{links:#}");
    }
}

#[test]
fn every_role_is_killed_and_nothing_is_wrong() {
    let rows = on_processes("kills", &["kills", "--kills", "4"]);
    let rows = rows.as_array().expect("one for each role");
    assert_eq!(rows.len(), 3);
    for row in rows {
        let found = (&row["wrong"], &row["count"]);
        assert_eq!(found, (&0.into(), &4.into()), "{row:#}");
    }
}
