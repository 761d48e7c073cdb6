//! Two processes that run as one member, as an old disk image starts them, and two remote I/Os on one device.

use std::collections::BTreeSet;
use std::fs;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::spawn;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};
use understudy_bus::free_addresses;

use super::crowd::{Device, cluster, count, until};
use super::{Running, answer, empty_folder, some_at_a_time, text};

/// All members of the cluster, as processes, and its device.
struct Plant {
    folder: std::path::PathBuf,
    cluster: String,
    addresses: Vec<SocketAddr>,
    device: Arc<Device>,
    /// The controller, the understudy, and the remote I/O.
    members: [Running; 3],
}

impl Plant {
    fn start(name: &str) -> Self {
        let folder = empty_folder(name);
        let addresses = free_addresses(5).expect("five free ports");
        let cluster = cluster(&folder, &addresses[..4]);
        let keys = folder.join("keys");
        let (status, made, _) = answer(&["keys", "init", &cluster, "--folder", text(&keys)]);
        assert_eq!(status, 0, "{made:#}");
        let device = Arc::new(Device::default());
        device.is_there.store(true, Ordering::Relaxed);
        let (running, address) = (Arc::clone(&device), addresses[3]);
        spawn(move || running.run(address));
        let start = |command: &str, name: &str| {
            let own = format!("{}/members/{name}", text(&keys));
            let journal = folder.join(format!("{name}.jsonl"));
            let common = ["--link", "udp", "--no-real-time", "--journal", text(&journal)];
            let member = [command, &cluster, "--name", name, "--keys", &own];
            Running::start(&[&member[..], &common].concat())
        };
        let members =
            [start("node", "valve"), start("node", "understudy"), start("remote-io", "valve-io")];
        device.wait_for_answers(20);
        Self { folder, cluster, addresses, device, members }
    }

    /// To both stations.
    fn signal_stations(&self, signal: Signal) {
        for station in &self.members[..2] {
            let id = i32::try_from(station.0.id()).expect("a process id");
            kill(Pid::from_raw(id), signal).expect("it lives");
        }
    }

    fn journal(&self, name: &str) -> std::path::PathBuf {
        self.folder.join(format!("{name}.jsonl"))
    }

    /// A copy of the controller, with its keys and with another address, of a cluster file that differs by `change`.
    fn copy_of_the_controller(&self, change: [&str; 2]) -> Running {
        let text_of_cluster = fs::read_to_string(&self.cluster).expect("it is ours");
        let image = self.folder.join("image");
        let keys = self.folder.join("keys/members/valve");
        let copied = Command::new("cp").args(["-a", text(&keys), text(&image)]).status();
        assert!(copied.expect("a cp").success());
        let changed = text_of_cluster.replace(change[0], change[1]);
        let cluster = self.folder.join("image.toml");
        fs::write(&cluster, changed).expect("it is ours");
        let places = [0, 1, 2].map(|place| self.addresses[place]);
        let peers = json!([
            { "member": { "station": 0 }, "name": "valve", "address": self.addresses[4] },
            { "member": { "station": 1 }, "name": "understudy", "address": places[1] },
            { "member": { "remote-io": 0 }, "name": "valve-io", "address": places[2] },
        ]);
        let endpoints = self.folder.join("endpoints.json");
        fs::write(&endpoints, peers.to_string()).expect("it is ours");
        let journal = self.journal("image");
        Running::start(&[
            "node",
            text(&cluster),
            "--name",
            "valve",
            "--keys",
            text(&image),
            "--endpoints",
            text(&endpoints),
            "--link",
            "udp",
            "--no-real-time",
            "--journal",
            text(&journal),
        ])
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        self.device.over.store(true, Ordering::Relaxed);
        self.device.is_there.store(false, Ordering::Relaxed);
    }
}

fn is_said(journal: &Path, what: &str) -> bool {
    let text = fs::read_to_string(journal).unwrap_or_default();
    text.contains(what)
}

#[test]
fn an_old_image_of_another_configuration_shuts_nobody_out() {
    let _one = some_at_a_time();
    let plant = Plant::start("old_image");
    let image = plant.copy_of_the_controller(["period = \"20ms\"", "period = \"30ms\""]);
    let remote_io = plant.journal("valve-io");
    for journal in [&remote_io, &plant.journal("understudy")] {
        until("the refusal of the image", || is_said(journal, "\"event\":\"refused\""));
    }
    plant.device.wait_for_answers(50);
    for refused in ["replayed", "of-another-life"] {
        let refused = format!("\"refused_as\":\"{refused}\"");
        assert!(!is_said(&remote_io, &refused), "the controller is refused");
    }
    let controller = plant.journal("valve");
    assert_eq!(count(&controller, "new-life"), 0, "it is received");
    drop(image);
}

/// The epochs in which a remote I/O has sampled.
fn epochs(journal: &Path) -> BTreeSet<u64> {
    let text = fs::read_to_string(journal).unwrap_or_default();
    let records = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let events = records.map(|mut record| record["event"].take());
    let sampled = events.filter(|event| event["event"] == "sampled");
    sampled.filter_map(|event| event["moment"]["epoch"].as_u64()).collect()
}

/// Two processes have the keys of the controller until the first of them is heard again; `disturb` does something meanwhile.
fn check_duplicate(name: &str, disturb: impl Fn(&Plant, &Path)) {
    let _one = some_at_a_time();
    let plant = Plant::start(name);
    let image = plant.copy_of_the_controller(["", ""]);
    let remote_io = plant.journal("valve-io");
    until("the alarm", || count(&remote_io, "duplicate-found") > 0);
    assert!(is_said(&remote_io, "\"member\":{\"station\":0}"));
    disturb(&plant, &remote_io);
    let controller = plant.journal("valve");
    until("a new life", || count(&controller, "new-life") > 0);
    plant.device.wait_for_answers(20);
    drop(image);
    until("the end of the alarm", || count(&remote_io, "duplicate-gone") > 0);
    plant.device.wait_for_answers(20);
    assert_eq!(count(&remote_io, "state-lost"), 0);
}

#[test]
fn two_processes_of_one_controller_are_named_and_the_controller_is_heard_again() {
    check_duplicate("duplicate", |_, _| {});
}

/// A remote I/O that hears nothing else for some cycles follows the cycles of the second process.
#[test]
fn a_controller_is_heard_again_where_the_cycles_of_the_second_process_count() {
    check_duplicate("followed", |plant, remote_io| {
        plant.signal_stations(Signal::SIGSTOP);
        until("cycles of the second process", || epochs(remote_io).len() > 1);
        plant.signal_stations(Signal::SIGCONT);
    });
}

#[test]
fn a_second_remote_io_on_one_device_is_an_alarm() {
    let _one = some_at_a_time();
    let plant = Plant::start("second_remote_io");
    let remote_io = plant.journal("valve-io");
    assert_eq!(count(&remote_io, "field-contested"), 0);
    // Of another cluster, of which nothing else runs: it drives the fail-safe outputs.
    let folder = plant.folder.join("other");
    fs::create_dir(&folder).expect("it is ours");
    let mut addresses = free_addresses(3).expect("three free ports");
    addresses.push(plant.addresses[3]);
    let other = cluster(&folder, &addresses);
    let second = Running::start(&[
        "remote-io",
        &other,
        "--name",
        "valve-io",
        "--security",
        "off",
        "--link",
        "udp",
        "--no-real-time",
    ]);
    until("the alarm", || count(&remote_io, "field-contested") > 0);
    drop(second);
    until("the end of the alarm", || count(&remote_io, "field-uncontested") > 0);
    plant.device.wait_for_answers(20);
}
