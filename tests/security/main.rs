//! Keys, calls, examinations and strangers, from outside: the binary on real sockets.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod deployment;
mod keys;
mod parties;
mod strangers;
mod systemd;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use serde_json::Value;
use understudy_bus::free_addresses;

/// Two clusters at once on two processors would measure each other, and one could find the ports of the other free.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

const DEADLINE: Duration = Duration::from_secs(90);

fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("security")
        .join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old run's folder goes");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn understudy(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_understudy"));
    command
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Runs to the end: the exit status and the answer.
fn answer(arguments: &[&str]) -> (i32, Value) {
    let output = understudy(arguments)
        .arg("--json")
        .output()
        .expect("the binary is built");
    let document = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| {
        let said = String::from_utf8_lossy(&output.stderr)
            .chars()
            .take(2000)
            .collect::<String>();
        panic!("{error}: {said}")
    });
    (output.status.code().expect("an exit status"), document)
}

fn codes(document: &Value) -> Vec<&str> {
    let failures = document["failures"].as_array().expect("a list");
    failures
        .iter()
        .filter_map(|failure| failure["code"].as_str())
        .collect()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// The press cell in a folder of its own, every party on a port of its own.
fn addressed_cell(folder: &Path) -> PathBuf {
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
            let address = addresses.next().expect("seven parties");
            addressed.push_str(&format!("address = \"{address}\"\n"));
        }
    }
    let path = folder.join("cluster.toml");
    fs::write(&path, addressed).expect("it is ours");
    path
}

/// A process that does not outlive its test.
struct Running(Child);

impl Running {
    fn start(arguments: &[&str]) -> Self {
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
