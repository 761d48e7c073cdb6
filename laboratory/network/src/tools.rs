//! The programs that set up networks: `ip` and `nft`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::error::NetworkError;

/// One program and the Debian package that has it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tool {
    pub(crate) program: &'static str,
    pub(crate) package: &'static str,
}

pub(crate) const IP: Tool = Tool { program: "ip", package: "iproute2" };

pub(crate) const NFT: Tool = Tool { program: "nft", package: "nftables" };

/// Where programs of the system lie that are not on everybody's path.
const SYSTEM_FOLDERS: [&str; 3] = ["/usr/sbin", "/sbin", "/usr/bin"];

impl Tool {
    pub(crate) fn find(self) -> Result<PathBuf, NetworkError> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let folders = std::env::split_paths(&path).chain(SYSTEM_FOLDERS.iter().map(PathBuf::from));
        folders
            .map(|folder| folder.join(self.program))
            .find(|program| program.is_file())
            .ok_or(NetworkError::NoTool { program: self.program, package: self.package })
    }
}

/// Runs `program` with `input` on its standard input.
pub(crate) fn run(program: &Path, arguments: &[&str], input: &str) -> Result<(), NetworkError> {
    let command = || format!("{} {}", program.display(), arguments.join(" "));
    let failed = |said: String| NetworkError::Tool { command: command(), said };
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| failed(error.to_string()))?;
    if let Some(mut standard_input) = child.stdin.take() {
        // One that ends early says why on its standard error.
        let _ = standard_input.write_all(input.as_bytes());
    }
    let output = child.wait_with_output().map_err(|error| failed(error.to_string()))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let said: Vec<&str> = said.lines().take(5).map(str::trim).collect();
    Err(failed(format!("{}: {}", output.status, said.join("; "))))
}
