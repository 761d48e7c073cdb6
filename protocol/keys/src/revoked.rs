//! Whose keys no longer count, and how a running member learns of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};
use understudy_seal::Revocations;
use understudy_wire::Member;

use crate::date::Date;
use crate::error::KeysError;
use crate::files;
use crate::register::Register;

/// How often a running member looks whether its list has changed.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// `revoked.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RevokedFile {
    #[serde(default)]
    pub(crate) revoked: Vec<Entry>,
}

/// Of one holder: this generation and all before it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) generation: u32,
    pub(crate) since: Date,
}

impl RevokedFile {
    pub(crate) fn of(register: &Register) -> Self {
        let holders = register.holders.iter();
        let revoked = holders.filter_map(|holder| {
            let revoked = holder.revoked_through?;
            Some(Entry {
                name: holder.name.clone(),
                generation: revoked.generation,
                since: revoked.since,
            })
        });
        Self { revoked: revoked.collect() }
    }

    pub(crate) fn read(path: &Path) -> Result<Self, KeysError> {
        files::read_toml(path)
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), KeysError> {
        let title = "Whose keys no longer count. Made by `understudy keys revoke`; read again while a member runs.";
        files::write_toml(path, title, self)
    }

    /// Those of some common names that are not revoked.
    pub(crate) fn without(&self, names: &[String]) -> Vec<String> {
        let gone = |common_name: &String| {
            let parts = common_name.rsplit_once('.');
            let parts = parts.and_then(|(name, number)| Some((name, number.parse().ok()?)));
            parts.is_some_and(|(name, generation)| self.holds(name, generation))
        };
        names.iter().filter(|name| !gone(name)).cloned().collect()
    }

    pub(crate) fn holds(&self, name: &str, generation: u32) -> bool {
        let revoked = |entry: &Entry| entry.name == name && generation <= entry.generation;
        self.revoked.iter().any(revoked)
    }
}

/// Follows `revoked.toml` of a running member. A list that is away or damaged changes nothing: what was revoked stays so.
#[derive(Debug)]
pub struct RevocationWatch {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// A sender, by the name and the generation of its key.
pub(crate) type HeardSender = (Member, String, u32);

impl RevocationWatch {
    pub(crate) fn start(
        path: PathBuf,
        heard: Vec<HeardSender>,
        revoked: Arc<Revocations>,
    ) -> Result<Self, KeysError> {
        let (stop, stopped) = channel();
        let failed = path.clone();
        let thread = std::thread::Builder::new()
            .name("revocations".into())
            .spawn(move || {
                // The file may have changed since the keys were loaded: the first look always reads it.
                let mut seen = None;
                while matches!(stopped.recv_timeout(LOOK_EVERY), Err(RecvTimeoutError::Timeout)) {
                    let now = changed(&path);
                    if now == seen {
                        continue;
                    }
                    if let Ok(file) = RevokedFile::read(&path) {
                        revoked.set(senders(&file, &heard));
                        seen = now;
                    }
                }
            })
            .map_err(|source| KeysError::Read { path: failed, source })?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for RevocationWatch {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // It can only have panicked, and nothing hangs on it any more.
            let _ = thread.join();
        }
    }
}

/// Those of `heard` whose key is revoked.
pub(crate) fn senders(file: &RevokedFile, heard: &[HeardSender]) -> impl Iterator<Item = Member> {
    heard
        .iter()
        .filter(|(_, name, generation)| file.holds(name, *generation))
        .map(|(member, _, _)| *member)
}

/// Tells one state of a file from the next.
fn changed(path: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}
