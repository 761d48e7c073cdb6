//! What the laboratory does when somebody commands.

use understudy_cluster::ChangeTexts;
use understudy_journal::{Command, Commanded, Done, OperatorAction, Refusal, RunEvent};
use understudy_simulator::{Action, Fault};
use understudy_wire::{ChangeRequest, Member, WriteRefusal};

use super::Laboratory;
use crate::process::Process;

impl Laboratory<'_> {
    pub(super) async fn obey(&mut self, commanded: Commanded) {
        let OperatorAction::Command { member, command, .. } = commanded.action.clone() else {
            let alarms = &self.account.terms.alarms;
            let (event, done) = commanded.action.recorded(alarms, &self.refused_orders);
            if let Some(event) = event {
                self.note(event);
                self.show_journal();
            }
            return commanded.answer(done);
        };
        let is_decided_there = matches!(
            command,
            Command::Write(_)
                | Command::Force(_)
                | Command::Unforce(_)
                | Command::Choose { .. }
                | Command::Release
                | Command::Change { .. }
        );
        let done = self.obey_command(member, &command).await;
        let is_sent = is_decided_there && done.is_ok();
        // Why it was refused is known later, and in the record. A write is recorded before samples have its value.
        if (!is_sent || matches!(command, Command::Write(_)))
            && let Some(event) = commanded.action.commanded(done.as_ref().err())
        {
            self.note(event);
        }
        // The outcome comes with the journal of the remote I/O.
        if is_sent {
            return self.orders.add(commanded, self.name(member));
        }
        commanded.answer(done);
    }

    async fn obey_command(&mut self, member: Member, command: &Command) -> Result<Done, Refusal> {
        // Whoever commands may make everybody stand still for as long as he wants.
        self.commanded = true;
        let refusal = self.too_early().or_else(|| self.refusal(member, command));
        match refusal {
            Some(refusal) => Err(refusal),
            None => self.command(member, command).await,
        }
    }

    /// Why no command is taken before the scenario is over, where that is so.
    fn too_early(&self) -> Option<Refusal> {
        let afterwards = self.afterwards.as_ref()?;
        let refuses = afterwards.refuse_until_then && self.judged.is_none();
        refuses.then_some(Refusal::ScenarioRuns(self.account.cycles))
    }

    /// Why a command cannot be done now.
    fn refusal(&self, member: Member, command: &Command) -> Option<Refusal> {
        let name = || self.name(member);
        let process = self.processes.get(&member);
        let running = self.is_running(member);
        let still = process.is_some_and(Process::is_suspended);
        let already = |is| Refusal::Already { name: name(), is };
        let wrong = |needs| Refusal::WrongMember { name: name(), needs };
        let remote_io = member.sampled_program().is_some();
        match command {
            Command::Restart if running => Some(Refusal::Running(name())),
            Command::Restart => None,
            Command::Isolate | Command::Rejoin if matches!(member, Member::Plant(_)) => {
                Some(wrong("a plant stays with its remote I/O"))
            }
            Command::Isolate | Command::Rejoin => None,
            Command::Release
            | Command::Choose { .. }
            | Command::Force(_)
            | Command::Write(_)
            | Command::Unforce(_)
                if !remote_io =>
            {
                Some(wrong("it is for remote I/Os"))
            }
            _ if !running => Some(Refusal::Down(name())),
            Command::Stop if still => Some(already("stands still")),
            Command::Continue if !still => Some(already("runs")),
            Command::Kill | Command::Continue => None,
            _ if still => Some(Refusal::Suspended(name())),
            // The rest is checked by the remote I/O.
            Command::Force(force) => {
                force.check().err().map(|error| Refusal::Force(error.to_string()))
            }
            _ => None,
        }
    }

    async fn command(&mut self, member: Member, command: &Command) -> Result<Done, Refusal> {
        let line = |word: &str, value: Result<String, serde_json::Error>| {
            value.map(|value| format!("{word} {value}"))
        };
        let action = match command {
            Command::Kill => Action::Crash,
            Command::Restart => Action::Restart,
            Command::Stop => Action::Stop,
            Command::Continue => Action::Continue,
            Command::Release => Action::Release,
            Command::Choose { choice } => Action::Choose { choice: *choice },
            Command::Isolate => return self.cut_all(member, true).await,
            Command::Rejoin => return self.cut_all(member, false).await,
            Command::Force(force) => {
                return self.tell(member, line("force", serde_json::to_string(force))).await;
            }
            Command::Write(write) if !self.write_limiter.admits(&write.owner) => {
                let refusal = WriteRefusal::Busy;
                return Err(Refusal::Write { refusal });
            }
            Command::Write(write) => {
                return self.tell(member, line("write", serde_json::to_string(write))).await;
            }
            Command::Change { request } => {
                return self.tell(member, line("change", serde_json::to_string(request))).await;
            }
            Command::Unforce(unforce) => {
                return self.tell(member, line("unforce", serde_json::to_string(unforce))).await;
            }
        };
        self.act(member, action).await
    }

    async fn act(&mut self, member: Member, action: Action) -> Result<Done, Refusal> {
        self.do_now(member, &[self.step_now(member, action)]).await
    }

    async fn do_now(&mut self, member: Member, steps: &[Fault]) -> Result<Done, Refusal> {
        let done = self.do_steps(steps).await;
        let done = done.map(|()| Done::default());
        done.map_err(|error| self.system(member, error))
    }

    async fn cut_all(&mut self, member: Member, cut: bool) -> Result<Done, Refusal> {
        let all: Vec<Member> = self.account.terms.members.iter().map(|(p, _)| p).collect();
        let stations_only = matches!(member, Member::RemoteIo(_))
            && !all.iter().any(|it| Some(*it) == member.partner());
        let others = all.into_iter().filter(|&other| match other {
            Member::Station(_) => other != member,
            Member::RemoteIo(_) | Member::Twin(_) => !stations_only && other != member,
            Member::Plant(_) => false,
        });
        let pairs = others.flat_map(|other| [(member, other), (other, member)]);
        let steps = pairs.map(|(from, to)| {
            let action = if cut { Action::Cut { to } } else { Action::Heal { to } };
            self.step_now(from, action)
        });
        let steps: Vec<Fault> = steps.collect();
        self.do_now(member, &steps).await
    }

    /// Records the texts of a change that a member has loaded, once.
    pub(super) fn note_change(&mut self, request: &ChangeRequest) {
        let ChangeRequest::Prepare { file } = request else {
            return;
        };
        // Where they cannot be read, the member says so.
        let texts = std::fs::read_to_string(file).ok();
        let texts = texts.and_then(|text| serde_json::from_str::<ChangeTexts>(&text).ok());
        if let Some(texts) = texts
            && self.change != Some(texts.after)
        {
            self.change = Some(texts.after);
            self.note(RunEvent::ChangeLoaded { texts: Box::new(texts) });
        }
    }

    async fn tell(
        &mut self,
        member: Member,
        line: Result<String, serde_json::Error>,
    ) -> Result<Done, Refusal> {
        let told = match (line, self.processes.get_mut(&member)) {
            (Ok(line), Some(process)) => process.command(&line).await,
            (Err(error), _) => Err(error.into()),
            (_, None) => Err(std::io::ErrorKind::NotFound.into()),
        };
        let told = told.map(|()| Done::default());
        told.map_err(|error| self.system(member, error))
    }

    fn system(&self, member: Member, error: impl std::fmt::Display) -> Refusal {
        Refusal::System { name: self.name(member), reason: error.to_string() }
    }
}
