//! What was done to the members and what they reported, as of one cycle: processes, cuts, forces, exclusions, protection.

use std::collections::{BTreeMap, BTreeSet};

use understudy_journal::Process;
use understudy_wire::{
    Force, Member, ProgramHash, ProgramId, ProgramSet, SignalPlace, StationId, StationSet,
};

use crate::online_change::{ChangeReport, ChangeStanding};
use crate::protection::{LostState, Protection};
use crate::station::StationStanding;

/// A force in effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ForcedSignal {
    pub(crate) force: Force,
    /// The version of the program whose point it is.
    pub(crate) points: ProgramHash,
    /// The cycle in which it was given.
    pub(crate) since: i64,
}

/// Standing of a program at its remote I/O, from the records up to a cycle.
#[derive(Debug, Clone, Default)]
pub(crate) struct ProgramStanding {
    pub(crate) awaits_release: bool,
    pub(crate) forced: Vec<ForcedSignal>,
    /// Whether signals of other programs are valid, by the first bit of their inputs; those that its remote I/O has reported.
    pub(crate) validity: BTreeMap<u16, bool>,
    /// Inputs that two modules read and that differ, by their first bits, with the remote I/O whose module is excluded.
    pub(crate) modules: BTreeMap<u16, Option<Member>>,
    /// Stations whose state of it its remote I/O has found faulty.
    pub(crate) excluded: StationSet,
    pub(crate) protection: Option<Protection>,
    pub(crate) lost: Option<LostState>,
    /// Parts that its simulated plant has finished, and its plant faults.
    pub(crate) plant: Option<(u64, u64)>,
}

/// The standing of all members in a cycle.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standing {
    processes: BTreeMap<Member, Process>,
    cuts: BTreeSet<(Member, Member)>,
    /// Stations that have started cycles since their process began.
    cycle_masters: BTreeSet<StationId>,
    /// Members of a cluster elsewhere whose journal is not received here.
    detached: BTreeSet<Member>,
    /// Members that have reported nothing for a while, whatever their processes do.
    silent: BTreeSet<Member>,
    /// Of programs with two remote I/Os: the one that drives, where that is known.
    authors: BTreeMap<ProgramId, Member>,
    stations: Vec<StationStanding>,
    programs: Vec<ProgramStanding>,
    change: ChangeStanding,
    /// What the scenario came to, where it is over and the cluster stays up.
    pub(crate) scenario_over: Option<String>,
}

impl Standing {
    pub(crate) fn new(stations: usize, programs: usize) -> Self {
        Self {
            stations: vec![StationStanding::default(); stations],
            programs: vec![ProgramStanding::default(); programs],
            ..Self::default()
        }
    }

    /// The process of a member; nothing without a record of it.
    pub(crate) fn process(&self, member: Member) -> Option<Process> {
        self.processes.get(&member).copied()
    }

    pub(crate) fn is_down(&self, member: Member) -> bool {
        self.process(member).is_some_and(Process::is_down)
    }

    /// The members that the frames of a member do not reach.
    pub(crate) fn cut_from(&self, member: Member) -> impl Iterator<Item = Member> {
        let cuts = self.cuts.iter();
        cuts.filter(move |(from, _)| *from == member).map(|(_, to)| *to)
    }

    /// The stations that have started cycles, by rank. A host stall makes another station start a cycle now and then, and the first
    /// living station continues without a record.
    pub(crate) fn cycle_masters(&self) -> impl Iterator<Item = StationId> {
        self.cycle_masters.iter().copied()
    }

    /// Whether the journal of a member is not received.
    pub(crate) fn is_detached(&self, member: Member) -> bool {
        self.detached.contains(&member)
    }

    /// Whether a member executes, as far as is known, and is received here.
    pub(crate) fn reports(&self, member: Member) -> bool {
        let driver = match member {
            Member::RemoteIo(program) => self.driver(program),
            other => other,
        };
        let executes = self.process(driver).is_none_or(Process::is_running);
        executes && !self.is_silent(member) && !self.is_detached(driver)
    }

    /// The remote I/O that drives the outputs of a program, as far as is known.
    pub(crate) fn driver(&self, program: ProgramId) -> Member {
        self.authors.get(&program).copied().unwrap_or(Member::RemoteIo(program))
    }

    /// What is known of online changes.
    pub(crate) fn change(&self) -> &ChangeStanding {
        &self.change
    }

    /// Whether a member has ceased to report.
    pub(crate) fn is_silent(&self, member: Member) -> bool {
        self.silent.contains(&member)
    }

    pub(crate) fn station(&self, station: StationId) -> Option<&StationStanding> {
        self.stations.get(station.index())
    }

    pub(crate) fn program(&self, program: ProgramId) -> Option<&ProgramStanding> {
        self.programs.get(program.index())
    }

    /// The programs whose remote I/O has excluded a station.
    pub(crate) fn excluded_from(&self, station: StationId) -> ProgramSet {
        let programs = (0..).map(ProgramId).zip(&self.programs);
        programs
            .filter(|(_, program)| program.excluded.contains(station))
            .map(|(program, _)| program)
            .collect()
    }

    pub(super) fn apply(&mut self, change: &Change, cycle: i64) {
        match change {
            Change::Process(member, process) => self.process_changed(*member, *process),
            Change::Resumed(member) => {
                self.processes.insert(*member, Process::Running);
            }
            Change::Alive(member) => {
                self.processes.entry(*member).or_insert(Process::Running);
            }
            Change::Cut(from, to) => {
                self.cuts.insert((*from, *to));
            }
            Change::Healed(from, to) => {
                self.cuts.remove(&(*from, *to));
            }
            Change::Attached(member) => {
                self.detached.remove(member);
            }
            Change::Detached(member) => {
                self.detached.insert(*member);
            }
            Change::Silent(member) => {
                self.silent.insert(*member);
            }
            Change::Reports(member) => {
                self.silent.remove(member);
            }
            Change::Author(program, member) => {
                self.authors.insert(*program, *member);
                // A new author tells of all that are excluded.
                if let Some(own) = self.programs.get_mut(program.index()) {
                    own.modules.clear();
                }
            }
            Change::BecameCycleMaster(station) => {
                self.cycle_masters.insert(*station);
            }
            Change::Online(report) => self.change.apply(report, cycle),
            Change::ScenarioOver(verdict) => self.scenario_over = Some(verdict.clone()),
            Change::Station(station, change) => {
                if let Some(own) = self.stations.get_mut(station.index()) {
                    change.apply(own, cycle);
                }
            }
            Change::Program(program, change) => {
                if let Some(own) = self.programs.get_mut(program.index()) {
                    change.apply(own, cycle);
                }
            }
        }
    }

    /// The process of a member begins or ends: its reports and the commands to it are void.
    fn process_changed(&mut self, member: Member, process: Process) {
        self.processes.insert(member, process);
        self.silent.remove(&member);
        if process == Process::Running {
            self.change.begins_anew(member);
        }
        match member {
            Member::Station(station) => {
                self.cycle_masters.remove(&station);
                if let Some(own) = self.stations.get_mut(station.index())
                    && process == Process::Running
                {
                    own.begin();
                }
            }
            Member::RemoteIo(program) | Member::Twin(program)
                if process != Process::Suspended && self.driver(program) == member =>
            {
                if let Some(own) = self.programs.get_mut(program.index()) {
                    *own = ProgramStanding { plant: own.plant, ..ProgramStanding::default() };
                }
                for station in &mut self.stations {
                    station.flagged_by.remove(program);
                }
            }
            _ => {}
        }
    }

    pub(super) fn shift(&mut self, by: i64) {
        self.change.shift(by);
        for station in &mut self.stations {
            for (_, cycle) in [&mut station.done, &mut station.silenced].into_iter().flatten() {
                *cycle = cycle.saturating_add(by);
            }
        }
        for program in &mut self.programs {
            program.forced.iter_mut().for_each(|forced| shift(Some(&mut forced.since), by));
            shift(program.protection.as_mut().map(|of| &mut of.since), by);
            shift(program.lost.as_mut().map(|of| &mut of.since), by);
        }
    }
}

fn shift(since: Option<&mut i64>, by: i64) {
    if let Some(since) = since {
        *since = since.saturating_add(by);
    }
}

/// A change of the standing.
#[derive(Debug, Clone)]
pub(super) enum Change {
    /// The process begins anew, ends or is suspended.
    Process(Member, Process),
    /// A suspended process continues.
    Resumed(Member),
    /// A record of the member itself.
    Alive(Member),
    Cut(Member, Member),
    Healed(Member, Member),
    Attached(Member),
    Detached(Member),
    /// It has reported nothing for a while.
    Silent(Member),
    /// It reports again.
    Reports(Member),
    BecameCycleMaster(StationId),
    /// One of two remote I/Os drives from now on.
    Author(ProgramId, Member),
    /// Something of an online change.
    Online(ChangeReport),
    ScenarioOver(String),
    Station(StationId, StationChange),
    Program(ProgramId, ProgramChange),
}

impl Change {
    /// Whether a member has reported it; otherwise it was done to a member, or is known here only.
    pub(super) fn is_report(&self) -> bool {
        match self {
            Self::Process(..)
            | Self::Resumed(_)
            | Self::Cut(..)
            | Self::Healed(..)
            | Self::Attached(_)
            | Self::Detached(_)
            | Self::Silent(_)
            | Self::Reports(_)
            | Self::Online(ChangeReport::Loaded(_) | ChangeReport::Given { .. })
            | Self::ScenarioOver(_)
            | Self::Station(_, StationChange::Done { .. }) => false,
            Self::Alive(_)
            | Self::BecameCycleMaster(_)
            | Self::Author(..)
            | Self::Online(ChangeReport::Configured(..))
            | Self::Station(..)
            | Self::Program(..) => true,
        }
    }
}

/// A change of a station.
#[derive(Debug, Clone)]
pub(super) enum StationChange {
    Joins,
    Adopted(ProgramId),
    Published,
    Received,
    Refused,
    Flagged(ProgramId),
    Cleared(ProgramId),
    /// Something was done to it; whether it may be silent since, where that changes.
    Done {
        text: String,
        silences: Option<bool>,
    },
}

impl StationChange {
    fn apply(&self, own: &mut StationStanding, cycle: i64) {
        match self {
            Self::Joins => own.joining = true,
            Self::Adopted(program) => own.shadow.insert(*program),
            Self::Published => {
                own.took_turns = true;
                own.joining = false;
                own.shadow = ProgramSet::EMPTY;
            }
            Self::Received => {
                own.took_turns = true;
                own.joining = false;
                own.refused = false;
            }
            Self::Refused => own.refused = true,
            Self::Flagged(by) => own.flagged_by.insert(*by),
            Self::Cleared(by) => own.flagged_by.remove(*by),
            Self::Done { text, silences } => {
                own.done = Some((text.clone(), cycle));
                match silences {
                    Some(true) => own.silenced.clone_from(&own.done),
                    Some(false) => own.silenced = None,
                    None => {}
                }
            }
        }
    }
}

/// A change of a program at its remote I/O.
#[derive(Debug, Clone)]
pub(super) enum ProgramChange {
    Started {
        awaits_release: bool,
    },
    Released,
    Excluded(StationSet),
    Readmitted(StationId),
    /// Other points count: what was said of places is void.
    Points,
    Forced(Force, ProgramHash),
    Unforced(SignalPlace),
    Validity(u16, bool),
    /// The modules of an input agree.
    ModulesAgree(u16),
    /// They differ, and the one of this remote I/O is excluded where one is.
    ModulesDiffer(u16, Option<Member>),
    Protection(Box<Protection>),
    Lost(Option<Box<LostState>>),
    Plant {
        finished: u64,
        plant_faults: u64,
    },
}

impl ProgramChange {
    fn apply(&self, own: &mut ProgramStanding, cycle: i64) {
        match self {
            Self::Started { awaits_release } => {
                own.awaits_release = *awaits_release;
                own.excluded = StationSet::EMPTY;
            }
            Self::Released => {
                own.awaits_release = false;
                own.excluded = StationSet::EMPTY;
            }
            Self::Excluded(stations) => own.excluded = own.excluded.or(*stations),
            Self::Readmitted(station) => own.excluded.remove(*station),
            Self::Points => {
                own.forced.clear();
                own.validity.clear();
                own.modules.clear();
            }
            Self::Forced(force, points) => {
                own.forced.retain(|other| other.force.signal != force.signal);
                let (force, points) = (force.clone(), *points);
                own.forced.push(ForcedSignal { force, points, since: cycle });
            }
            Self::Unforced(signal) => own.forced.retain(|other| other.force.signal != *signal),
            Self::Validity(input, valid) => {
                own.validity.insert(*input, *valid);
            }
            Self::ModulesAgree(input) => {
                own.modules.remove(input);
            }
            Self::ModulesDiffer(input, excluded) => {
                own.modules.insert(*input, *excluded);
            }
            Self::Protection(protection) => own.protection = Some(protection.as_ref().clone()),
            Self::Lost(lost) => own.lost = lost.as_deref().cloned(),
            Self::Plant { finished, plant_faults } => own.plant = Some((*finished, *plant_faults)),
        }
    }

    pub(super) fn shift(&mut self, by: i64) {
        match self {
            Self::Protection(protection) => shift(Some(&mut protection.since), by),
            Self::Lost(lost) => shift(lost.as_mut().map(|lost| &mut lost.since), by),
            _ => {}
        }
    }
}
