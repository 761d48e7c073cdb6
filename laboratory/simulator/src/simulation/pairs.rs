//! Two remote I/Os of one program.

use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_remote_io::{PairSettings, RemoteIo, Settings};
use understudy_wire::{Member, Part, ProgramId, ProgramSet, StateChoice};

use super::{Observe, Record, Simulation};
use crate::fault::{Action, Fault};
use crate::referee::Violation;
use crate::slot::Slot;

/// The settings of the second remote I/O of a program; nothing where it has none.
pub(super) fn twin_of(settings: &Settings) -> Option<Settings> {
    let pair = PairSettings { is_twin: true, ..settings.pair? };
    Some(Settings { pair: Some(pair), ..settings.clone() })
}

impl Simulation {
    pub(super) fn remote_io_slot(&mut self, member: Member) -> Option<&mut Slot<RemoteIo>> {
        match member {
            Member::RemoteIo(program) => self.remote_ios.get_mut(program.index()),
            Member::Twin(program) => self.twins.get_mut(program.index())?.as_mut(),
            Member::Station(_) | Member::Plant(_) => None,
        }
    }

    /// A remote I/O that runs.
    pub(super) fn running_remote_io(&self, member: Member) -> Option<&RemoteIo> {
        match member {
            Member::RemoteIo(program) => self.remote_ios.get(program.index())?.running(),
            Member::Twin(program) => self.twins.get(program.index())?.as_ref()?.running(),
            Member::Station(_) | Member::Plant(_) => None,
        }
    }

    fn remote_ios_of(&self, program: ProgramId) -> impl Iterator<Item = (Member, &RemoteIo)> {
        let members = [Member::RemoteIo(program), Member::Twin(program)];
        members.into_iter().filter_map(|member| Some((member, self.running_remote_io(member)?)))
    }

    /// The remote I/O that samples and drives; nothing where none does.
    pub fn author(&self, program: ProgramId) -> Option<Member> {
        let is_author = |part: Option<Part>| part.is_none_or(|part| part == Part::Author);
        let mut authors = self.remote_ios_of(program).filter(|(_, it)| is_author(it.part()));
        authors.next().map(|(member, _)| member)
    }

    /// The remote I/O of a program that asks the operator for the state to continue from.
    pub(super) fn asking_member(&self, program: ProgramId) -> Option<Member> {
        let mut asking = self.remote_ios_of(program).filter(|(_, it)| it.asks_operator());
        asking.next().map(|(member, _)| member)
    }

    /// Programs of which the operator has to choose the state that they continue from.
    pub fn asking(&self) -> ProgramSet {
        let programs = (0..self.remote_ios.len()).map(|index| ProgramId(index as u8));
        programs.filter(|program| self.asking_member(*program).is_some()).collect()
    }

    /// Lets the operator answer where a state is lost, now: the newest available state, or a cold start where no station holds one.
    pub fn let_operator_choose(&mut self) {
        let choices = [StateChoice::Newest { cycle: None }, StateChoice::Cold];
        for (program, choice) in self.asking().iter().flat_map(|it| choices.map(|one| (it, one))) {
            // The second one is refused where the first was taken.
            self.schedule(Fault {
                at_cycle: 0,
                phase: 0.0,
                member: self.asking_member(program).unwrap_or(Member::RemoteIo(program)),
                action: Action::Choose { choice },
            });
        }
    }

    /// One author at a time: each drives once in a period, so two that drive within half of one are two.
    pub(super) fn note_driver(
        &mut self,
        member: Member,
        program: ProgramId,
        observe: &mut Observe<'_>,
    ) {
        if self.twins[program.index()].is_none() {
            return;
        }
        let last = self.driven_by[program.index()].replace((member, self.now));
        let Some((other, at)) = last.filter(|(other, _)| *other != member) else {
            return;
        };
        if self.now.since(at) < self.period() / 2 {
            let moment = self.referees[program.index()].truth().map(|(moment, _)| moment);
            let violation = Violation::TwoWriters { moment: moment.unwrap_or_default() };
            observe(self.now, self.pace.cycle(), other, Record::Violation(&violation));
            self.violations.push(violation);
        }
    }

    pub(super) fn poll_remote_io(
        &mut self,
        member: Member,
    ) -> Option<Output<understudy_remote_io::Event>> {
        self.remote_io_slot(member)?.machine()?.poll_output()
    }

    pub(super) fn show_field(&mut self, program: ProgramId) {
        if let Some(field) = self.plants.field(program) {
            let slot = &mut self.remote_ios[program.index()];
            let sensors = RemoteIoInput::Field(&field.sensors);
            slot.give(self.now, Input::RemoteIo(sensors));
            self.wakeups.set(Member::RemoteIo(program), slot.due());
            if let Some(twin) = &mut self.twins[program.index()] {
                twin.give(self.now, Input::RemoteIo(sensors));
                self.wakeups.set(Member::Twin(program), twin.due());
            }
        }
    }
}
