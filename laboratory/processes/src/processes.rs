//! The processes of a run: they are started, heard, disturbed and ended here.

use std::collections::BTreeSet;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use tokio::process::Command;
use tokio::sync::mpsc::Receiver;
use understudy_bus::{Cuts, HostEvent, log_environment, zenoh_runtime};
use understudy_journal::{Happening, Record, RunEvent, check_version};
use understudy_scenarios::{action_text, action_word};
use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, SignalPlace, Unforce, Via};

use super::{Deaths, Laboratory, Progress};
use crate::error::LaboratoryError;
use crate::process::{Process, Said, Saying};

/// How long a process may take to end by itself.
const END_PATIENCE: Duration = Duration::from_secs(3);

impl Laboratory<'_> {
    pub(super) async fn start(&mut self, member: Member) -> Result<(), LaboratoryError> {
        let name = self.name(member);
        let multicast = self.site.multicast();
        let multicast = multicast.map_or("none".to_owned(), |first| first.to_string());
        let zenoh = zenoh_runtime(self.site.paths(member));
        let mut command = Command::new(&self.settings.program);
        command
            .arg(match member {
                Member::Station(_) => "node",
                Member::RemoteIo(_) | Member::Twin(_) => "remote-io",
                Member::Plant(_) => "plant",
            })
            .arg(&self.settings.cluster_file)
            .args(["--name", &name])
            .arg("--endpoints")
            .args(self.site.endpoints(member))
            .args(["--multicast", &multicast])
            .arg("--retain")
            .arg(&self.retained)
            .arg("--in-laboratory")
            .args(self.keys.arguments(&name))
            .args(&self.settings.arguments)
            .env(zenoh.0, zenoh.1)
            .envs(log_environment().iter().map(|(name, value)| (name, value)));
        let life = self.lives.entry(member).and_modify(|life| *life += 1).or_insert(1);
        let start = || Process::start(member, *life, command, self.sender.clone());
        let process = self.site.at(member, start)?;
        let mut process = process.map_err(|source| LaboratoryError::Start {
            name,
            program: self.settings.program.clone(),
            source,
        })?;
        if let Some(cuts) = self.cuts.get(&member) {
            cut(&mut process, cuts).await;
        }
        self.processes.insert(member, process);
        self.recovery.started(member);
        self.note(RunEvent::Started { member });
        Ok(())
    }

    pub(super) fn is_running(&self, member: Member) -> bool {
        self.processes.get(&member).is_some_and(Process::is_running)
    }

    /// An action that no scenario has asked for, in the cycle that comes next.
    pub(super) fn step_now(&self, member: Member, action: Action) -> Fault {
        let at_cycle = self.account.cycle().map_or(0, |cycle| cycle + 1);
        Fault { at_cycle, phase: 0.0, member, action }
    }

    /// Starts a member that has ended unexpectedly.
    pub(super) async fn restart(&mut self, member: Member) {
        let step = self.step_now(member, Action::Restart);
        if let Err(error) = self.do_steps(&[step]).await {
            let after = self.recovery.ended(member, Instant::now());
            self.show_step(format!("{error}; again in {after:?}"));
        }
    }

    fn action_text(&self, step: &Fault) -> String {
        action_text(step.member, step.action, &self.account.terms.members)
    }

    /// A line for whoever watches the run.
    fn show_step(&mut self, what: String) {
        let cycle = self.account.cycle().unwrap_or(0);
        (self.watch)(Progress::Step { cycle, what });
    }

    pub(super) async fn hear(&mut self, said: Said) -> Result<(), LaboratoryError> {
        let Said { member, life, what } = said;
        match what {
            Saying::Line(line) => self.read(member, &line),
            Saying::End(lines) => {
                let Some(process) = self.processes.get_mut(&member) else {
                    return Ok(());
                };
                if process.life() != life || !process.is_running() {
                    return Ok(());
                }
                let status = process.end(END_PATIENCE).await;
                self.died(member, life, status, lines)
            }
        }
    }

    /// A member has ended unexpectedly.
    fn died(
        &mut self,
        member: Member,
        life: u32,
        status: Option<ExitStatus>,
        lines: Vec<String>,
    ) -> Result<(), LaboratoryError> {
        let how = status.map_or("it closed its output".to_owned(), |it| it.to_string());
        self.note(RunEvent::Ended { member, how: how.clone(), said: lines.clone() });
        self.show_journal();
        // A member that says itself why it cannot work keeps the run from beginning; what a signal does comes from outside.
        let refused = status.is_some_and(|status| status.code().is_some());
        let never_worked = life == 1 && !self.ready.contains(&member) && refused;
        if never_worked || self.settings.deaths == Deaths::EndTheRun {
            let name = self.name(member);
            return Err(LaboratoryError::Ended { name, how, lines });
        }
        let name = self.name(member);
        let back = match self.settings.deaths {
            Deaths::Restarted => {
                let after = self.recovery.ended(member, Instant::now());
                format!("it is started again in {after:?}")
            }
            _ => format!(
                "start it again with `understudy operate {} --name {name} restart`",
                self.directory.display()
            ),
        };
        self.show_step(format!("{name} ended unexpectedly ({how}): {back}"));
        Ok(())
    }

    fn read(&mut self, member: Member, line: &str) -> Result<(), LaboratoryError> {
        let Ok(record) = serde_json::from_str::<Record>(line) else {
            return Err(LaboratoryError::Record {
                name: self.name(member),
                line: line.chars().take(200).collect(),
            });
        };
        if let Happening::Host(HostEvent::Ready { rights, version, .. }) = &record.event {
            check_version(*version).map_err(|wrong| LaboratoryError::Version {
                name: self.name(member),
                found: wrong.found,
            })?;
            self.ready.insert(member);
            self.machine.extend(rights.lacking.iter().cloned());
        }
        self.take(&record);
        Ok(())
    }

    /// Does steps that are due at one time. What they cut between hosts is cut at one time, as where a network fails.
    pub(super) async fn do_steps(&mut self, steps: &[Fault]) -> Result<(), LaboratoryError> {
        let mut done = Vec::new();
        for step in steps {
            if self.begin_step(step).await? {
                done.push(step);
            }
        }
        if let Some(last) = steps.last() {
            self.site.apply().map_err(|source| self.step_failed(last, source))?;
        }
        for step in done {
            self.note(RunEvent::Fault {
                action: step.action,
                member: step.member,
                asked: step.at_cycle,
            });
            let what = format!("{}: {}", self.name(step.member), self.action_text(step));
            (self.watch)(Progress::Step { cycle: step.at_cycle, what });
        }
        Ok(())
    }

    fn step_failed(&self, step: &Fault, source: std::io::Error) -> LaboratoryError {
        let name = self.name(step.member);
        LaboratoryError::Step { action: action_word(step.action), name, source }
    }

    /// False where the step cannot be done as its member is.
    async fn begin_step(&mut self, step: &Fault) -> Result<bool, LaboratoryError> {
        let name = self.name(step.member);
        let running = self.is_running(step.member);
        let cannot = match step.action {
            Action::Restart if running => Some("it runs already"),
            Action::Crash
            | Action::Stop
            | Action::Continue
            | Action::Release
            | Action::Choose { .. }
            | Action::Write { .. }
            | Action::Set { .. }
            | Action::Unset { .. }
                if !running =>
            {
                Some("it has ended")
            }
            _ => None,
        };
        if let Some(why) = cannot {
            // Only after a member ended unexpectedly, or an operator acted: scenarios are checked for it.
            let action = self.action_text(step);
            self.show_step(format!("{name}: no {action}: {why}"));
            return Ok(false);
        }
        let points = step.member.sampled_program();
        let points = points.and_then(|program| self.points.get(program.index()).copied());
        let done = match (step.action, self.processes.get_mut(&step.member)) {
            (Action::Restart, _) => {
                self.start(step.member).await?;
                Ok(())
            }
            (Action::Cut { to }, _) => self.cut(step.member, to, true).await,
            (Action::Heal { to }, _) => self.cut(step.member, to, false).await,
            (Action::Unplug { network }, _) => self.unplug(step.member, network, true).await,
            (Action::Plug { network }, _) => self.unplug(step.member, network, false).await,
            (Action::Crash, Some(process)) => process.crash().await,
            (Action::Stop, Some(process)) => process.stop(),
            (Action::Continue, Some(process)) => process.go_on(),
            (Action::Release, Some(process)) => process.command("release").await,
            (Action::Write { .. }, Some(process)) => {
                let write = step.write(points).and_then(|write| serde_json::to_string(&write).ok());
                process.command(&format!("write {}", write.unwrap_or_default())).await
            }
            (Action::Set { .. }, Some(process)) => {
                let force = step.action.force(points);
                let line = serde_json::to_string(&force).map(|it| format!("force {it}"));
                process.command(&line.unwrap_or_default()).await
            }
            (Action::Unset { input }, Some(process)) => {
                let unforce = Unforce { signal: SignalPlace::Input(input), points };
                let line = serde_json::to_string(&unforce).map(|it| format!("unforce {it}"));
                process.command(&line.unwrap_or_default()).await
            }
            (Action::Choose { choice }, Some(process)) => {
                let line = serde_json::to_string(&choice).map(|it| format!("choose {it}"));
                process.command(&line.unwrap_or_default()).await
            }
            // Refused before the run began.
            _ => Err(std::io::ErrorKind::Unsupported.into()),
        };
        done.map(|()| true).map_err(|source| self.step_failed(step, source))
    }

    /// No frame of one member counts for another any more, or each does again.
    async fn cut(&mut self, from: Member, to: Member, is_cut: bool) -> std::io::Result<()> {
        if self.site.cut(from, to, is_cut) {
            return Ok(());
        }
        let cuts = self.cuts.entry(to).or_default();
        cuts.set(from, is_cut);
        if let Some(process) = self.processes.get_mut(&to) {
            cut(process, cuts).await;
        }
        Ok(())
    }

    /// A member sends and receives nothing more over a network or the direct link, or everything again. A plant stays on the cables of its remote I/O.
    async fn unplug(
        &mut self,
        member: Member,
        network: Via,
        is_unplugged: bool,
    ) -> std::io::Result<()> {
        if self.site.unplug(member, network, is_unplugged) {
            return Ok(());
        }
        let cuts = self.cuts.entry(member).or_default();
        cuts.unplug(network, is_unplugged);
        if let Some(process) = self.processes.get_mut(&member) {
            cut(process, cuts).await;
        }
        Ok(())
    }

    /// Everybody ends: asked first, then made to.
    pub(super) async fn end(&mut self, receiver: &mut Receiver<Said>) {
        for process in self.processes.values_mut() {
            process.ask_to_end().await;
        }
        let deadline = tokio::time::Instant::now() + END_PATIENCE;
        let mut living: BTreeSet<(Member, u32)> = self
            .processes
            .values()
            .filter(|process| !process.has_ended())
            .map(|process| (process.member(), process.life()))
            .collect();
        // What they still say belongs to the journal, and they only end when somebody listens.
        while !living.is_empty() {
            match tokio::time::timeout_at(deadline, receiver.recv()).await {
                Ok(Some(said)) => match said.what {
                    Saying::Line(line) => {
                        // The run is over; a last line that is cut is none of its failures.
                        let _ = self.read(said.member, &line);
                    }
                    Saying::End(_) => {
                        living.remove(&(said.member, said.life));
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

/// Tells a member of which others it shall drop the frames.
async fn cut(process: &mut Process, cuts: &Cuts) {
    // Two numbers are always writable as JSON.
    let cuts = serde_json::to_string(cuts).unwrap_or_default();
    // One that has ended meanwhile is told when it starts again.
    if let Err(error) = process.command(&format!("cut {cuts}")).await {
        tracing::debug!(%error, "a member was not told of its cut links");
    }
}
