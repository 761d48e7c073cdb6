//! What the members keep on their disks.

use std::collections::BTreeMap;
use std::sync::Arc;

use understudy_cycle::OnlineChange;
use understudy_node::{Settings, Station};
use understudy_remote_io::RemoteIo;
use understudy_wire::{
    Configurations, Member, Note, ProgramId, ProgramSet, Retained, RetainedRun, StationId, Time,
};

/// Steps after which a station keeps the whole state again.
const RETAIN_EVERY: u32 = 8;

/// The disks of all members; they outlive the members.
#[derive(Debug, Clone, Hash)]
pub(crate) struct Disks {
    stations: Vec<Vec<RetainedRun>>,
    remote_ios: Vec<Option<Note>>,
    twins: Vec<Option<Note>>,
    /// Remote I/Os whose notes cannot be read.
    damaged: ProgramSet,
    /// Remote I/Os whose disks take nothing.
    read_only: ProgramSet,
    /// The configurations of members that have loaded an online change.
    changed: BTreeMap<Member, Configurations>,
}

impl Disks {
    pub(crate) fn new(stations: usize, remote_ios: usize) -> Self {
        Self {
            stations: vec![Vec::new(); stations],
            remote_ios: vec![None; remote_ios],
            twins: vec![None; remote_ios],
            damaged: ProgramSet::EMPTY,
            read_only: ProgramSet::EMPTY,
            changed: BTreeMap::new(),
        }
    }

    /// A station that starts with what its disk has.
    pub(crate) fn station(
        &self,
        now: Time,
        settings: Settings,
        change: Option<&Arc<OnlineChange>>,
    ) -> Station {
        let station = settings.station;
        let mut machine = Station::new(now, settings);
        if let Some((change, configurations)) = self.changed_of(Member::Station(station), change) {
            machine = machine.changed(change, configurations);
        }
        machine.retaining(RETAIN_EVERY, &self.stations[station.index()])
    }

    fn changed_of<'c>(
        &self,
        member: Member,
        change: Option<&'c Arc<OnlineChange>>,
    ) -> Option<(&'c Arc<OnlineChange>, Configurations)> {
        Some((change?, *self.changed.get(&member)?))
    }

    /// A member keeps what it knows of an online change.
    pub(crate) fn configure(&mut self, member: Member, configurations: Configurations) {
        self.changed.insert(member, configurations);
    }

    /// A remote I/O that starts with what its disk has.
    pub(crate) fn remote_io(
        &self,
        now: Time,
        settings: understudy_remote_io::Settings,
        change: Option<&Arc<OnlineChange>>,
    ) -> RemoteIo {
        let program = settings.program;
        let is_twin = settings.pair.is_some_and(|pair| pair.is_twin);
        let notes = if is_twin { &self.twins } else { &self.remote_ios };
        let note = notes[program.index()].clone();
        let is_damaged = !is_twin && self.damaged.contains(program);
        let member = if is_twin { Member::Twin(program) } else { Member::RemoteIo(program) };
        let mut machine = RemoteIo::new(now, settings);
        if let Some((change, configurations)) = self.changed_of(member, change) {
            machine = machine.changed(change, configurations);
        }
        machine.noting(note, is_damaged)
    }

    /// A member keeps a record.
    pub(crate) fn write(&mut self, member: Member, record: Retained) {
        match (member, record) {
            (Member::Station(station), Retained::State(state)) => {
                let runs = &mut self.stations[station.index()];
                // Two files in turn: that of the state before stays as it is.
                let of_it = |run: &RetainedRun| run.state.program == state.program;
                if runs.iter().filter(|run| of_it(run)).count() == 2
                    && let Some(oldest) = runs.iter().position(of_it)
                {
                    runs.remove(oldest);
                }
                runs.push(RetainedRun::from(state));
            }
            (Member::Station(station), Retained::Step(step)) => {
                let runs = &mut self.stations[station.index()];
                if let Some(run) = runs.iter_mut().rfind(|run| run.state.program == step.program) {
                    run.steps.push(step);
                }
            }
            (Member::RemoteIo(program), _) if self.read_only.contains(program) => {}
            (Member::RemoteIo(program), Retained::Note(note)) => {
                self.remote_ios[program.index()] = Some(note);
                self.damaged.remove(program);
            }
            (Member::Twin(program), Retained::Note(note)) => {
                self.twins[program.index()] = Some(note);
            }
            _ => {}
        }
    }

    /// The notes of a remote I/O cannot be read any more.
    pub(crate) fn damage(&mut self, program: ProgramId) {
        self.remote_ios[program.index()] = None;
        self.damaged.insert(program);
    }

    /// From now on the disk of a remote I/O takes nothing.
    pub(crate) fn write_protect(&mut self, program: ProgramId) {
        self.read_only.insert(program);
    }

    /// A station gets another disk, with nothing on it.
    pub(crate) fn empty(&mut self, station: StationId) {
        self.stations[station.index()].clear();
    }

    /// The last `steps` of each program that a station kept are not on its disk.
    pub(crate) fn lose(&mut self, station: StationId, steps: usize) {
        for run in &mut self.stations[station.index()] {
            run.steps.truncate(run.steps.len().saturating_sub(steps));
        }
    }
}
