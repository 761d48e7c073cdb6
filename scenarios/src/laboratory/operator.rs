//! What the laboratory does when somebody commands.

use understudy_simulator::{Action, Fault};
use understudy_wire::{Force, Party, ProgramId};

use super::Laboratory;
use super::process::Process;
use crate::operator::{Command, Commanded, OperatorAction, Refusal};
use crate::record::RunEvent;

impl Laboratory<'_> {
    pub(super) async fn obey(&mut self, commanded: Commanded) {
        let done = match commanded.action.clone() {
            OperatorAction::Acknowledge(seen) => {
                self.note(RunEvent::Acknowledged(seen));
                self.show_journal();
                Ok(())
            }
            OperatorAction::Command {
                party,
                command,
                owner,
                reason,
            } => self.obey_command(party, command, owner, reason).await,
        };
        commanded.answer(done);
    }

    async fn obey_command(
        &mut self,
        party: Party,
        command: Command,
        owner: String,
        reason: String,
    ) -> Result<(), Refusal> {
        // Whoever commands may make everybody stand still for as long as he wants.
        self.commanded = true;
        let refusal = self.too_early().or_else(|| self.refusal(party, &command));
        let done = match refusal {
            Some(refusal) => Err(refusal),
            None => self.command(party, &command).await,
        };
        self.note(RunEvent::Commanded {
            party,
            command,
            owner,
            reason,
            refused: done.as_ref().err().map(ToString::to_string),
        });
        done
    }

    /// Why no command is taken before the scenario is over, where that is so.
    fn too_early(&self) -> Option<Refusal> {
        let afterwards = self.afterwards.as_ref()?;
        let refuses = afterwards.refuse_until_then && self.judged.is_none();
        refuses.then_some(Refusal::ScenarioRuns(self.account.cycles))
    }

    /// Why a command cannot be done now.
    fn refusal(&self, party: Party, command: &Command) -> Option<Refusal> {
        let name = || self.name(party);
        let process = self.processes.get(&party);
        let running = self.is_running(party);
        let still = process.is_some_and(Process::is_suspended);
        let already = |is| Refusal::Already { name: name(), is };
        let wrong = |needs| Refusal::WrongParty {
            name: name(),
            needs,
        };
        let remote_io = matches!(party, Party::RemoteIo(_));
        match command {
            Command::Restart if running => Some(Refusal::Running(name())),
            Command::Restart => None,
            Command::Isolate | Command::Rejoin if matches!(party, Party::Plant(_)) => {
                Some(wrong("a plant stays with its remote I/O"))
            }
            Command::Isolate | Command::Rejoin => None,
            Command::Release
            | Command::Choose { .. }
            | Command::Force(_)
            | Command::Unforce { .. }
                if !remote_io =>
            {
                Some(wrong("it is for remote I/Os"))
            }
            _ if !running => Some(Refusal::Down(name())),
            Command::Stop if still => Some(already("stands still")),
            Command::Continue if !still => Some(already("runs")),
            Command::Force(force) => self.force_refusal(party, force),
            _ => None,
        }
    }

    fn force_refusal(&self, party: Party, force: &Force) -> Option<Refusal> {
        let Party::RemoteIo(ProgramId(program)) = party else {
            return None;
        };
        let signals = self.account.terms.signals.get(usize::from(program))?;
        let (inputs, outputs) = (signals.inputs.len(), signals.outputs.len());
        Refusal::of_force(&self.name(party), force, inputs, outputs)
    }

    async fn command(&mut self, party: Party, command: &Command) -> Result<(), Refusal> {
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
            Command::Isolate => return self.cut_all(party, true).await,
            Command::Rejoin => return self.cut_all(party, false).await,
            Command::Force(force) => {
                return self
                    .tell(party, line("force", serde_json::to_string(force)))
                    .await;
            }
            Command::Unforce { signal } => {
                return self
                    .tell(party, line("unforce", serde_json::to_string(signal)))
                    .await;
            }
        };
        self.act(party, action).await
    }

    async fn act(&mut self, party: Party, action: Action) -> Result<(), Refusal> {
        let step = Fault {
            at_cycle: self.account.cycle().map_or(0, |cycle| cycle + 1),
            phase: 0.0,
            party,
            action,
        };
        let done = self.do_step(&step).await;
        done.map_err(|error| self.system(party, error))
    }

    async fn cut_all(&mut self, party: Party, cut: bool) -> Result<(), Refusal> {
        let all: Vec<Party> = self.account.terms.parties.iter().map(|(p, _)| p).collect();
        let stations_only = matches!(party, Party::RemoteIo(_));
        let others = all.into_iter().filter(|&other| match other {
            Party::Station(_) => other != party,
            Party::RemoteIo(_) => !stations_only,
            Party::Plant(_) => false,
        });
        for other in others {
            for (from, to) in [(party, other), (other, party)] {
                let action = if cut {
                    Action::Cut { to }
                } else {
                    Action::Heal { to }
                };
                self.act(from, action).await?;
            }
        }
        Ok(())
    }

    async fn tell(
        &mut self,
        party: Party,
        line: Result<String, serde_json::Error>,
    ) -> Result<(), Refusal> {
        let told = match (line, self.processes.get_mut(&party)) {
            (Ok(line), Some(process)) => process.command(&line).await,
            (Err(error), _) => Err(error.into()),
            (_, None) => Err(std::io::ErrorKind::NotFound.into()),
        };
        told.map_err(|error| self.system(party, error))
    }

    fn system(&self, party: Party, error: impl std::fmt::Display) -> Refusal {
        Refusal::System {
            name: self.name(party),
            reason: error.to_string(),
        }
    }
}
