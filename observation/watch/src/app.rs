//! What all answers are made from.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};

use tokio::sync::{Semaphore, watch};
use understudy_journal::Commander;
use understudy_view::{Alarm, Reading, Run};

use crate::api::not_remembered;
use crate::error::Problem;
use crate::follower::Newest;
use crate::login::{Logins, Person, Role};
use crate::model::{Known, Model};

/// Viewers at once that are told what is newest.
pub(crate) const MAXIMUM_VIEWERS: usize = 100;

/// What the page may do to the run besides looking.
#[derive(Debug, Clone)]
pub struct Commanding {
    /// Reaches whoever writes the run: for commands, and for alarms that somebody has seen.
    pub commander: Commander,
    /// Why nothing can be commanded; alarms can be acknowledged all the same.
    pub forbidden: Option<String>,
    /// Commands that cannot be given in this run, each with the reason.
    pub impossible: Vec<(&'static str, String)>,
}

#[derive(Debug)]
pub(crate) struct App {
    model: Arc<RwLock<Model>>,
    pub(crate) newest: watch::Receiver<Newest>,
    pub(crate) commanding: Commanding,
    pub(crate) logins: Option<Logins>,
    /// Under which the page is known besides its addresses.
    pub(crate) names: Vec<String>,
    pub(crate) run: PathBuf,
    pub(crate) viewers: Arc<Semaphore>,
    /// One other journal is read at a time.
    pub(crate) reader: Semaphore,
    /// What was read again from the journal for cycles that are not remembered any more.
    older: Mutex<Option<Arc<Known>>>,
}

impl App {
    pub(crate) fn new(
        model: Arc<RwLock<Model>>,
        newest: watch::Receiver<Newest>,
        commanding: Commanding,
        logins: Option<Logins>,
        names: Vec<String>,
        run: PathBuf,
    ) -> Self {
        Self {
            model,
            newest,
            commanding,
            logins,
            names,
            run,
            viewers: Arc::new(Semaphore::new(MAXIMUM_VIEWERS)),
            reader: Semaphore::new(1),
            older: Mutex::default(),
        }
    }

    /// For the time of an answer; the follower waits meanwhile.
    pub(crate) fn model(&self) -> RwLockReadGuard<'_, Model> {
        self.model.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why somebody may not command; nothing where they may.
    pub(crate) fn why_not(&self, person: &Person) -> Option<&str> {
        let forbidden = self.commanding.forbidden.as_deref();
        forbidden.or_else(|| Self::why_not_act(person))
    }

    /// Why somebody may do nothing but look.
    pub(crate) fn why_not_act(person: &Person) -> Option<&'static str> {
        (person.role == Role::Viewer).then_some("whoever is logged in may only look")
    }

    /// What the journal says of a cycle that is not remembered any more. To be called where nobody else waits for the thread.
    pub(crate) fn reread(&self, cycle: i64) -> Result<Arc<Known>, Problem> {
        let mut older = self.older.lock().unwrap_or_else(PoisonError::into_inner);
        let remembers = |known: &Known| {
            let ends = known.oldest().zip(known.newest());
            ends.is_some_and(|(oldest, newest)| (oldest..=newest).contains(&cycle))
        };
        if let Some(known) = older.as_ref().filter(|known| remembers(known)) {
            return Ok(Arc::clone(known));
        }
        let run = Run::open(&self.run).map_err(|error| Problem::of_view(&error))?;
        let known = Arc::new(Known::of_journal(&run, cycle));
        if !remembers(&known) {
            return Err(not_remembered(cycle));
        }
        *older = Some(Arc::clone(&known));
        Ok(known)
    }

    /// The alarm of a number.
    pub(crate) fn alarm(&self, number: u64) -> Result<Option<Alarm>, Reading> {
        let model = self.model();
        let mut alarms = model
            .present()?
            .into_iter()
            .flat_map(|known| known.run.alarms());
        Ok(alarms.find(|alarm| alarm.number == number).cloned())
    }
}
