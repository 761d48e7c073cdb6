//! Program faults: when a program is stopped by one, and when the operator has released it.

use std::sync::Arc;

use understudy_cluster::{Cluster, OnlineChanges};
use understudy_journal::{Happening, Record, RunEvent};
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
    cluster: Arc<Cluster>,
    changes: OnlineChanges,
    /// Of the programs with numbers.
    programs: Vec<(History, Stop)>,
}

/// Cycles of a program that are looked at together.
const CYCLES: usize = 2;

impl Stops {
    pub(crate) fn new(cluster: &Cluster) -> Self {
        let cluster = Arc::new(cluster.clone());
        let changes = OnlineChanges::of(Arc::clone(&cluster));
        Self { programs: Self::begun(&cluster), changes, cluster }
    }

    /// The same before the first record.
    pub(crate) fn again(&self) -> Self {
        Self::new(&self.cluster)
    }

    fn begun(cluster: &Cluster) -> Vec<(History, Stop)> {
        let programs = (0..).map(ProgramId).zip(cluster.controllers());
        let stopping = programs.filter(|(_, controller)| controller.can_stop());
        let histories = stopping.filter_map(|(program, _)| History::new(cluster, program, CYCLES));
        histories.map(|history| (history, Stop::Running)).collect()
    }

    /// Takes the next record; the program fault that it shows, in words.
    pub(crate) fn take(&mut self, record: &Record) -> Option<String> {
        let event = match &record.event {
            Happening::RemoteIo(event) => event,
            Happening::Run(RunEvent::ChangeLoaded { texts }) => {
                let change = Arc::new(self.changes.load(texts)?);
                self.programs.iter_mut().for_each(|(history, _)| history.learn(&change));
                return None;
            }
            _ => return None,
        };
        let member = record.member?;
        let program = member.sampled_program()?;
        let mut programs = self.programs.iter_mut();
        let (history, stop) = programs.find(|(history, _)| history.program() == program)?;
        if !fits(&self.cluster, program, event) {
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
                        let controller = self.changes.controller(program, history.running());
                        Some(program_fault_text(controller, fault.as_ref()))
                    }
                    Change::Running => None,
                }
            }
            _ => None,
        }
    }
}

/// Whether the images of a report are as wide as those of the program: a journal of other programs does not belong to this cluster.
pub(crate) fn fits(cluster: &Cluster, program: ProgramId, event: &RemoteIoEvent) -> bool {
    let Some(controller) = cluster.controllers().get(program.index()) else {
        return false;
    };
    let interface = &controller.interface;
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
