//! A cluster as it is deployed: every member at an address of its own, as a process of its own.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use understudy_bus::free_addresses;

use super::{answer, understudy};

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// The press cell in a folder of its own, every member on a port of its own.
pub(crate) fn addressed_cell(folder: &Path) -> PathBuf {
    let mut addresses = free_addresses(7).expect("seven free ports").into_iter();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/press-cell");
    for name in ["robot.ladder", "press.ladder"] {
        fs::copy(source.join(name), folder.join(name)).expect("the example is whole");
    }
    let cluster = fs::read_to_string(source.join("cluster.toml")).expect("the example is whole");
    let mut addressed = String::new();
    for line in cluster.lines() {
        addressed.push_str(line);
        addressed.push('\n');
        if line.starts_with("[[") {
            let address = addresses.next().expect("seven members");
            addressed.push_str(&format!("address = \"{address}\"\n"));
        }
    }
    let path = folder.join("cluster.toml");
    fs::write(&path, addressed).expect("it is ours");
    path
}

/// A process that does not outlive its test.
pub(crate) struct Running(pub(crate) Child);

impl Running {
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let child = understudy(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        Self(child.expect("the binary is built"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It can only fail where the process has ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The members of the press cell, with the command that runs each.
pub(crate) const MEMBERS: [(&str, &str); 7] = [
    ("robot", "node"),
    ("press", "node"),
    ("understudy", "node"),
    ("robot-io", "remote-io"),
    ("press-io", "remote-io"),
    ("arm", "plant"),
    ("ram", "plant"),
];

/// Every member of the press cell as a process with an address and keys of its own, at a period of 50 ms.
pub(crate) struct Deployed {
    folder: PathBuf,
    pub(crate) cluster: PathBuf,
    pub(crate) keys: PathBuf,
    members: BTreeMap<&'static str, Running>,
}

impl Deployed {
    pub(crate) fn start(folder: &Path) -> Self {
        let cluster = addressed_cell(folder);
        let file = fs::read_to_string(&cluster).expect("it is ours");
        let times = "period = \"50ms\"\nlink = \"udp\"";
        assert!(file.contains("period = \"10ms\"") && !file.contains("\nlink"));
        fs::write(&cluster, file.replace("period = \"10ms\"", times)).expect("it is ours");
        Self::of(folder, cluster, &[])
    }

    /// A cluster whose members have the names of those of the press cell and addresses of their own, each as a process. These
    /// viewers have keys too.
    pub(crate) fn of(folder: &Path, cluster: PathBuf, viewers: &[&str]) -> Self {
        let keys = folder.join("keys");
        let (status, made, _) = answer(&["keys", "init", text(&cluster), "--folder", text(&keys)]);
        assert_eq!(status, 0, "{made:#}");
        for viewer in viewers {
            let issue = ["keys", "issue", text(&cluster), "--viewer", viewer];
            let (status, issued, _) = answer(&[&issue[..], &["--folder", text(&keys)]].concat());
            assert_eq!(status, 0, "{issued:#}");
        }
        let folder = folder.to_owned();
        let mut deployed = Self { folder, cluster, keys, members: BTreeMap::new() };
        MEMBERS.iter().for_each(|(name, _)| deployed.start_with(name, &deployed.cluster.clone()));
        deployed
    }

    /// Starts a member with a cluster file, in place of the process that ran as it. Its journal and its errors are files of their own.
    pub(crate) fn start_with(&mut self, name: &str, cluster: &Path) {
        let found = MEMBERS.iter().find(|(member, _)| *member == name);
        let (name, command) = found.expect("a member");
        self.members.remove(name);
        let own = self.keys.join("members").join(name);
        let journal = self.journal(name);
        for before in [&journal, &self.errors(name)] {
            // What the previous process wrote.
            let _ = fs::remove_file(before);
        }
        let member = [command, text(cluster), "--name", name, "--keys", text(&own)];
        let child = understudy(&[&member[..], &["--no-real-time"]].concat())
            .args(["--journal", text(&journal)])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(self.errors(name)).expect("a file"))
            .spawn();
        self.members.insert(name, Running(child.expect("the binary is built")));
    }

    /// The file of a member's own journal.
    pub(crate) fn journal(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.jsonl"))
    }

    /// The file of what a member says on standard error.
    pub(crate) fn errors(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.errors"))
    }

    pub(crate) fn process(&mut self, name: &str) -> &mut Child {
        &mut self.members.get_mut(name).expect("it was started").0
    }

    pub(crate) fn signal(&mut self, name: &str, signal: Signal) {
        let id = i32::try_from(self.process(name).id()).expect("a process id");
        kill(Pid::from_raw(id), signal).expect("it runs");
    }
}
