//! Root file systems that a test makes, and commands inside of them.

use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use understudy_testing::skip;

use super::shared::empty_folder;
use super::{SUITE, skipped};

/// The numbers of a user and of its group.
pub(crate) struct User(pub(crate) String, pub(crate) String);

impl User {
    /// One that is not root.
    pub(crate) fn ordinary() -> Self {
        Self("1000".into(), "1000".into())
    }
}

/// A root file system that is removed after the test.
pub(crate) struct Root(PathBuf);

/// Whether a command that a test needs ended well; says that the test skips where not.
fn done(result: io::Result<Output>, otherwise: &str) -> Option<()> {
    match result {
        Ok(output) if output.status.success() => Some(()),
        Ok(output) => {
            let errors = String::from_utf8_lossy(&output.stderr);
            skipped(&format!("{otherwise}: {}", errors.trim()))
        }
        Err(error) => skipped(&format!("{otherwise}: {error}")),
    }
}

impl Root {
    /// An empty one, where this machine lets a test run commands in one.
    pub(crate) fn empty(name: &str) -> Option<Self> {
        let possible = Command::new("unshare")
            .args(["--fork", "--pid", "--mount", "--net", "--ipc", "--uts"])
            .args(["mount", "--make-rprivate", "/"])
            .output();
        done(possible, "namespaces cannot be made; that needs root")?;
        Some(Self(empty_folder(name)))
    }

    /// A bare Debian with these packages besides the required ones.
    pub(crate) fn debian(name: &str, packages: &[&str]) -> Option<Self> {
        let root = Self::empty(name)?;
        let made = Command::new("mmdebstrap")
            .args(["--quiet", "--mode=root", "--variant=minbase"])
            .args(packages.iter().map(|package| format!("--include={package}")))
            .arg(SUITE)
            .arg(&root.0)
            .stdin(Stdio::null())
            .output();
        done(made, "mmdebstrap makes no Debian here")?;
        Some(root)
    }

    pub(crate) fn path(&self, inside: &str) -> PathBuf {
        self.0.join(inside)
    }

    /// Copies a file to a place in it, where everybody may run it.
    pub(crate) fn copy(&self, file: &Path, inside: &str) {
        let to = self.path(inside);
        fs::copy(file, &to).expect("there is room");
        fs::set_permissions(&to, fs::Permissions::from_mode(0o755)).expect("it is ours");
    }

    /// Runs a command of root's to its end, which has to be good; answers with its standard output.
    pub(crate) fn run(&self, command: &[&str]) -> String {
        let root = User("0".into(), "0".into());
        let output = self.inside(&root, "/", command);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}: {text}{errors}");
        text
    }

    fn inside(&self, user: &User, folder: &str, command: &[&str]) -> Output {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/packages/inside.sh");
        Command::new("sh")
            .arg(script)
            .arg(&self.0)
            .args([folder, &user.0, &user.1])
            .args(command)
            .stdin(Stdio::null())
            .output()
            .expect("a shell")
    }

    /// Runs the demo: it passes, or says that this machine was too busy to tell.
    pub(crate) fn demo(&self, user: &User, folder: &str, command: &[&str]) {
        let output = self.inside(user, folder, command);
        let text = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.code() == Some(3) {
            skip("this machine woke the members too late for a verdict");
            return;
        }
        assert!(output.status.success(), "{command:?}: {text}{errors}");
        assert!(text.contains("passed"), "{text}");
    }
}

impl Drop for Root {
    fn drop(&mut self) {
        // What was mounted in it went with the last process inside.
        let _ = fs::remove_dir_all(&self.0);
    }
}
