//! What each event adds to the account.

use understudy_journal::{Command, RunEvent};
use understudy_node::Event as StationEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_simulator::Action;
use understudy_wire::{
    Force, Image, Member, Moment, OrderRefusal, Part, ProgramId, ProgramSet, Source, StationId,
    Time,
};

use super::service::Outcome;
use super::{
    Account, Death, DoneForce, DoneStep, LAG_CYCLES, MAXIMUM_DEATHS, MAXIMUM_FORCES, Start,
};

impl Account {
    pub(super) fn station(&mut self, station: StationId, event: &StationEvent) {
        match event {
            StationEvent::Published { moment, words } => {
                let widest = words.iter().max_by_key(|word| word.mask.len());
                let (Some(word), Some(number)) = (widest, self.numbering.of(*moment)) else {
                    return;
                };
                let programs = self.terms.agreement.schedule.controllers();
                if word.mask == ProgramSet::first(programs)
                    && self.terms.agreement.schedule.is_understudy(station)
                    && let Some(cycle) = self.open_cycle(number)
                {
                    cycle.covering.insert(station);
                    self.look_for_origin(number, *moment);
                }
                if let (Some(at), Some(trace)) =
                    (self.since_origin(number), self.traces.stations.get_mut(station.index()))
                {
                    let mut sum = word.sum.clone();
                    let others = words.iter().filter(|other| other.mask != word.mask);
                    others.for_each(|other| sum.add(&other.sum));
                    trace.push(at, &sum);
                }
            }
            StationEvent::Holds { moment, program, of, lineage, state } => {
                if let Some(referee) = self.terms.referees.get_mut(program.index()) {
                    referee.holds(*moment, (*of, *lineage), state);
                }
            }
            StationEvent::Refused { member, theirs, ours } => {
                self.refuse(*member, theirs.to_string(), ours.to_string());
            }
            _ => {}
        }
    }

    pub(super) fn remote_io(
        &mut self,
        member: Member,
        program: ProgramId,
        at: Time,
        event: &RemoteIoEvent,
    ) {
        let violation = self
            .terms
            .referees
            .get_mut(program.index())
            .and_then(|referee| referee.observe_from(member, at, event).err());
        // The records of the last samples of the other one may be missing, as after a restart.
        if let RemoteIoEvent::PartChanged { part: Part::Author, .. } = event
            && let Some(referee) = self.terms.referees.get_mut(program.index())
        {
            referee.starts_again();
        }
        if let RemoteIoEvent::Sampled { moment, inputs, .. } = event {
            self.sampled(program, *moment, inputs);
        }
        let RemoteIoEvent::Applied { moment, source, missing, heard, .. } = event else {
            let changes = self.alarms.fold.remote_io(member, program, 0, event);
            self.alarms_changed(&changes, None);
            self.order_decided(program, event);
            self.started(program, event);
            if let RemoteIoEvent::Refused { member, theirs, ours } = event {
                self.refuse(*member, theirs.to_string(), ours.to_string());
            }
            if let Some(violation) = violation {
                self.violate(program, self.numbering.latest(), violation);
            }
            return;
        };
        let idle = *missing == Some(Missing::NoCycle);
        let number = self.numbering.deadline(program, *moment, idle);
        let changes = self.alarms.fold.remote_io(member, program, number, event);
        self.alarms_changed(&changes, Some(number));
        let outcome = Outcome { source: *source, wrong: violation.is_some() };
        if let Some(violation) = violation {
            self.violate(program, Some(number), violation);
        }
        let expected = self.terms.agreement.schedule.expected();
        let Some(cycle) = self.open_cycle(number) else {
            return;
        };
        cycle.outcomes.insert(program, outcome);
        if !idle {
            cycle.heard = cycle.heard.or(*heard);
            if *source == Source::Direct && expected.without(*heard).is_empty() {
                cycle.content.insert(program);
            }
        }
        self.look_for_origin(number, *moment);
        while self.open.len() > LAG_CYCLES && self.oldest_is_told() {
            self.close_oldest();
        }
    }

    /// The start of a program, after an outage among others.
    fn started(&mut self, program: ProgramId, event: &RemoteIoEvent) {
        let (born, warm) = match event {
            RemoteIoEvent::StartedWarm { born, lost, .. } => (*born, Some(*lost)),
            RemoteIoEvent::StartedCold { born, .. } => (*born, None),
            _ => return,
        };
        let number = self.numbering.of(born).or_else(|| self.numbering.latest());
        let cycle = number.and_then(|number| self.since_origin(number));
        self.outages.started(Start { program, cycle, warm });
    }

    /// Forces, and orders that were refused.
    fn order_decided(&mut self, program: ProgramId, event: &RemoteIoEvent) {
        let next = self.next_cycle();
        match event {
            RemoteIoEvent::ChoiceRefused { refusal, .. } => {
                let asked = self.steps.iter_mut().rev().find(|step| {
                    step.member.sampled_program() == Some(program)
                        && matches!(step.action, Action::Choose { .. } | Action::Release)
                });
                if let Some(step) = asked {
                    step.refused = Some(*refusal);
                }
            }
            RemoteIoEvent::Forced { force, .. } => self.forced(program, force, next, None),
            RemoteIoEvent::ForceRefused { force, refusal, .. } => {
                self.forced(program, force, next, Some(*refusal));
            }
            RemoteIoEvent::Unforced { signal, .. } => {
                self.end_forces(next, |of| of.program == program && of.force.signal == *signal);
            }
            _ => {}
        }
    }

    fn forced(
        &mut self,
        program: ProgramId,
        force: &Force,
        from: Option<u64>,
        refused: Option<OrderRefusal>,
    ) {
        if refused.is_none() {
            // A new one of the same signal takes its place.
            self.end_forces(from, |of| of.program == program && of.force.signal == force.signal);
        }
        self.force_count += 1;
        if self.forces.len() < MAXIMUM_FORCES {
            let signal = self.terms.present.members().signal(program, force.signal).cloned();
            let (force, to) = (force.clone(), None);
            self.forces.push(DoneForce { program, force, signal, from, to, refused });
        }
    }

    /// Forces end with the process of their remote I/O.
    fn forces_of_ended(&mut self, member: Member, action: Action, cycle: u64) {
        if action == Action::Crash {
            self.networks.is_new(member, Some(cycle));
        }
        if let (Some(program), Action::Crash) = (member.sampled_program(), action) {
            self.end_forces(Some(cycle), |of| of.program == program);
        }
    }

    fn end_forces(&mut self, to: Option<u64>, is_over: impl Fn(&DoneForce) -> bool) {
        let lasting = |of: &&mut DoneForce| of.to.is_none() && of.refused.is_none();
        for force in self.forces.iter_mut().filter(lasting).filter(|of| is_over(of)) {
            // One that was over before the origin lasted no cycle.
            force.to = Some(to.unwrap_or(0));
        }
    }

    /// u(i) of a program with inputs that do not come from the field.
    fn sampled(&mut self, program: ProgramId, moment: Moment, inputs: &Image) {
        let at = self.numbering.of(moment).and_then(|number| self.since_origin(number));
        let signals = self.terms.signals.get(program.index());
        if let Some(at) = at.filter(|at| *at < self.cycles)
            && signals.is_some_and(|signals| signals.sourced)
            && let Some(trace) = self.traces.plants.get_mut(program.index())
        {
            trace.sensors.push(at, inputs);
        }
    }

    pub(super) fn plant(&mut self, program: ProgramId, event: &understudy_plant::Event) {
        let understudy_plant::Event::Stepped { moment, field, .. } = event else {
            return;
        };
        self.starting_plants.remove(program);
        if let Some(referee) = self.terms.referees.get_mut(program.index()) {
            referee.saw(&field.sensors);
        }
        let at = self.numbering.of(*moment).and_then(|number| self.since_origin(number));
        let within = at.is_some_and(|at| at < self.cycles);
        if let Some(service) = self.services.get_mut(program.index())
            && (at.is_none() || within)
        {
            service.field(field, within);
        }
        if let (Some(at), Some(trace)) = (at, self.traces.plants.get_mut(program.index()))
            && within
        {
            trace.positions.push(at, &field.positions.to_vec());
            if !self.terms.signals[program.index()].sourced {
                trace.sensors.push(at, &field.sensors);
            }
        }
    }

    pub(super) fn run(&mut self, event: &RunEvent) {
        match event {
            RunEvent::Fault { action, member, asked } => {
                if let (
                    Member::RemoteIo(program) | Member::Twin(program),
                    Action::Release | Action::Choose { .. },
                ) = (*member, *action)
                    && let Some(referee) = self.terms.referees.get_mut(program.index())
                {
                    referee.operator_chooses();
                }
                let measured = self.disturb(*member, *action).unwrap_or(0);
                self.steps.push(DoneStep {
                    action: *action,
                    member: *member,
                    asked: *asked,
                    measured,
                    refused: None,
                });
                self.forces_of_ended(*member, *action, measured);
            }
            RunEvent::Ended { member, how, said } => {
                let cycle = self.disturb(*member, Action::Crash);
                self.forces_of_ended(*member, Action::Crash, cycle.unwrap_or(0));
                self.death_count += 1;
                if self.deaths.len() < MAXIMUM_DEATHS {
                    self.deaths.push(Death {
                        member: *member,
                        cycle,
                        how: how.clone(),
                        said: said.clone(),
                    });
                }
            }
            RunEvent::Commanded {
                member: Member::RemoteIo(program) | Member::Twin(program),
                command: Command::Write(write),
                ..
            } => {
                if let Some(referee) = self.terms.referees.get_mut(program.index()) {
                    referee.asked(write.input, write.value);
                }
            }
            RunEvent::Commanded { .. } | RunEvent::CommandRefused(_) => {}
            RunEvent::Interrupted => {
                self.interrupted = true;
                // The newest cycle may be cut off for some: it is none of the run any more.
                let newest = self.numbering.latest();
                let told = newest.and_then(|newest| self.since_origin(newest));
                self.cycles = self.cycles.min(told.unwrap_or(0));
            }
            RunEvent::Journal { .. }
            | RunEvent::ChangeLoaded { .. }
            | RunEvent::Checkpoint { .. }
            | RunEvent::Continues(_)
            | RunEvent::InEffect { .. }
            | RunEvent::Started { .. }
            | RunEvent::Origin { .. }
            | RunEvent::Acknowledged(_)
            | RunEvent::Shelved(_)
            | RunEvent::Unshelved(_)
            | RunEvent::Attached { .. }
            | RunEvent::Detached { .. }
            | RunEvent::ScenarioOver { .. }
            | RunEvent::Finished => {}
        }
    }
}
