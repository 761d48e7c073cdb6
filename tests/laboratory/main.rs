//! Real processes: what the laboratory promises of them. Over plain UDP, so that an unoptimised build keeps its times too.

#![allow(clippy::print_stderr, reason = "what was measured is worth a line")]
#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod alarms;
mod boiler;
mod campaigns;
mod changed_points;
mod changes;
mod deaths;
mod drafts;
mod field;
mod gates;
mod handshake;

mod hosts;
mod last_numbers;
mod points;
mod power;
mod program_change;
mod set_inputs;
#[allow(dead_code, reason = "each test uses its part")]
#[path = "../shared/mod.rs"]
mod shared;
mod standing_still;
mod suspended;
mod tennessee_eastman;
mod twins;
mod writes;

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Instant;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use understudy_testing::skip;

use shared::{DEADLINE, answer, empty_folder, one_at_a_time, some_at_a_time, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";
/// Its deadline is long beside the delays of a busy machine.
const PERIOD: &str = "50ms";

/// No process of a run is left: each of them has the run's list of addresses among its arguments.
fn no_orphan(out: &Path) {
    let deadline = Instant::now() + DEADLINE;
    let out = out.to_str().expect("text");
    loop {
        let left: Vec<String> = processes().into_iter().filter(|line| line.contains(out)).collect();
        if left.is_empty() {
            return;
        }
        assert!(Instant::now() < deadline, "left behind: {left:#?}");
        std::thread::yield_now();
    }
}

/// The command lines of this machine's living processes.
fn processes() -> BTreeSet<String> {
    let folders = fs::read_dir("/proc").expect("a Linux").filter_map(Result::ok);
    folders
        .filter_map(|folder| fs::read(folder.path().join("cmdline")).ok())
        .map(|line| String::from_utf8_lossy(&line).replace('\0', " "))
        .filter(|line| line.contains("--in-laboratory"))
        .collect()
}

/// What a run over plain UDP came to. Cycles in which a machine that other programs share stood still are counted apart.
fn check(name: &str, scenario: &str, more: &[&str]) -> Value {
    check_of(name, (PRESS_CELL, "udp"), scenario, more)
}

/// The same of a cluster over a link.
fn check_of(name: &str, (cluster, link): (&str, &str), scenario: &str, more: &[&str]) -> Value {
    let _one = some_at_a_time();
    let out = empty_folder(name);
    let arguments = ["lab", cluster, "--scenario", scenario, "--link", link, "--period", PERIOD];
    let out_argument = ["--out", out.to_str().expect("text")];
    let (_, document, errors) = answer(&[&arguments[..], &out_argument, more].concat());
    no_orphan(&out);
    let summary = document["result"]["summary"].clone();
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{document:#}\n{errors}");
    summary
}

/// Cycles that a busy machine may cost a run without a late wake-up to show for it; a failure that is not masked costs thirty and more.
const TOLERATED_CYCLES: u64 = 5;

/// Whether a run shows what it expects: not on a machine that other programs stopped for longer than a cycle may take.
fn is_conclusive(summary: &Value) -> bool {
    let late = summary["inconclusive"].as_str();
    if let Some(late) = late {
        skip(format_args!("inconclusive: {late}"));
    }
    late.is_none()
}

/// Every expectation of the scenario is met; those that count cycles may miss a few, because how punctual a machine is belongs into
/// benchmarks. Of an inconclusive run nothing but its outputs is certain.
fn assert_met(summary: &Value) {
    let is_conclusive = is_conclusive(summary);
    let expectations = summary["expectations"].as_array().expect("expectations");
    for expectation in expectations {
        let expected = expectation["expected"].as_str().expect("text");
        let found = expectation["found"].as_str().expect("text");
        let counts_cycles = expected.starts_with("no cycles ") || expected.contains(" in cycles ");
        let mut numbers = found.split(|character: char| !character.is_ascii_digit());
        let cycles = numbers.find_map(|number| number.parse::<u64>().ok());
        let few = counts_cycles && cycles.is_some_and(|cycles| cycles <= TOLERATED_CYCLES);
        let is_certain = is_conclusive || expected.contains("wrong");
        assert!(expectation["met"] == true || few || !is_certain, "{summary:#}");
    }
}

fn count(summary: &Value, remote_io: usize, source: &str) -> u64 {
    summary["remote_ios"][remote_io]["counts"][source].as_u64().expect("a count")
}

/// A remote I/O had outputs of a source in so many cycles or more, but for those in which the host stood still.
fn assert_count(summary: &Value, remote_io: usize, source: &str, least: u64) {
    let found = count(summary, remote_io, source);
    let period = summary["circumstances"]["period_us"].as_u64().expect("a period");
    let stalls = summary["stalls"].as_array().expect("a list").iter();
    let late: u64 = stalls.filter_map(|stall| stall["late_us"].as_u64()).sum();
    assert!(found + late.div_ceil(period) >= least, "{source}: {found}, {summary:#}");
}

#[test]
fn each_station_is_killed_and_nothing_is_seen_of_it() {
    let summary = check("kill_each", "scenarios/kill-each.toml", &[]);
    assert_met(&summary);
    assert_eq!(summary["steps"].as_array().map(Vec::len), Some(6));
    assert_count(&summary, 0, "reconstructed", 30);
}

#[test]
fn both_controllers_are_killed_and_the_understudy_carries_both() {
    let summary = check("double_kill", "scenarios/double-kill.toml", &[]);
    assert_met(&summary);
}

#[test]
fn the_second_failure_in_the_papers_mode_is_fail_safe() {
    let scenario = "scenarios/paper-double-kill.toml";
    let summary = check("paper_double_kill", scenario, &["--mode", "paper"]);
    assert_met(&summary);
    assert_count(&summary, 0, "fail_safe", 41);
    assert_count(&summary, 1, "fail_safe", 41);
}

#[test]
fn stations_that_stand_still_do_not_speak_from_a_stale_state() {
    let summary = check("stop_and_continue", "scenarios/stop-and-continue.toml", &[]);
    assert_met(&summary);
}

#[test]
fn stations_that_are_cut_off_are_masked_and_come_back() {
    let scenario = "examples/press-cell/cut-off-and-healed.toml";
    let summary = check("cut_off", scenario, &[]);
    assert_met(&summary);
    assert_count(&summary, 0, "reconstructed", 150);
    // No proxy lies between the members for it.
    let circumstances = summary["circumstances"]["machine"].to_string();
    assert!(!circumstances.contains("proxy"), "{circumstances}");
}

#[test]
fn a_broken_link_costs_no_protection() {
    let scenario = "examples/press-cell/broken-link.toml";
    let summary = check("broken_link", scenario, &[]);
    assert_met(&summary);
    assert_count(&summary, 0, "reconstructed", 290);
}

#[test]
fn a_lost_state_is_not_replaced_by_an_older_one_until_the_operator_says_so() {
    let scenario = "examples/press-cell/lost-state.toml";
    let summary = check("lost_state", scenario, &[]);
    assert_met(&summary);
    assert_count(&summary, 0, "fail_safe", 90);
    assert_count(&summary, 0, "reconstructed", 190);
}

#[test]
fn a_remote_io_that_is_started_again_adopts_its_history() {
    let summary = check("remote_io_restart", "scenarios/remote-io-restart.toml", &[]);
    assert_met(&summary);
}

#[test]
fn the_demo_at_a_shorter_length() {
    let _one = some_at_a_time();
    let out = empty_folder("demo");
    let arguments = ["demo", "--cycles", "250", "--period", PERIOD, "--out"];
    let (status, document, errors) =
        answer(&[&arguments[..], &[out.to_str().expect("text")]].concat());
    no_orphan(&out);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["circumstances"]["link"], "udp", "{document:#}");
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    assert_met(summary);
    assert_eq!(summary["passed"], status == 0, "{document:#}\n{errors}");
    for name in ["journal.jsonl", "summary.json", "figure10.svg", "report.html", "endpoints.json"] {
        assert!(out.join("latest").join(name).exists(), "{name}");
    }
}

/// Starts a laboratory and waits until its cycles run.
fn running(out: &Path, more: &[&str]) -> (Child, BufReader<std::process::ChildStderr>) {
    running_cluster(Path::new(PRESS_CELL), out, more)
}

fn running_cluster(
    cluster: &Path,
    out: &Path,
    more: &[&str],
) -> (Child, BufReader<std::process::ChildStderr>) {
    let cluster = cluster.to_str().expect("text");
    let arguments =
        ["lab", cluster, "--link", "udp", "--period", PERIOD, "--cycles", "100000", "--out"];
    running_with(&arguments, out, more, "synchronised: ")
}

/// Starts a command and waits until it says `words`.
fn running_with(
    arguments: &[&str],
    out: &Path,
    more: &[&str],
    words: &str,
) -> (Child, BufReader<std::process::ChildStderr>) {
    let mut child = understudy(arguments)
        .arg(out)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary is built");
    let mut errors = BufReader::new(child.stderr.take().expect("piped"));
    let mut line = String::new();
    while !line.contains(words) {
        line.clear();
        let length = errors.read_line(&mut line).expect("text");
        assert_ne!(length, 0, "it ended before it was synchronised");
    }
    (child, errors)
}

fn signal(process: u32, signal: Signal) {
    let id = i32::try_from(process).expect("a process id");
    kill(Pid::from_raw(id), signal).expect("it lives");
}

#[test]
fn an_interrupted_run_leaves_its_results_and_no_orphan() {
    let _one = some_at_a_time();
    let out = empty_folder("interrupted");
    let (mut child, _errors) = running(&out, &[]);
    signal(child.id(), Signal::SIGINT);
    let mut text = String::new();
    child.stdout.take().expect("piped").read_to_string(&mut text).expect("text");
    assert_eq!(child.wait().expect("it ends").code(), Some(1));
    assert!(text.contains("interrupted after"), "{text}");
    no_orphan(&out);
    assert!(out.join("latest/report.html").exists());
}

#[test]
fn a_killed_laboratory_leaves_no_orphan_and_the_next_run_cleans_up() {
    let _one = some_at_a_time();
    let out = empty_folder("killed");
    let (mut child, _errors) = running(&out, &[]);
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    // A suspended member ends as well.
    signal(process_of(&out, "robot"), Signal::SIGSTOP);
    child.kill().expect("it lives");
    child.wait().expect("it ends");
    no_orphan(&out);
    assert!(run.join("keys").exists() && run.join("operator.sock").exists());
    let (mut child, _errors) = running(&out, &[]);
    for left in ["keys", "operator.sock"] {
        assert!(!run.join(left).exists(), "{left} of the killed run");
        assert!(out.join("latest").join(left).exists(), "{left} of this run");
    }
    assert!(run.join("journal.jsonl").exists());
    signal(child.id(), Signal::SIGINT);
    child.wait().expect("it ends");
    no_orphan(&out);
    assert!(!out.join("latest").join("keys").exists());
}

/// The process id that a member of a running laboratory has told in its journal's first record.
fn process_of(out: &Path, name: &str) -> u32 {
    let out = out.to_str().expect("text");
    let folders = fs::read_dir("/proc").expect("a Linux").filter_map(Result::ok);
    let mut found = folders.filter(|folder| {
        let line = fs::read(folder.path().join("cmdline")).unwrap_or_default();
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        line.contains(out) && line.contains(&format!("--name {name} "))
    });
    let folder = found.next().expect("it runs");
    folder.file_name().to_string_lossy().parse().expect("a number")
}

#[test]
fn a_port_in_use_is_said_plainly_and_everything_is_stopped() {
    let _one = some_at_a_time();
    let out = empty_folder("port");
    let taken = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let port = taken.local_addr().expect("an address").port();
    for name in ["robot.ladder", "press.ladder"] {
        fs::copy(
            format!("{}/examples/press-cell/{name}", env!("CARGO_MANIFEST_DIR")),
            out.join(name),
        )
        .expect("copied");
    }
    let cluster =
        fs::read_to_string(format!("{}/{PRESS_CELL}", env!("CARGO_MANIFEST_DIR"))).expect("text");
    let line = "name = \"robot\"\nladder";
    let addressed = format!("name = \"robot\"\naddress = \"127.0.0.1:{port}\"\nladder");
    assert!(cluster.contains(line));
    fs::write(out.join("cluster.toml"), cluster.replace(line, &addressed)).expect("written");
    let (file, runs) = (out.join("cluster.toml"), out.join("runs"));
    let arguments = [
        "lab",
        file.to_str().expect("text"),
        "--link",
        "udp",
        "--out",
        runs.to_str().expect("text"),
    ];
    let (status, document, _) = answer(&arguments);
    assert_eq!(status, 1, "{document:#}");
    let failure = &document["failures"][0];
    assert_eq!(failure["code"], "U0501", "{document:#}");
    assert!(failure["message"].as_str().is_some_and(|text| text.contains(&format!("port {port}"))));
    no_orphan(&out);
}
