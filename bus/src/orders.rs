//! What is wanted of a running party.

use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use understudy_wire::{Force, SignalPlace, StateChoice};

use crate::doorbell::{Inbox, Outbox, doorbell};
use crate::error::BusError;

/// Orders that wait, at most; what comes on top of them is dropped. To stop is never dropped.
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
    Unforce(SignalPlace),
}

/// The party's end.
#[derive(Debug)]
pub struct Orders {
    inbox: Inbox<Order>,
    stopping: Arc<AtomicBool>,
}

/// The end of whoever gives orders; may be cloned, and used from any thread.
#[derive(Debug, Clone)]
pub struct Control {
    outbox: Outbox<Order>,
    stopping: Arc<AtomicBool>,
}

/// Both ends.
///
/// # Errors
/// [`BusError::System`] where there is no eventfd to be had.
pub fn orders() -> Result<(Control, Orders), BusError> {
    let (outbox, inbox) = doorbell(BOUND).map_err(BusError::system("an eventfd for orders"))?;
    let stopping = Arc::new(AtomicBool::new(false));
    let control = Control {
        outbox,
        stopping: Arc::clone(&stopping),
    };
    Ok((control, Orders { inbox, stopping }))
}

impl Control {
    /// Gives an order; never blocks.
    pub fn give(&self, order: Order) {
        if order == Order::Stop {
            self.stopping.store(true, Ordering::SeqCst);
        }
        self.outbox.put(order);
    }
}

impl Orders {
    pub(crate) fn take(&self) -> Option<Order> {
        if self.stopping.load(Ordering::SeqCst) {
            return Some(Order::Stop);
        }
        self.inbox.take()
    }

    pub(crate) fn readiness(&self) -> BorrowedFd<'_> {
        self.inbox.readiness()
    }
}
