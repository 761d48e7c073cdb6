//! All groups of a plant file: the remaining redundancy of each, and where each spare is.
//!
//! ```text
//!   group: Snapshot ─┐
//!   group: Snapshot ─┼──► overview(plant, views) ──► page, terminal, metrics, JSON
//!   group: nothing  ─┘
//! ```
//!
//! It follows from the snapshots of the groups alone. Invariants: a group of which no present snapshot is there is *not observed*, never
//! complete; a spare is asleep only where a member receives its reports.

mod followed;
mod text;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::{PlantFile, PlantSpare, Priority};
use understudy_cycle::Mode;

use crate::alarm::STATE_LOST;
use crate::snapshot::{ProgramSnapshot, Snapshot, StationSnapshot};
use crate::station::StationState;

pub use followed::FollowedPlant;

/// What is known of a group.
#[derive(Debug, Clone)]
pub enum GroupView {
    /// Its present state.
    Present(Box<Snapshot>),
    /// Its present state is not known, and why.
    Unknown(String),
}

/// All groups of a plant and their spares.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PlantOverview {
    /// Groups, in the order of the plant file.
    pub groups: Vec<GroupOverview>,
    /// Spares, in the order of the plant file.
    pub spares: Vec<SpareOverview>,
    /// What lacks now: groups without protection or without observation, and spares that do not report.
    pub alarms: Vec<PlantAlarm>,
}

/// Protection of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GroupState {
    /// The failure of any one station is masked, and no station has failed.
    Complete,
    /// A station has failed, and the failure of any one further station is masked: other understudies or a spare.
    Reduced,
    /// The failure of one further station would not be masked.
    Unprotected,
    /// Its present state is not known.
    NotObserved,
}

impl GroupState {
    /// Every state.
    pub const ALL: [Self; 4] =
        [Self::Complete, Self::Reduced, Self::Unprotected, Self::NotObserved];

    /// The state as JSON, labels of metrics and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Reduced => "reduced",
            Self::Unprotected => "unprotected",
            Self::NotObserved => "not-observed",
        }
    }
}

/// A group of the plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct GroupOverview {
    /// Its name in the plant file.
    pub name: String,
    /// Its protection.
    pub state: GroupState,
    /// Further failures of stations that are masked whichever they are; nothing where that is not known.
    pub survives: Option<u8>,
    /// The cycle, as the view of the group counts it.
    pub cycle: Option<i64>,
    /// Stations, other than slots of spares, that do not publish.
    pub failed: Vec<String>,
    /// Programs of which a remote I/O does not report that they are protected.
    pub unprotected_programs: Vec<String>,
    /// Spares that serve it or wake in it.
    pub spares: Vec<String>,
    /// Why no spare protects it, where it is unprotected; why it is not observed.
    pub reason: Option<String>,
}

/// Where a spare is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpareState {
    /// It watches its groups.
    Asleep,
    /// It joins a group and does not publish yet.
    Waking,
    /// It publishes in a group.
    Serving,
    /// No member receives its reports, or its station in a group is not received any more.
    NotReceived,
}

impl SpareState {
    /// Every state.
    pub const ALL: [Self; 4] = [Self::Asleep, Self::Waking, Self::Serving, Self::NotReceived];

    /// The state as JSON, labels of metrics and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Asleep => "asleep",
            Self::Waking => "waking",
            Self::Serving => "serving",
            Self::NotReceived => "not-received",
        }
    }
}

/// A spare of the plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SpareOverview {
    /// Its name in the plant file.
    pub name: String,
    /// Where it is.
    pub state: SpareState,
    /// The group in which it wakes or serves.
    pub group: Option<String>,
    /// Groups in which its reports are not received, while others receive them.
    pub not_received_in: Vec<String>,
}

/// Something that lacks in the plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PlantAlarm {
    /// `unprotected`, `not-observed`, `spare-not-received`, or the kind of an alarm of the group.
    pub alarm: &'static str,
    /// The group or the spare.
    pub name: String,
    /// What lacks, and why.
    pub text: String,
}

impl PlantOverview {
    /// The overview of a plant whose groups are known as `views` says, in the order of the plant file.
    pub fn new(plant: &PlantFile, views: &[GroupView]) -> Self {
        let spares: Vec<SpareOverview> =
            plant.spares.iter().map(|spare| spare_overview(plant, spare, views)).collect();
        let groups: Vec<GroupOverview> = (0..plant.groups.len())
            .map(|group| group_overview(plant, group, views.get(group), &spares))
            .collect();
        let own = plant.groups.iter().zip(views);
        let own = own.flat_map(|(group, view)| urgent(&group.name, view));
        let alarms = own.chain(alarms(&groups, &spares)).collect();
        Self { groups, spares, alarms }
    }
}

/// The alarms of a group that require an immediate response: what its outputs are counts more than what protects them.
fn urgent(group: &str, view: &GroupView) -> Vec<PlantAlarm> {
    let GroupView::Present(snapshot) = view else {
        return Vec::new();
    };
    let lasting = snapshot.alarms.iter().filter(|alarm| alarm.over.is_none());
    let urgent = lasting
        .filter(|alarm| alarm.priority == Some(Priority::Critical) || alarm.alarm == STATE_LOST);
    let told = urgent.map(|alarm| PlantAlarm {
        alarm: alarm.alarm,
        name: group.to_owned(),
        text: format!("{group}: {}", alarm.text),
    });
    told.collect()
}

fn spare_overview(plant: &PlantFile, spare: &PlantSpare, views: &[GroupView]) -> SpareOverview {
    let name = |group: usize| plant.groups[group].name.clone();
    let mut places = Vec::new();
    let mut received = Vec::new();
    let mut not_received_in = Vec::new();
    for serves in &spare.serves {
        let Some(GroupView::Present(snapshot)) = views.get(serves.group) else {
            continue;
        };
        let slot = snapshot.stations.iter().find(|station| station.name == serves.name);
        match slot.map(|slot| slot.state) {
            Some(StationState::Publishing) => places.push((SpareState::Serving, serves.group)),
            Some(StationState::Standby) | None => {}
            Some(_) => places.push((SpareState::Waking, serves.group)),
        }
        match snapshot.spares.iter().find(|it| it.name == spare.name && it.received) {
            Some(report) => {
                // It was flagged after the spare had reported to be awake: it does not wake, but has failed.
                let has_failed = report.flagged_slots.contains(&serves.name);
                received.push((report.serves.clone(), has_failed));
            }
            None => not_received_in.push(name(serves.group)),
        }
    }
    // The station of a slot publishes or joins: that counts more than a report, which is some seconds old.
    let place = places.iter().find(|(state, _)| *state == SpareState::Serving).or(places.first());
    let reported =
        received.iter().filter_map(|(group, has_failed)| Some((group.as_ref()?, *has_failed)));
    let reported = reported.max();
    let (state, group) = match (place, reported) {
        (Some((state, group)), _) => (*state, Some(name(*group))),
        (None, _) if received.is_empty() => (SpareState::NotReceived, None),
        (None, Some((group, has_failed))) if is_missing(plant, spare, group, views) => {
            let state = if has_failed { SpareState::NotReceived } else { SpareState::Waking };
            (state, Some(group.clone()))
        }
        (None, _) => (SpareState::Asleep, None),
    };
    if state == SpareState::NotReceived && group.is_none() {
        not_received_in.clear();
    }
    SpareOverview { name: spare.name.clone(), state, group, not_received_in }
}

/// Whether the group of that name, in which a spare reports to be awake, does not show its station: it has not joined yet, or the group is not
/// observed.
fn is_missing(plant: &PlantFile, spare: &PlantSpare, group: &str, views: &[GroupView]) -> bool {
    let serves = |group: usize| spare.serves.iter().any(|serves| serves.group == group);
    let found = plant.groups.iter().position(|it| it.name == group);
    found.is_some_and(|group| {
        let view = views.get(group);
        let is_complete = matches!(view, Some(GroupView::Present(of)) if of.margin.survives > 0);
        serves(group) && !is_complete
    })
}

/// Whether a station is the slot of a spare.
fn is_slot(plant: &PlantFile, group: usize, station: &StationSnapshot) -> bool {
    let slots = plant.groups[group].cluster.agreement().schedule.spare_slots();
    slots.iter().any(|slot| slot.0 == station.rank)
}

fn group_overview(
    plant: &PlantFile,
    group: usize,
    view: Option<&GroupView>,
    spares: &[SpareOverview],
) -> GroupOverview {
    let name = plant.groups[group].name.clone();
    let here = spares.iter().filter(|spare| {
        spare.group.as_ref() == Some(&name) && spare.state != SpareState::NotReceived
    });
    let here: Vec<String> = here.map(|spare| spare.name.clone()).collect();
    let unknown = |reason: String| GroupOverview {
        name: name.clone(),
        state: GroupState::NotObserved,
        survives: None,
        cycle: None,
        failed: Vec::new(),
        unprotected_programs: Vec::new(),
        spares: here.clone(),
        reason: Some(reason),
    };
    let snapshot = match view {
        Some(GroupView::Present(snapshot)) => snapshot,
        Some(GroupView::Unknown(reason)) => return unknown(reason.clone()),
        None => return unknown("its journals are not read".to_owned()),
    };
    let stations = snapshot.stations.iter();
    let failed = stations.filter(|it| !is_slot(plant, group, it));
    let failed = failed.filter(|station| station.state != StationState::Publishing);
    let failed: Vec<String> = failed.map(|station| station.name.clone()).collect();
    let programs = snapshot.programs.iter();
    let is_unprotected = |it: &ProgramSnapshot| it.protection.as_ref().map(|it| !it.protected);
    let unprotected = programs.clone().filter(|it| is_unprotected(it) == Some(true));
    let unprotected: Vec<String> = unprotected.map(|it| it.program.clone()).collect();
    let unreported = programs.filter(|it| is_unprotected(it).is_none());
    let unreported = unreported
        .map(|it| format!("protection of {}: {}", it.program, snapshot.protection_text(it)));
    let unreported: Vec<String> = unreported.collect();
    // What is not known does not hide what is known to lack.
    if unprotected.is_empty() && !unreported.is_empty() {
        return GroupOverview { failed, cycle: snapshot.cycle, ..unknown(unreported.join("; ")) };
    }
    let survives = snapshot.margin.survives;
    let state = match (survives, failed.is_empty()) {
        (0, _) => GroupState::Unprotected,
        _ if !unprotected.is_empty() => GroupState::Unprotected,
        (_, true) => GroupState::Complete,
        (_, false) => GroupState::Reduced,
    };
    let reason =
        (state == GroupState::Unprotected).then(|| no_spare(plant, group, snapshot, spares));
    GroupOverview {
        name,
        state,
        survives: Some(survives),
        cycle: snapshot.cycle,
        failed,
        unprotected_programs: unprotected,
        spares: here,
        reason,
    }
}

/// Why no spare protects a group now.
fn no_spare(
    plant: &PlantFile,
    group: usize,
    snapshot: &Snapshot,
    spares: &[SpareOverview],
) -> String {
    let own = &plant.groups[group];
    if snapshot.stations.iter().all(|station| station.state != StationState::Publishing) {
        return "no station publishes, so there is no state that a spare could adopt".to_owned();
    }
    if own.cluster.agreement().mode == Mode::Paper {
        return "no spare serves a group in the mode `paper`".to_owned();
    }
    let mut reasons = Vec::new();
    for (spare, known) in plant.spares.iter().zip(spares) {
        let Some(serves) = spare.serves.iter().find(|serves| serves.group == group) else {
            continue;
        };
        let name = &spare.name;
        let mut stations = snapshot.stations.iter();
        let slot = stations.find(|station| station.name == serves.name);
        let is_unread = slot.is_some_and(|slot| slot.link.detached);
        reasons.push(match (known.state, &known.group) {
            _ if !serves.fits => format!("the group is too large for {name}"),
            (SpareState::NotReceived, Some(at)) => failed_text(name, at),
            (SpareState::NotReceived, None) => format!("{name} is not received"),
            (SpareState::Waking, Some(at)) if *at == own.name => format!("{name} is waking"),
            (SpareState::Serving, Some(at)) if *at == own.name && is_unread => format!(
                "{name} serves it, and its station is not received here: what it protects is not known"
            ),
            (SpareState::Serving, Some(at)) if *at == own.name => {
                format!("{name} serves it, which is not enough")
            }
            (state, Some(at)) => {
                let does = if state == SpareState::Waking { "wakes in" } else { "serves" };
                format!("{name} {does} {at}")
            }
            (_, None) => {
                format!(
                    "{name} wakes when a station has been flagged for {} cycles",
                    spare.spare_after
                )
            }
        });
    }
    if reasons.is_empty() {
        return "no spare of the plant file serves it".to_owned();
    }
    reasons.join(", ")
}

/// A spare that has failed while it served a group.
fn failed_text(name: &str, group: &str) -> String {
    format!("{name} has served {group}, and its station there is not received any more")
}

fn alarms(groups: &[GroupOverview], spares: &[SpareOverview]) -> Vec<PlantAlarm> {
    let of_groups = groups.iter().filter_map(|group| {
        let GroupOverview { name, failed, reason, .. } = group;
        let reason = reason.as_deref().unwrap_or_default();
        let (alarm, text) = match group.state {
            GroupState::Complete | GroupState::Reduced => return None,
            GroupState::Unprotected => {
                let failed = match failed.len() {
                    0 => String::new(),
                    _ => format!(" (failed: {})", failed.join(", ")),
                };
                ("unprotected", format!("{name} is UNPROTECTED{failed}: {reason}"))
            }
            GroupState::NotObserved => {
                ("not-observed", format!("{name} is not observed: {reason}"))
            }
        };
        Some(PlantAlarm { alarm, name: name.clone(), text })
    });
    let of_spares = spares.iter().filter_map(|spare| {
        let name = &spare.name;
        let lost_in = spare.group.as_ref().filter(|_| spare.state == SpareState::NotReceived);
        let text = match (lost_in, spare.not_received_in.as_slice()) {
            (Some(group), _) => failed_text(name, group),
            (None, _) if spare.state == SpareState::NotReceived => {
                format!("{name} is not received by any group: it may not wake")
            }
            (None, []) => return None,
            (None, groups) => {
                format!("{name} is not received in {}: it may not wake there", groups.join(", "))
            }
        };
        Some(PlantAlarm { alarm: "spare-not-received", name: name.clone(), text })
    });
    of_groups.chain(of_spares).collect()
}
