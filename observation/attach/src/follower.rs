//! One party: its words as long as it is heard, and calls again when it is not.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::mpsc::Sender;
use understudy_bus::{Call, Peer};
use understudy_wire::Party;

use crate::found::{Line, Vain};

/// Between two calls to a party that was not heard.
const AGAIN: Duration = Duration::from_secs(2);

/// What the recorder is told.
pub(crate) enum Told {
    /// A line of the party's journal.
    Line(Party, String),
    /// It is heard from now on.
    Attached(Party),
    /// It is not heard, and why.
    Detached(Party, String),
}

/// The calls that stand, for commands.
#[derive(Clone, Default)]
pub(crate) struct Calls(Arc<Mutex<BTreeMap<Party, Arc<Call>>>>);

impl Calls {
    pub(crate) fn to(&self, party: Party) -> Option<Arc<Call>> {
        self.lock(|calls| calls.get(&party).cloned())
    }

    fn set(&self, party: Party, call: Option<Arc<Call>>) {
        self.lock(|calls| match call {
            Some(call) => calls.insert(party, call),
            None => calls.remove(&party),
        });
    }

    fn lock<T>(&self, work: impl FnOnce(&mut BTreeMap<Party, Arc<Call>>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Follows one party until it is told to end.
pub(crate) struct Follower {
    pub(crate) peer: Peer,
    pub(crate) line: Line,
    pub(crate) told: Sender<Told>,
    pub(crate) calls: Calls,
    pub(crate) ends: Arc<AtomicBool>,
}

impl Follower {
    pub(crate) fn run(self, first: Result<Call, String>) {
        let party = self.peer.party;
        let mut call = first;
        let mut said = String::new();
        while !self.ends.load(Ordering::Relaxed) {
            let reason = match call {
                Ok(call) => {
                    self.follow(call);
                    said.clear();
                    "it ceased to be heard".to_owned()
                }
                Err(reason) => reason,
            };
            // Said once, however often it is tried.
            if said != reason && !self.ends.load(Ordering::Relaxed) {
                said.clone_from(&reason);
                if self
                    .told
                    .blocking_send(Told::Detached(party, reason))
                    .is_err()
                {
                    return;
                }
            }
            std::thread::sleep(AGAIN);
            call = self.line.call(&self.peer).map_err(Vain::words);
        }
    }

    /// Until it is silent for too long.
    fn follow(&self, call: Call) {
        let party = self.peer.party;
        let call = Arc::new(call);
        self.calls.set(party, Some(Arc::clone(&call)));
        let mut heard = false;
        // That it cannot be followed is said by whoever called this.
        let _ = call.follow(self.line.patience, |line| {
            if !std::mem::replace(&mut heard, true)
                && self.told.blocking_send(Told::Attached(party)).is_err()
            {
                return false;
            }
            let told = Told::Line(party, line.to_owned());
            self.told.blocking_send(told).is_ok() && !self.ends.load(Ordering::Relaxed)
        });
        self.calls.set(party, None);
    }
}
