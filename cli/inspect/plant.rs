//! The groups of a plant file, for `watch`, `top` and `gateway metrics`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use understudy_attach::Attached;
use understudy_cluster::Cluster;
use understudy_journal::RunDirectory;
use understudy_view::{FollowedPlant, GroupState, PlantOverview};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::inspect::attach::{AttachArguments, record};
use crate::plants;

/// Time between two attempts to attach to a group.
const AGAIN: Duration = Duration::from_secs(5);

/// Maximum wait for the first cycle of every group that is attached.
const HEARD_FOR: Duration = Duration::from_secs(5);

/// Time in which all members of a remote cluster have reported.
const ALL_SAY: Duration = Duration::from_secs(1);

const LOOK: Duration = Duration::from_millis(100);

/// A plant whose groups are followed, and attached where keys are given; until this is dropped.
pub(crate) struct OpenedPlant {
    pub(crate) plant: FollowedPlant,
    pub(crate) runs: PathBuf,
    attached: usize,
    ends: Arc<AtomicBool>,
    _groups: Vec<(RunDirectory, Attached)>,
}

impl Drop for OpenedPlant {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
    }
}

/// Whether a path is a plant file.
pub(crate) fn is_plant(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|ending| ending == "toml");
    let text = || std::fs::read_to_string(path).unwrap_or_default();
    is_toml && understudy_cluster::looks_like_a_plant_file(&text())
}

/// Follows the groups of a plant file: the runs that processes write below `runs`. With keys it attaches to each group first, and to those that
/// are not received again and again.
pub(crate) fn open(
    path: &Path,
    runs: &Path,
    keys: &AttachArguments,
    journal_limit: u64,
    console: &mut Console,
) -> Result<OpenedPlant, Answer> {
    let (plant, _) = plants::valid(path)?;
    if keys.has_endpoints() {
        let message = "--endpoints is for one cluster; the members of a plant have the addresses of their cluster files";
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    let ends = Arc::new(AtomicBool::new(false));
    let mut groups = Vec::new();
    let mut wrong = Answer::done("", ()).with_status(Status::BadInput);
    let mut later = Vec::new();
    for group in plant.groups.iter().filter(|_| keys.is_wanted()) {
        let file = path.parent().unwrap_or(Path::new("")).join(&group.file);
        let again = Again {
            keys: keys.of_group(&group.name),
            file,
            cluster: group.cluster.clone(),
            runs: runs.to_owned(),
            journal_limit,
        };
        match again.attach() {
            Ok(attached) => {
                console.note(&format!("{}: attached", group.name));
                groups.push(attached);
            }
            Err(answer) if answer.status == Status::BadInput => {
                wrong.failures.extend(answer.failures);
            }
            Err(answer) => {
                let reason = answer.failures.first().map(|failure| failure.message.clone());
                let reason = reason.unwrap_or_default();
                console.note(&format!("{}: not received, retrying: {reason}", group.name));
                later.push(again);
            }
        }
    }
    if !wrong.failures.is_empty() {
        return Err(wrong);
    }
    for again in later {
        let ends = Arc::clone(&ends);
        std::thread::Builder::new()
            .name("attach".to_owned())
            .spawn(move || again.until_attached(&ends))
            .map_err(|error| {
                let message = format!("cannot start a thread for a group: {error}");
                Answer::failed(Status::Failed, "U0675", message)
            })?;
    }
    let attached = groups.len();
    let runs = runs.to_owned();
    Ok(OpenedPlant { plant: FollowedPlant::new(plant), runs, attached, ends, _groups: groups })
}

/// A group to attach to.
struct Again {
    keys: AttachArguments,
    file: PathBuf,
    cluster: Cluster,
    runs: PathBuf,
    journal_limit: u64,
}

impl Again {
    fn attach(&self) -> Result<(RunDirectory, Attached), Answer> {
        let (found, _) = self.keys.find(&self.cluster)?;
        record(found, &self.file, &self.cluster, &self.runs, self.journal_limit)
    }

    /// Attaches once a member is received, and stays so until the end.
    fn until_attached(&self, ends: &AtomicBool) {
        let mut attached = None;
        while !ends.load(Ordering::Relaxed) {
            if attached.is_none() {
                attached = self.attach().ok();
            }
            std::thread::sleep(AGAIN);
        }
    }
}

impl OpenedPlant {
    /// The overview now.
    pub(crate) fn look(&mut self) -> PlantOverview {
        self.plant.look(&self.runs, Instant::now())
    }

    /// The overview once the groups that are attached have reported cycles, or after a time limit.
    pub(crate) fn settled(&mut self) -> PlantOverview {
        let started = Instant::now();
        while started.elapsed() < HEARD_FOR {
            let overview = self.look();
            let unknown = |state| state == GroupState::NotObserved;
            let observed = overview.groups.iter().filter(|group| !unknown(group.state)).count();
            if observed >= self.attached {
                break;
            }
            std::thread::sleep(LOOK);
        }
        if self.attached > 0 {
            std::thread::sleep(ALL_SAY);
        }
        self.look()
    }
}
