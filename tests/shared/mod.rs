//! What the tests of real processes have in common: the binary, folders of their own, and one at a time.

pub(crate) mod deployed;
pub(crate) mod modbus;
pub(crate) mod page;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::Duration;

use serde_json::Value;

/// Whatever is waited for comes within this time, on a busy machine too.
pub(crate) const DEADLINE: Duration = Duration::from_secs(90);

/// Clusters of several tests run side by side: their processes wait most of the time, and each laboratory takes ports of its own.
static CLUSTERS: RwLock<()> = RwLock::new(());

/// For a test that measures, or fills the machine: no other cluster runs meanwhile.
pub(crate) fn one_at_a_time() -> RwLockWriteGuard<'static, ()> {
    CLUSTERS.write().unwrap_or_else(PoisonError::into_inner)
}

/// For a test whose cluster keeps its times beside others.
pub(crate) fn some_at_a_time() -> RwLockReadGuard<'static, ()> {
    CLUSTERS.read().unwrap_or_else(PoisonError::into_inner)
}

/// An empty folder of a test's own.
pub(crate) fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old run's folder goes");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// The built binary, in the project's folder.
pub(crate) fn understudy(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_understudy"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Runs to the end: the exit status, the answer, and what was said on standard error.
pub(crate) fn answer(arguments: &[&str]) -> (i32, Value, String) {
    let output = understudy(arguments).arg("--json").output().expect("the binary is built");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {errors:.2000}"));
    (output.status.code().expect("an exit status"), document, errors)
}
