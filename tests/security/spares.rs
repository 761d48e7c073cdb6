//! A spare beside two groups on loopback: it wakes where a station has failed, and retires when that is back.

use std::collections::BTreeMap;
use std::fs;
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use understudy_bus::free_addresses;

use super::shared::deployed::Deployed;
use super::{DEADLINE, Running, codes, empty_folder, one_at_a_time, text, understudy};

const GROUPS: [&str; 2] = ["line-1", "line-2"];

/// Flagged for so long, a station wakes the spare; at 50 ms this is half a second.
const SPARE_AFTER: u64 = 10;

/// The groups of the example, with free addresses and keys, as files.
struct Plant {
    folder: PathBuf,
    /// By group: the address of the slot.
    slots: BTreeMap<&'static str, SocketAddr>,
}

impl Plant {
    fn new(name: &str) -> Self {
        let folder = empty_folder(name);
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/shared-spare");
        let plant = fs::read_to_string(source.join("plant.toml")).expect("the example is whole");
        let times = format!("spare_after = {SPARE_AFTER}\nretire_after = \"2s\"");
        fs::write(folder.join("plant.toml"), plant.replace("retire_after = \"5s\"", &times))
            .expect("it is ours");
        let slots = GROUPS.map(|group| {
            let own = folder.join(group);
            fs::create_dir_all(&own).expect("a folder");
            for ladder in ["robot.ladder", "press.ladder"] {
                fs::copy(source.join(group).join(ladder), own.join(ladder)).expect("it is whole");
            }
            let cluster = source.join(group).join("cluster.toml");
            let cluster = fs::read_to_string(cluster).expect("the example is whole");
            let addresses = free_addresses(8).expect("eight free ports");
            let mut next = addresses.iter();
            let lines = cluster.replace("\"10ms\"", "\"50ms\"");
            let lines = lines.lines().map(|line| match line.starts_with("address") {
                true => format!("address = \"{}\"\n", next.next().expect("eight members")),
                false => format!("{line}\n"),
            });
            fs::write(own.join("cluster.toml"), lines.collect::<String>()).expect("it is ours");
            (group, addresses[3])
        });
        Self { folder, slots: slots.into() }
    }

    /// All members of a group but its spare, with keys for the spare.
    fn start(&self, group: &str) -> Deployed {
        let own = self.folder.join(group);
        let deployed = Deployed::of(&own, own.join("cluster.toml"), &["spare-1", "desk"]);
        self.link_keys(group);
        let desk = self.folder.join("desk");
        fs::create_dir_all(&desk).expect("a folder");
        symlink(own.join("keys/members/desk"), desk.join(group)).expect("a link");
        deployed
    }

    fn link_keys(&self, group: &str) {
        fs::create_dir_all(self.folder.join("keys")).expect("a folder");
        let members = self.folder.join(group).join("keys/members");
        symlink(members, self.folder.join("keys").join(group)).expect("a link");
    }

    fn spare(&self) -> Running {
        self.spare_of("plant.toml")
    }

    fn spare_of(&self, plant: &str) -> Running {
        let (plant, keys) = (self.folder.join(plant), self.folder.join("keys"));
        let journals = self.folder.join("journals");
        let spare = ["spare", text(&plant), "--name", "spare-1", "--keys", text(&keys)];
        let child = understudy(&[&spare[..], &["--no-real-time", "--journals"]].concat())
            .arg(text(&journals))
            .arg("--retain")
            .arg(self.folder.join("kept"))
            .stdin(Stdio::null())
            .stdout(fs::File::create(self.folder.join("spare.out")).expect("a file"))
            .stderr(fs::File::create(self.folder.join("spare.errors")).expect("a file"))
            .spawn();
        Running(child.expect("the binary is built"))
    }

    /// Attaches to all groups for the overview of the plant, and records below `runs`.
    fn desk(&self) -> Running {
        let (plant, keys) = (self.folder.join("plant.toml"), self.folder.join("desk"));
        let watch = ["watch", text(&plant), "--address", "127.0.0.1:0", "--keys", text(&keys)];
        let child = understudy(&[&watch[..], &["--out"]].concat())
            .arg(self.folder.join("runs"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(self.folder.join("desk.errors")).expect("a file"))
            .spawn();
        Running(child.expect("the binary is built"))
    }

    /// Until the overview of the plant contains each of these texts.
    fn overview_has(&self, wanted: &[&str]) {
        let (plant, runs) = (self.folder.join("plant.toml"), self.folder.join("runs"));
        let top = ["top", text(&plant), "--once", "--json", "--out", text(&runs)];
        let look = || {
            let answer = understudy(&top).output().expect("it runs");
            String::from_utf8_lossy(&answer.stdout).into_owned()
        };
        until(&look, &|found| wanted.iter().all(|text| found.contains(text)));
    }

    /// Until the spare has reported this.
    fn reported(&self, wanted: &str) {
        let log = self.folder.join("spare.errors");
        until(&|| fs::read_to_string(&log).unwrap_or_default(), &|said| said.contains(wanted));
    }

    /// Until a process listens at the slot of a group, or none does.
    fn slot_is_taken(&self, group: &str, taken: bool) {
        let address = self.slots[group];
        until(&|| TcpStream::connect(address).is_ok(), &|open| *open == taken);
    }
}

fn until<T: std::fmt::Debug>(look: &dyn Fn() -> T, reached: &dyn Fn(&T) -> bool) {
    let begun = Instant::now();
    loop {
        let found = look();
        if reached(&found) {
            return;
        }
        assert!(begun.elapsed() < DEADLINE, "{found:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The events of a remote I/O whose kind is `applied`, `protected` or `unprotected`, in their order.
fn events(deployed: &Deployed, name: &str) -> Vec<Value> {
    let journal = fs::read_to_string(deployed.journal(name)).unwrap_or_default();
    let records = journal.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let kinds = ["applied", "protected", "unprotected"];
    let events = records.map(|record| record["event"].clone());
    events.filter(|event| kinds.contains(&event["event"].as_str().unwrap_or_default())).collect()
}

fn kinds(events: &[Value]) -> Vec<&str> {
    let kinds = events.iter().filter_map(|event| event["event"].as_str());
    kinds.filter(|kind| *kind != "applied").collect()
}

/// Until a remote I/O has reported this many changes of protection, the last one of which is `wanted`.
fn protection_is(deployed: &Deployed, name: &str, changes: usize, wanted: &str) {
    until(&|| events(deployed, name), &|found| {
        let kinds = kinds(found);
        kinds.len() == changes && kinds.last() == Some(&wanted)
    });
}

/// Sources of the applied outputs since the first direct one.
fn sources(deployed: &Deployed, name: &str) -> Vec<String> {
    let events = events(deployed, name);
    let sources = events.iter().filter_map(|event| event["source"].as_str());
    sources.skip_while(|source| *source != "direct").map(str::to_owned).collect()
}

/// Until a remote I/O has passed some more deadlines.
fn passes(deployed: &Deployed, name: &str, deadlines: usize) {
    let before = sources(deployed, name).len();
    until(&|| sources(deployed, name).len(), &|now| *now >= before + deadlines);
}

#[test]
fn a_spare_masks_the_second_failure_and_retires_when_the_station_is_back() {
    let _alone = one_at_a_time();
    let plant = Plant::new("spare");
    let mut groups = GROUPS.map(|group| plant.start(group));
    let mut spare = plant.spare();
    for (group, deployed) in GROUPS.iter().zip(&groups) {
        plant.reported(&format!("{group}: watches it"));
        for name in ["robot-io", "press-io"] {
            protection_is(deployed, name, 1, "protected");
        }
    }
    let mut desk = plant.desk();
    plant.overview_has(&[r#""alarms":[]"#, r#""state":"asleep""#]);
    groups[0].signal("robot", Signal::SIGKILL);
    // After `spare_after` cycles, and one more where a report is late.
    plant.reported("line-1: wakes as spare; failed: robot (flagged for 1");
    plant.reported("line-1: publishes");
    protection_is(&groups[0], "robot-io", 3, "protected");
    // The second failure: only the spare executes the program of the robot now.
    groups[0].signal("understudy", Signal::SIGKILL);
    passes(&groups[0], "robot-io", 60);
    // A busy host suspends a process for a deadline or two; without the spare, none of these would be proved.
    for name in ["robot-io", "press-io"] {
        let applied = sources(&groups[0], name);
        let newest = &applied[applied.len() - 50..];
        let unproved = newest.iter().filter(|it| ["held", "fail-safe"].contains(&it.as_str()));
        let unproved = unproved.count();
        assert!(unproved <= 2, "{name}: {unproved} of {newest:?}");
    }
    assert_eq!(kinds(&events(&groups[1], "robot-io")), ["protected"], "the other group");
    let cluster = groups[0].cluster.clone();
    for name in ["robot", "understudy"] {
        groups[0].start_with(name, &cluster);
    }
    plant.reported("line-1: retires");
    plant.slot_is_taken("line-1", false);
    until(&|| plant.folder.join("kept/line-1.spare.awake").exists(), &|awake| !awake);
    passes(&groups[0], "robot-io", 20);
    // Its slot has been flagged since, which is no fault.
    let journal = || fs::read_to_string(groups[0].journal("robot-io")).unwrap_or_default();
    let is_slot =
        |line: &str| line.contains(r#""event":"flagged""#) && line.contains(r#""station":3"#);
    until(&|| journal().lines().any(is_slot), &|flagged| *flagged);
    let desk_of_it = plant.folder.join("desk/line-1");
    let of_it = ["--name", "robot-io", "--keys", text(&desk_of_it), "status"];
    let status = understudy(&["operate", text(&groups[0].cluster)]).args(of_it).output();
    let status = String::from_utf8(status.expect("it runs").stdout).expect("a text");
    assert!(status.contains("protected:") && !status.contains("flagged"), "{status}");
    // It is free for the other group. Its station ends with it, whether it is ended in order or killed.
    groups[1].signal("understudy", Signal::SIGKILL);
    plant.reported("line-2: publishes");
    plant.slot_is_taken("line-2", true);
    // A failure in each group, and capacity for one: the overview names the other.
    groups[0].signal("robot", Signal::SIGKILL);
    plant.overview_has(&["line-1 is UNPROTECTED (failed: robot): spare-1 serves line-2"]);
    assert!(terminate(&mut desk).success());
    plant.overview_has(&["line-1 is not observed: no process records its run"]);
    assert!(terminate(&mut spare).success());
    plant.slot_is_taken("line-2", false);
    // What its station has kept may be the newest state: it wakes where it was, before anything is flagged.
    let mut spare = plant.spare();
    plant.reported("line-2: wakes as spare, as it was when it ended");
    plant.reported("line-2: publishes");
    plant.slot_is_taken("line-2", true);
    spare.0.kill().expect("it runs");
    plant.slot_is_taken("line-2", false);
}

/// Ends a process in order.
fn terminate(process: &mut Running) -> ExitStatus {
    let id = i32::try_from(process.0.id()).expect("a process id");
    kill(Pid::from_raw(id), Signal::SIGTERM).expect("it runs");
    process.0.wait().expect("it ends")
}

/// No group runs: the spare reports that, and ends in order.
#[test]
fn a_spare_reports_groups_that_it_cannot_watch_and_ends_with_sigterm() {
    let _alone = one_at_a_time();
    let plant = Plant::new("unseen");
    GROUPS.iter().for_each(|group| drop(plant.start(group)));
    let mut spare = plant.spare();
    plant.reported("line-1: cannot watch it, retrying: ");
    let status = terminate(&mut spare);
    let said = fs::read_to_string(plant.folder.join("spare.out")).expect("its output");
    assert!(status.success() && said.contains("spare-1: woke 0 times"), "{status}: {said}");
}

/// Two plant files claim one machine: the second process ends with the reason, the first one goes on, and the second one may start when that has ended.
#[test]
fn a_spare_that_two_plant_files_claim_runs_once() {
    let _alone = one_at_a_time();
    let plant = Plant::new("claimed");
    GROUPS.iter().for_each(|group| drop(plant.start(group)));
    let other = "[[group]]\nname = \"line-2\"\ncluster = \"line-2/cluster.toml\"\n\n[[spare]]\nname = \"spare-1\"\ngroups = { line-2 = \"spare\" }\n";
    fs::write(plant.folder.join("other.toml"), other).expect("it is ours");
    let mut first = plant.spare();
    plant.reported("line-1: cannot watch it, retrying: ");
    let (file, keys) = (plant.folder.join("other.toml"), plant.folder.join("keys"));
    let second = ["spare", text(&file), "--name", "spare-1", "--keys", text(&keys), "--json"];
    let refused = understudy(&second).output().expect("it runs");
    let said: Value = serde_json::from_slice(&refused.stdout).expect("one document");
    assert_eq!(codes(&said), ["U0627"], "{said}");
    assert_eq!(refused.status.code(), Some(2), "{said}");
    let status = terminate(&mut first);
    assert!(status.success(), "the first one has run until it was told to end: {status}");
    let mut third = plant.spare_of("other.toml");
    plant.reported("line-2: cannot watch it, retrying: ");
    let status = terminate(&mut third);
    assert!(status.success(), "{status}");
}
