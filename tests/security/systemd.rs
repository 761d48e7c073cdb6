//! The units of `deployment/`, started by a systemd of their own in namespaces, over a copy of this machine that is thrown away.

#![allow(clippy::print_stderr, reason = "what is left behind is named")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use understudy_testing::skip;

use super::{DEADLINE, addressed_cell, answer, empty_folder, one_at_a_time, text};

/// A machine with systemd, whose processes end with it.
struct Machine {
    outer: Child,
    /// The process that is number 1 in there, as it is numbered here.
    first: u32,
    groups: PathBuf,
}

/// Where the processes of the machine are grouped; systemd makes its own groups below.
fn groups() -> Option<PathBuf> {
    let mounts = fs::read_to_string("/proc/self/mounts").ok()?;
    let mount = mounts.lines().find(|line| line.contains(" cgroup2 "))?;
    let root = PathBuf::from(mount.split(' ').nth(1)?);
    Some(root.join(format!("understudy-test-{}", std::process::id())))
}

impl Machine {
    /// Nothing, with the reason on standard error, where this machine does not let a test do that.
    fn boot(folder: &Path) -> Option<Self> {
        let skipped = |reason: &str| {
            skip(reason);
            None
        };
        if !Path::new("/lib/systemd/systemd").exists() {
            return skipped("this machine has no systemd");
        }
        let Some(groups) = groups().filter(|groups| fs::create_dir(groups).is_ok()) else {
            return skipped("groups of processes (cgroup2) cannot be made; that needs root");
        };
        fs::create_dir(folder.join("machine")).expect("it is ours");
        let script = "echo $$ > \"$1/cgroup.procs\" && shift && exec unshare --fork --kill-child --pid --mount --uts --ipc --net --cgroup \"$@\"";
        let outer = Command::new("sh")
            .args(["-c", script, "sh", text(&groups), "sh"])
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/security/systemd.sh"))
            .args([env!("CARGO_BIN_EXE_understudy-runtime"), text(folder)])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(folder.join("boot.log")).expect("it is ours"))
            .spawn()
            .expect("there is a shell");
        let mut machine = Self { outer, first: 0, groups };
        let started = Instant::now();
        while started.elapsed() < DEADLINE {
            if machine.outer.try_wait().expect("it is ours").is_some() {
                let log = fs::read_to_string(folder.join("boot.log")).unwrap_or_default();
                return skipped(&format!("no machine can be made here: {}", log.trim()));
            }
            let number = machine.outer.id();
            let children = fs::read_to_string(format!("/proc/{number}/task/{number}/children"));
            let first = children.unwrap_or_default().trim().parse();
            machine.first = first.unwrap_or(0);
            if machine.first != 0 && machine.says(&["is-active", "multi-user.target"]) == "active" {
                return Some(machine);
            }
            sleep(Duration::from_millis(100));
        }
        skipped("systemd does not come up here in time")
    }

    fn run(&self, command: &[&str]) -> Output {
        Command::new("nsenter")
            .args(["-t", &self.first.to_string(), "-a", "-r", "-w"])
            .args(command)
            .output()
            .expect("nsenter comes with unshare")
    }

    fn says(&self, arguments: &[&str]) -> String {
        let output = self.run(&[&["systemctl"], arguments].concat());
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    fn properties(&self, unit: &str) -> BTreeMap<String, String> {
        let asked = "-pMainPID,ActiveState,SubState,Result,ExecMainStatus,NRestarts";
        let said = self.says(&["show", asked, unit]);
        let pairs = said.lines().filter_map(|line| line.split_once('='));
        pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect()
    }

    /// Waits until the properties of a unit are such.
    fn wait(
        &self,
        unit: &str,
        what: &str,
        such: impl Fn(&BTreeMap<String, String>) -> bool,
    ) -> BTreeMap<String, String> {
        let started = Instant::now();
        loop {
            let found = self.properties(unit);
            if such(&found) {
                return found;
            }
            assert!(started.elapsed() < DEADLINE, "{unit}: {what}: {found:?}");
            sleep(Duration::from_millis(50));
        }
    }

    /// Waits until a new process of the unit runs in the place of `process`.
    fn wait_for_another(&self, unit: &str, process: &str) {
        self.wait(unit, "is not started again", |found| {
            found["ActiveState"] == "active" && found["MainPID"] != process
        });
    }

    /// Waits until a line of a member's journal that came after `from` bytes has this in it.
    fn wait_for_line(&self, member: &str, from: usize, part: &str) {
        let path = format!("/proc/{}/root/var/log/understudy/{member}.jsonl", self.first);
        let started = Instant::now();
        while !fs::read(&path).is_ok_and(|journal| {
            String::from_utf8_lossy(journal.get(from..).unwrap_or_default()).contains(part)
        }) {
            assert!(started.elapsed() < DEADLINE, "{member} never says {part}");
            sleep(Duration::from_millis(50));
        }
    }

    fn journal_bytes(&self, member: &str) -> usize {
        let path = format!("/proc/{}/root/var/log/understudy/{member}.jsonl", self.first);
        fs::read(path).map_or(0, |journal| journal.len())
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // Number 1 of a namespace takes all others with it, and the mounts go with the last process.
        let _ = self.outer.kill();
        let _ = self.outer.wait();
        remove_groups(&self.groups);
    }
}

/// A group can be removed when its last process is gone.
fn remove_groups(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            remove_groups(&entry.path());
        }
    }
    let started = Instant::now();
    while fs::remove_dir(folder).is_err() && folder.exists() {
        if started.elapsed() > DEADLINE {
            eprintln!("{} is left", folder.display());
            return;
        }
        sleep(Duration::from_millis(20));
    }
}

const UNITS: [&str; 7] = [
    "understudy-node@robot",
    "understudy-node@press",
    "understudy-node@understudy",
    "understudy-remote-io@robot-io",
    "understudy-remote-io@press-io",
    "understudy-plant@arm",
    "understudy-plant@ram",
];

#[test]
fn systemd_starts_watches_and_restarts_the_members() {
    let _one = one_at_a_time();
    let folder = empty_folder("systemd");
    for part in ["cell", "units"] {
        fs::create_dir(folder.join(part)).expect("it is ours");
    }
    let cluster = addressed_cell(&folder.join("cell"));
    let keys = folder.join("keys");
    let made = answer(&["keys", "init", text(&cluster), "--folder", text(&keys)]);
    assert_eq!(made.0, 0, "{:#}", made.1);
    for kind in ["node", "remote-io", "plant"] {
        let name = format!("understudy-{kind}@.service");
        let unit = Path::new(env!("CARGO_MANIFEST_DIR")).join("deployment");
        fs::copy(unit.join(&name), folder.join("units").join(&name)).expect("it is there");
    }
    let Some(machine) = Machine::boot(&folder) else {
        return;
    };

    let started = machine.run(&[&["systemctl", "start"], &UNITS[..]].concat());
    assert!(started.status.success(), "{started:?}");
    machine.wait_for_line("robot-io", 0, r#""source":"direct""#);
    machine.wait_for_line("press-io", 0, r#""source":"direct""#);

    // No root, one capability (CAP_SYS_NICE), no way to more.
    let robot = machine.properties(UNITS[0])["MainPID"].clone();
    let status = machine.run(&["cat", &format!("/proc/{robot}/status")]);
    let status = String::from_utf8_lossy(&status.stdout).into_owned();
    let value = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        line.unwrap_or_default().trim().to_owned()
    };
    assert_ne!(value("Uid:").split('\t').next(), Some("0"), "{status}");
    for name in ["CapPrm:", "CapEff:", "CapBnd:"] {
        assert_eq!(value(name), "0000000000800000", "{name}");
    }
    assert_eq!((value("NoNewPrivs:"), value("Seccomp:")), ("1".into(), "2".into()));

    // One that stands still is found by the watchdog; until it is back, its outputs are restored.
    let before = machine.journal_bytes("robot-io");
    machine.run(&["kill", "-STOP", &robot]);
    machine.wait(UNITS[0], "is not missed", |found| found["NRestarts"] != "0");
    machine.wait_for_line("robot-io", before, r#""source":"reconstructed""#);
    machine.wait_for_another(UNITS[0], &robot);

    // One that crashes is started again.
    let press = machine.properties(UNITS[1])["MainPID"].clone();
    machine.run(&["kill", "-KILL", &press]);
    machine.wait_for_another(UNITS[1], &press);

    // A plant that is driven in every cycle is not taken for one that stands still.
    let mut process = String::new();
    let mut since = Instant::now();
    let started = Instant::now();
    while since.elapsed() < Duration::from_secs(4) {
        let now = machine.properties(UNITS[5])["MainPID"].clone();
        if now != process {
            (process, since) = (now, Instant::now());
        }
        assert!(started.elapsed() < DEADLINE, "the plant starts again and again");
        sleep(Duration::from_millis(50));
    }

    // A wrong input is not tried again, and is said.
    let ladder = "/etc/understudy/robot.ladder";
    machine.run(&["mv", ladder, "/etc/understudy/away"]);
    let restarted = machine.run(&["systemctl", "restart", UNITS[0]]);
    assert!(!restarted.status.success());
    machine.wait(UNITS[0], "is tried again", |found| {
        found["SubState"] == "failed" && found["ExecMainStatus"] == "2"
    });
    machine.run(&["mv", "/etc/understudy/away", ladder]);
    assert!(machine.run(&["systemctl", "start", UNITS[0]]).status.success());

    let stopped = machine.run(&[&["systemctl", "stop"], &UNITS[..]].concat());
    assert!(stopped.status.success(), "{stopped:?}");
    assert_eq!(machine.properties(UNITS[4])["Result"], "success");
}
