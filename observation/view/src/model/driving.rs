//! Who reports, and whether each remote I/O gives a sign: without it the outputs of its program are driven by no member.

use understudy_journal::Record;
use understudy_wire::{Member, ProgramId, ProgramSet};

use super::Model;
use super::standing::Change;
use crate::describe::program_name;
use crate::event::{Event, Level};

/// The alarm of a remote I/O that drives nothing.
const NOT_DRIVEN: &str = "not-driven";

impl Model {
    /// A member has reported a cycle, and has samples of some programs in it.
    pub(super) fn reported(
        &mut self,
        record: &Record,
        member: Member,
        cycle: i64,
        samples: ProgramSet,
    ) {
        let reported = self.reports.note(member, cycle, samples);
        if reported.is_back {
            self.changes.push(cycle, Change::Reports(member));
        }
        for member in reported.silent {
            let process = self.changes.now().process(member);
            if process.is_none_or(|process| process.is_running()) {
                self.changes.push(cycle, Change::Silent(member));
                self.values_unknown(member, cycle);
            }
        }
        for program in samples.iter() {
            let process = self.changes.now().process(self.changes.now().driver(program));
            if process.is_none_or(|process| process.is_running()) {
                let name = self.members().name(Member::RemoteIo(program)).to_owned();
                // One that was suspended passes the deadline first that it missed.
                let now = self.cycles.latest().map_or(cycle, |latest| latest.max(cycle));
                self.alarms.over(&(name, NOT_DRIVEN), now);
            }
        }
        // Before the origin some members may not have been started yet.
        if self.cycles.has_origin() {
            for program in reported.without_sign {
                self.gives_no_sign(record, program, cycle);
            }
        }
        self.find_complete();
    }

    /// The values at a remote I/O that does not report are not known, and neither are the alarms on them. Both remote I/Os of a program report as the first.
    fn values_unknown(&mut self, member: Member, cycle: i64) {
        if let Member::RemoteIo(program) = member {
            let changes = self.process_alarms.fold.forget(program);
            let name = self.members().name(member).to_owned();
            self.process_alarms_changed(&name, cycle, &changes);
        }
    }

    pub(super) fn find_complete(&mut self) {
        self.reports.find_complete(&self.received);
        // Records in effect are of cycles that nothing was shown of.
        if !self.cycles.is_fixed() {
            self.changes.shown(self.reports.complete());
        }
    }

    /// A remote I/O whose process does not execute drives nothing.
    pub(super) fn not_driven(&mut self, program: ProgramId, cycle: i64, reason: &str) -> String {
        let of = program_name(program, self.members());
        let text = format!("{of}: no remote I/O drives the outputs, because {reason}");
        let name = self.members().name(Member::RemoteIo(program)).to_owned();
        self.alarms.raise_critical((name, NOT_DRIVEN), cycle, text.clone());
        text
    }

    /// No member says whether the outputs are driven, where none of those that execute programs is received.
    pub(super) fn nothing_is_received(&mut self, cycle: i64) {
        let members = self.cluster.members();
        let mut tell = members.filter(|member| {
            !matches!(member, Member::Plant(_)) && !self.cluster.is_spare_slot(*member)
        });
        if !tell.all(|member| self.changes.now().is_detached(member)) {
            return;
        }
        for program in (0..self.cluster.controllers().len() as u8).map(ProgramId) {
            let of = program_name(program, self.members());
            let text = format!(
                "{of}: it is not known whether the outputs are driven, because nothing is received from any member: they, or the network to this viewer, have failed"
            );
            let name = self.members().name(Member::RemoteIo(program)).to_owned();
            self.alarms.raise_critical((name, NOT_DRIVEN), cycle, text);
        }
    }

    fn gives_no_sign(&mut self, record: &Record, program: ProgramId, cycle: i64) {
        let name = self.members().name(Member::RemoteIo(program)).to_owned();
        let process = self.changes.now().process(Member::RemoteIo(program));
        let is_paired = self.is_paired(program);
        if !is_paired && process.is_some_and(|process| !process.is_running()) {
            return;
        }
        let reason = if is_paired {
            let twin = self.members().name(Member::Twin(program));
            format!("neither {name} nor {twin} samples, as far as stations receive them")
        } else {
            format!("{name} reports nothing, and no station receives its samples")
        };
        let text = self.not_driven(program, cycle, &reason);
        self.tell(Event {
            number: 0,
            at: None,
            cycle,
            at_ns: record.at_ns,
            name,
            event: NOT_DRIVEN,
            level: Level::Alarm,
            text,
            cause: None,
        });
    }
}
