//! Members that are suspended from outside: what they say when they go on.

use std::fs;

use nix::sys::signal::Signal;
use serde_json::Value;
use understudy_journal::monotonic_ns;

use super::deaths::{Records, is};
use super::shared::deployed::Running;
use super::shared::{empty_folder, some_at_a_time};
use super::{no_orphan, running, signal};

/// Cycles of 50 ms: far more than a second, after which missing samples are reported.
const STILL: u64 = 60;

/// The cycle of the first deadline that was passed after a time.
fn deadline_after(records: &mut Records, at_ns: u64) -> u64 {
    let found = records.wait_for("a deadline", |record| {
        is(record, "robot-io", "applied") && record["at_ns"].as_u64() > Some(at_ns)
    });
    cycle(&found)
}

fn cycle(record: &Value) -> u64 {
    record["event"]["moment"]["cycle"].as_u64().expect("a cycle")
}

/// The turns of the cycles that it has missed wait in one socket and their samples in another one, so that it goes through cycles without a
/// sample although its remote I/O has sent one in each: that is no remote I/O that is gone.
#[test]
fn a_station_that_stood_still_does_not_report_samples_as_missing() {
    let _one = some_at_a_time();
    let out = empty_folder("stood-still");
    let (child, _errors) = running(&out, &[]);
    // It ends with a test that fails, too.
    let mut laboratory = Running(child);
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    for name in ["understudy", "robot", "press"] {
        let process = Records::of(&run).ready(name);
        let mut records = Records::of(&run);
        signal(process, Signal::SIGSTOP);
        let begun = deadline_after(&mut records, monotonic_ns());
        records.wait_for("deadlines without it", |record| {
            is(record, "robot-io", "applied") && cycle(record) >= begun + STILL
        });
        let goes_on = monotonic_ns();
        signal(process, Signal::SIGCONT);
        records.wait_for("its return", |record| {
            is(record, name, "published") && record["at_ns"].as_u64() > Some(goes_on)
        });
        let back = deadline_after(&mut records, monotonic_ns());
        records.wait_for("deadlines with it", |record| {
            is(record, "robot-io", "applied") && cycle(record) >= back + STILL / 2
        });
        let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
        let missing = journal.lines().filter(|line| line.contains("samples-missing"));
        assert_eq!(missing.collect::<Vec<_>>(), [""; 0], "{name}");
    }
    signal(laboratory.0.id(), Signal::SIGINT);
    laboratory.0.wait().expect("it ends");
    no_orphan(&out);
}
