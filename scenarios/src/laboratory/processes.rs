//! The processes of a run: they are started, heard, disturbed and ended here.

use std::collections::BTreeSet;
use std::time::Duration;

use tokio::process::Command;
use tokio::sync::mpsc::Receiver;
use understudy_bus::{HostEvent, ZENOH_RUNTIME};
use understudy_simulator::{Action, Fault};
use understudy_wire::Party;

use super::error::LaboratoryError;
use super::process::{Process, Said, Saying};
use super::{Laboratory, Progress};
use crate::record::{Happening, Record, RunEvent};
use crate::scenario::action_word;

/// How long a process may take to end by itself.
const END_PATIENCE: Duration = Duration::from_secs(3);

impl Laboratory<'_> {
    pub(super) fn start(&mut self, party: Party) -> Result<(), LaboratoryError> {
        let name = self.name(party);
        let mut command = Command::new(&self.settings.program);
        command
            .arg(match party {
                Party::Station(_) => "node",
                Party::RemoteIo(_) => "remote-io",
                Party::Plant(_) => "plant",
            })
            .arg(&self.settings.cluster_file)
            .args(["--name", &name])
            .arg("--endpoints")
            .args(self.site.endpoints(party))
            .arg("--in-laboratory")
            .args(self.keys.arguments(&name))
            .args(&self.settings.arguments)
            .env(ZENOH_RUNTIME.0, ZENOH_RUNTIME.1);
        let life = self
            .lives
            .entry(party)
            .and_modify(|life| *life += 1)
            .or_insert(1);
        let start = || Process::start(party, *life, command, self.sender.clone());
        let process = self.site.at(party, start)?;
        let process = process.map_err(|source| LaboratoryError::Start {
            name,
            program: self.settings.program.clone(),
            source,
        })?;
        self.processes.insert(party, process);
        self.note(RunEvent::Started { party });
        Ok(())
    }

    pub(super) async fn hear(&mut self, said: Said) -> Result<(), LaboratoryError> {
        let Said { party, life, what } = said;
        match what {
            Saying::Line(line) => self.read(party, &line),
            Saying::End(lines) => {
                let Some(process) = self.processes.get_mut(&party) else {
                    return Ok(());
                };
                if process.life() != life || process.may_end {
                    return Ok(());
                }
                let status = process.end(END_PATIENCE).await;
                let how = status.map_or("by no status".to_owned(), |status| status.to_string());
                self.note(RunEvent::Ended {
                    party,
                    how: how.clone(),
                });
                Err(LaboratoryError::Ended {
                    name: self.name(party),
                    how,
                    lines,
                })
            }
        }
    }

    fn read(&mut self, party: Party, line: &str) -> Result<(), LaboratoryError> {
        let Ok(record) = serde_json::from_str::<Record>(line) else {
            return Err(LaboratoryError::Record {
                name: self.name(party),
                line: line.chars().take(200).collect(),
            });
        };
        if let Happening::Host(HostEvent::Ready { rights, .. }) = &record.event {
            self.ready.insert(party);
            self.machine.extend(rights.lacking.iter().cloned());
        }
        self.take(&record);
        Ok(())
    }

    pub(super) async fn do_step(&mut self, step: &Fault) -> Result<(), LaboratoryError> {
        let name = self.name(step.party);
        if step.action == Action::Restart {
            self.start(step.party)?;
        } else {
            let Some(process) = self.processes.get_mut(&step.party) else {
                return Ok(());
            };
            let done = match step.action {
                Action::Cut { to } => self.site.cut(step.party, to, true),
                Action::Heal { to } => self.site.cut(step.party, to, false),
                Action::Crash => process.crash().await,
                Action::Stop => process.stop(),
                Action::Continue => process.go_on(),
                Action::Release => process.command("release").await,
                Action::Choose { choice } => {
                    let line = serde_json::to_string(&choice).map(|it| format!("choose {it}"));
                    process.command(&line.unwrap_or_default()).await
                }
                // Refused before the run began.
                _ => Err(std::io::ErrorKind::Unsupported.into()),
            };
            done.map_err(|source| LaboratoryError::Step {
                action: action_word(step.action),
                name: name.clone(),
                source,
            })?;
        }
        self.note(RunEvent::Fault {
            action: step.action,
            party: step.party,
            asked: step.at_cycle,
        });
        (self.watch)(Progress::Step {
            cycle: step.at_cycle,
            what: format!("{} {name}", action_word(step.action)),
        });
        Ok(())
    }

    /// Everybody ends: asked first, then made to.
    pub(super) async fn end(&mut self, receiver: &mut Receiver<Said>) {
        for process in self.processes.values_mut() {
            process.ask_to_end().await;
        }
        let deadline = tokio::time::Instant::now() + END_PATIENCE;
        let mut living: BTreeSet<(Party, u32)> = self
            .processes
            .values()
            .map(|process| (process.party(), process.life()))
            .collect();
        // What they still say belongs to the journal, and they only end when somebody listens.
        while !living.is_empty() {
            match tokio::time::timeout_at(deadline, receiver.recv()).await {
                Ok(Some(said)) => match said.what {
                    Saying::Line(line) => {
                        // The run is over; a last line that is cut is none of its failures.
                        let _ = self.read(said.party, &line);
                    }
                    Saying::End(_) => {
                        living.remove(&(said.party, said.life));
                    }
                },
                Ok(None) | Err(_) => break,
            }
        }
        for (_, mut process) in std::mem::take(&mut self.processes) {
            process.end(Duration::from_millis(100)).await;
        }
    }
}
