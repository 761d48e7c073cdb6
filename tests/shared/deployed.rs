//! A cluster as it is deployed: every member at an address of its own, as a process of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use understudy_bus::free_addresses;

use super::understudy;

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
