//! Programs with two remote I/Os: which one drives, whether the other one is there, and whether the input modules of both agree.

use std::collections::BTreeMap;

use understudy_journal::Record;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{Member, Part, ProgramId};

use super::Model;
use super::programs::{FAIL_SAFE, FORCED};
use super::standing::{Change, ProgramChange};
use crate::describe::{CHANGE_TAKEN_BACK, PROGRAM_FAULT, modules_text};
use crate::history::Step;

/// Alarm of an author whose partner is not received.
pub(super) const PARTNER_LOST: &str = "partner-lost";

/// Alarm of inputs whose two modules differ, or of which one is excluded.
pub(super) const INPUT_MODULES: &str = "input-modules";

/// Alarms of a program that its author raises and ends, whichever remote I/O that is.
const OF_THE_AUTHOR: [&str; 6] =
    [CHANGE_TAKEN_BACK, "configuration-disputed", "disputed", FAIL_SAFE, FORCED, PROGRAM_FAULT];

impl Model {
    /// Whether a program has two remote I/Os.
    pub(super) fn is_paired(&self, program: ProgramId) -> bool {
        self.cluster.twins().contains(program)
    }

    /// The remote I/O that drove the outputs of a program at a step; where it reported no deadline, the one that was to drive them.
    pub(crate) fn driver_at(&self, program: ProgramId, step: &Step) -> Member {
        let driven = step.driven.as_ref();
        driven.map_or_else(|| self.standing(step.cycle).driver(program), |driven| driven.by)
    }

    /// The name of the remote I/O that drove the outputs of a program in a cycle, as [`Self::driver_at`].
    pub(super) fn driver_name(&self, program: ProgramId, cycle: i64) -> &str {
        let step = self.deadline(program, cycle);
        let own = step.map(|step| self.driver_at(program, step));
        self.members().name(own.unwrap_or_else(|| self.standing(cycle).driver(program)))
    }

    /// The member as which it reports: both remote I/Os of a program report as one.
    pub(super) fn reported_as(&self, member: Member) -> Member {
        match member.sampled_program() {
            Some(program) if self.changes.now().driver(program) == member => {
                Member::RemoteIo(program)
            }
            _ => member,
        }
    }

    /// Whether an event is one of a follower that says nothing of the program: what it receives, and that it proves nothing.
    pub(super) fn is_of_follower(
        &self,
        member: Member,
        program: ProgramId,
        event: &RemoteIoEvent,
    ) -> bool {
        let is_of_author = matches!(
            event,
            RemoteIoEvent::Flagged { .. }
                | RemoteIoEvent::Cleared { .. }
                | RemoteIoEvent::PartnerLost { .. }
                | RemoteIoEvent::PartnerReceived { .. }
        );
        is_of_author && self.is_paired(program) && self.changes.now().driver(program) != member
    }

    pub(super) fn pair_changed(
        &mut self,
        record: &Record,
        member: Member,
        program: ProgramId,
        cycle: i64,
        event: &RemoteIoEvent,
    ) {
        match event {
            RemoteIoEvent::PartChanged { part: Part::Author, .. } => {
                let before = member.partner().unwrap_or(member);
                let names = [before, member].map(|one| self.present.members().name(one));
                for name in names {
                    self.alarms.all_over(name, &[PARTNER_LOST, INPUT_MODULES], cycle);
                }
                self.alarms.pass_on(names, &OF_THE_AUTHOR);
                self.changes.push(cycle, Change::Author(program, member));
                // Records of the last samples of the other one may be missing.
                if let Some(history) = self.histories.get_mut(program.index()) {
                    history.starts_again();
                }
            }
            RemoteIoEvent::PartnerLost { .. } => {
                let text = self.described(record).text;
                self.alarms.raise((record.name.clone(), PARTNER_LOST), cycle, text);
            }
            RemoteIoEvent::PartnerReceived { .. } => {
                self.alarms.all_over(&record.name, &[PARTNER_LOST], cycle);
            }
            RemoteIoEvent::InputsDiffer { input, .. } => {
                let change = ProgramChange::ModulesDiffer(*input, None);
                self.modules_changed(record, program, cycle, change);
            }
            RemoteIoEvent::InputExcluded { input, at, .. } => {
                let change = ProgramChange::ModulesDiffer(*input, Some(*at));
                self.modules_changed(record, program, cycle, change);
            }
            RemoteIoEvent::InputsAgree { input, .. } => {
                self.modules_changed(record, program, cycle, ProgramChange::ModulesAgree(*input));
            }
            RemoteIoEvent::SecondAuthor { .. } => {
                let text = self.described(record).text;
                self.alarms.occurred((record.name.clone(), "second-author"), cycle, text);
            }
            _ => {}
        }
    }

    /// One alarm names all inputs of a program whose modules are in doubt. One more asks for an acknowledgement again.
    fn modules_changed(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        change: ProgramChange,
    ) {
        let asks_again = !matches!(change, ProgramChange::ModulesAgree(_));
        let by = record.member.unwrap_or(Member::RemoteIo(program));
        self.changes.reported(by, cycle, Change::Program(program, change));
        let subject = (record.name.clone(), INPUT_MODULES);
        let standing = self.changes.now().program(program);
        let inputs = standing.map_or_else(BTreeMap::new, |own| own.modules.clone());
        if inputs.is_empty() {
            return self.alarms.over(&subject, cycle);
        }
        let text = modules_text(record.member, &inputs, self.members());
        self.alarms.replace(subject, cycle, text, asks_again);
    }
}
