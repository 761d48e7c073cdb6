//! The points of each program that count, record by record: the names, types and places of what is reported of its inputs and outputs.
//!
//! ```text
//!   start of the process of a remote I/O   those of its cluster file: of the run, or of the version that `points` names
//!   points-changed                         those of the version `to`, for all records of the remote I/O after it
//!   applied with `points`                  those of that version: a reader that begins in the middle knows them from here on
//! ```
//!
//! Invariant: a name is given to a bit only by the points of the version that its record has. Of a version that is not known here, nothing has a name.

use std::sync::Arc;

use understudy_bus::HostEvent;
use understudy_cluster::{Cluster, Controller, OnlineChanges, RemoteIo as RemoteIoPlace};
use understudy_cycle::OnlineChange;
use understudy_remote_io::Event as RemoteIo;
use understudy_simulator::Action;
use understudy_wire::{Member, ProgramHash, ProgramId};

use crate::members::Members;
use crate::record::{Happening, Record, RunEvent};
use crate::rules::Process;

/// The versions of the programs by whose points a cycle is named.
#[derive(Debug, Clone)]
pub struct PointsInEffect {
    /// The version of each program, in the order of the cluster.
    versions: Vec<ProgramHash>,
    /// The cluster with which the run began, with the programs of these versions; without inputs and outputs of one that is not known.
    cluster: Arc<Cluster>,
}

/// By the versions, of which all else follows in one run.
impl PartialEq for PointsInEffect {
    fn eq(&self, other: &Self) -> bool {
        self.versions == other.versions
    }
}

impl PointsInEffect {
    /// Those of a cluster.
    pub fn of(cluster: Arc<Cluster>) -> Self {
        let versions = cluster.controllers().iter().map(|controller| controller.hash);
        Self { versions: versions.collect(), cluster }
    }

    /// The cluster of the run with these programs, and without inputs and outputs of one that is not known.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// The version of each program, in the order of the cluster.
    pub fn versions(&self) -> &[ProgramHash] {
        &self.versions
    }

    /// A program as its version; nothing where that is not known.
    pub fn controller(&self, program: ProgramId) -> Option<&Controller> {
        let version = self.versions.get(program.index())?;
        let controller = self.cluster.controllers().get(program.index());
        controller.filter(|controller| controller.hash == *version)
    }

    /// The remote I/O of a program; nothing where its version is not known.
    pub fn remote_io(&self, program: ProgramId) -> Option<&RemoteIoPlace> {
        self.controller(program)?;
        self.cluster.remote_ios().get(program.index())
    }
}

/// The points that count after the records that were taken.
#[derive(Debug, Clone)]
pub struct Present {
    changes: OnlineChanges,
    points: PointsInEffect,
    members: Members,
}

/// What a record changes of the points.
#[derive(Debug, Clone)]
pub enum Turn {
    /// Programs may change by this from now on.
    Loaded(Arc<OnlineChange>),
    /// Other points of this program count, for this record and all after it.
    Points(ProgramId),
}

impl Present {
    /// Before the first record of a run of this cluster.
    pub fn of(cluster: Arc<Cluster>) -> Self {
        Self {
            members: Members::of(&cluster),
            changes: OnlineChanges::of(Arc::clone(&cluster)),
            points: PointsInEffect::of(cluster),
        }
    }

    /// Before the first record of the same run.
    #[must_use]
    pub fn again(&self) -> Self {
        Self::of(Arc::clone(self.first()))
    }

    /// Takes the next record, before what it reports is named.
    pub fn take(&mut self, record: &Record) -> Option<Turn> {
        match (&record.event, record.member) {
            (Happening::RemoteIo(event), Some(member)) => {
                let version = match event {
                    RemoteIo::Applied { points, .. } => (*points)?,
                    RemoteIo::PointsChanged { to, .. } => *to,
                    RemoteIo::Points { version } => *version,
                    _ => return None,
                };
                self.turn(member.sampled_program()?, version)
            }
            (Happening::Host(HostEvent::Ready { .. }), Some(member)) => self.begins(member),
            (Happening::Run(event), _) => self.run(event),
            _ => None,
        }
    }

    fn run(&mut self, event: &RunEvent) -> Option<Turn> {
        match event {
            RunEvent::ChangeLoaded { texts } => {
                let change = self.changes.load(texts)?;
                // A version that was not known may be one of it.
                self.lay_out();
                Some(Turn::Loaded(Arc::new(change)))
            }
            RunEvent::Started { member } | RunEvent::Attached { member } => self.begins(*member),
            RunEvent::Fault { action, member, .. }
                if Process::after(*action).is_some_and(Process::is_running)
                    && *action != Action::Continue =>
            {
                self.begins(*member)
            }
            _ => None,
        }
    }

    /// A process begins, or its records do: with the points of the cluster, as far as it says nothing else.
    fn begins(&mut self, member: Member) -> Option<Turn> {
        let program = member.sampled_program()?;
        let first = self.first().controllers().get(program.index())?.hash;
        self.turn(program, first)
    }

    fn turn(&mut self, program: ProgramId, version: ProgramHash) -> Option<Turn> {
        let own = self.points.versions.get_mut(program.index())?;
        let before = std::mem::replace(own, version);
        if before == version {
            return None;
        }
        let of = |version| self.controller_of(program, version);
        let stay = of(before).zip(of(version)).is_some_and(|(old, new)| have_same_points(old, new));
        self.lay_out();
        (!stay).then_some(Turn::Points(program))
    }

    fn lay_out(&mut self) {
        self.points = self.composed(&self.points.versions);
        self.members = Members::of(self.cluster());
    }

    /// The points of these versions, one for each program.
    pub fn with(&self, versions: &[ProgramHash]) -> PointsInEffect {
        if versions == self.points.versions { self.points.clone() } else { self.composed(versions) }
    }

    fn composed(&self, versions: &[ProgramHash]) -> PointsInEffect {
        let mut cluster = Arc::clone(self.first());
        for (program, version) in (0..).map(ProgramId).zip(versions) {
            let own = self.first().controllers().get(program.index()).map(|own| own.hash);
            if Some(*version) != own {
                cluster = Arc::new(match self.changes.cluster_with(program, *version) {
                    Some(of_version) => cluster.with_program_of(of_version, program),
                    None => cluster.without_points_of(program),
                });
            }
        }
        PointsInEffect { versions: versions.to_vec(), cluster }
    }

    /// The cluster with which the run began.
    pub fn first(&self) -> &Arc<Cluster> {
        self.changes.first()
    }

    /// The points that count.
    pub fn points(&self) -> &PointsInEffect {
        &self.points
    }

    /// The cluster of the run with the points that count, and without inputs and outputs of a program whose points are not known.
    pub fn cluster(&self) -> &Arc<Cluster> {
        self.points.cluster()
    }

    /// The members with the signals that count; none of a program whose points are not known.
    pub fn members(&self) -> &Members {
        &self.members
    }

    /// The version of each program whose points count.
    pub fn versions(&self) -> &[ProgramHash] {
        self.points.versions()
    }

    /// A program as the version whose points count; nothing where that is not known.
    pub fn controller(&self, program: ProgramId) -> Option<&Controller> {
        self.points.controller(program)
    }

    /// A program as one of its versions; nothing where that is not known.
    pub fn controller_of(&self, program: ProgramId, version: ProgramHash) -> Option<&Controller> {
        self.changes.controller(program, version)
    }
}

/// Whether two versions of a program have the same inputs and outputs at the same places.
fn have_same_points(old: &Controller, new: &Controller) -> bool {
    let (old, new) = (&old.interface, &new.interface);
    old.inputs.are_laid_out_as(&new.inputs) && old.outputs.are_laid_out_as(&new.outputs)
}
