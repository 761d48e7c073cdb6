//! Online changes at one member: loaded by a thread that may take its time, handed to the cycle, and kept on disk.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use understudy_cycle::{ChangeOrder, Changing, OnlineChange};
use understudy_wire::{ChangeRequest, ConfigurationHash, Configurations};

use crate::channel::{DONE, given};
use crate::orders::{Control, Order};

/// What a member loads a change with, and where it keeps it.
pub trait ChangeKeeper: Send {
    /// Loads the change of these texts, as JSON.
    ///
    /// # Errors
    /// Why they are not a change of this cluster, with a code.
    fn load(&mut self, texts: &str) -> Result<Arc<OnlineChange>, String>;

    /// Reads the texts of a change from a file.
    ///
    /// # Errors
    /// Why it cannot be read, with a code.
    fn read(&mut self, file: &str) -> Result<String, String>;

    /// Keeps the loaded change with these configurations, so that the member has them when it starts again; answers with the canonical text of its own.
    ///
    /// # Errors
    /// Why they are not kept, with a code: the member has them until it ends.
    fn keep(&mut self, configurations: Configurations) -> Result<String, String>;
}

/// What a member knows of online changes outside of its cycle. May be cloned; all clones are of one member.
#[derive(Clone)]
pub struct Changes {
    known: Arc<Mutex<Known>>,
    /// Held while an order is given: one after another.
    keeper: Arc<Mutex<Option<Box<dyn ChangeKeeper>>>>,
}

struct Known {
    changing: Changing,
    text: String,
}

impl Changes {
    /// A member that starts with these configurations, the first of them of the canonical text `text`, and with the change between them; without a
    /// keeper it takes no change.
    pub fn new(
        configurations: Configurations,
        change: Option<Arc<OnlineChange>>,
        text: String,
        keeper: Option<Box<dyn ChangeKeeper>>,
    ) -> Self {
        let mut changing = Changing::new(configurations.own);
        if let (Some(change), Some(_)) = (change, configurations.prepared) {
            // It is a change of this configuration, since the member runs with it.
            let _ = changing.take(&ChangeOrder::Prepare(change), true);
        }
        let known = Arc::new(Mutex::new(Known { changing, text }));
        Self { known, keeper: Arc::new(Mutex::new(keeper)) }
    }

    /// A member of this configuration that takes no change.
    pub fn none(own: ConfigurationHash) -> Self {
        Self::new(Configurations { own, prepared: None }, None, String::new(), None)
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The configuration of the member, and the one that it has loaded beside it.
    pub(crate) fn configurations(&self) -> Configurations {
        self.known().changing.configurations()
    }

    /// The canonical text of the member's configuration.
    pub(crate) fn text(&self) -> String {
        self.known().text.clone()
    }

    /// Whether an order is for the signals of this member: those of both configurations of a change are the same.
    pub(crate) fn admits(&self, theirs: &str) -> bool {
        let Configurations { own, prepared } = self.configurations();
        let is_same = |hash: ConfigurationHash| theirs == hash.to_string();
        is_same(own) || prepared.is_some_and(is_same)
    }

    /// Loads a change from its texts; the answer to who asked.
    pub(crate) fn prepare(&self, control: &Control, texts: &str) -> String {
        self.with_keeper(|keeper| {
            let change = keeper.load(texts)?;
            self.give(control, keeper, ChangeOrder::Prepare(change))
        })
    }

    /// Moves a change on; the answer to who asked.
    pub(crate) fn take(&self, control: &Control, request: &ChangeRequest) -> String {
        self.with_keeper(|keeper| {
            let order = match request {
                ChangeRequest::Prepare { file } => {
                    let texts = keeper.read(file)?;
                    ChangeOrder::Prepare(keeper.load(&texts)?)
                }
                ChangeRequest::Switch { change, to } => ChangeOrder::Switch(*change, *to),
                ChangeRequest::Run { change, configuration } => {
                    ChangeOrder::Run(*change, *configuration)
                }
                ChangeRequest::Forget { change, configuration } => {
                    ChangeOrder::Forget(*change, *configuration)
                }
            };
            self.give(control, keeper, order)
        })
    }

    fn with_keeper(
        &self,
        order: impl FnOnce(&mut Box<dyn ChangeKeeper>) -> Result<String, String>,
    ) -> String {
        let mut keeper = self.keeper.lock().unwrap_or_else(PoisonError::into_inner);
        let none = || Err("U0632: this member takes no online change".to_owned());
        keeper.as_mut().map_or_else(none, order).unwrap_or_else(|reason| reason)
    }

    /// Gives an order to the cycle, and keeps what it leads to.
    fn give(
        &self,
        control: &Control,
        keeper: &mut Box<dyn ChangeKeeper>,
        order: ChangeOrder,
    ) -> Result<String, String> {
        let answer = given(control, Order::Change(order.clone()));
        if answer != DONE || matches!(order, ChangeOrder::Switch(..)) {
            return Ok(answer);
        }
        let configurations = {
            let changing = &mut self.known().changing;
            // The cycle has taken the same order.
            let _ = changing.take(&order, true);
            changing.configurations()
        };
        self.known().text = keeper.keep(configurations)?;
        Ok(answer)
    }
}
