//! Clocks outside the validity of certificates: each side that knows it says it, with both times.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;
use understudy_keys::{Authority, Date};
use understudy_wire::Role;

use super::{DEADLINE, Running, addressed_cell, answer, codes, empty_folder, some_at_a_time, text};

const DAY: Duration = Duration::from_secs(24 * 3600);

/// Waits until a member's journal has an event whose reason contains all of these.
fn wait_for(journal: &Path, event: &str, parts: &[&str]) {
    let started = Instant::now();
    let is_it = |line: &str| {
        let record: Value = serde_json::from_str(line).unwrap_or_default();
        let reason = record["event"]["reason"].as_str().unwrap_or_default();
        record["event"]["event"] == event && parts.iter().all(|part| reason.contains(part))
    };
    while !fs::read_to_string(journal).unwrap_or_default().lines().any(is_it) {
        assert!(started.elapsed() < DEADLINE, "no {event} with {parts:?}");
        std::thread::yield_now();
    }
}

/// Writes another end of the validity into a holder's `keys.toml`; its certificate stays as it is.
fn expires(folder: &Path, date: Date) {
    let path = folder.join("keys.toml");
    let file = fs::read_to_string(&path).expect("it was issued");
    let is_end = |line: &&str| line.starts_with("expires = ");
    let line = file.lines().find(is_end).expect("it has an end");
    fs::write(&path, file.replace(line, &format!("expires = \"{date}\""))).expect("it is ours");
}

#[test]
fn an_expired_certificate_is_named_where_it_is_known() {
    let _one = some_at_a_time();
    let folder = empty_folder("expired");
    let path = addressed_cell(&folder);
    let keys = folder.join("keys");
    let file = fs::read_to_string(&path).expect("written");
    let mut open =
        |name: &str| fs::read_to_string(folder.join(name)).map_err(|error| error.to_string());
    let loaded = understudy_cluster::read("cluster.toml", &file, &mut open);
    let cluster = loaded.cluster.expect("no errors");
    // All certificates have expired, and then the remote I/O gets a new one.
    let past = Date::of(SystemTime::now() - 400 * DAY);
    let mut authority = Authority::init(&keys, &cluster, past).expect("a new folder");
    let names: Vec<String> = cluster
        .members()
        .filter_map(|member| cluster.member_name(member).map(str::to_owned))
        .collect();
    let people = [("engineer".to_owned(), Role::Engineer)];
    authority.issue(&cluster, &names, people[..].into(), 90, past).expect("names of the cluster");
    drop(authority);
    let cluster = text(&path);
    let issue = ["keys", "issue", cluster, "robot-io", "--folder", text(&keys)];
    assert_eq!(answer(&issue).0, 0);
    let of = |name: &str| keys.join("members").join(name);
    let (robot_io, engineer) = (of("robot-io"), of("engineer"));
    let journal = folder.join("robot-io.jsonl");
    let start = ["remote-io", cluster, "--name", "robot-io", "--keys", text(&robot_io)];
    let common = ["--link", "udp", "--no-real-time", "--journal", text(&journal)];
    let _running = Running::start(&[&start[..], &common].concat());

    let status = || {
        let call = ["operate", cluster, "--name", "robot-io", "--keys", text(&engineer), "status"];
        answer(&call)
    };
    let (code, document, _) = status();
    assert_eq!((code, codes(&document)), (2, vec!["U0908"]));
    let message = document["failures"][0]["message"].as_str().expect("text");
    let now = Date::of(SystemTime::now()).to_string();
    assert!(message.contains("expired on ") && message.contains(&now[..10]), "{message}");

    // A caller whose clock is slow does not know it; the member does.
    wait_for_channel(&journal);
    expires(&engineer, Date::of(SystemTime::now() + 400 * DAY));
    let (code, document, _) = status();
    assert_eq!((code, codes(&document)), (1, vec!["U0509"]));
    let parts = ["certificate expired", "verification time 20", "not valid after 20"];
    wait_for(&journal, "refused-certificates", &parts);
}

fn wait_for_channel(journal: &Path) {
    let started = Instant::now();
    while !fs::read_to_string(journal).unwrap_or_default().contains("channel-opened") {
        assert!(started.elapsed() < DEADLINE, "it does not listen");
        std::thread::yield_now();
    }
}

#[test]
fn a_member_whose_certificate_expires_while_it_runs_records_it() {
    let _one = some_at_a_time();
    let folder = empty_folder("expires");
    let path = addressed_cell(&folder);
    let (cluster, keys) = (text(&path), folder.join("keys"));
    assert_eq!(answer(&["keys", "init", cluster, "--folder", text(&keys)]).0, 0);
    let robot_io = keys.join("members/robot-io");
    let journal = folder.join("robot-io.jsonl");
    let start = ["remote-io", cluster, "--name", "robot-io", "--keys", text(&robot_io)];
    let common = ["--link", "udp", "--no-real-time", "--journal", text(&journal)];
    // On a busy machine it may start too late.
    for seconds in [5, 10, 20, 40] {
        expires(&robot_io, Date::of(SystemTime::now() + Duration::from_secs(seconds)));
        let mut running = Running::start(&[&start[..], &common].concat());
        let started = Instant::now();
        while !fs::read_to_string(&journal).unwrap_or_default().contains("channel-opened")
            && running.0.try_wait().expect("it is ours").is_none()
        {
            assert!(started.elapsed() < DEADLINE, "it neither listens nor ends");
            std::thread::yield_now();
        }
        if running.0.try_wait().expect("it is ours").is_none() {
            let parts = ["the certificate of robot-io expired on ", "clock of this machine is at "];
            return wait_for(&journal, "channel-failed", &parts);
        }
    }
    panic!("it never started in time");
}
