//! A bounded queue whose reader sleeps in ppoll.
//!
//! Invariant: whoever puts something in makes the file descriptor readable, unless it already is; so a reader that finds the
//! queue empty after [`Inbox::take`] may sleep on [`Inbox::readiness`] and misses nothing.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use nix::sys::eventfd::{EfdFlags, EventFd};

/// The reader's end.
#[derive(Debug)]
pub(crate) struct Inbox<T> {
    receiver: Receiver<T>,
    bell: Arc<Bell>,
}

/// The writers' end.
#[derive(Debug)]
pub(crate) struct Outbox<T> {
    sender: SyncSender<T>,
    bell: Arc<Bell>,
}

impl<T> Clone for Outbox<T> {
    fn clone(&self) -> Self {
        Self {
            sender: self.sender.clone(),
            bell: Arc::clone(&self.bell),
        }
    }
}

#[derive(Debug)]
struct Bell {
    eventfd: EventFd,
    rung: AtomicBool,
    dropped: AtomicU64,
}

/// A queue of at most `bound` items; what comes on top of them is dropped and counted.
pub(crate) fn doorbell<T>(bound: usize) -> nix::Result<(Outbox<T>, Inbox<T>)> {
    let (sender, receiver) = sync_channel(bound);
    let bell = Arc::new(Bell {
        eventfd: EventFd::from_flags(EfdFlags::EFD_NONBLOCK | EfdFlags::EFD_CLOEXEC)?,
        rung: AtomicBool::new(false),
        dropped: AtomicU64::new(0),
    });
    let outbox = Outbox {
        sender,
        bell: Arc::clone(&bell),
    };
    Ok((outbox, Inbox { receiver, bell }))
}

impl<T> Outbox<T> {
    /// Never blocks.
    pub(crate) fn put(&self, item: T) {
        if self.sender.try_send(item).is_err() {
            self.bell.dropped.fetch_add(1, Ordering::Relaxed);
        }
        if !self.bell.rung.swap(true, Ordering::SeqCst) {
            // It can fail only where the counter is full, and then it is readable.
            let _ = self.bell.eventfd.write(1);
        }
    }
}

impl<T> Inbox<T> {
    /// The next item; never blocks.
    pub(crate) fn take(&self) -> Option<T> {
        if let Ok(item) = self.receiver.try_recv() {
            return Some(item);
        }
        if !self.bell.rung.load(Ordering::SeqCst) {
            return None;
        }
        // The descriptor is emptied before `rung` is cleared: a writer in between does not ring, but its item is in the queue
        // by then, and is found below.
        let _ = self.bell.eventfd.read();
        self.bell.rung.store(false, Ordering::SeqCst);
        self.receiver.try_recv().ok()
    }

    /// Readable when there is something to take.
    pub(crate) fn readiness(&self) -> BorrowedFd<'_> {
        self.bell.eventfd.as_fd()
    }

    /// How many items found the queue full.
    pub(crate) fn dropped(&self) -> u64 {
        self.bell.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

    use super::*;

    fn readable<T>(inbox: &Inbox<T>, timeout: PollTimeout) -> bool {
        let mut descriptors = [PollFd::new(inbox.readiness(), PollFlags::POLLIN)];
        poll(&mut descriptors, timeout) == Ok(1)
    }

    #[test]
    fn a_full_queue_drops_and_counts() {
        let (outbox, inbox) = doorbell(2).expect("an eventfd");
        for item in 0..5 {
            outbox.put(item);
        }
        assert!(readable(&inbox, PollTimeout::ZERO));
        assert_eq!(
            [inbox.take(), inbox.take(), inbox.take()],
            [Some(0), Some(1), None]
        );
        assert_eq!(inbox.dropped(), 3);
        assert!(!readable(&inbox, PollTimeout::ZERO));
    }

    #[test]
    fn a_reader_that_sleeps_misses_nothing() {
        const ITEMS: u32 = 20_000;
        let (outbox, inbox) = doorbell(ITEMS as usize).expect("an eventfd");
        std::thread::scope(|scope| {
            scope.spawn(|| (0..ITEMS).for_each(|item| outbox.put(item)));
            let mut expected = 0;
            while expected < ITEMS {
                match inbox.take() {
                    Some(item) => {
                        assert_eq!(item, expected);
                        expected += 1;
                    }
                    None => assert!(
                        readable(&inbox, PollTimeout::from(5_000_u16)),
                        "slept for ever"
                    ),
                }
            }
        });
    }
}
