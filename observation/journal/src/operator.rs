//! What a person does while a run is written: commands to its members, and alarms that he has seen.
//!
//! ```text
//!   page, terminal ──► Commander ──┬─ a queue in this process ──┬─► Commands ──► whoever writes the run: does it, and notes it
//!                                  └─ the socket of the run ────┘
//! ```
//!
//! A command that cannot be done says why and changes nothing; the run goes on. Every command is in the journal, with who gave it and for
//! what reason, also one that was refused.

mod acknowledgement;
mod new_write;
mod pending;
mod sessions;
mod shelving;
mod socket;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tokio::sync::{mpsc, oneshot};
use understudy_wire::{
    ChangeRequest, Force, Member, OrderRefusal, StateChoice, Unforce, Write, WriteOutcome,
    WriteRefusal,
};

use crate::record::RunEvent;
use understudy_bus::{RefusedOrder, RefusedOrders};
use understudy_cluster::AlarmDeclaration;

pub use acknowledgement::Acknowledgement;
pub use new_write::{RequestedValue, WriteProblem, WriteRequest, force_value, new_write};
pub use pending::{DecidedOrder, PendingOrders, write_answer};
pub use sessions::{DECIDED_WITHIN, WriteSessions, attempt_until_decided};
pub use shelving::{AlarmRefusal, MAXIMUM_SHELVING_SECONDS, Shelving, Unshelving, find_alarm};
pub use socket::RunSocket;
pub(crate) use socket::SOCKET;

/// Commands that wait, at most; whoever gives another is told so.
const WAITING: usize = 16;

/// What is to be done to a member.
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
    /// Choose the state that the program of a remote I/O continues from, where it is lost.
    Choose {
        /// Which.
        choice: StateChoice,
    },
    /// Cut it off from all others; a plant stays with its remote I/O.
    Isolate,
    /// Connect it again.
    Rejoin,
    /// Put a value in the place of a signal of a remote I/O.
    Force(Force),
    /// Write a value to an operator input of a remote I/O.
    Write(Write),
    /// Take a step of an online change.
    Change {
        /// Which.
        request: ChangeRequest,
    },
    /// Take it back.
    Unforce(Unforce),
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
        /// Which member.
        name: String,
        /// How it is.
        is: &'static str,
    },
    /// Only a remote I/O, or a member of another kind, can do that.
    #[error("U0554: {name} cannot do that: {needs}")]
    WrongMember {
        /// Which member.
        name: String,
        /// What is needed.
        needs: &'static str,
    },
    /// The program has no such signal, or the force is not complete.
    #[error("U0556: {0}")]
    Force(String),
    /// The run is not there any more, or too many commands wait.
    #[error("U0557: the run takes no command now")]
    Busy,
    /// The scenario is to be judged first.
    #[error("U0560: the scenario runs until cycle {0}; commands are taken after that")]
    ScenarioRuns(u64),
    /// The system refused it.
    #[error("U0558: {name}: {reason}")]
    System {
        /// Which member.
        name: String,
        /// What the system said.
        reason: String,
    },
    /// Its process is not one of this laboratory.
    #[error("U0559: {name}: {reason}")]
    Elsewhere {
        /// Which member.
        name: String,
        /// What can be done there in its place.
        reason: String,
    },
    /// It is suspended, and would do later what is asked now.
    #[error("U0551: {0} is suspended: let it continue first")]
    Suspended(String),
    /// The remote I/O refuses a choice, a force or the end of a force.
    #[error("{code}: {0}", code = .0.code())]
    Order(OrderRefusal),
    /// The remote I/O refuses a write.
    #[error("{code}: {refusal}", code = .refusal.code())]
    Write {
        /// Reason.
        refusal: WriteRefusal,
    },
    /// A write as it was asked for is not a write to the program.
    #[error(transparent)]
    Problem(#[from] WriteProblem),
    /// The alarm cannot be shelved or acknowledged.
    #[error("{0}")]
    Alarm(AlarmRefusal),
    /// The outcome of a write is not known yet.
    #[error(
        "U0648: the outcome of the write is not known: the value may be in effect, or takes effect with the next applied outputs, such as after their release; check the state of the program"
    )]
    Undecided,
    /// Another process writes the run, and says why.
    #[error("{0}")]
    Said(String),
}

impl Refusal {
    /// What a member answers in place of being done; with its code, where the member says one.
    pub fn of_answer(answer: String) -> Self {
        let said = Self::Said(answer);
        if said.own_code().is_some() { said } else { Self::Force(said.to_string()) }
    }
}

/// What somebody does.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "action", rename_all = "kebab-case")]
pub enum OperatorAction {
    /// A command to a member.
    Command {
        /// To whom.
        member: Member,
        /// What.
        command: Command,
        /// Who gives it.
        owner: String,
        /// Why.
        reason: String,
    },
    /// An alarm was seen.
    Acknowledge(Acknowledgement),
    /// An alarm on a signal is shelved.
    Shelve(Shelving),
    /// It is shelved no more.
    Unshelve(Unshelving),
    /// An order was refused before it was one of the above; only its record is wanted.
    Refused(RefusedOrder),
}

impl OperatorAction {
    /// The record of an action on an alarm.
    ///
    /// # Errors
    /// [`Refusal::Alarm`], and [`Refusal::Busy`] for a command to a member.
    pub fn alarm_event(&self, alarms: &[AlarmDeclaration]) -> Result<RunEvent, Refusal> {
        let event = match self {
            Self::Command { .. } | Self::Refused(_) => return Err(Refusal::Busy),
            Self::Acknowledge(seen) => Ok(RunEvent::Acknowledged(seen.clone())),
            Self::Shelve(shelving) => {
                let checked = shelving.check(alarms);
                checked.map(|()| RunEvent::Shelved(shelving.clone()))
            }
            Self::Unshelve(unshelving) => {
                let checked = unshelving.check(alarms);
                checked.map(|()| RunEvent::Unshelved(unshelving.clone()))
            }
        };
        event.map_err(Refusal::Alarm)
    }

    /// The record of a command to a member, with why it was refused; nothing for other actions.
    pub fn commanded(&self, refused: Option<&Refusal>) -> Option<RunEvent> {
        let Self::Command { member, command, owner, reason } = self else {
            return None;
        };
        Some(RunEvent::Commanded {
            member: *member,
            command: command.clone(),
            owner: owner.clone(),
            reason: reason.clone(),
            refused: refused.map(ToString::to_string),
        })
    }

    /// The record of an action that is no command to a member, and what it came to. A refused one has a record too, within `refused`.
    pub fn recorded(
        &self,
        alarms: &[AlarmDeclaration],
        refused: &RefusedOrders,
    ) -> (Option<RunEvent>, Result<Done, Refusal>) {
        if let Self::Refused(order) = self {
            let order = refused.admit(order.clone());
            return (order.map(RunEvent::CommandRefused), Ok(Done::default()));
        }
        match self.alarm_event(alarms) {
            Ok(event) => (Some(event), Ok(Done::default())),
            Err(refusal) => {
                let order = self.refused(&refusal).and_then(|order| refused.admit(order));
                (order.map(RunEvent::CommandRefused), Err(refusal))
            }
        }
    }

    /// An action on an alarm as a refused order.
    pub fn refused(&self, refusal: &Refusal) -> Option<RefusedOrder> {
        let (order, name, owner, reason) = match self {
            Self::Command { .. } | Self::Refused(_) => return None,
            Self::Acknowledge(seen) => ("acknowledge-alarm", &seen.name, &seen.owner, ""),
            Self::Shelve(shelving) => {
                ("shelve-alarm", &shelving.name, &shelving.owner, shelving.reason.as_str())
            }
            Self::Unshelve(unshelving) => {
                ("unshelve-alarm", &unshelving.name, &unshelving.owner, unshelving.reason.as_str())
            }
        };
        Some(RefusedOrder::new(order, name, owner, refusal).with("", reason))
    }
}

/// What an action came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Done {
    /// Cycle of the cluster from which a written value is in effect.
    pub cycle: Option<u64>,
}

impl Done {
    /// The outcome of a write.
    ///
    /// # Errors
    /// [`Refusal::Write`].
    pub fn of_write(outcome: WriteOutcome) -> Result<Self, Refusal> {
        match outcome {
            WriteOutcome::InEffect { since } => Ok(Self { cycle: Some(since.cycle.0) }),
            WriteOutcome::Refused { refusal } => Err(Refusal::Write { refusal }),
        }
    }
}

/// An action that waits for its answer.
#[derive(Debug)]
pub struct Commanded {
    /// What.
    pub action: OperatorAction,
    answer: oneshot::Sender<Result<Done, Refusal>>,
}

impl Commanded {
    /// Whether it writes an operator input.
    fn is_write(&self) -> bool {
        matches!(&self.action, OperatorAction::Command { command: Command::Write(_), .. })
    }

    /// Says how it went.
    pub fn answer(self, done: Result<Done, Refusal>) {
        // Nobody waits for it where the page was closed.
        let _ = self.answer.send(done);
    }
}

/// The end of whoever acts; may be cloned, and used from any thread.
#[derive(Debug, Clone)]
pub struct Commander(Way);

#[derive(Debug, Clone)]
enum Way {
    Queue(mpsc::Sender<Commanded>),
    /// The directory of a run.
    Run(Arc<Path>),
}

/// Waits for an action on a thread that has nothing else to do.
fn block_on<T>(action: impl Future<Output = T>) -> Result<T, Refusal> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|error| Refusal::System {
        name: "a runtime".to_owned(),
        reason: error.to_string(),
    })?;
    Ok(runtime.block_on(action))
}

/// The end of whoever writes the run.
#[derive(Debug)]
pub struct Commands {
    receiver: mpsc::Receiver<Commanded>,
    /// So that there is always somebody who might act.
    sender: mpsc::Sender<Commanded>,
}

/// Both ends, in one process.
pub fn commands() -> (Commander, Commands) {
    let (sender, receiver) = mpsc::channel(WAITING);
    let commands = Commands { receiver, sender: sender.clone() };
    (Commander(Way::Queue(sender)), commands)
}

impl Commander {
    /// For a run that another process writes, or wrote.
    pub fn of_run(run: PathBuf) -> Self {
        Self(Way::Run(run.into()))
    }

    /// Gives a command, and waits until it is done or refused.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn give(
        &self,
        member: Member,
        command: Command,
        owner: String,
        reason: String,
    ) -> Result<Done, Refusal> {
        self.act(OperatorAction::Command { member, command, owner, reason }).await
    }

    /// Says that an alarm was seen, and waits until that is in the journal.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn acknowledge(&self, acknowledgement: Acknowledgement) -> Result<Done, Refusal> {
        self.act(OperatorAction::Acknowledge(acknowledgement)).await
    }

    /// The same from a thread that has nothing else to do.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn acknowledge_and_wait(&self, acknowledgement: Acknowledgement) -> Result<Done, Refusal> {
        self.act_and_wait(&OperatorAction::Acknowledge(acknowledgement))
    }

    /// Has an order recorded that was refused. Where no process writes the run there is no journal that could have it.
    pub fn refused_and_wait(&self, order: RefusedOrder) {
        let _ = self.act_and_wait(&OperatorAction::Refused(order));
    }

    /// Does what an operator wants, from a thread that has nothing else to do.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn act_and_wait(&self, action: &OperatorAction) -> Result<Done, Refusal> {
        block_on(self.act(action.clone()))?
    }

    /// Does what an operator wants, and waits until it is done or refused.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn act(&self, action: OperatorAction) -> Result<Done, Refusal> {
        match &self.0 {
            Way::Run(run) => socket::ask(run, &action).await,
            Way::Queue(queue) => {
                let (answer, answered) = oneshot::channel();
                let commanded = Commanded { action, answer };
                queue.try_send(commanded).map_err(|_| Refusal::Busy)?;
                answered.await.unwrap_or(Err(Refusal::Busy))
            }
        }
    }
}

impl Commands {
    /// The next action; waits until there is one.
    pub async fn next(&mut self) -> Commanded {
        match self.receiver.recv().await {
            Some(commanded) => commanded,
            // A sender is held here.
            None => std::future::pending().await,
        }
    }

    /// Another end for whoever acts.
    pub fn commander(&self) -> Commander {
        Commander(Way::Queue(self.sender.clone()))
    }
}
