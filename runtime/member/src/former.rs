//! Files of members that the cluster does not have any more: a member that was renamed finds nothing under its own name.
//!
//! ```text
//!   CLUSTER.STATION.CONTROLLER   a station: of a program, by the name of its controller
//!   CLUSTER.REMOTE_IO            a remote I/O
//! ```
//!
//! No file tells a renamed member from one that was removed while another one was added. So nothing that is found here is used without a question, and
//! nothing starts cold past it without one.

use std::path::Path;

use understudy_bus::{FoundFile, Owner, RetainedFiles};
use understudy_cluster::Cluster;
use understudy_wire::{Member, ProgramHash, ProgramId, RetainedRun};

/// What a station kept of a program under a name that the cluster does not have any more.
pub(crate) struct Former {
    /// The files.
    pub(crate) files: RetainedFiles,
    /// The states in them; at least one.
    pub(crate) runs: Vec<RetainedRun>,
    /// The files, as an alarm names them.
    pub(crate) found: FoundFile,
    controller: String,
}

/// What stations kept under names that the cluster does not have any more: for `program`, or for a controller that is gone.
pub(crate) fn states(
    cluster: &Cluster,
    folder: &Path,
    owner: Owner,
    program: ProgramId,
) -> Vec<Former> {
    let own = cluster.controllers()[program.index()].name.as_str();
    let is_controller = |name: &str| cluster.controllers().iter().any(|it| it.name == name);
    let is_station = |name: &str| has_member(cluster, name, |it| matches!(it, Member::Station(_)));
    let mut former = Vec::new();
    for files in RetainedFiles::at(folder).unwrap_or_default() {
        let name = files.name().to_owned();
        let [of, station, controller] = name.split('.').collect::<Vec<_>>()[..] else {
            continue;
        };
        let is_former = !is_controller(controller) || controller == own && !is_station(station);
        if of != cluster.name() || !is_former {
            continue;
        }
        let (runs, found) = files.runs(Some(owner));
        let Some(first) = found.into_iter().next().filter(|_| !runs.is_empty()) else {
            continue;
        };
        let problem = format!(
            "station {station} kept it for controller {controller}, and the cluster does not have both names any more: \
             its values are used only where the operator chooses them"
        );
        let found = FoundFile { problem: Some(problem), ..first };
        former.push(Former { files, runs, found, controller: controller.to_owned() });
    }
    former
}

impl Former {
    fn newest(&self) -> Option<&RetainedRun> {
        self.runs.iter().max_by_key(|run| run.state.number)
    }
}

/// The one whose values a program may start from, where the operator decides so: the newest of one controller, that of the same program or the only
/// one that is gone. Nothing where that is ambiguous.
pub(crate) fn candidate(former: Vec<Former>, hash: ProgramHash) -> Option<Former> {
    let is_same = |it: &Former| it.newest().is_some_and(|newest| newest.state.hash == hash);
    let any_same = former.iter().any(is_same);
    let candidates: Vec<Former> =
        former.into_iter().filter(|it| !any_same || is_same(it)).collect();
    let first = candidates.first()?.controller.clone();
    if candidates.iter().any(|it| it.controller != first) {
        return None;
    }
    let stepped = |it: &Former| it.newest().map(RetainedRun::stepped);
    candidates.into_iter().max_by_key(stepped)
}

/// Notes that may be of the remote I/O `name` from before it, or its cluster, was renamed. Those of a program that kept nothing do not count.
pub(crate) fn notes(
    cluster: &Cluster,
    folder: &Path,
    name: &str,
    is_retentive: bool,
) -> Vec<FoundFile> {
    let is_remote_io =
        |name: &str| has_member(cluster, name, |it| matches!(it, Member::RemoteIo(_)));
    let mut former = Vec::new();
    for files in RetainedFiles::at(folder).unwrap_or_default() {
        let problem = match files.name().split('.').collect::<Vec<_>>()[..] {
            [of, other] if of == cluster.name() && !is_remote_io(other) => {
                format!(
                    "remote I/O {other} made its notes, and the cluster does not have it any more"
                )
            }
            [of, other] if of != cluster.name() && other == name => {
                format!("{other} of the cluster {of} made its notes")
            }
            _ => continue,
        };
        let notes = files.notes(None);
        if let Some(first) = notes.files.into_iter().next()
            && notes.was_retentive.unwrap_or(is_retentive)
        {
            let problem =
                format!("{problem}: if {name} is the same one, its program has kept values");
            former.push(FoundFile { problem: Some(problem), ..first });
        }
    }
    former
}

fn has_member(cluster: &Cluster, name: &str, is_kind: impl Fn(Member) -> bool) -> bool {
    cluster.members().any(|member| is_kind(member) && cluster.member_name(member) == Some(name))
}
