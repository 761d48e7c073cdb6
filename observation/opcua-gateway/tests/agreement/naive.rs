//! The facts of a cycle, folded from all records as simply as possible.

use std::collections::{BTreeMap, BTreeSet};

use understudy_journal::{Action, Happening, RunEvent};
use understudy_node::Event as StationEvent;
use understudy_plant::Event as PlantEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_wire::{Member, ProgramId, SignalPlace, Source, StationId, StationSet};

use super::dice::Entry;
use super::facts::{Facts, ProgramFacts, StationFacts};

/// A deadline.
struct Deadline {
    program: ProgramId,
    cycle: i64,
    source: Source,
    missing: Option<Missing>,
    heard: StationSet,
    outputs: String,
}

/// What is so in a cycle.
#[derive(Default)]
struct Now {
    processes: BTreeMap<Member, &'static str>,
    joining: BTreeSet<StationId>,
    shadow: BTreeSet<(StationId, ProgramId)>,
    refused: BTreeSet<StationId>,
    received: BTreeSet<StationId>,
    flags: BTreeSet<(ProgramId, StationId)>,
    excluded: BTreeSet<(ProgramId, StationId)>,
    forced: BTreeSet<(ProgramId, SignalPlace)>,
    awaits_release: BTreeSet<ProgramId>,
    protected: BTreeMap<ProgramId, bool>,
    lost: BTreeSet<ProgramId>,
    finished: BTreeMap<ProgramId, u64>,
    masters: BTreeSet<StationId>,
    cuts: BTreeSet<(Member, Member)>,
    /// Members whose journals are not received.
    detached: BTreeSet<Member>,
}

/// The newest cycle and all deadlines, counted from the origin.
pub(crate) struct Naive<'e> {
    entries: &'e [Entry],
    origin: i64,
    deadlines: Vec<Deadline>,
    /// The newest cycle that was shown when each entry was read.
    shown: Vec<Option<i64>>,
    pub(crate) oldest: i64,
    pub(crate) newest: Option<i64>,
}

impl<'e> Naive<'e> {
    pub(crate) fn new(entries: &'e [Entry]) -> Self {
        let origin = entries.iter().find_map(|entry| match &entry.record.event {
            Happening::Run(RunEvent::Origin { .. }) => Some(entry.at),
            _ => None,
        });
        let origin = origin.unwrap_or(0);
        let deadlines: Vec<Deadline> =
            entries.iter().filter_map(|entry| deadline(entry, origin)).collect();
        let mut first: BTreeMap<ProgramId, i64> = BTreeMap::new();
        for deadline in &deadlines {
            first.entry(deadline.program).or_insert(deadline.cycle);
        }
        let shown = shown(entries, origin);
        Self {
            entries,
            origin,
            oldest: first.values().copied().max().unwrap_or(0).max(0),
            newest: shown.last().copied().flatten(),
            shown,
            deadlines,
        }
    }

    pub(crate) fn facts(&self, cycle: i64, stations: u8, programs: u8) -> Facts {
        let now = self.now(cycle);
        let schedule = (0..stations).map(StationId);
        let stations: Vec<StationFacts> = schedule
            .clone()
            .map(|station| StationFacts {
                state: self.state(&now, station, cycle),
                flagged: now.flags.iter().any(|(_, flagged)| *flagged == station),
                excluded_from: (0..programs)
                    .filter(|program| now.excluded.contains(&(ProgramId(*program), station)))
                    .collect(),
            })
            .collect();
        let members = schedule.count() as u8;
        let master = (0..members).map(StationId).find(|station| {
            let own = Member::Station(*station);
            let cut = now.cuts.iter().filter(|(from, _)| *from == own);
            let all_cut = cut.count() >= usize::from(members - 1 + programs);
            now.masters.contains(station)
                && stations[station.index()].state == "publishing"
                && !all_cut
        });
        Facts {
            cycle,
            cycle_master: master.map(|station| station.0),
            programs: (0..programs)
                .map(|program| self.program(&now, ProgramId(program), cycle))
                .collect(),
            stations,
            host_stalls: self.stalls(cycle),
        }
    }

    fn stalls(&self, cycle: i64) -> u64 {
        let is_stall = |entry: &&Entry| {
            matches!(
                entry.record.event,
                Happening::Station(StationEvent::Stalled { .. })
                    | Happening::RemoteIo(RemoteIoEvent::Stalled { .. })
            )
        };
        let stalls = self.entries.iter().filter(is_stall);
        let is_present = self.newest == Some(cycle);
        stalls.filter(|entry| is_present || entry.at - self.origin <= cycle).count() as u64
    }

    fn heard(&self, cycle: i64) -> StationSet {
        let deadlines = self.deadlines.iter();
        let heard = deadlines.filter(|deadline| deadline.cycle == cycle);
        heard.fold(StationSet::EMPTY, |all, deadline| all.or(deadline.heard))
    }

    fn state(&self, now: &Now, station: StationId, cycle: i64) -> String {
        let process = now.processes.get(&Member::Station(station)).copied();
        let flagged = now.flags.iter().any(|(_, flagged)| *flagged == station);
        let received = now.received.contains(&station);
        let state = if let Some(dead @ ("killed" | "ended" | "suspended")) = process {
            dead
        } else if self.heard(cycle).contains(station) {
            "publishing"
        } else if now.refused.contains(&station) {
            "refused"
        } else if now.shadow.iter().any(|(own, _)| *own == station) {
            "shadow-mode"
        } else if now.joining.contains(&station) {
            "joining"
        } else if flagged && received {
            "flagged"
        } else if received {
            "not-received"
        } else if process.is_none() {
            "not-started"
        } else {
            "joining"
        };
        state.to_owned()
    }

    fn program(&self, now: &Now, program: ProgramId, cycle: i64) -> ProgramFacts {
        let member = Member::RemoteIo(program);
        let process = now.processes.get(&member).copied();
        let is_down = matches!(process, Some("killed" | "ended"));
        let reports = matches!(process, None | Some("running")) && !now.detached.contains(&member);
        let own = || self.deadlines.iter().filter(|of| of.program == program);
        let driven = own().find(|of| of.cycle == cycle).filter(|_| !is_down);
        let count = |source| {
            let counted = own().filter(|of| of.source == source);
            let until = counted.filter(|of| (0..=cycle).contains(&of.cycle));
            until.count() as u64
        };
        let word = |source| match source {
            Source::Direct => "direct",
            Source::Reconstructed => "reconstructed",
            Source::Held => "held",
            Source::FailSafe => "fail-safe",
        };
        let state = match (process, driven.map(|of| of.missing)) {
            (Some(dead @ ("killed" | "ended" | "suspended")), _) => dead,
            (_, None | Some(Some(Missing::NoHistory))) => "listening",
            (_, Some(Some(Missing::NotReleased))) => "awaits-release",
            (_, Some(Some(Missing::StateLost))) => "state-lost",
            _ => "serving",
        };
        ProgramFacts {
            source: driven.map(|of| word(of.source).to_owned()),
            outputs: driven.map(|of| of.outputs.clone()),
            counts: [
                count(Source::Direct),
                count(Source::Reconstructed),
                count(Source::Held),
                count(Source::FailSafe),
            ],
            awaits_release: now.awaits_release.contains(&program),
            forced: now.forced.iter().filter(|(of, _)| *of == program).count(),
            // Not known where the remote I/O does not report.
            protected: now.protected.get(&program).copied().filter(|_| reports),
            lost: now.lost.contains(&program),
            finished: now.finished.get(&program).copied(),
            remote_io: state.to_owned(),
        }
    }

    /// Every record that takes effect up to a cycle, in the order of cycles; in the newest all that was done to the members.
    fn now(&self, cycle: i64) -> Now {
        let mut begun: BTreeMap<Member, i64> = BTreeMap::new();
        let mut stamped: Vec<(i64, &Entry)> = Vec::new();
        let before = std::iter::once(&None).chain(&self.shown);
        for (entry, shown) in self.entries.iter().zip(before) {
            let mut at = (entry.at - self.origin).max(shown.map_or(i64::MIN, |shown| shown + 1));
            if let Some((member, _)) = process(entry) {
                begun.insert(member, at);
            } else if let Some(member) = entry.record.member
                && reports(entry)
            {
                at = at.max(begun.get(&member).copied().unwrap_or(i64::MIN));
            }
            stamped.push((at, entry));
        }
        stamped.sort_by_key(|(at, _)| *at);
        let mut now = Now::default();
        let is_present = self.newest == Some(cycle);
        for (at, entry) in stamped {
            if at <= cycle || is_present && entry.record.member.is_none() {
                now.take(entry);
            }
        }
        now
    }
}

/// What was reported of which cycles.
#[derive(Default)]
struct Reported {
    /// By member that is not away: its first and its newest cycle, and the count of cycles then.
    members: BTreeMap<Member, (i64, i64, u64)>,
    away: BTreeSet<Member>,
    heard: BTreeMap<i64, StationSet>,
    furthest: Option<i64>,
    count: u64,
}

/// The newest complete cycle after each entry: it has the deadlines of all remote I/Os and the turns of all stations that were received, but for
/// those that are away. No member is silent for long in these journals.
fn shown(entries: &[Entry], origin: i64) -> Vec<Option<i64>> {
    let mut reported = Reported::default();
    let mut shown: Option<i64> = None;
    let shown_after = |entry: &Entry| {
        reported.take(entry, entry.at - origin);
        shown = shown.max(reported.complete());
        shown
    };
    entries.iter().map(shown_after).collect()
}

impl Reported {
    fn take(&mut self, entry: &Entry, at: i64) {
        if let Some((member, word)) = process(entry)
            && word != "running"
        {
            self.away.insert(member);
            self.members.remove(&member);
        }
        let Some(member) = entry.record.member else {
            return;
        };
        match &entry.record.event {
            Happening::RemoteIo(RemoteIoEvent::Applied { heard, .. }) => {
                let before = self.heard.entry(at).or_insert(StationSet::EMPTY);
                *before = before.or(*heard);
            }
            Happening::Station(StationEvent::Published { .. }) => {}
            _ => return,
        }
        if self.furthest < Some(at) {
            (self.furthest, self.count) = (Some(at), self.count + 1);
        }
        self.away.remove(&member);
        let (_, newest, count) = self.members.entry(member).or_insert((at, at, 0));
        (*newest, *count) = (at.max(*newest), self.count);
    }

    fn complete(&self) -> Option<i64> {
        let furthest = self.furthest?;
        let begun = self.members.values().map(|(first, ..)| *first).max();
        let from = begun.unwrap_or(furthest);
        (from..=furthest).rev().find(|cycle| self.is_complete(*cycle))
    }

    fn is_complete(&self, cycle: i64) -> bool {
        let remote_ios = [ProgramId(0), ProgramId(1)].map(Member::RemoteIo);
        let newest = |member| self.members.get(member).map(|(_, newest, _)| *newest);
        let mut awaited = remote_ios.iter().filter(|member| !self.away.contains(member));
        let mut stations = (0..3).map(StationId);
        awaited.all(|member| newest(member) >= Some(cycle))
            && stations.all(|station| {
                let member = Member::Station(station);
                let own = self.members.get(&member);
                let unread = own.map_or(i64::MIN, |(_, newest, _)| newest.saturating_add(1));
                let mut unread = self.heard.range(unread..).filter(|(of, _)| **of <= cycle);
                let is_read = !unread.any(|(_, heard)| heard.contains(station));
                let is_past = |(_, newest, count): &(i64, i64, u64)| {
                    *newest >= cycle || self.count - count > 20
                };
                self.away.contains(&member) || is_read && own.is_none_or(is_past)
            })
    }
}

/// What a member tells of itself or of its own program; what it receives is of the cycle alone.
fn reports(entry: &Entry) -> bool {
    !matches!(
        entry.record.event,
        Happening::RemoteIo(RemoteIoEvent::Applied { .. } | RemoteIoEvent::Refused { .. })
            | Happening::Plant(_)
    )
}

fn deadline(entry: &Entry, origin: i64) -> Option<Deadline> {
    match (&entry.record.event, entry.record.member?) {
        (
            Happening::RemoteIo(RemoteIoEvent::Applied {
                outputs,
                driven,
                source,
                missing,
                heard,
                ..
            }),
            Member::RemoteIo(program),
        ) => Some(Deadline {
            program,
            cycle: entry.at - origin,
            source: *source,
            missing: *missing,
            heard: *heard,
            outputs: driven.as_ref().unwrap_or(outputs).to_string(),
        }),
        _ => None,
    }
}

/// A process that begins anew, ends or is suspended.
fn process(entry: &Entry) -> Option<(Member, &'static str)> {
    match &entry.record.event {
        Happening::Run(RunEvent::Started { member }) => Some((*member, "running")),
        Happening::Run(RunEvent::Ended { member, .. }) => Some((*member, "ended")),
        Happening::Run(RunEvent::Fault { action, member, .. }) => match action {
            Action::Crash => Some((*member, "killed")),
            Action::Stop => Some((*member, "suspended")),
            Action::Restart => Some((*member, "running")),
            _ => None,
        },
        _ => None,
    }
}

impl Now {
    fn take(&mut self, entry: &Entry) {
        if let Some((member, word)) = process(entry) {
            self.processes.insert(member, word);
            match member {
                Member::Station(station) => {
                    self.masters.remove(&station);
                    if word == "running" {
                        self.joining.insert(station);
                        self.shadow.retain(|(own, _)| *own != station);
                        self.refused.remove(&station);
                    }
                }
                Member::RemoteIo(program) if word != "suspended" => self.forget(program),
                _ => {}
            }
        }
        match (&entry.record.event, entry.record.member) {
            (Happening::Run(RunEvent::Attached { member }), _) => {
                self.detached.remove(member);
            }
            (Happening::Run(RunEvent::Detached { member, .. }), _) => {
                self.detached.insert(*member);
            }
            (Happening::Run(RunEvent::Fault { action, member, .. }), _) => match action {
                Action::Continue => {
                    self.processes.insert(*member, "running");
                }
                Action::Cut { to } => {
                    self.cuts.insert((*member, *to));
                }
                Action::Heal { to } => {
                    self.cuts.remove(&(*member, *to));
                }
                _ => {}
            },
            (Happening::Station(event), Some(Member::Station(station))) => {
                self.processes.entry(Member::Station(station)).or_insert("running");
                self.station(station, event);
            }
            (Happening::RemoteIo(event), Some(Member::RemoteIo(program))) => {
                self.remote_io(program, event);
            }
            (Happening::Plant(PlantEvent::Stepped { field, .. }), Some(Member::Plant(program))) => {
                self.finished.insert(program, field.finished);
            }
            _ => {}
        }
    }

    fn forget(&mut self, program: ProgramId) {
        self.flags.retain(|(by, _)| *by != program);
        self.excluded.retain(|(by, _)| *by != program);
        self.forced.retain(|(of, _)| *of != program);
        self.awaits_release.remove(&program);
        self.protected.remove(&program);
        self.lost.remove(&program);
    }

    fn station(&mut self, station: StationId, event: &StationEvent) {
        match event {
            StationEvent::Published { .. } => {
                self.received.insert(station);
                self.joining.remove(&station);
                self.shadow.retain(|(own, _)| *own != station);
            }
            StationEvent::Joins { .. } => {
                self.joining.insert(station);
            }
            StationEvent::Adopted { program, from: Some(_), .. } => {
                self.shadow.insert((station, *program));
            }
            StationEvent::BecameCycleMaster { .. } => {
                self.masters.insert(station);
            }
            StationEvent::Excluded { program, .. } => {
                self.excluded.insert((*program, station));
            }
            StationEvent::Readmitted { program, .. } => {
                self.excluded.remove(&(*program, station));
            }
            _ => {}
        }
    }

    fn remote_io(&mut self, program: ProgramId, event: &RemoteIoEvent) {
        match event {
            RemoteIoEvent::Applied { heard, .. } => {
                for station in heard.iter() {
                    self.received.insert(station);
                    self.refused.remove(&station);
                }
            }
            RemoteIoEvent::Refused { member: Member::Station(station), .. } => {
                self.refused.insert(*station);
            }
            RemoteIoEvent::Flagged { station, .. } => {
                self.flags.insert((program, *station));
            }
            RemoteIoEvent::Cleared { station, .. } => {
                self.flags.remove(&(program, *station));
            }
            RemoteIoEvent::Forced { force, .. } => {
                self.forced.insert((program, force.signal));
            }
            RemoteIoEvent::Unforced { signal, .. } => {
                self.forced.remove(&(program, *signal));
            }
            RemoteIoEvent::Protected { .. } => {
                self.protected.insert(program, true);
            }
            RemoteIoEvent::Unprotected { .. } => {
                self.protected.insert(program, false);
            }
            RemoteIoEvent::StateLost { .. } => {
                self.lost.insert(program);
            }
            RemoteIoEvent::StateRecovered { .. } => {
                self.lost.remove(&program);
            }
            RemoteIoEvent::StartedCold { awaits_release, .. } => {
                self.lost.remove(&program);
                self.excluded.retain(|(by, _)| *by != program);
                if *awaits_release {
                    self.awaits_release.insert(program);
                }
            }
            RemoteIoEvent::Released { .. } => {
                self.awaits_release.remove(&program);
                self.excluded.retain(|(by, _)| *by != program);
            }
            RemoteIoEvent::ValueFault { accused, located: true, .. } => {
                self.exclude(program, *accused)
            }
            RemoteIoEvent::RecalledExclusion { stations, .. } => self.exclude(program, *stations),
            _ => {}
        }
    }

    fn exclude(&mut self, program: ProgramId, stations: StationSet) {
        let stations = stations.iter();
        self.excluded.extend(stations.map(|station| (program, station)));
    }
}
