//! Comparisons and the memory of long runs; speed is for quiet machines and no test.

use std::fs;

use crate::{empty_folder, understudy};

#[test]
fn the_cluster_beside_pairs() {
    let folder = empty_folder("failover");
    let figure = folder.join("failover.svg");
    let path = figure.to_str().expect("text");
    let asked = [
        "--failures",
        "4",
        "--loss-cycles",
        "200",
        "--kills",
        "0",
        "--figure",
        path,
        "--json",
    ];
    let answer = understudy(&[&["bench", "failover"], &asked[..]].concat());
    assert_eq!(answer.status, 0, "{}{}", answer.output, answer.errors);
    let contenders = answer.json()["result"]["contenders"].clone();
    let contenders = contenders.as_array().expect("a list").clone();
    assert_eq!(contenders.len(), 5);
    assert_eq!(contenders[0]["wrong"], 0);
    assert_eq!(contenders[0]["lost_worst"], 0);
    assert!(
        fs::read_to_string(&figure)
            .expect("a figure")
            .starts_with("<svg")
    );
}

#[test]
fn a_long_run_needs_no_more_memory() {
    let answer = understudy(&["bench", "memory", "--cycles", "5000"]);
    assert_eq!(answer.status, 0, "{}{}", answer.output, answer.errors);
}

#[test]
fn a_scan_of_a_program_takes_its_time() {
    let found = understudy(&[
        "bench",
        "scan",
        "examples/press-cell/robot.ladder",
        "--json",
    ])
    .json();
    assert_eq!(found["result"]["runs"], 64, "{found}");
    assert!(
        found["result"]["nanoseconds_per_scan"].as_f64() > Some(0.0),
        "{found}"
    );
}
