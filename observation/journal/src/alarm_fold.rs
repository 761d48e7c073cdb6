//! Evaluation of the alarms of a cluster from the records of its journal.
//!
//! ```text
//!   value ──► condition (with hysteresis) ──► active (with delays)
//! ```
//!
//! Each is true, false or unknown. Invariant: the evaluation depends on the records and their cycles only, and an evaluation that starts in the
//! middle of a journal is unknown until it equals that of the whole journal.

use std::collections::BTreeMap;
use std::sync::Arc;

use understudy_bus::HostEvent;
use understudy_cluster::{AlarmDeclaration, CommonPoints, Way, same_point};
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_typed::Point;
use understudy_wire::{Image, Member, Part, ProgramHash, ProgramId};

use crate::present::Present;
use crate::record::{Happening, Record, RunEvent};
use crate::rules::Process;

/// Versions of programs of which it is known what the points of alarms are in them, at most.
const MOST_VERSIONS: usize = 64;

/// Condition of an alarm up to a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Condition {
    /// Whether the condition holds, with its hysteresis.
    held: Option<bool>,
    /// The first cycle of those in a row with this `held`.
    since: i64,
    /// Whether the alarm is active, with its delays.
    active: Option<bool>,
}

impl Condition {
    /// Before the first value.
    const UNKNOWN: Self = Self { held: None, since: 0, active: None };

    /// At the beginning of a run.
    const OVER: Self = Self { held: Some(false), since: 0, active: Some(false) };

    /// Takes the value of a cycle.
    fn step(&mut self, alarm: &AlarmDeclaration, cycle: i64, value: Option<u64>) {
        let held = value.and_then(|value| {
            let of = alarm.point.of;
            alarm.condition.holds(of, value, self.held)
        });
        if held != self.held {
            self.held = held;
            self.since = cycle;
        }
        let Some(held) = held else {
            self.active = None;
            return;
        };
        let delay = if held { alarm.on_delay } else { alarm.off_delay };
        if cycle.saturating_sub(self.since) >= i64::from(delay) {
            self.active = Some(held);
        }
    }
}

/// A program, with what its remote I/O reported.
#[derive(Debug, Clone, Default)]
struct Track {
    /// u(i) as last sampled.
    inputs: Option<Image>,
    /// Whether the values before the next ones are not those of the beginning.
    begun: bool,
    /// Whether its remote I/O does not run or is not received.
    silent: bool,
    /// Whether its points are not known, so that none of its values is.
    is_unnamed: bool,
    /// Of two remote I/Os of a program: the author, where that is known.
    author: Option<Member>,
    /// The version of the program whose points counted last, where another one than the first did.
    version: Option<ProgramHash>,
}

/// The alarms of a cluster, evaluated record by record.
#[derive(Debug, Clone)]
pub struct AlarmFold {
    alarms: Arc<[AlarmDeclaration]>,
    /// Of each, the point in the version of its program whose points count; nothing where that does not have it.
    points: Vec<Option<Point>>,
    /// The same for the versions whose points have counted: what was renamed step by step is found again after a restart, which begins with the first one.
    found: BTreeMap<(ProgramId, ProgramHash), Vec<Option<Point>>>,
    conditions: Vec<Condition>,
    /// Whether each was raised and is not known to be over.
    lasting: Vec<bool>,
    tracks: Vec<Track>,
}

/// Change of an alarm by a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AlarmChange {
    /// Index of the alarm in the cluster.
    pub alarm: usize,
    /// Whether it is active; nothing while that is unknown.
    pub active: Option<bool>,
    /// Whether it was raised or is over with this record; neither where it was unknown for a while and is as before.
    pub transition: Option<AlarmTransition>,
}

/// Beginning or end of an active alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlarmTransition {
    /// It is active.
    Raised {
        /// Whether it may have been active before: its state was unknown.
        since_before: bool,
    },
    /// It was active and is not any more.
    Over,
}

impl AlarmFold {
    /// The alarms before the first record, of a cluster with so many programs.
    pub fn new(alarms: Arc<[AlarmDeclaration]>, programs: usize) -> Self {
        Self {
            conditions: vec![Condition::UNKNOWN; alarms.len()],
            lasting: vec![false; alarms.len()],
            tracks: vec![Track::default(); programs],
            points: alarms.iter().map(|alarm| Some(alarm.point.clone())).collect(),
            found: BTreeMap::new(),
            alarms,
        }
    }

    /// Other points of a program count from now on; nothing of them is known where the version is not. An alarm goes on with the point that its point has
    /// become, by name or by a declared pair, and of the same type, and ends where there is none.
    pub fn lay_out(&mut self, program: ProgramId, present: &Present) -> Vec<AlarmChange> {
        let version = present.controller(program);
        let Some(track) = self.tracks.get_mut(program.index()) else {
            return Vec::new();
        };
        // By the points of before.
        track.inputs = None;
        track.is_unnamed = version.is_none();
        let Some(version) = version else {
            return self.forget(program);
        };
        let before = track.version.replace(version.hash);
        let first = present.first().controllers().get(program.index()).map(|first| first.hash);
        if self.found.len() >= MOST_VERSIONS {
            self.found.clear();
        }
        if let Some(first) = first {
            let points = || self.alarms.iter().map(|alarm| Some(alarm.point.clone())).collect();
            self.found.entry((program, first)).or_insert_with(points);
        }
        let before = before.or(first).and_then(|before| present.controller_of(program, before));
        let common =
            before.map(|before| CommonPoints::of(before, version, Way::There)).unwrap_or_default();
        let known = self.found.get(&(program, version.hash));
        let follow = |(place, alarm): (usize, &AlarmDeclaration)| {
            let (common, points) = match alarm.is_output {
                true => (&common.outputs, &version.interface.outputs),
                false => (&common.inputs, &version.interface.inputs),
            };
            let known = known.and_then(|known| known[place].clone());
            let followed = self.points[place].as_ref().and_then(|point| {
                let found = common.iter().find(|[was, _]| was.name == point.name);
                found.map(|[_, is]| is.clone())
            });
            known.or(followed).or_else(|| same_point(&alarm.point, points).cloned())
        };
        let points: Vec<Option<Point>> = self.alarms.iter().enumerate().map(follow).collect();
        for (place, alarm) in self.alarms.iter().enumerate() {
            if alarm.program == program {
                self.points[place].clone_from(&points[place]);
            }
        }
        self.found.insert((program, version.hash), points);
        self.change(program, |_, point, condition| {
            if point.is_none() {
                *condition = Condition::OVER;
            }
        })
    }

    /// Takes the next record, of a cycle of the run; answers with the alarms that it changes.
    pub fn take(&mut self, record: &Record, cycle: i64) -> Vec<AlarmChange> {
        match (&record.event, record.member) {
            (
                Happening::RemoteIo(event),
                Some(member @ (Member::RemoteIo(program) | Member::Twin(program))),
            ) => self.remote_io(member, program, cycle, event),
            (Happening::Host(HostEvent::JournalLost { .. }), Some(member)) => {
                self.forget_values_of(member)
            }
            (Happening::Run(event), _) => self.run(event),
            _ => Vec::new(),
        }
    }

    /// The same alarms before the first record again.
    #[must_use]
    pub fn again(&self) -> Self {
        Self::new(Arc::clone(&self.alarms), self.tracks.len())
    }

    /// Records were lost: the values are unknown until the next ones.
    pub fn forget_all(&mut self) -> Vec<AlarmChange> {
        let programs = (0..self.tracks.len()).map(|program| ProgramId(program as u8));
        let changes: Vec<_> = programs.map(|program| self.forget(program)).collect();
        changes.concat()
    }

    /// Moves every cycle that was taken so far.
    pub fn shift(&mut self, by: i64) {
        for condition in &mut self.conditions {
            condition.since = condition.since.saturating_add(by);
        }
    }

    /// Takes a report of a remote I/O, of a cycle of the run.
    pub fn remote_io(
        &mut self,
        member: Member,
        program: ProgramId,
        cycle: i64,
        event: &RemoteIoEvent,
    ) -> Vec<AlarmChange> {
        if self.alarms.is_empty() {
            return Vec::new();
        }
        let Some(track) = self.tracks.get_mut(program.index()) else {
            return Vec::new();
        };
        let (sampled, missing) = match event {
            RemoteIoEvent::Applied { sampled, missing, .. } => (sampled, missing),
            RemoteIoEvent::PartChanged { part: Part::Author, .. } => {
                track.author = Some(member);
                track.silent = false;
                return Vec::new();
            }
            RemoteIoEvent::StartedCold { .. } | RemoteIoEvent::StartedWarm { .. }
                if !track.begun =>
            {
                track.begun = true;
                return self.set(program, Condition::OVER);
            }
            _ => return Vec::new(),
        };
        track.begun = true;
        if track.silent || track.is_unnamed {
            return Vec::new();
        }
        match (sampled, missing) {
            (Some(inputs), _) => track.inputs = Some(inputs.clone()),
            // Nothing was to be sampled: the values are those of the last cycle.
            (None, Some(Missing::NoCycle) | None) => {}
            (None, Some(_)) => track.inputs = None,
        }
        let inputs = track.inputs.clone();
        let value = |alarm: &AlarmDeclaration, point: &Point| {
            let image = if alarm.is_output { event.driven() } else { inputs.as_ref() };
            let image = image?;
            let ends = point.bit as usize + point.of.bits() as usize;
            (ends <= image.width()).then(|| point.get(image.words()))
        };
        self.change(program, |alarm, point, condition| {
            if let Some(point) = point {
                condition.step(alarm, cycle, value(alarm, point));
            }
        })
    }

    /// Takes what happens to the members as the laboratory tells it.
    pub fn run(&mut self, event: &RunEvent) -> Vec<AlarmChange> {
        let (member, is_silent) = match event {
            RunEvent::Fault { action, member, .. } => match Process::after(*action) {
                Some(process) => (member, !process.is_running()),
                None => return Vec::new(),
            },
            RunEvent::Started { member } => (member, false),
            RunEvent::Ended { member, .. } | RunEvent::Detached { member, .. } => (member, true),
            // Its records from before are not in this journal.
            RunEvent::Attached { member } => {
                if let Some(program) = member.sampled_program()
                    && let Some(track) = self.tracks.get_mut(program.index())
                {
                    track.silent = false;
                    return self.forget(program);
                }
                return Vec::new();
            }
            _ => return Vec::new(),
        };
        let Some(program) = self.program_driven_by(*member) else {
            return Vec::new();
        };
        if let Some(track) = self.tracks.get_mut(program.index()) {
            track.silent = is_silent;
        }
        if is_silent { self.forget(program) } else { Vec::new() }
    }

    /// The program whose outputs a member drives: a follower drives none.
    fn program_driven_by(&self, member: Member) -> Option<ProgramId> {
        let program = member.sampled_program()?;
        let author = self.tracks.get(program.index())?.author;
        (author.unwrap_or(Member::RemoteIo(program)) == member).then_some(program)
    }

    /// What a member reports is not known until its next reports; nothing changes where it is a follower.
    pub fn forget_values_of(&mut self, member: Member) -> Vec<AlarmChange> {
        self.program_driven_by(member).map_or_else(Vec::new, |program| self.forget(program))
    }

    /// The values of a program are unknown until the next ones.
    pub fn forget(&mut self, program: ProgramId) -> Vec<AlarmChange> {
        if let Some(track) = self.tracks.get_mut(program.index()) {
            track.inputs = None;
            track.begun = true;
        }
        self.set(program, Condition::UNKNOWN)
    }

    fn set(&mut self, program: ProgramId, to: Condition) -> Vec<AlarmChange> {
        let of = |point: Option<&Point>| if point.is_some() { to } else { Condition::OVER };
        self.change(program, |_, point, condition| *condition = of(point))
    }

    /// Changes the conditions of a program.
    fn change(
        &mut self,
        program: ProgramId,
        mut change: impl FnMut(&AlarmDeclaration, Option<&Point>, &mut Condition),
    ) -> Vec<AlarmChange> {
        let mut changes = Vec::new();
        let alarms = self.alarms.iter().zip(&self.points).zip(&mut self.conditions).enumerate();
        for (index, ((alarm, point), condition)) in alarms {
            if alarm.program != program {
                continue;
            }
            let before = condition.active;
            change(alarm, point.as_ref(), condition);
            let active = condition.active;
            if active == before {
                continue;
            }
            let lasts = &mut self.lasting[index];
            let transition = match active {
                Some(true) if !*lasts => {
                    Some(AlarmTransition::Raised { since_before: before.is_none() })
                }
                Some(false) if *lasts => Some(AlarmTransition::Over),
                _ => None,
            };
            *lasts = active.unwrap_or(*lasts);
            changes.push(AlarmChange { alarm: index, active, transition });
        }
        changes
    }
}

#[cfg(test)]
mod tests;
