//! What a fault does to a member. Links do their own part in [`crate::links`].

use std::collections::VecDeque;
use std::sync::Arc;

use understudy_cycle::{Agreement, ChangeOrder, Input, Machine, Program, RemoteIoInput};
use understudy_wire::{
    ConfigurationHash, Epoch, Frame, Member, Moment, PointsHash, ProgramHash, ProgramId,
    SignalPlace, StationId, Unforce,
};

use super::pairs::twin_of;
use super::{Observe, Record, Simulation};
use crate::fault::{Action, ChangeStep, Fault};
use crate::input_reports::InputReports;
use crate::pace::founds;
use crate::slot::Slot;

impl Simulation {
    pub(super) fn apply(&mut self, fault: &Fault, observe: &mut Observe<'_>) {
        let &Fault { member, action, .. } = fault;
        observe(self.now, self.pace.cycle(), member, Record::Fault(fault));
        self.links.disturb(self.now, member, action);
        if !matches!(action, Action::StickInput { .. } | Action::FreeInput { .. }) {
            self.input_reports.iter_mut().flatten().for_each(InputReports::begin_again);
        }
        let is_there = match member {
            Member::Station(station) => station.index() < self.stations.len(),
            Member::RemoteIo(program) | Member::Plant(program) => {
                program.index() < self.remote_ios.len()
            }
            Member::Twin(_) => self.remote_io_slot(member).is_some(),
        };
        match (member, action) {
            _ if !is_there => {}
            (Member::Plant(program), Action::Crash) => self.plants.crash(program),
            (Member::Plant(_), Action::Restart) => self.restart(member, action),
            (Member::Plant(_), _) => {}
            (
                _,
                Action::Restart
                | Action::RestartMisconfigured
                | Action::RestartWrongProgram
                | Action::RestartInEpoch { .. },
            ) => self.restart(member, action),
            (Member::Station(station), Action::FlipState { program, bit }) => {
                if let Some(machine) = self.stations[station.index()].machine() {
                    machine.flip_state(program, usize::from(bit));
                }
            }
            (_, Action::Change { step }) => self.change(member, step, observe),
            (Member::RemoteIo(program) | Member::Twin(program), Action::Release) => {
                self.referees[program.index()].operator_chooses();
                if let Some(reports) = &mut self.input_reports[program.index()] {
                    reports.release();
                }
                self.give(member, Input::RemoteIo(RemoteIoInput::Release), observe);
            }
            (Member::RemoteIo(program) | Member::Twin(program), Action::Choose { choice }) => {
                self.referees[program.index()].operator_chooses();
                self.give(member, Input::RemoteIo(RemoteIoInput::Choose(choice)), observe);
            }
            (Member::RemoteIo(_) | Member::Twin(_), Action::Set { .. }) => {
                if let Some(force) = action.force(self.points_read(member)) {
                    let force = RemoteIoInput::Force(&force);
                    self.give(member, Input::RemoteIo(force), observe);
                }
            }
            (Member::RemoteIo(_) | Member::Twin(_), Action::Unset { input }) => {
                let (signal, points) = (SignalPlace::Input(input), self.points_read(member));
                let unforce = Unforce { signal, points };
                self.give(member, Input::RemoteIo(RemoteIoInput::Unforce(&unforce)), observe);
            }
            (Member::RemoteIo(_) | Member::Twin(_), Action::StickInput { input, value }) => {
                self.stick_input(member, input, Some(value));
            }
            (Member::RemoteIo(_) | Member::Twin(_), Action::FreeInput { input }) => {
                self.stick_input(member, input, None);
            }
            (Member::RemoteIo(_) | Member::Twin(_), Action::Write { .. }) => {
                if let Some(write) = fault.write(self.points_read(member)) {
                    self.give(member, Input::RemoteIo(RemoteIoInput::Write(&write)), observe);
                }
            }
            (Member::Station(station), _) => {
                if action == Action::Crash {
                    self.note_crash(station);
                    self.spare_ended(station);
                }
                let slot = &mut self.stations[station.index()];
                let waiting = disturb(slot, action);
                self.wakeups.set(member, slot.due());
                self.catch_up(member, waiting, observe);
            }
            (Member::RemoteIo(_) | Member::Twin(_), _) => {
                let Some(slot) = self.remote_io_slot(member) else {
                    return;
                };
                let waiting = disturb(slot, action);
                let due = slot.due();
                self.wakeups.set(member, due);
                self.catch_up(member, waiting, observe);
            }
        }
    }

    /// The points that a person reads in the newest sample before he gives an order to a remote I/O.
    fn points_read(&self, member: Member) -> Option<PointsHash> {
        let referee = self.referees.get(member.sampled_program()?.index())?;
        Some(referee.layout().hash)
    }

    /// An engineer takes a step of the online change at one member.
    fn change(&mut self, member: Member, step: ChangeStep, observe: &mut Observe<'_>) {
        let Some(change) = self.parts.change.clone() else {
            return;
        };
        let changed = |program: ProgramId| change.of(program);
        let name = change.name();
        let order = match (step, member) {
            (ChangeStep::Prepare, _) => Some(ChangeOrder::Prepare(Arc::clone(&change))),
            (ChangeStep::Switch, Member::RemoteIo(program)) => {
                changed(program).map(|it| ChangeOrder::Switch(name, it.after.hash))
            }
            (ChangeStep::SwitchBack, Member::RemoteIo(program)) => {
                changed(program).map(|it| ChangeOrder::Switch(name, it.before.hash))
            }
            (ChangeStep::Switch | ChangeStep::SwitchBack, _) => None,
            (ChangeStep::Accept, _) => Some(ChangeOrder::Run(name, change.after)),
            (ChangeStep::TakeBack, _) => Some(ChangeOrder::Run(name, change.before)),
            (ChangeStep::Forget, _) => Some(ChangeOrder::Forget(name, change.after)),
            (ChangeStep::ForgetNew, _) => Some(ChangeOrder::Forget(name, change.before)),
        };
        if let Some(order) = order {
            self.give(member, Input::Change(&order), observe);
        }
    }

    /// The last `steps` of each program that a station has kept are not on its disk, as where the power fails before they are written.
    pub fn lose_steps(&mut self, station: StationId, steps: usize) {
        self.disks.lose(station, steps);
    }

    /// The notes of a remote I/O cannot be read any more.
    pub fn damage_notes(&mut self, program: ProgramId) {
        self.disks.damage(program);
    }

    /// From now on the disk of a remote I/O takes nothing: its newest note gets old.
    pub fn write_protect(&mut self, program: ProgramId) {
        self.disks.write_protect(program);
    }

    /// A station gets an empty disk.
    pub fn lose_disk(&mut self, station: StationId) {
        self.disks.empty(station);
    }

    fn restart(&mut self, member: Member, action: Action) {
        let agreed = |agreement: &Arc<Agreement>| match action {
            Action::RestartMisconfigured => Arc::new(misconfigured(agreement, number(member))),
            Action::RestartWrongProgram => Arc::new(misconfigured(agreement, 0)),
            _ => Arc::clone(agreement),
        };
        let has_wrong_programs = action == Action::RestartWrongProgram;
        match member {
            Member::Station(station) => {
                self.founded += 1;
                let mut settings = self.parts.stations[station.index()].clone();
                settings.founds = match action {
                    Action::RestartInEpoch { epoch } => {
                        Moment { epoch: Epoch(epoch), ..Moment::default() }
                    }
                    _ => founds(self.parts.stations[0].founds, self.founded),
                };
                settings.agreement = agreed(&settings.agreement);
                if has_wrong_programs {
                    settings.programs = settings.programs.iter().map(wrong_program).collect();
                    settings.generated = None;
                }
                self.unannounced.insert(station);
                if self.stations[station.index()].running().is_some() {
                    self.note_crash(station);
                }
                let slot = &mut self.stations[station.index()];
                slot.restart(self.disks.station(self.now, settings, self.parts.change.as_ref()));
                self.wakeups.set(member, slot.due());
            }
            Member::RemoteIo(program) | Member::Twin(program) => {
                let mut settings = self.parts.remote_ios[program.index()].clone();
                if let (Member::Twin(_), Some(twin)) = (member, twin_of(&settings)) {
                    settings = twin;
                }
                settings.agreement = agreed(&settings.agreement);
                if has_wrong_programs {
                    settings.hash = wrong_hash(settings.hash);
                }
                self.misled.restarts(member, has_wrong_programs);
                let change = self.parts.change.clone();
                let machine = self.disks.remote_io(self.now, settings, change.as_ref());
                let own = machine.configurations().own;
                self.referees[program.index()].starts_with(member, own);
                if let Some(slot) = self.remote_io_slot(member) {
                    slot.restart(machine);
                    let due = slot.due();
                    self.wakeups.set(member, due);
                }
                self.show_field(program);
            }
            Member::Plant(program) => self.plants.restart(program),
        }
    }

    /// Frames that have waited for a member that stood still.
    fn catch_up(
        &mut self,
        member: Member,
        waiting: VecDeque<Arc<Frame>>,
        observe: &mut Observe<'_>,
    ) {
        for frame in waiting {
            self.give(member, Input::Frame(&frame), observe);
        }
    }
}

/// A number that no other member has, above 0.
fn number(member: Member) -> u64 {
    match member {
        Member::Station(station) => (u64::from(station.0) + 1) << 8,
        Member::RemoteIo(program) | Member::Plant(program) => u64::from(program.0) + 1,
        Member::Twin(program) => u64::from(program.0) + 128,
    }
}

/// A program that computes the same from another initial lineage: whatever is applied of it is wrong, as the referee knows the right program.
fn wrong_program(program: &Program) -> Program {
    Program { hash: wrong_hash(program.hash), ..program.clone() }
}

fn wrong_hash(hash: ProgramHash) -> ProgramHash {
    ProgramHash(!hash.0)
}

/// The wrong configuration with this number.
fn misconfigured(agreement: &Agreement, number: u64) -> Agreement {
    Agreement {
        configuration: ConfigurationHash(!agreement.configuration.0 ^ number),
        ..agreement.clone()
    }
}

/// Answers with the frames that have waited for it, where it goes on.
fn disturb<M: Machine>(slot: &mut Slot<M>, action: Action) -> VecDeque<Arc<Frame>> {
    match action {
        Action::Crash => slot.crash(),
        Action::Stop => slot.stop(),
        Action::Continue => return slot.go_on(),
        Action::Slow { by } => slot.slow_down(by),
        _ => {}
    }
    VecDeque::new()
}
