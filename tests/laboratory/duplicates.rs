//! Two processes that run as one member with the same keys, as after a disk image was started a second time.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use nix::sys::signal::Signal;
use serde_json::Value;
use understudy_bus::free_addresses;

use super::deaths::{Records, is};
use super::shared::{empty_folder, some_at_a_time, understudy};
use super::{PERIOD, PRESS_CELL, no_orphan, running, signal};

/// A second robot beside that of a run: with a copy of its keys, at an address of its own.
struct Double {
    child: Child,
}

impl Double {
    fn start(run: &Path, folder: &Path, period: &str) -> Self {
        let keys = folder.join("keys");
        fs::create_dir(&keys).expect("a folder");
        fs::set_permissions(&keys, Permissions::from_mode(0o700)).expect("it is ours");
        for entry in fs::read_dir(run.join("keys/members/robot")).expect("keys") {
            let path = entry.expect("it is ours").path();
            fs::copy(&path, keys.join(path.file_name().expect("a file"))).expect("copied");
        }
        let endpoints = endpoints(run, folder);
        let arguments = [
            "node",
            PRESS_CELL,
            "--name",
            "robot",
            "--link",
            "udp",
            "--period",
            period,
            "--no-real-time",
        ];
        let child = understudy(&arguments)
            .arg("--keys")
            .arg(keys)
            .arg("--endpoints")
            .arg(endpoints)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("the binary is built");
        Self { child }
    }
}

impl Drop for Double {
    fn drop(&mut self) {
        // It can only fail where the process has ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Those of the run, with another address of the robot.
fn endpoints(run: &Path, folder: &Path) -> PathBuf {
    let text = fs::read_to_string(run.join("endpoints.json")).expect("endpoints");
    let all: Value = serde_json::from_str(&text).expect("JSON");
    let mut members = all.as_array().expect("a list").iter();
    let own = members.find(|member| member["name"] == "robot");
    let own = own.and_then(|robot| robot["address"].as_str());
    let own = own.expect("the robot's address");
    let address = free_addresses(1).expect("a free port")[0];
    let path = folder.join("endpoints.json");
    fs::write(&path, text.replace(own, &address.to_string())).expect("written");
    path
}

fn records(run: &Path) -> Vec<Value> {
    let text = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let lines = whole.lines();
    lines
        .map(|line| serde_json::from_str(line).expect("a record"))
        .collect()
}

/// A record that is waited for, and what it is called.
type Wanted<'a> = (&'a str, &'a dyn Fn(&Value) -> bool);

/// A run with a copy of its robot, until `wanted` came; its records, and its summary.
fn with_copy(name: &str, period: &str, wanted: &[Wanted<'_>]) -> Vec<Value> {
    let _one = some_at_a_time();
    let out = empty_folder(name);
    let folder = empty_folder(&format!("{name}_copy"));
    let (mut child, _errors) = running(&out, &["--security", "keys"]);
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    let copy = Double::start(&run, &folder, period);
    for (what, wanted) in wanted {
        Records::of(&run).wait_for(what, wanted);
    }
    drop(copy);
    signal(child.id(), Signal::SIGINT);
    child.wait().expect("it ends");
    no_orphan(&out);
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["violation_count"], 0, "{summary:#}");
    records(&run)
}

fn refused_as<'a>(kind: &'a str) -> impl Fn(&Value) -> bool + 'a {
    move |record| {
        let event = &record["event"];
        event["refused_as"] == kind && event["sender"]["station"] == 0
    }
}

#[test]
fn a_second_process_with_the_same_keys_is_named_and_the_first_one_lives_on() {
    let two_lives = |record: &Value| {
        let event = &record["event"];
        event["event"] == "duplicate-found" && event["member"]["station"] == 0
    };
    let refused = |record: &Value| is(record, "robot", "new-life");
    with_copy(
        "two_lives",
        PERIOD,
        &[
            ("the name of both", &two_lives),
            ("the word of the one that is refused", &refused),
        ],
    );
}

#[test]
fn a_copy_with_another_configuration_shuts_nobody_out() {
    let told = |record: &Value| is(record, "robot-io", "refused");
    let again = |record: &Value| is(record, "understudy", "refused");
    let records = with_copy(
        "old_image",
        "60ms",
        &[("the other configuration", &told), ("the same", &again)],
    );
    for kind in ["replayed", "of-another-life"] {
        let refused = records.iter().find(|record| refused_as(kind)(record));
        assert_eq!(refused, None);
    }
    let silent = |record: &&Value| is(record, "robot", "new-life");
    assert_eq!(records.iter().find(silent), None);
}
