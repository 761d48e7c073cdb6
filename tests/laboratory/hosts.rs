//! Hosts of their own and links that misbehave. What a machine's delays may change is not asserted: that nothing is wrong is.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;
use understudy_testing::skip;

use super::shared::DEADLINE;
use super::{PERIOD, PRESS_CELL, answer, check, empty_folder, no_orphan, running, some_at_a_time};

/// Whether this machine lets the tests make namespaces; where not, says why.
fn permitted(name: &str) -> bool {
    let out = empty_folder(&format!("{name}_permitted"));
    let arguments = [
        "lab", PRESS_CELL, "--link", "udp", "--period", PERIOD, "--cycles", "1", "--hosts",
        "netns", "--out",
    ];
    let (_, document, _) = answer(&[&arguments[..], &[out.to_str().expect("text")]].concat());
    let code = document["failures"][0]["code"].as_str().unwrap_or_default();
    let lacking = ["U0543", "U0544"].contains(&code);
    if lacking {
        skip(&document["failures"][0]["message"]);
    }
    !lacking
}

fn notes(summary: &Value) -> String {
    summary["circumstances"]["machine"].to_string()
}

#[test]
fn a_scenario_runs_unchanged_on_hosts_of_their_own() {
    if !permitted("hosts") {
        return;
    }
    let summary = check("hosts", "scenarios/kill-each.toml", &["--hosts", "netns"]);
    assert!(notes(&summary).contains("5 hosts"), "{}", notes(&summary));
}

#[test]
fn nothing_is_wrong_where_nft_loses_frames() {
    if !permitted("nft") {
        return;
    }
    let more = ["--hosts", "netns", "--loss", "5%"];
    let summary = check("nft", "scenarios/kill-each.toml", &more);
    assert!(notes(&summary).contains("nft loses 5 %"), "{}", notes(&summary));
}

#[test]
fn nothing_is_wrong_on_links_that_lose_delay_double_reorder_and_change() {
    let more = [
        "--loss",
        "2%",
        "--delay",
        "200us",
        "--jitter",
        "100us",
        "--duplicate",
        "2%",
        "--reorder",
        "1%",
        "--corrupt",
        "1%",
    ];
    let summary = check("impaired", "scenarios/kill-each.toml", &more);
    assert!(notes(&summary).contains("through the proxy"), "{}", notes(&summary));
}

/// The network namespaces of a run's processes.
fn namespaces(out: &Path) -> BTreeSet<PathBuf> {
    let out = out.to_str().expect("text");
    let folders = fs::read_dir("/proc").expect("a Linux");
    folders
        .filter_map(Result::ok)
        .filter(|folder| {
            let line = fs::read(folder.path().join("cmdline")).unwrap_or_default();
            String::from_utf8_lossy(&line).contains(out)
        })
        .filter_map(|folder| fs::read_link(folder.path().join("ns/net")).ok())
        .collect()
}

/// Those of `namespaces` in which a process still runs.
fn inhabited(namespaces: &BTreeSet<PathBuf>) -> BTreeSet<PathBuf> {
    let folders = fs::read_dir("/proc").expect("a Linux");
    let found = folders
        .filter_map(Result::ok)
        .filter_map(|folder| fs::read_link(folder.path().join("ns/net")).ok());
    found.filter(|one| namespaces.contains(one)).collect()
}

#[test]
fn a_killed_laboratory_leaves_no_host() {
    if !permitted("killed_hosts") {
        return;
    }
    let _one = some_at_a_time();
    let out = empty_folder("killed_hosts");
    let (mut child, _errors) = running(&out, &["--hosts", "netns"]);
    let own = fs::read_link("/proc/self/ns/net").expect("a Linux");
    let mut made = namespaces(&out);
    assert!(made.remove(&own), "the laboratory itself stays where it is");
    assert_eq!(made.len(), 5, "one for each station and each remote I/O");
    child.kill().expect("it lives");
    child.wait().expect("it ends");
    no_orphan(&out);
    // A namespace without a name goes with its last process; one that is ending loses its command line before its namespace.
    let deadline = Instant::now() + DEADLINE;
    while !inhabited(&made).is_empty() {
        assert!(Instant::now() < deadline, "left: {:?}", inhabited(&made));
        std::thread::yield_now();
    }
    let named = fs::read_dir("/run/netns").into_iter().flatten();
    let named: Vec<_> = named.filter_map(Result::ok).collect();
    assert!(
        !named.iter().any(|entry| entry.file_name().to_string_lossy().contains("understudy")),
        "{named:?}"
    );
}
