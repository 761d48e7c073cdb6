//! Hosts of their own and links that misbehave. What a machine's delays may change is not asserted: that nothing is wrong is.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;
use understudy_testing::skip;

use super::shared::DEADLINE;
use super::{
    PERIOD, PRESS_CELL, answer, assert_met, check, check_of, empty_folder, no_orphan, running,
    some_at_a_time,
};

/// Whether this machine lets the tests make namespaces; where not, says why.
pub(crate) fn permitted(name: &str) -> bool {
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

/// A scenario file of this test.
fn scenario_file(name: &str, text: &str) -> String {
    let path = empty_folder(&format!("{name}_scenario")).join("scenario.toml");
    fs::write(&path, text).expect("a file");
    path.to_str().expect("text").to_owned()
}

fn step(at: u64, action: &str, more: &str) -> String {
    format!("[[step]]\nat = {at}\naction = \"{action}\"\n{more}\n")
}

const NOTHING_IS_HELD: &str = "[expect]\nwrong = 0\nheld = 0\nfail_safe = 0\n";

/// A machine that loses its cable says no farewell: its connections end by time-outs, longer than a lease. All others continue meanwhile.
#[test]
fn the_loss_of_a_cable_deafens_nobody_else() {
    if !permitted("cable") {
        return;
    }
    let both_ways = "station = \"understudy\"\nboth_ways = true";
    let text = format!(
        "title = \"The understudy loses its cable\"\ncycles = 200\n{}{}{NOTHING_IS_HELD}",
        step(40, "cut", both_ways),
        step(160, "heal", both_ways),
    );
    let scenario = scenario_file("cable", &text);
    for link in ["udp", "zenoh"] {
        let name = format!("cable_{link}");
        assert_met(&check_of(&name, (PRESS_CELL, link), &scenario, &["--hosts", "netns"]));
    }
}

/// The second network fails, then the cable of a member to the first one: no output is held, and both are reported.
#[test]
fn one_of_two_networks_fails_and_nothing_is_held() {
    if !permitted("networks") {
        return;
    }
    let (all, one) =
        ("network = 2\nstation = \"robot\"\nothers = true", "network = 1\nstation = \"press-io\"");
    let text = format!(
        "title = \"Each of two networks fails\"\ncycles = 160\n{}{}{}{NOTHING_IS_HELD}",
        step(20, "unplug", all),
        step(70, "plug", all),
        step(110, "unplug", one),
    );
    let scenario = scenario_file("networks", &text);
    for link in ["udp", "zenoh"] {
        let name = format!("networks_{link}");
        let cluster = "examples/two-networks/cluster.toml";
        assert_met(&check_of(&name, (cluster, link), &scenario, &["--hosts", "netns"]));
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(&name);
        let journal = out.join("latest/journal.jsonl");
        let journal = fs::read_to_string(journal).expect("a journal");
        for network in [1, 2] {
            let told =
                format!("\"event\":\"network-reception\",\"network\":{network},\"lost\":[{{");
            assert!(journal.contains(&told), "network {network} over {link}");
        }
    }
}
