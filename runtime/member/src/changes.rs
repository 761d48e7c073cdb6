//! The online change that a member has loaded, and the file that keeps it: `CLUSTER.MEMBER.change` in the folder of what it keeps.
//!
//! A member that starts again has the configurations that it had, so that its place in a change is not lost with its process.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_bus::{ChangeKeeper, Changes, FoundFile};
use understudy_cluster::{ChangeTexts, Cluster};
use understudy_cycle::OnlineChange;
use understudy_wire::{ConfigurationHash, Configurations, ProgramHash, ProgramId};

use crate::run::MemberOptions;

/// The longest text of a change that is read from a file.
const MOST_BYTES: u64 = 32 << 20;

/// What is kept of a change.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct KeptChange {
    configurations: Configurations,
    texts: ChangeTexts,
}

/// A change with the texts that it was loaded from.
#[derive(Debug, Clone)]
struct LoadedChange {
    texts: ChangeTexts,
    change: Arc<OnlineChange>,
}

/// What a member starts with.
pub(crate) struct StartedChange {
    /// The change, and the configurations that the member had.
    pub(crate) restored: Option<(Arc<OnlineChange>, Configurations)>,
    pub(crate) changes: Changes,
    /// The file, where it says nothing that can be used.
    pub(crate) found: Option<FoundFile>,
}

impl StartedChange {
    /// Whether a program is one of those of the change.
    pub(crate) fn has_loaded(&self, program: ProgramId, hash: ProgramHash) -> bool {
        let change = self.restored.as_ref().and_then(|(change, _)| change.of(program));
        change.is_some_and(|change| [change.before.hash, change.after.hash].contains(&hash))
    }
}

struct Keeper {
    cluster: Cluster,
    /// Nothing where the member keeps nothing.
    file: Option<PathBuf>,
    loaded: Option<LoadedChange>,
}

/// What a member has kept of an online change, and what takes the next one.
pub(crate) fn started_change(cluster: &Cluster, options: &MemberOptions) -> StartedChange {
    let file = options
        .retain
        .as_ref()
        .map(|folder| folder.join(format!("{}.{}.change", cluster.name(), options.name)));
    let own = cluster.agreement().configuration;
    let mut keeper = Keeper { cluster: cluster.clone(), file: file.clone(), loaded: None };
    let kept = file.as_ref().map_or(Ok(None), |file| keeper.kept(file));
    let (kept, problem) = match kept {
        Ok(kept) => (kept, None),
        Err(problem) => (None, Some(problem)),
    };
    let found = file.zip(problem).map(|(path, problem)| FoundFile { path, problem: Some(problem) });
    let first = Configurations { own, prepared: None };
    let configurations = kept.as_ref().map_or(first, |(_, configurations)| *configurations);
    keeper.loaded = kept.as_ref().map(|(loaded, _)| loaded.clone());
    let restored = kept.map(|(loaded, configurations)| (loaded.change, configurations));
    let text = keeper.text(configurations.own);
    let change = restored.as_ref().map(|(change, _)| Arc::clone(change));
    let changes = Changes::new(configurations, change, text, Some(Box::new(keeper)));
    StartedChange { restored, changes, found }
}

impl Keeper {
    /// What the file has; nothing where there is none, or where it is of a change that is over for this cluster file.
    fn kept(&self, file: &Path) -> Result<Option<(LoadedChange, Configurations)>, String> {
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.to_string()),
        };
        let kept: KeptChange = serde_json::from_str(&text).map_err(|error| error.to_string())?;
        let own = self.cluster.agreement().configuration;
        if own != kept.texts.before && own != kept.texts.after {
            return Err(format!(
                "it is of a change from {} to {}, and the cluster file is configuration {own}",
                kept.texts.before, kept.texts.after
            ));
        }
        let change = kept.texts.load(&self.cluster).map_err(|error| error.to_string())?;
        let mut configurations = kept.configurations;
        if configurations.prepared.is_none() && configurations.own != own {
            // Its cluster file is still that of before: it goes on with what was accepted.
            tracing::info!(%own, accepted = %configurations.own, "an online change was accepted");
        } else if configurations.prepared.is_none() {
            return Ok(None);
        } else if own == kept.texts.after {
            // The engineer has put the new cluster file there.
            configurations = Configurations { own, prepared: Some(kept.texts.before) };
        }
        Ok(Some((LoadedChange { texts: kept.texts, change: Arc::new(change) }, configurations)))
    }

    /// The canonical text of a configuration that is loaded.
    fn text(&self, own: ConfigurationHash) -> String {
        let changed = self.loaded.as_ref();
        let changed = changed.and_then(|loaded| loaded.texts.canonical_text(&self.cluster, own));
        changed.unwrap_or_else(|| self.cluster.canonical_text().to_owned())
    }
}

impl ChangeKeeper for Keeper {
    fn load(&mut self, texts: &str) -> Result<Arc<OnlineChange>, String> {
        let texts: ChangeTexts = serde_json::from_str(texts)
            .map_err(|error| format!("U0631: these are no texts of an online change: {error}"))?;
        let change = texts.load(&self.cluster).map_err(|error| format!("U0631: {error}"))?;
        let change = Arc::new(change);
        // Another change is refused by the cycle while one is loaded.
        if self.loaded.is_none() {
            self.loaded = Some(LoadedChange { texts, change: Arc::clone(&change) });
        }
        Ok(change)
    }

    fn read(&mut self, file: &str) -> Result<String, String> {
        let unread = |reason: String| format!("U0631: {file} cannot be read: {reason}");
        let length = fs::metadata(file).map_err(|error| unread(error.to_string()))?.len();
        if length > MOST_BYTES {
            return Err(unread(format!("it has {length} bytes; at most {MOST_BYTES} are read")));
        }
        fs::read_to_string(file).map_err(|error| unread(error.to_string()))
    }

    fn keep(&mut self, configurations: Configurations) -> Result<String, String> {
        let text = self.text(configurations.own);
        let own = self.cluster.agreement().configuration;
        let is_over = configurations.prepared.is_none();
        let kept = match (&self.file, &self.loaded) {
            (Some(file), Some(_)) if is_over && configurations.own == own => remove(file),
            (Some(file), Some(loaded)) => {
                write(file, &KeptChange { configurations, texts: loaded.texts.clone() })
            }
            _ => Ok(()),
        };
        if is_over && configurations.own == own {
            self.loaded = None;
        }
        kept.map_err(|error| {
            format!(
                "U0633: it is done, and not kept on the disk, so it ends with the process: {error}"
            )
        })?;
        Ok(text)
    }
}

fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes the file whole or not at all.
fn write(file: &Path, kept: &KeptChange) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let beside = file.with_extension("change.new");
    let mut new = File::create(&beside)?;
    new.write_all(&serde_json::to_vec(kept)?)?;
    new.sync_all()?;
    fs::rename(&beside, file)?;
    File::open(folder)?.sync_all()
}
