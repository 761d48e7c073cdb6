//! What is wanted of a running member.

use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_cycle::ChangeOrder;
use understudy_wire::{
    Force, Member, OrderRefusal, ProgramSet, StateChoice, StationSet, Unforce, Via, Write,
    WriteAnswer,
};

use crate::doorbell::{Inbox, Outbox, doorbell};
use crate::error::BusError;
use crate::writes::{Answers, WRITES_PER_SECOND, WriteLimiter, answers};

/// Orders that wait, at most; what comes on top of them is dropped. To stop and to cut are never dropped.
const BOUND: usize = 16;

/// One order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Order {
    /// To end.
    Stop,
    /// The operator releases the outputs of a program that was started cold.
    Release,
    /// The operator chooses the state that a program continues from.
    Choose(StateChoice),
    /// The operator puts a value in the place of a signal.
    Force(Force),
    /// The operator takes it back.
    Unforce(Unforce),
    /// An operator writes a value.
    Write(Write),
    /// An engineer moves an online change on.
    Change(ChangeOrder),
    /// The laboratory cuts these links and pulls these cables, and no others.
    Cut(Cuts),
}

/// An order with the caller who waits for its outcome.
#[derive(Debug)]
pub(crate) struct Given {
    pub(crate) order: Order,
    caller: Option<SyncSender<Obeyed>>,
}

impl Given {
    /// Tells the caller what became of the order; never blocks.
    pub(crate) fn answer(self, obeyed: Obeyed) {
        if let Some(caller) = self.caller {
            // A caller who does not wait any more needs no answer.
            let _ = caller.try_send(obeyed);
        }
    }
}

/// What became of an order of an operator; nothing where the member does not take such orders.
pub(crate) type Obeyed = Option<Result<(), OrderRefusal>>;

/// Why the outcome of an order is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// It was not taken: too many wait.
    Full,
    /// It was taken, and the member has not answered in time.
    Late,
}

/// Members whose frames a member of a laboratory drops, as if the links from them were cut, and networks that it is unplugged from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Cuts {
    stations: StationSet,
    remote_ios: ProgramSet,
    #[serde(default, skip_serializing_if = "is_none")]
    twins: ProgramSet,
    #[serde(default, skip_serializing_if = "is_plugged")]
    unplugged: [bool; Via::ALL.len()],
}

fn is_none(twins: &ProgramSet) -> bool {
    twins.is_empty()
}

fn is_plugged(unplugged: &[bool; Via::ALL.len()]) -> bool {
    *unplugged == [false; Via::ALL.len()]
}

impl Cuts {
    /// Pulls the cable to a network, or the direct link, or plugs it in again.
    pub fn unplug(&mut self, via: Via, is_unplugged: bool) {
        self.unplugged[via.index()] = is_unplugged;
    }

    /// Cuts the networks between a member and this one, or heals them; the direct link stays. A plant stays with its remote I/O.
    pub fn set(&mut self, member: Member, cut: bool) {
        match (member, cut) {
            (Member::Station(station), true) => self.stations.insert(station),
            (Member::Station(station), false) => self.stations.remove(station),
            (Member::RemoteIo(program), true) => self.remote_ios.insert(program),
            (Member::RemoteIo(program), false) => self.remote_ios.remove(program),
            (Member::Twin(program), true) => self.twins.insert(program),
            (Member::Twin(program), false) => self.twins.remove(program),
            (Member::Plant(_), _) => {}
        }
    }

    fn has_cuts(self) -> bool {
        !(self.stations.is_empty() && self.remote_ios.is_empty() && self.twins.is_empty())
    }

    pub(crate) fn contains(self, member: Member) -> bool {
        match member {
            Member::Station(station) => self.stations.contains(station),
            Member::RemoteIo(program) => self.remote_ios.contains(program),
            Member::Twin(program) => self.twins.contains(program),
            Member::Plant(_) => false,
        }
    }
}

/// What holds from an order until the next one of its kind; it waits in no queue, so that none of it is lost.
#[derive(Debug, Default)]
struct Standing {
    stopping: AtomicBool,
    cuts: Mutex<Cuts>,
}

impl Standing {
    fn cuts(&self) -> MutexGuard<'_, Cuts> {
        self.cuts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The member's end.
#[derive(Debug)]
pub struct Orders {
    inbox: Inbox<Given>,
    standing: Arc<Standing>,
    limiter: Arc<WriteLimiter>,
    answers: Answers,
}

/// The end of whoever gives orders; may be cloned, and used from any thread.
#[derive(Debug, Clone)]
pub struct Control {
    outbox: Outbox<Given>,
    standing: Arc<Standing>,
    limiter: Arc<WriteLimiter>,
    answers: Arc<Mutex<Option<Receiver<WriteAnswer>>>>,
}

/// Both ends.
///
/// # Errors
/// [`BusError::System`] where there is no eventfd to be had.
pub fn orders() -> Result<(Control, Orders), BusError> {
    let (outbox, inbox) = doorbell(BOUND).map_err(BusError::system("an eventfd for orders"))?;
    let standing = Arc::new(Standing::default());
    let limiter = Arc::new(WriteLimiter::new(WRITES_PER_SECOND));
    let (answers, given) = answers();
    let control = Control {
        outbox,
        standing: Arc::clone(&standing),
        limiter: Arc::clone(&limiter),
        answers: Arc::new(Mutex::new(Some(given))),
    };
    let orders = Orders { inbox, standing, limiter, answers };
    Ok((control, orders))
}

impl Control {
    /// Gives an order; never blocks. False where it was not taken, because too many wait or too many writes came.
    pub fn give(&self, order: Order) -> bool {
        match &order {
            Order::Write(write) if !self.limiter.admits(&write.owner) => return false,
            Order::Stop => self.standing.stopping.store(true, Ordering::SeqCst),
            Order::Cut(cuts) => {
                *self.standing.cuts() = *cuts;
                return true;
            }
            _ => {}
        }
        self.outbox.put(Given { order, caller: None })
    }

    /// Gives an order of an operator, and waits until the member has obeyed or refused it.
    pub(crate) fn ask(&self, order: Order, patience: Duration) -> Result<Obeyed, Unknown> {
        let (caller, answered) = sync_channel(1);
        if !self.outbox.put(Given { order, caller: Some(caller) }) {
            return Err(Unknown::Full);
        }
        answered.recv_timeout(patience).map_err(|_| Unknown::Late)
    }

    /// The answers to writes; once.
    pub(crate) fn take_answers(&self) -> Option<Receiver<WriteAnswer>> {
        let mut answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        answers.take()
    }
}

impl Orders {
    pub(crate) fn take(&self) -> Option<Given> {
        if self.standing.stopping.load(Ordering::SeqCst) {
            return Some(Given { order: Order::Stop, caller: None });
        }
        self.inbox.take()
    }

    /// Answers a write; never blocks.
    pub(crate) fn answer(&self, answer: WriteAnswer) {
        self.answers.give(answer);
    }

    /// Writes that were not taken since this was last asked.
    pub(crate) fn take_refused_writes(&self) -> u64 {
        self.limiter.take_refused()
    }

    /// Whether the networks between a member and this one are cut.
    pub(crate) fn is_cut(&self, member: Member) -> bool {
        self.standing.cuts().contains(member)
    }

    /// Whether the networks between any member and this one are cut.
    pub(crate) fn has_cuts(&self) -> bool {
        self.standing.cuts().has_cuts()
    }

    /// By path, whether the cable to it is pulled.
    pub(crate) fn unplugged(&self) -> [bool; Via::ALL.len()] {
        self.standing.cuts().unplugged
    }

    pub(crate) fn readiness(&self) -> BorrowedFd<'_> {
        self.inbox.readiness()
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{ProgramId, StationId};

    use super::*;

    const ROBOT: Member = Member::Station(StationId(0));
    const PRESS_IO: Member = Member::RemoteIo(ProgramId(1));

    #[test]
    fn a_cut_is_not_lost_where_orders_are() {
        let (control, orders) = orders().expect("an eventfd");
        for _ in 0..=BOUND {
            control.give(Order::Release);
        }
        let mut cuts = Cuts::default();
        cuts.set(ROBOT, true);
        cuts.set(PRESS_IO, true);
        control.give(Order::Cut(cuts));
        assert!(orders.is_cut(ROBOT) && orders.is_cut(PRESS_IO));
        assert!(!orders.is_cut(Member::Station(StationId(1))));
        assert!(!orders.is_cut(Member::RemoteIo(ProgramId(0))));
        cuts.set(ROBOT, false);
        control.give(Order::Cut(cuts));
        assert!(!orders.is_cut(ROBOT) && orders.is_cut(PRESS_IO));
    }

    #[test]
    fn a_plant_stays_with_its_remote_io() {
        let plant = Member::Plant(ProgramId(1));
        let mut cuts = Cuts::default();
        cuts.set(plant, true);
        assert_eq!(cuts, Cuts::default());
        assert!(!cuts.contains(plant));
    }
}
