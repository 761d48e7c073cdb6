//! What all answers are made from.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};

use tokio::sync::{Semaphore, watch};
use understudy_scenarios::Commander;
use understudy_view::Run;

use crate::api::not_remembered;
use crate::error::Problem;
use crate::login::{Logins, Person, Role};
use crate::model::{Known, Model};

/// Viewers at once that are told what is newest.
pub(crate) const MAXIMUM_VIEWERS: usize = 100;

/// Whether the page may command, and whom.
#[derive(Debug, Clone)]
pub enum Commanding {
    /// It may: the laboratory runs in this process.
    Allowed(Commander),
    /// It may not, for this reason.
    Forbidden(&'static str),
}

#[derive(Debug)]
pub(crate) struct App {
    model: Arc<RwLock<Model>>,
    /// The newest state as JSON, written once for all viewers.
    pub(crate) newest: watch::Receiver<Arc<str>>,
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
        newest: watch::Receiver<Arc<str>>,
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
    pub(crate) fn why_not(&self, person: &Person) -> Option<&'static str> {
        match &self.commanding {
            Commanding::Forbidden(why) => Some(why),
            Commanding::Allowed(_) if person.role == Role::Viewer => {
                Some("whoever is logged in may only look")
            }
            Commanding::Allowed(_) => None,
        }
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
        let run = Run::open(&self.run).map_err(|error| Problem::unrecorded(error.to_string()))?;
        let known = Arc::new(Known::of_journal(&run, cycle));
        if !remembers(&known) {
            return Err(not_remembered(cycle));
        }
        *older = Some(Arc::clone(&known));
        Ok(known)
    }

    /// False where the run has no such alarm.
    pub(crate) fn acknowledge(&self, alarm: u64, by: String) -> bool {
        self.model
            .write()
            .unwrap_or_else(PoisonError::into_inner)
            .acknowledge(alarm, &by)
    }
}
