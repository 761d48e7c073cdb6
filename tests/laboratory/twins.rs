//! Two remote I/Os of a program as processes: either fails, with both wirings, and modules of their own that disagree.

use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::Value;
use understudy_testing::skip;

use super::deaths::{Records, is, operate};
use super::hosts::permitted;
use super::shared::deployed::Running;
use super::shared::{DEADLINE, empty_folder, modbus, some_at_a_time};
use super::{assert_met, check_of, no_orphan, running_cluster, signal};

/// The author ends, the first one is back, and the other one is suspended and ends.
const FAILURES: &str = "title = \"Either remote I/O of the robot fails\"\ncycles = 220\n\
    [[step]]\nat = 40\naction = \"crash\"\nstation = \"robot-io\"\n\
    [[step]]\nat = 80\naction = \"restart\"\nstation = \"robot-io\"\n\
    [[step]]\nat = 120\naction = \"stop\"\nstation = \"robot-io-2\"\n\
    [[step]]\nat = 140\naction = \"continue\"\nstation = \"robot-io-2\"\n\
    [[step]]\nat = 170\naction = \"crash\"\nstation = \"robot-io\"\n\
    [expect]\nwrong = 0\nplant_faults = 0\n";

/// The members that have become the author of the robot, in their order.
fn authors(run: &Path) -> Vec<String> {
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let records = journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let authors = records.filter(|record| {
        record["event"]["event"] == "part-changed" && record["event"]["part"] == "author"
    });
    let names = authors.filter_map(|record| Some(record["name"].as_str()?.to_owned()));
    names.filter(|name| name.starts_with("robot")).collect()
}

fn either_fails(name: &str, cluster: &str) {
    let scenario = empty_folder(&format!("{name}_scenario")).join("failures.toml");
    fs::write(&scenario, FAILURES).expect("written");
    let scenario = scenario.to_str().expect("text");
    assert_met(&check_of(name, (cluster, "udp"), scenario, &[]));
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(name);
    let authors = authors(&out.join("latest"));
    // Either may be the first one; on a machine that stops a process for long, the other one drives in between.
    let expected = ["robot-io-2", "robot-io", "robot-io-2"];
    let mut found = authors.iter();
    let is_switched = expected.iter().all(|name| found.any(|author| author == name));
    assert!(is_switched, "{authors:?}");
}

#[test]
fn either_of_two_remote_ios_at_one_device_fails() {
    either_fails("twins_exclusive", "examples/twin-remote-io/cluster.toml");
}

#[test]
fn either_of_two_remote_ios_with_modules_of_their_own_fails() {
    either_fails("twins_parallel", "examples/twin-remote-io/parallel.toml");
}

/// Both networks are cut between the two remote I/Os of the robot, the direct link of the press is pulled, and the author of the robot ends.
const SEPARATED: &str = "title = \"The networks fail between the remote I/Os of the robot\"\ncycles = 500\n\
    [[step]]\nat = 40\naction = \"cut\"\nstation = \"robot-io\"\nto = \"robot-io-2\"\nboth_ways = true\n\
    [[step]]\nat = 40\naction = \"unplug\"\nstation = \"press-io\"\ndirect_link = true\n\
    [[step]]\nat = 240\naction = \"plug\"\nstation = \"press-io\"\ndirect_link = true\n\
    [[step]]\nat = 250\naction = \"crash\"\nstation = \"robot-io\"\n\
    [expect]\nwrong = 0\n";

/// Over the direct link the two receive each other meanwhile, each path that fails is told of, and the follower takes over.
fn separated_by_networks(name: &str, link: &str, more: &[&str]) {
    let scenario = empty_folder(&format!("{name}_scenario")).join("separated.toml");
    // Between hosts the plant stands beside the first remote I/O, and the other one does not reach it either.
    let reached = if more.is_empty() { "plant_faults = 0\n" } else { "" };
    fs::write(&scenario, format!("{SEPARATED}{reached}")).expect("written");
    let scenario = scenario.to_str().expect("text");
    let cluster = ("examples/twin-remote-io/direct-link.toml", link);
    let summary = check_of(name, cluster, scenario, more);
    assert_met(&summary);
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(name);
    assert_eq!(authors(&out.join("latest")).last().map(String::as_str), Some("robot-io-2"));
    let faults = summary["network_faults"].as_array().expect("a list");
    let names: Vec<&str> = faults.iter().filter_map(|fault| fault["name"].as_str()).collect();
    for path in ["network 1", "network 2", "direct link"] {
        assert!(names.contains(&path), "{path}: {summary:#}");
    }
    let journal = fs::read_to_string(out.join("latest/journal.jsonl")).expect("a journal");
    let records = journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let mut is_lost = false;
    for record in records {
        let is_of_robot = record["name"].as_str().is_some_and(|name| name.starts_with("robot"));
        match record["event"]["event"].as_str() {
            Some("fault") if record["event"]["action"] == "crash" => break,
            Some("partner-lost") if is_of_robot => is_lost = true,
            Some("partner-received") if is_of_robot => is_lost = false,
            _ => {}
        }
    }
    assert!(!is_lost, "the two remote I/Os of the robot receive each other over the direct link");
}

#[test]
fn a_direct_link_carries_what_networks_do_not_over_udp() {
    separated_by_networks("separated_udp", "udp", &[]);
}

#[test]
fn a_direct_link_carries_what_networks_do_not_over_zenoh() {
    separated_by_networks("separated_zenoh", "zenoh", &[]);
}

#[test]
fn a_direct_link_is_a_cable_of_its_own_between_hosts() {
    if permitted("separated_hosts") {
        separated_by_networks("separated_netns", "udp", &["--hosts", "netns"]);
    }
}

/// A sensor that two modules read, and what is written to the coil of each.
#[derive(Debug, Default)]
struct Modules {
    sensor: bool,
    /// What a module shows whatever the sensor is: the first one, and that of the twin.
    stuck: [Option<bool>; 2],
    coils: [Vec<bool>; 2],
}

impl Modules {
    fn answer(&mut self, module: usize, request: &[u8]) -> Vec<u8> {
        match *request {
            [2, 0, 0, 0, 1] => {
                vec![2, 1, u8::from(self.stuck[module].unwrap_or(self.sensor))]
            }
            [5, 0, 0, value, 0] => {
                self.coils[module].push(value == 0xFF);
                request.to_vec()
            }
            // Its coil cannot be read.
            [function, ..] => vec![function | 0x80, 1],
            [] => Vec::new(),
        }
    }
}

fn lock(modules: &Mutex<Modules>) -> MutexGuard<'_, Modules> {
    modules.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits until these modules, by number, drive a value with their newest write, of those after `from`.
fn wait_driven(modules: &Mutex<Modules>, which: &[usize], value: bool) {
    let from = lock(modules).coils.each_ref().map(Vec::len);
    let deadline = Instant::now() + DEADLINE;
    loop {
        let driven = lock(modules).coils.clone();
        if which.iter().all(|it| driven[*it][from[*it]..].last() == Some(&value)) {
            return;
        }
        assert!(Instant::now() < deadline, "modules {which:?} do not drive {value}");
        std::thread::yield_now();
    }
}

const ECHO: &str = "PROGRAM echo\n  VAR_INPUT seen : BOOL; END_VAR\n  VAR_OUTPUT lamp : BOOL; END_VAR\n  \
    lamp := seen;\nEND_PROGRAM\n";

fn cluster([first, twin]: [u16; 2]) -> String {
    format!(
        "[cluster]\nname = \"echo\"\n\n[[controller]]\nname = \"echo\"\nladder = \"echo.st\"\n\n\
         [[remote_io]]\nname = \"echo-io\"\ncontroller = \"echo\"\n\n\
         [remote_io.twin]\nname = \"echo-io-2\"\nwiring = \"parallel\"\nmodbus = \"127.0.0.1:{twin}\"\n\
         take_over_after = 3\ndiscrepancy_cycles = 10\n\n\
         [remote_io.field]\nmodbus = \"127.0.0.1:{first}\"\n\
         inputs = {{ seen = \"discrete:0\" }}\noutputs = {{ lamp = \"coil:0\" }}\n"
    )
}

/// Whether a remote I/O tells of its input modules.
fn is_of_inputs(record: &Value) -> bool {
    let event = record["event"]["event"].as_str().unwrap_or_default();
    ["inputs-differ", "input-excluded", "inputs-agree"].contains(&event)
}

/// A module is stuck: the alarm comes, and lasts while its remote I/O is down and when it is back, until the sensor moves: then the module is excluded, until
/// an operator releases it. The other remote I/O takes over with modules of its own.
#[test]
fn a_module_that_disagrees_is_told_until_it_is_excluded() {
    let _one = some_at_a_time();
    let out = empty_folder("disagreeing");
    let modules = Arc::new(Mutex::new(Modules::default()));
    let ports = [0, 1].map(|module| {
        let served = Arc::clone(&modules);
        modbus::serve(move |request| lock(&served).answer(module, request))
    });
    fs::write(out.join("echo.st"), ECHO).expect("written");
    fs::write(out.join("cluster.toml"), cluster(ports)).expect("written");
    let runs = out.join("runs");
    let (child, _errors) = running_cluster(&out.join("cluster.toml"), &runs, &[]);
    // It ends with a test that fails, too.
    let mut laboratory = Running(child);
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let mut records = Records::of(&run);
    let ordered = |name: &str, command: &str| {
        let (status, document) = operate(&run, name, command);
        assert_eq!(status, 0, "{document:#}");
    };
    let both = [0, 1];
    lock(&modules).sensor = true;
    wait_driven(&modules, &both, true);

    // The module of the twin is stuck, and the sensor goes off.
    let from = {
        let mut modules = lock(&modules);
        modules.stuck[1] = Some(true);
        modules.sensor = false;
        modules.coils.each_ref().map(Vec::len)
    };
    records.wait_for("the alarm", |record| is(record, "echo-io", "inputs-differ"));
    let coils = lock(&modules).coils.clone();
    let mut written = both.into_iter().flat_map(|it| coils[it][from[it]..].iter());
    let kept = written.all(|on| *on);

    // The other one counts alone, and the alarm lasts.
    signal(Records::of(&run).ready("echo-io-2"), Signal::SIGKILL);
    records.wait_for("its loss", |record| is(record, "echo-io", "partner-lost"));
    wait_driven(&modules, &[0], false);
    ordered("echo-io-2", "restart");
    records.wait_for("its return", |record| is(record, "echo-io", "partner-received"));
    for _ in 0..10 {
        records.wait_for("a sample of both", |record| is(record, "echo-io", "sampled"));
    }
    lock(&modules).sensor = true;
    let excluded = records.wait_for("its exclusion", |record| {
        is(record, "echo-io", "input-excluded") || is(record, "echo-io", "inputs-agree")
    });
    assert_eq!(excluded["event"]["event"], "input-excluded", "{excluded}");
    lock(&modules).sensor = false;
    wait_driven(&modules, &both, false);

    // It is repaired and released.
    lock(&modules).stuck[1] = None;
    ordered("echo-io", "release");
    records.wait_for("the end of the alarm", |record| is(record, "echo-io", "inputs-agree"));
    lock(&modules).sensor = true;
    wait_driven(&modules, &both, true);

    // The author ends: the other one goes on, and the modules of the first one drive the same when it is back.
    signal(Records::of(&run).ready("echo-io"), Signal::SIGKILL);
    records.wait_for("a new author", |record| {
        is(record, "echo-io-2", "part-changed") && record["event"]["part"] == "author"
    });
    lock(&modules).sensor = false;
    wait_driven(&modules, &[1], false);
    ordered("echo-io", "restart");
    lock(&modules).sensor = true;
    wait_driven(&modules, &both, true);

    signal(laboratory.0.id(), Signal::SIGINT);
    laboratory.0.wait().expect("it ends");
    no_orphan(&runs);
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let told: Vec<Value> = journal
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .filter(is_of_inputs)
        .collect();
    let events: Vec<_> = told.iter().map(|it| it["event"]["event"].as_str()).collect();
    let expected = ["inputs-differ", "input-excluded", "inputs-agree"].map(Some);
    assert_eq!(events, expected, "{told:#?}");
    if journal.contains("\"event\":\"stalled\"") {
        return skip(
            "inconclusive: a member was woken late, and one module may have counted alone",
        );
    }
    assert!(kept, "the last value is driven while the modules differ: {coils:?}");
}
