//! What a person commands while a laboratory runs.
//!
//! A command that cannot be done says why and changes nothing; the run goes on. Every command is in the journal, with who gave it and for
//! what reason, also one that was refused.

use serde::{Deserialize, Serialize};
use tokio::sync::{mpsc, oneshot};
use understudy_simulator::{Action, Fault};
use understudy_wire::{Force, Party, ProgramId, SignalPlace};

use super::Laboratory;
use crate::record::RunEvent;

/// Commands that wait, at most; whoever gives another is told so.
const WAITING: usize = 16;

/// What is to be done to a party.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case")]
pub enum Command {
    /// End its process as `kill -9` does.
    Kill,
    /// Start it again.
    Restart,
    /// Make it stand still.
    Stop,
    /// Let it go on.
    Continue,
    /// Release the outputs of a remote I/O, and the stations that it has excluded.
    Release,
    /// Cut it off from all others; a plant stays with its remote I/O.
    Isolate,
    /// Connect it again.
    Rejoin,
    /// Put a value in the place of a signal of a remote I/O.
    Force(Force),
    /// Take it back.
    Unforce {
        /// Which signal.
        signal: SignalPlace,
    },
}

/// Why a command was not done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It needs a process.
    #[error("U0551: {0} is down: restart it first")]
    Down(String),
    /// It needs that there is none.
    #[error("U0552: {0} is running: there is nothing to restart")]
    Running(String),
    /// It stands still, or does not, already.
    #[error("U0553: {name} {is} already")]
    Already {
        /// Which party.
        name: String,
        /// How it is.
        is: &'static str,
    },
    /// Only a remote I/O, or a party of another kind, can do that.
    #[error("U0554: {name} cannot do that: {needs}")]
    WrongParty {
        /// Which party.
        name: String,
        /// What is needed.
        needs: &'static str,
    },
    /// There is nothing between the parties that could cut.
    #[error("U0555: the links of this run cannot be cut: nothing lies between its processes")]
    NoProxy,
    /// The program has no such signal, or the force is not complete.
    #[error("U0556: {0}")]
    Force(String),
    /// The run is not there any more, or too many commands wait.
    #[error("U0557: the run takes no command now")]
    Busy,
    /// The system refused it.
    #[error("U0558: {name}: {reason}")]
    System {
        /// Which party.
        name: String,
        /// What the system said.
        reason: String,
    },
}

/// One command on its way.
#[derive(Debug)]
pub(super) struct Commanded {
    party: Party,
    command: Command,
    owner: String,
    reason: String,
    answer: oneshot::Sender<Result<(), Refusal>>,
}

/// The end of whoever commands; may be cloned, and used from any thread.
#[derive(Debug, Clone)]
pub struct Commander(mpsc::Sender<Commanded>);

/// The laboratory's end.
#[derive(Debug)]
pub struct Commands(mpsc::Receiver<Commanded>);

/// Both ends.
pub fn commands() -> (Commander, Commands) {
    let (sender, receiver) = mpsc::channel(WAITING);
    (Commander(sender), Commands(receiver))
}

impl Commander {
    /// Gives a command, and waits until it is done or refused.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn give(
        &self,
        party: Party,
        command: Command,
        owner: String,
        reason: String,
    ) -> Result<(), Refusal> {
        let (answer, answered) = oneshot::channel();
        let commanded = Commanded {
            party,
            command,
            owner,
            reason,
            answer,
        };
        self.0.try_send(commanded).map_err(|_| Refusal::Busy)?;
        answered.await.unwrap_or(Err(Refusal::Busy))
    }
}

impl Commands {
    /// The next command; waits for ever where nobody can give one.
    pub(super) async fn next(commands: &mut Option<Self>) -> Commanded {
        if let Some(Self(receiver)) = commands
            && let Some(commanded) = receiver.recv().await
        {
            return commanded;
        }
        // Whoever commanded is gone for good.
        std::future::pending().await
    }
}

impl Laboratory<'_> {
    pub(super) async fn obey(&mut self, commanded: Commanded) {
        let Commanded {
            party,
            command,
            owner,
            reason,
            answer,
        } = commanded;
        let done = match self.refusal(party, &command) {
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
        // Nobody waits for the answer where its page was closed.
        let _ = answer.send(done);
    }

    /// Why a command cannot be done now.
    fn refusal(&self, party: Party, command: &Command) -> Option<Refusal> {
        let name = || self.name(party);
        let process = self.processes.get(&party);
        let running = process.is_some_and(|process| !process.may_end);
        let still = process.is_some_and(|process| process.stands_still());
        let already = |is| Refusal::Already { name: name(), is };
        let wrong = |needs| Refusal::WrongParty {
            name: name(),
            needs,
        };
        let remote_io = matches!(party, Party::RemoteIo(_));
        match command {
            Command::Restart if running => Some(Refusal::Running(name())),
            Command::Restart => None,
            Command::Isolate | Command::Rejoin if !self.site.can_cut() => Some(Refusal::NoProxy),
            Command::Isolate | Command::Rejoin if matches!(party, Party::Plant(_)) => {
                Some(wrong("a plant stays with its remote I/O"))
            }
            Command::Isolate | Command::Rejoin => None,
            Command::Release | Command::Force(_) | Command::Unforce { .. } if !remote_io => {
                Some(wrong("it is for remote I/Os"))
            }
            _ if !running => Some(Refusal::Down(name())),
            Command::Stop if still => Some(already("stands still")),
            Command::Continue if !still => Some(already("runs")),
            Command::Force(force) => self.force_refusal(party, force),
            _ => None,
        }
    }

    fn force_refusal(&self, party: Party, force: &understudy_wire::Force) -> Option<Refusal> {
        if let Err(error) = force.check() {
            return Some(Refusal::Force(error.to_string()));
        }
        let Party::RemoteIo(ProgramId(program)) = party else {
            return None;
        };
        let signals = self.account.terms.signals.get(usize::from(program))?;
        let (place, count, kind) = match force.signal {
            SignalPlace::Input(place) => (place, signals.inputs.len(), "inputs"),
            SignalPlace::Output(place) => (place, signals.outputs.len(), "outputs"),
        };
        (usize::from(place) >= count).then(|| {
            let name = self.name(party);
            Refusal::Force(format!("{name} has {count} {kind}, and no number {place}"))
        })
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
