//! Program faults: when a program is stopped by one, and when the operator has released it.

use understudy_cluster::{Cluster, Controller};
use understudy_journal::{Happening, Present, Record, Turn};
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_typed::Fault;
use understudy_wire::{ProgramId, Time};

use crate::describe::program_fault_text;
use crate::history::{History, Sampled};

/// Whether a program fault has stopped a program, as its remote I/O reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Stop {
    #[default]
    Running,
    Stopped,
    /// The operator has released it; its next sample resets it.
    Released,
}

/// What a deadline changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    /// A program fault has occurred; the fault, where the state is known.
    Stopped(Option<Fault>),
    /// The program runs again.
    Running,
}

impl Stop {
    /// A deadline, and the newest sample before it.
    pub(crate) fn decided(
        &mut self,
        missing: Option<Missing>,
        newest: Option<&Sampled>,
    ) -> Option<Change> {
        match missing {
            Some(Missing::ProgramFault) => {
                // After a reset the program may stop again in the same scan.
                let is_new = newest.is_some_and(|sampled| sampled.fault_is_new);
                if *self != Self::Running && !is_new {
                    return None;
                }
                *self = Self::Stopped;
                Some(Change::Stopped(newest.and_then(|sampled| sampled.fault)))
            }
            None if *self != Self::Running => {
                *self = Self::Running;
                Some(Change::Running)
            }
            _ => None,
        }
    }

    /// The operator has released the outputs.
    pub(crate) fn released(&mut self) {
        if *self == Self::Stopped {
            *self = Self::Released;
        }
    }
}

/// The program faults of a run, in the order of its records.
#[derive(Debug, Clone)]
pub(crate) struct Stops {
    /// Of the programs that can stop.
    programs: Vec<(History, Stop)>,
}

/// Cycles of a program that are looked at together.
const CYCLES: usize = 2;

impl Stops {
    pub(crate) fn new(cluster: &Cluster) -> Self {
        let programs = (0..).map(ProgramId).zip(cluster.controllers());
        let stopping = programs.filter(|(_, controller)| controller.can_stop());
        let histories = stopping.filter_map(|(program, _)| History::new(cluster, program, CYCLES));
        Self { programs: histories.map(|history| (history, Stop::Running)).collect() }
    }

    /// Other points count, or may count, from the next record on.
    pub(crate) fn turned(&mut self, turn: &Turn, present: &Present) {
        if let Turn::Loaded(change) = turn {
            for program in change.programs.iter().map(|changed| changed.program) {
                self.may_stop(program, present);
            }
        }
        let mut histories = self.programs.iter_mut().map(|(history, _)| history);
        match turn {
            Turn::Loaded(change) => histories.for_each(|history| history.learn(change)),
            Turn::Points(program) => {
                let version = present.versions().get(program.index());
                let history = histories.find(|history| history.program() == *program);
                if let Some((history, version)) = history.zip(version) {
                    history.lay_out(*version, present.controller(*program).is_some());
                }
            }
        }
    }

    /// A program that could not stop may be replaced by one that can; of its state nothing is known here.
    fn may_stop(&mut self, program: ProgramId, present: &Present) {
        if self.programs.iter().any(|(history, _)| history.program() == program) {
            return;
        }
        if let Some(mut history) = History::new(present.first(), program, CYCLES) {
            history.misses_records();
            self.programs.push((history, Stop::Running));
        }
    }

    /// Takes the next record; the program fault that it shows, in words.
    pub(crate) fn take(&mut self, record: &Record, present: &Present) -> Option<String> {
        let Happening::RemoteIo(event) = &record.event else {
            return None;
        };
        let member = record.member?;
        let program = member.sampled_program()?;
        let mut programs = self.programs.iter_mut();
        let (history, stop) = programs.find(|(history, _)| history.program() == program)?;
        if !fits(present.controller(program), event) {
            return None;
        }
        let _ = history.note(0, member, Time(record.at_ns), event);
        match event {
            RemoteIoEvent::Released { .. } => {
                stop.released();
                None
            }
            RemoteIoEvent::Applied { missing, .. } => {
                let newest = history.steps().back();
                let newest = newest.and_then(|step| step.sampled.as_ref());
                match stop.decided(*missing, newest)? {
                    Change::Stopped(fault) => {
                        let controller = present.controller_of(program, history.running());
                        Some(program_fault_text(controller, fault.as_ref()))
                    }
                    Change::Running => None,
                }
            }
            _ => None,
        }
    }
}

/// Whether the images of a report are as wide as those of the version of its program whose points count: a journal of other programs does not belong to this
/// cluster. Of a version that is not known, any are.
pub(crate) fn fits(version: Option<&Controller>, event: &RemoteIoEvent) -> bool {
    let Some(version) = version else {
        return true;
    };
    let interface = &version.interface;
    let are_inputs = |width| width == interface.inputs.width();
    match event {
        RemoteIoEvent::Sampled { inputs, .. } => are_inputs(inputs.width()),
        RemoteIoEvent::Applied { sampled, outputs, driven, .. } => {
            let sampled = sampled.as_ref();
            let mut outputs = std::iter::once(outputs).chain(driven);
            sampled.is_none_or(|sampled| are_inputs(sampled.width()))
                && outputs.all(|outputs| outputs.width() == interface.outputs.width())
        }
        _ => true,
    }
}
