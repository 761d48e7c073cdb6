//! What the laboratory does, and what it sees of the processes that it runs.

use understudy_journal::{Action, Command, Process, Record, RunEvent};
use understudy_wire::Member;

use super::Model;
use super::standing::{Change, StationChange};
use crate::alarm::UNPROTECTED;
use crate::describe::fault_text;
use crate::online_change::{ChangeReport, LoadedChange};

/// The alarm of a simulated plant that has ended.
const ENDED: &str = "ended";

impl Model {
    pub(super) fn run(&mut self, record: &Record, event: &RunEvent) {
        // An action takes effect in the next cycle.
        let cycle = match event {
            RunEvent::Origin { moment, .. } => self.cycles.of(Some(*moment)),
            RunEvent::Finished
            | RunEvent::Acknowledged(_)
            | RunEvent::Shelved(_)
            | RunEvent::Unshelved(_) => self.cycles.of(None),
            _ => self.cycles.of(None).saturating_add(i64::from(self.cycles.latest().is_some())),
        };
        self.fold_process_alarms(record, cycle);
        match event {
            RunEvent::Started { member } => {
                let name = self.members().name(*member).to_owned();
                self.process_is(*member, Process::Running, cycle);
                self.done(*member, format!("{name} is started"), Some(false), cycle);
                self.alarms.over(&(name.clone(), ENDED), cycle);
                self.alarms.concerns_no_more(&(name, UNPROTECTED), None, cycle);
            }
            RunEvent::Fault { action, member, .. } => self.fault(*action, *member, cycle),
            RunEvent::Ended { member, how, .. } => {
                let name = self.members().name(*member).to_owned();
                let text = format!("{name} ended unexpectedly: {how}");
                self.process_is(*member, Process::Ended, cycle);
                self.done(*member, text.clone(), Some(true), cycle);
                match member {
                    Member::RemoteIo(program) if !self.is_paired(*program) => {
                        drop(self.not_driven(*program, cycle, &text));
                    }
                    // Of a station it is the cause of what its programs lack.
                    Member::Station(_) => {
                        self.alarms.concerns(&(name, UNPROTECTED), None, cycle, text);
                    }
                    Member::Plant(_) | Member::RemoteIo(_) | Member::Twin(_) => {
                        self.alarms.raise((name, ENDED), cycle, text);
                    }
                }
            }
            RunEvent::Origin { moment, cycle } => {
                let cycle = i64::try_from(*cycle).unwrap_or(i64::MAX / 2);
                self.cycles.origin_is_recorded(*moment, cycle);
            }
            RunEvent::ScenarioOver { verdict } => {
                self.changes.push(cycle, Change::ScenarioOver(verdict.clone()));
            }
            RunEvent::Interrupted => self.interrupted = true,
            RunEvent::Finished => self.finished = true,
            RunEvent::Acknowledged(seen) => self.alarms.acknowledged(seen, cycle),
            RunEvent::Shelved(shelving) => self.shelved(shelving, cycle),
            RunEvent::Unshelved(unshelving) => {
                self.process_alarms.shelve(&unshelving.name, None, cycle);
            }
            RunEvent::Attached { member } => {
                self.changes.push(cycle, Change::Attached(*member));
                // Its records from before are not in this journal.
                if let Some(program) = member.sampled_program() {
                    self.misses_records(program);
                }
            }
            RunEvent::Detached { member, .. } => {
                self.changes.push(cycle, Change::Detached(*member));
                self.nothing_is_received(cycle);
            }
            RunEvent::Commanded {
                member: Member::RemoteIo(program) | Member::Twin(program),
                command: Command::Write(write),
                ..
            } => {
                if let Some(history) = self.histories.get_mut(program.index()) {
                    history.asked(write);
                }
            }
            RunEvent::Commanded {
                command: Command::Change { request },
                owner,
                refused: None,
                ..
            } => {
                let (by, request) = (owner.clone(), request.clone());
                self.changes.push(cycle, Change::Online(ChangeReport::Given { by, request }));
            }
            RunEvent::ChangeLoaded { texts } => {
                let loaded = ChangeReport::Loaded(LoadedChange::of(texts));
                self.changes.push(cycle, Change::Online(loaded));
            }
            RunEvent::Commanded { .. }
            | RunEvent::CommandRefused(_)
            | RunEvent::Journal { .. }
            | RunEvent::Checkpoint { .. }
            | RunEvent::Continues(_)
            | RunEvent::InEffect { .. } => {}
        }
        self.happened(record, cycle, None);
    }

    fn fault(&mut self, action: Action, member: Member, cycle: i64) {
        match (action, Process::after(action)) {
            (Action::Continue, _) => {
                self.changes.push(cycle, Change::Resumed(member));
            }
            (_, Some(process)) => self.process_is(member, process, cycle),
            (Action::Cut { to }, _) => self.changes.push(cycle, Change::Cut(member, to)),
            (Action::Heal { to }, _) => self.changes.push(cycle, Change::Healed(member, to)),
            _ => {}
        }
        let what = Process::after(action).and_then(Process::absence);
        if let (Member::RemoteIo(program), Some(what)) = (member, what)
            && !self.is_paired(program)
        {
            let reason = format!("{} {what}", self.members().name(member));
            self.not_driven(program, cycle, &reason);
        }
        let runs = self.changes.now().process(member).is_none_or(Process::is_running);
        let silences = silences(action).filter(|silences| *silences || runs);
        self.done(member, fault_text(action, member, self.members()), silences, cycle);
    }

    fn process_is(&mut self, member: Member, process: Process, cycle: i64) {
        if process != Process::Suspended {
            self.refuses_none(member, cycle);
            self.links_forgotten(member, cycle);
        }
        let change = Change::Process(member, process);
        self.changes.process(member, cycle, change);
        if !process.is_running() {
            self.network_forgets(member, cycle);
            self.reports.down(self.reported_as(member));
            self.find_complete();
        }
        if let (Some(program), false) = (member.sampled_program(), process == Process::Suspended) {
            self.remote_io_is_new(member, program);
        }
    }

    fn done(&mut self, member: Member, text: String, silences: Option<bool>, cycle: i64) {
        if let Member::Station(station) = member {
            let change = Change::Station(station, StationChange::Done { text, silences });
            self.changes.push(cycle, change);
        }
    }
}

/// Whether a member may be silent after an action; nothing for an action that does not concern this.
fn silences(action: Action) -> Option<bool> {
    match action {
        Action::Crash | Action::Stop | Action::Cut { .. } | Action::Corrupt { .. } => Some(true),
        Action::Slow { by } | Action::Delay { by, .. } => Some(!by.is_zero()),
        Action::Continue | Action::Heal { .. } => Some(false),
        _ => Process::after(action).map(|_| false),
    }
}
