//! One member: its lines as long as it is received, and calls again when it is not.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::mpsc::Sender;
use understudy_bus::{Call, Peer, Told as Followed};
use understudy_wire::Member;

use crate::found::{Line, Vain};

/// Reason of a member whose lines do not arrive over a connection that was open.
const NOTHING_RECEIVED: &str = "nothing is received from it";

/// Between two calls to a member that was not received.
const AGAIN: Duration = Duration::from_secs(2);

/// Messages to the recorder.
pub(crate) enum Told {
    /// A line of the member's journal.
    Line(Member, String),
    /// So many lines of it were lost.
    Lost(Member, u64),
    /// It is received from now on.
    Attached(Member),
    /// It is not received, and why.
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
        let mut call = first;
        let mut said = None;
        while !self.ends.load(Ordering::Relaxed) {
            let reason = match call {
                Ok(call) => {
                    let other = self.follow(call, &mut said);
                    other.unwrap_or_else(|| NOTHING_RECEIVED.to_owned())
                }
                Err(reason) => reason,
            };
            if !self.detached(&mut said, reason) {
                return;
            }
            std::thread::sleep(AGAIN);
            call = self.line.call(&self.peer).map_err(Vain::words);
        }
    }

    /// Tells why the member is not received: once for all attempts. False where the recorder has ended.
    fn detached(&self, said: &mut Option<String>, reason: String) -> bool {
        if said.as_ref() == Some(&reason) || self.ends.load(Ordering::Relaxed) {
            return true;
        }
        *said = Some(reason.clone());
        self.told.blocking_send(Told::Detached(self.peer.member, reason)).is_ok()
    }

    /// Until nothing is received for too long, or it starts again with what cannot be shown here: the reason.
    fn follow(&self, call: Call, said: &mut Option<String>) -> Option<String> {
        let member = self.peer.member;
        let call = Arc::new(call);
        self.calls.set(member, Some(Arc::clone(&call)));
        let (mut is_attached, mut other) = (false, None);
        // The caller reports that it cannot be followed.
        let _ = call.follow(self.line.patience, |followed| {
            let told = match followed {
                Followed::By(reporter) => {
                    let checked = reporter.ok_or(Vain::Older).and_then(|by| self.line.check(by));
                    other = checked.err().map(Vain::words);
                    if other.is_some() || std::mem::replace(&mut is_attached, true) {
                        return other.is_none();
                    }
                    *said = None;
                    Told::Attached(member)
                }
                Followed::Line(line) => Told::Line(member, line.to_owned()),
                Followed::Lost(lines) => Told::Lost(member, lines),
                // The connection may be dead, or the member: its last lines are not the present.
                Followed::Silent => {
                    is_attached = false;
                    return self.detached(said, NOTHING_RECEIVED.to_owned());
                }
            };
            self.told.blocking_send(told).is_ok() && !self.ends.load(Ordering::Relaxed)
        });
        self.calls.set(member, None);
        other
    }
}
