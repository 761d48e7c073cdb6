//! One member: its words as long as it is heard, and calls again when it is not.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::mpsc::Sender;
use understudy_bus::{Call, Peer, Told as Followed};
use understudy_wire::Member;

use crate::found::{Line, Vain};

/// Between two calls to a member that was not heard.
const AGAIN: Duration = Duration::from_secs(2);

/// Messages to the recorder.
pub(crate) enum Told {
    /// A line of the member's journal.
    Line(Member, String),
    /// So many lines of it were lost.
    Lost(Member, u64),
    /// It is heard from now on.
    Attached(Member),
    /// It is not heard, and why.
    Detached(Member, String),
}

/// Open calls, for commands.
#[derive(Clone, Default)]
pub(crate) struct Calls(Arc<Mutex<BTreeMap<Member, Arc<Call>>>>);

impl Calls {
    pub(crate) fn to(&self, member: Member) -> Option<Arc<Call>> {
        self.lock(|calls| calls.get(&member).cloned())
    }

    fn set(&self, member: Member, call: Option<Arc<Call>>) {
        self.lock(|calls| match call {
            Some(call) => calls.insert(member, call),
            None => calls.remove(&member),
        });
    }

    fn lock<T>(&self, work: impl FnOnce(&mut BTreeMap<Member, Arc<Call>>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Follows one member until the end is requested.
pub(crate) struct Follower {
    pub(crate) peer: Peer,
    pub(crate) line: Line,
    pub(crate) told: Sender<Told>,
    pub(crate) calls: Calls,
    pub(crate) ends: Arc<AtomicBool>,
}

impl Follower {
    pub(crate) fn run(self, first: Result<Call, String>) {
        let member = self.peer.member;
        let mut call = first;
        let mut said = String::new();
        while !self.ends.load(Ordering::Relaxed) {
            let reason = match call {
                Ok(call) => {
                    said.clear();
                    self.follow(call).unwrap_or_else(|| "it ceased to be heard".to_owned())
                }
                Err(reason) => reason,
            };
            // Reported once for all attempts.
            if said != reason && !self.ends.load(Ordering::Relaxed) {
                said.clone_from(&reason);
                if self.told.blocking_send(Told::Detached(member, reason)).is_err() {
                    return;
                }
            }
            std::thread::sleep(AGAIN);
            call = self.line.call(&self.peer).map_err(Vain::words);
        }
    }

    /// Until it is silent for too long, or starts again with what cannot be shown here: the reason.
    fn follow(&self, call: Call) -> Option<String> {
        let member = self.peer.member;
        let call = Arc::new(call);
        self.calls.set(member, Some(Arc::clone(&call)));
        let (mut heard, mut other) = (false, None);
        // The caller reports that it cannot be followed.
        let _ = call.follow(self.line.patience, |followed| {
            let told = match followed {
                Followed::By(reporter) => {
                    let checked = reporter.ok_or(Vain::Older).and_then(|by| self.line.check(by));
                    other = checked.err().map(Vain::words);
                    return other.is_none()
                        && (std::mem::replace(&mut heard, true)
                            || self.told.blocking_send(Told::Attached(member)).is_ok());
                }
                Followed::Line(line) => Told::Line(member, line.to_owned()),
                Followed::Lost(lines) => Told::Lost(member, lines),
            };
            self.told.blocking_send(told).is_ok() && !self.ends.load(Ordering::Relaxed)
        });
        self.calls.set(member, None);
        other
    }
}
