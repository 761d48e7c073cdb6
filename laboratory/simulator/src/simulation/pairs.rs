//! Two remote I/Os of one program.

use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_remote_io::{Event, PairSettings, RemoteIo, Settings};
use understudy_wire::{Image, Member, Moment, Part, ProgramId, ProgramSet, StateChoice};

use super::{Observe, Record, Simulation};
use crate::fault::{Action, Fault};
use crate::modules::Wrong;
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

    pub(super) fn drive_plant(
        &mut self,
        program: ProgramId,
        outputs: &Image,
        observe: &mut Observe<'_>,
    ) {
        self.plants.drive(program, outputs);
        if let Some(field) = self.plants.field(program) {
            let plant = Member::Plant(program);
            observe(self.now, self.pace.cycle(), plant, Record::Plant(outputs, field));
        }
        self.show_field(program);
    }

    /// Modules next to those of the author drive what the author has driven lately, or nothing.
    pub(super) fn follow(
        &mut self,
        member: Member,
        program: ProgramId,
        outputs: &Image,
        observe: &mut Observe<'_>,
    ) {
        let (actuators, wrong) = self.modules[program.index()].follow(self.now, member, outputs);
        let moment = self.newest_sample(program);
        let violation = wrong.map(|wrong| match wrong {
            Wrong::NotOfAuthor => Violation::NotFollowed { moment, driven: outputs.clone() },
            Wrong::TooMuch => Violation::TooMuch { moment },
        });
        if let Some(violation) = violation {
            observe(self.now, self.pace.cycle(), member, Record::Violation(&violation));
            self.violations.push(violation);
        }
        if let Some(actuators) = actuators {
            self.drive_plant(program, &actuators, observe);
        }
    }

    /// Takes an event of a remote I/O: whether the modules of both drive more than it has decided.
    pub(super) fn judge_sum(&mut self, program: ProgramId, event: &Event) -> Option<Violation> {
        let is_too_much = self.modules[program.index()].decided(self.now, event.driven()?);
        is_too_much.then(|| Violation::TooMuch { moment: self.newest_sample(program) })
    }

    /// The cycle of the newest sample of a program that was judged.
    fn newest_sample(&self, program: ProgramId) -> Moment {
        let truth = self.referees[program.index()].truth();
        truth.map(|(moment, _)| moment).unwrap_or_default()
    }

    /// An input module of one of two remote I/Os shows a fixed value of an input from now on; the true one again with `None`.
    pub(super) fn stick_input(&mut self, member: Member, input: u16, value: Option<bool>) {
        let width =
            |program: ProgramId| self.parts.remote_ios[program.index()].layout.input_width();
        let there = member.sampled_program().filter(|it| usize::from(input) < width(*it));
        if let Some(program) = there {
            self.modules[program.index()].stick(member, usize::from(input), value);
            self.show_field(program);
        }
    }

    /// Takes an event of a remote I/O: what should have been reported of the input modules of its program.
    pub(super) fn judge_inputs(
        &mut self,
        member: Member,
        program: ProgramId,
        event: &Event,
    ) -> Option<Violation> {
        let reports = self.input_reports[program.index()].as_mut()?;
        let field = self.plants.field(program)?;
        let modules = &self.modules[program.index()];
        let shown = [Member::RemoteIo(program), Member::Twin(program)]
            .map(|member| modules.shown(member, &field.sensors));
        let paired = &self.parts.remote_ios[program.index()].paired_inputs;
        let input = reports.note(paired, member, event, shown.each_ref().map(AsRef::as_ref))?;
        let moment = self.referees[program.index()].truth().map(|(moment, _)| moment);
        Some(Violation::InputsNotReported { moment: moment.unwrap_or_default(), input })
    }

    pub(super) fn show_field(&mut self, program: ProgramId) {
        let Some(field) = self.plants.field(program) else {
            return;
        };
        let modules = &self.modules[program.index()];
        for member in [Member::RemoteIo(program), Member::Twin(program)] {
            let sensors = modules.shown(member, &field.sensors);
            let slot = match member {
                Member::Twin(_) => self.twins[program.index()].as_mut(),
                _ => Some(&mut self.remote_ios[program.index()]),
            };
            if let Some(slot) = slot {
                slot.give(self.now, Input::RemoteIo(RemoteIoInput::Field(&sensors)));
                self.wakeups.set(member, slot.due());
            }
        }
    }
}
