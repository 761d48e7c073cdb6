//! Shared state of the server.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};

use tokio::sync::{Semaphore, watch};
use understudy_bus::RefusedOrder;
use understudy_journal::{Commander, OperatorAction, WriteSessions};
use understudy_view::{Alarm, Reading, Run};

use crate::api::not_remembered;
use crate::error::Problem;
use crate::follower::Newest;
use understudy_wire::Role;

use crate::guard::Gate;
use crate::login::Person;
use crate::model::{Known, Model};

/// Viewers at once that follow the newest state.
pub(crate) const MAXIMUM_VIEWERS: usize = 100;

/// Commands that the page may give.
#[derive(Debug, Clone)]
pub struct Commanding {
    /// Reaches the process that writes the run, for commands and acknowledgements.
    pub commander: Commander,
    /// Reason why no command can be given; alarms can be acknowledged all the same.
    pub forbidden: Option<String>,
    /// Whether commands are refused until the scenario is over.
    pub after_scenario: bool,
    /// Commands that are impossible in this run, each with the reason.
    pub impossible: Vec<(&'static str, String)>,
    /// Person in whose name a page without logins commands: the one of the keys that it uses. `None`: the name that is entered.
    pub person: Option<String>,
}

impl Commanding {
    /// Has an order recorded that was refused here. Where no process writes the run there is no journal that could have it.
    pub(crate) async fn record_refused(&self, order: Option<RefusedOrder>) {
        if let Some(order) = order {
            let _ = self.commander.act(OperatorAction::Refused(order)).await;
        }
    }
}

#[derive(Debug)]
pub(crate) struct App {
    model: Arc<RwLock<Model>>,
    pub(crate) newest: watch::Receiver<Newest>,
    pub(crate) commanding: Commanding,
    /// Writes to operator inputs.
    pub(crate) writes: WriteSessions,
    pub(crate) gate: Arc<Gate>,
    pub(crate) run: PathBuf,
    pub(crate) viewers: Arc<Semaphore>,
    /// One other journal is read at a time.
    pub(crate) reader: Semaphore,
    /// The run as it was read again for a cycle that is not remembered any more.
    older: Mutex<Option<Arc<Known>>>,
}

impl App {
    pub(crate) fn new(
        model: Arc<RwLock<Model>>,
        newest: watch::Receiver<Newest>,
        commanding: Commanding,
        gate: Arc<Gate>,
        run: PathBuf,
    ) -> Self {
        Self {
            model,
            newest,
            writes: WriteSessions::new(commanding.commander.clone()),
            commanding,
            gate,
            run,
            viewers: Arc::new(Semaphore::new(MAXIMUM_VIEWERS)),
            reader: Semaphore::new(1),
            older: Mutex::default(),
        }
    }

    /// The model, locked for an answer.
    pub(crate) fn model(&self) -> RwLockReadGuard<'_, Model> {
        self.model.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reason why a person may not give commands, if there is one.
    pub(crate) fn why_not(&self, person: &Person) -> Option<&str> {
        let forbidden = self.commanding.forbidden.as_deref();
        let role = (person.role < Role::Engineer).then_some("only an engineer may give commands");
        forbidden.or(role)
    }

    /// Reason why a person may not write operator inputs, if there is one.
    pub(crate) fn why_not_write(&self, person: &Person) -> Option<&str> {
        let forbidden = self.commanding.forbidden.as_deref();
        forbidden.or_else(|| Self::why_not_act(person))
    }

    /// Reason why a person may change nothing, if there is one.
    pub(crate) fn why_not_act(person: &Person) -> Option<&'static str> {
        (person.role < Role::Operator).then_some("a viewer may not change anything")
    }

    /// The run up to a cycle that is not remembered any more, from its journal. It blocks the thread.
    pub(crate) fn reread(&self, cycle: i64) -> Result<Arc<Known>, Problem> {
        let mut older = self.older.lock().unwrap_or_else(PoisonError::into_inner);
        let remembers = |known: &Known| {
            let ends = known.run.oldest().zip(known.run.newest());
            ends.is_some_and(|(oldest, newest)| (oldest..=newest).contains(&cycle))
        };
        if let Some(known) = older.as_ref().filter(|known| remembers(known)) {
            return Ok(Arc::clone(known));
        }
        let run = Run::open(&self.run).map_err(|error| Problem::of_view(&error))?;
        let known = Known::of_journal(&run, cycle).map_err(|error| Problem::of_view(&error))?;
        let known = Arc::new(known);
        if !remembers(&known) {
            return Err(not_remembered(cycle));
        }
        *older = Some(Arc::clone(&known));
        Ok(known)
    }

    /// The alarm of a number.
    pub(crate) fn alarm(&self, number: u64) -> Result<Option<Alarm>, Reading> {
        let model = self.model();
        let mut alarms = model.present()?.into_iter().flat_map(|known| known.run.alarms());
        Ok(alarms.find(|alarm| alarm.number == number).cloned())
    }
}
