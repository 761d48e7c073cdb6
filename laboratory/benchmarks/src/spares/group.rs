//! A group as processes of this machine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use understudy::{Answer, Status};
use understudy_bus::free_addresses;
use understudy_cluster::{Cluster, read};
use understudy_simulator::Referee;
use understudy_wire::{Member, ProgramId, StationId};

use super::witness::{self, Counts};
use crate::children::understudy_command;

const CLUSTER: &str = include_str!("../../../../examples/shared-spare/line-1/cluster.toml");
const ROBOT: &str = include_str!("../../../../examples/shared-spare/line-1/robot.ladder");
const PRESS: &str = include_str!("../../../../examples/shared-spare/line-1/press.ladder");

/// A group whose first program has a wide state: a ring of numbers.
const WIDE: &str = r#"
[cluster]
name = "line-1"
period = "10ms"

[[controller]]
name = "recorder"
ladder = "recorder.st"
address = "127.0.0.1:1"

[[controller]]
name = "counter"
ladder = "counter.st"
address = "127.0.0.1:1"

[[understudy]]
name = "understudy"
address = "127.0.0.1:1"

[[understudy]]
name = "spare"
spare = true
address = "127.0.0.1:1"

[[remote_io]]
name = "recorder-io"
controller = "recorder"
address = "127.0.0.1:1"

[[remote_io]]
name = "counter-io"
controller = "counter"
address = "127.0.0.1:1"

[[plant]]
name = "recorder-plant"
controller = "recorder"
ladder = "plant.st"
address = "127.0.0.1:1"

[[plant]]
name = "counter-plant"
controller = "counter"
ladder = "plant.st"
address = "127.0.0.1:1"
"#;

const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT hold : BOOL; END_VAR
  VAR_OUTPUT count : DINT; END_VAR
  IF NOT hold THEN count := count + 1; END_IF;
END_PROGRAM";

const PLANT: &str = "
PROGRAM plant
  VAR_INPUT count : DINT; END_VAR
  VAR_OUTPUT hold : BOOL; END_VAR
  hold := FALSE;
END_PROGRAM";

/// Writes each value of a counter to a ring, and reads what it wrote a turn of the ring before.
fn recorder(kibibytes: usize) -> String {
    let last = (kibibytes * 1024 / 8).max(16) - 8;
    format!(
        "
PROGRAM recorder
  VAR_INPUT hold : BOOL; END_VAR
  VAR_OUTPUT count : DINT; END_VAR
  VAR ring : ARRAY [0..{last}] OF LINT; place : DINT; sum : LINT; END_VAR
  IF NOT hold THEN
    sum := sum + ring[(place * 7919) MOD {last}];
    ring[place] := sum + 1;
    place := (place + 1) MOD {last};
    count := place;
  END_IF;
END_PROGRAM"
    )
}

/// The answer for something that the system refuses.
pub(crate) fn failed(what: &str, error: &dyn std::fmt::Display) -> Answer {
    Answer::failed(Status::Failed, "U0530", format!("{what}: {error}"))
}

/// The members of a group but its spare.
pub(super) struct Group {
    pub(super) name: String,
    pub(super) folder: PathBuf,
    real_time: bool,
    cluster: Cluster,
    processes: BTreeMap<String, Child>,
    /// By program: what its remote I/O has reported.
    counts: Vec<Arc<Mutex<Counts>>>,
    /// Stalls that its stations have reported.
    stalls: Arc<AtomicU64>,
}

impl Group {
    /// Writes the files of a group, issues its keys, and starts its members.
    pub(super) fn start(
        folder: &Path,
        name: &str,
        state: Option<usize>,
        real_time: bool,
    ) -> Result<Self, Answer> {
        let files: Vec<(&str, String)> = match state {
            Some(kibibytes) => vec![
                ("recorder.st", recorder(kibibytes)),
                ("counter.st", COUNTER.to_owned()),
                ("plant.st", PLANT.to_owned()),
            ],
            None => vec![("robot.ladder", ROBOT.to_owned()), ("press.ladder", PRESS.to_owned())],
        };
        let text = if state.is_some() { WIDE } else { CLUSTER };
        let count = text.lines().filter(|line| line.starts_with("address")).count();
        let addresses = free_addresses(count).map_err(|error| failed("free ports", &error))?;
        let mut next = addresses.iter();
        let lines = text.lines().map(|line| match next.as_slice().first() {
            Some(address) if line.starts_with("address") => {
                next.next();
                format!("address = \"{address}\"\n")
            }
            _ => format!("{line}\n"),
        });
        let text = lines.collect::<String>().replace("\"line-1\"", &format!("\"{name}\""));
        std::fs::create_dir_all(folder).map_err(|error| failed("a folder", &error))?;
        let all = files.iter().map(|(name, text)| (*name, text)).chain([("cluster.toml", &text)]);
        for (file, text) in all {
            std::fs::write(folder.join(file), text).map_err(|error| failed(file, &error))?;
        }
        let loaded = read("cluster.toml", &text, &mut |wanted| {
            let found = files.iter().find(|(name, _)| *name == wanted);
            found.map(|(_, text)| text.clone()).ok_or_else(|| "no such file".to_owned())
        });
        let reports = loaded.reports;
        let cluster =
            loaded.cluster.ok_or_else(|| failed("cluster.toml", &format!("{reports:?}")))?;
        let mut group = Self {
            name: name.to_owned(),
            folder: folder.to_owned(),
            real_time,
            processes: BTreeMap::new(),
            counts: cluster.controllers().iter().map(|_| Arc::default()).collect(),
            stalls: Arc::default(),
            cluster,
        };
        group.issue_keys()?;
        let members = group.cluster.members();
        let members: Vec<Member> = members.filter(|it| !group.cluster.is_spare_slot(*it)).collect();
        for member in members {
            group.start_member(member)?;
        }
        Ok(group)
    }

    fn issue_keys(&self) -> Result<(), Answer> {
        let (file, keys) = (self.folder.join("cluster.toml"), self.folder.join("keys"));
        for arguments in [&["init"][..], &["issue", "--viewer", "spare-1"]] {
            let mut command = understudy_command()?;
            command.arg("keys").args(arguments).arg(&file).arg("--folder").arg(&keys);
            let done = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
            let done = done.map_err(|error| failed("keys", &error))?;
            if !done.success() {
                return Err(failed("keys", &done));
            }
        }
        Ok(())
    }

    fn start_member(&mut self, member: Member) -> Result<(), Answer> {
        let name = self.cluster.member_name(member).unwrap_or_default().to_owned();
        let kind = match member {
            Member::Station(_) => "node",
            Member::RemoteIo(_) | Member::Twin(_) => "remote-io",
            Member::Plant(_) => "plant",
        };
        let mut command = understudy_command()?;
        command.arg(kind).arg(self.folder.join("cluster.toml")).args(["--name", &name]);
        command.arg("--keys").arg(self.folder.join("keys/members").join(&name));
        command.arg("--ends-with-parent");
        if !self.real_time {
            command.arg("--no-real-time");
        }
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        if !matches!(member, Member::Plant(_)) {
            command.stdout(Stdio::piped());
        }
        let mut process = command.spawn().map_err(|error| failed(&name, &error))?;
        match (member, process.stdout.take()) {
            (Member::RemoteIo(program), Some(journal)) => witness::follow(
                journal,
                self.referee(program)?,
                Arc::clone(&self.counts[program.index()]),
            ),
            (_, Some(journal)) => witness::follow_stalls(journal, Arc::clone(&self.stalls)),
            (_, None) => {}
        }
        self.processes.insert(name, process);
        Ok(())
    }

    fn referee(&self, program: ProgramId) -> Result<Referee, Answer> {
        let settings = self.cluster.remote_io_settings(program);
        let settings = settings.ok_or_else(|| failed("a remote I/O", &"it has no settings"))?;
        let scan = self.cluster.programs()[program.index()].executable.clone();
        Ok(Referee::new(&settings, scan))
    }

    /// Names of the controllers and the understudy, by rank.
    pub(super) fn stations(&self) -> Vec<String> {
        let expected = self.cluster.agreement().schedule.expected();
        let names = expected.iter().map(|id| self.cluster.member_name(Member::Station(id)));
        names.map(|name| name.unwrap_or_default().to_owned()).collect()
    }

    /// kill -9.
    pub(super) fn kill(&mut self, name: &str) -> Result<(), Answer> {
        let process = self.processes.get_mut(name);
        let process = process.ok_or_else(|| failed(name, &"it does not run"))?;
        process.kill().map_err(|error| failed(name, &error))
    }

    /// Starts a station that was killed.
    pub(super) fn start_station(&mut self, name: &str) -> Result<(), Answer> {
        if let Some(mut before) = self.processes.remove(name) {
            before.wait().map_err(|error| failed(name, &error))?;
        }
        let ranks = 0..self.cluster.agreement().schedule.stations() as u8;
        let stations = ranks.map(|rank| Member::Station(StationId(rank)));
        let found = stations.into_iter().find(|it| self.cluster.member_name(*it) == Some(name));
        self.start_member(found.ok_or_else(|| failed(name, &"unknown station"))?)
    }

    /// By program: what its remote I/O has reported so far.
    pub(super) fn counts(&self) -> Vec<Counts> {
        self.counts.iter().map(witness::now).collect()
    }

    /// Stalls that its members have reported so far.
    pub(super) fn stalls(&self) -> u64 {
        let stations = self.stalls.load(Ordering::Relaxed);
        self.counts().iter().fold(stations, |all, of| all + of.stalls)
    }

    /// Waits until all remote I/Os have reported something.
    pub(super) fn until(
        &self,
        patience: Duration,
        reached: impl Fn(&Counts) -> bool,
    ) -> Result<(), Answer> {
        let begun = Instant::now();
        while !self.counts().iter().all(&reached) {
            if begun.elapsed() > patience {
                return Err(failed(&self.name, &format!("not reached: {:?}", self.counts())));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        for process in self.processes.values_mut() {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}
