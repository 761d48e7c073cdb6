//! A bounded queue whose reader sleeps in ppoll.
//!
//! Invariants: whoever puts something in makes the file descriptor readable, unless it already is or somebody is about to; so a reader
//! that finds nothing by [`Inbox::take`] may sleep on [`Inbox::readiness`] and misses nothing. And where the descriptor is readable,
//! `rung` is set: a reader that is woken finds out why, and does not wake again and again. That holds wherever the scheduler stops a
//! writer: the reader is in real time, and a writer that it waits for by looking would never go on.

use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use nix::sys::eventfd::{EfdFlags, EventFd};

/// The reader's end.
#[derive(Debug)]
pub(crate) struct Inbox<T>(Arc<Shared<T>>);

/// The writers' end.
#[derive(Debug)]
pub(crate) struct Outbox<T>(Arc<Shared<T>>);

impl<T> Clone for Outbox<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

#[derive(Debug)]
struct Shared<T> {
    bound: usize,
    /// Behind a lock on which the reader sleeps; a queue without one has it spin until a writer in the middle has ended.
    items: Mutex<VecDeque<T>>,
    eventfd: EventFd,
    /// Set by a writer before it makes the descriptor readable, and cleared by the reader after it has emptied it.
    rung: AtomicBool,
    dropped: AtomicU64,
}

/// A queue of at most `bound` items; what comes on top of them is dropped and counted.
pub(crate) fn doorbell<T>(bound: usize) -> nix::Result<(Outbox<T>, Inbox<T>)> {
    let shared = Arc::new(Shared {
        bound,
        items: Mutex::new(VecDeque::with_capacity(bound)),
        eventfd: EventFd::from_flags(EfdFlags::EFD_NONBLOCK | EfdFlags::EFD_CLOEXEC)?,
        rung: AtomicBool::new(false),
        dropped: AtomicU64::new(0),
    });
    Ok((Outbox(Arc::clone(&shared)), Inbox(shared)))
}

impl<T> Shared<T> {
    fn push(&self, item: T) -> bool {
        let mut items = self.items.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = items.len() < self.bound;
        if fits {
            items.push_back(item);
        }
        fits
    }

    fn pop(&self) -> Option<T> {
        let mut items = self.items.lock().unwrap_or_else(PoisonError::into_inner);
        items.pop_front()
    }

    fn ring(&self) {
        if !self.rung.swap(true, Ordering::SeqCst) {
            // It can fail only where the counter is full, and then it is readable.
            let _ = self.eventfd.write(1);
        }
    }
}

impl<T> Outbox<T> {
    /// Waits for nothing but another's `put` or `take`; false where the item was dropped.
    pub(crate) fn put(&self, item: T) -> bool {
        let fits = self.0.push(item);
        if !fits {
            self.0.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.0.ring();
        fits
    }
}

impl<T> Inbox<T> {
    /// The next item.
    pub(crate) fn take(&self) -> Option<T> {
        let shared = &self.0;
        if !shared.rung.load(Ordering::SeqCst) {
            return None;
        }
        if let Some(item) = shared.pop() {
            return Some(item);
        }
        // A writer that has set `rung` and not yet written will do so, and wakes who sleeps then.
        if shared.eventfd.read().is_err() {
            return None;
        }
        shared.rung.store(false, Ordering::SeqCst);
        // Who came in between did not ring. Behind what it has put there may be more.
        let item = shared.pop()?;
        shared.ring();
        Some(item)
    }

    /// Readable when there is something to take.
    pub(crate) fn readiness(&self) -> BorrowedFd<'_> {
        self.0.eventfd.as_fd()
    }

    /// How many items found the queue full.
    pub(crate) fn dropped(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
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
        assert_eq!([inbox.take(), inbox.take(), inbox.take()], [Some(0), Some(1), None]);
        assert_eq!(inbox.dropped(), 3);
        assert!(!readable(&inbox, PollTimeout::ZERO));
    }

    /// A writer is stopped at each point of its `put`, the reader looks and sleeps, and the writer goes on.
    #[test]
    fn a_writer_that_is_stopped_in_the_middle_neither_wakes_for_nothing_nor_is_missed() {
        let (outbox, inbox) = doorbell(2).expect("an eventfd");
        let steps: [&dyn Fn(); 3] = [
            &|| assert!(outbox.0.push(7)),
            &|| assert!(!outbox.0.rung.swap(true, Ordering::SeqCst)),
            &|| assert_eq!(outbox.0.eventfd.write(1), Ok(8)),
        ];
        for stopped_before in 0..=steps.len() {
            let mut taken = Vec::new();
            for (place, step) in steps.iter().enumerate() {
                if place == stopped_before {
                    taken.extend(std::iter::from_fn(|| inbox.take()));
                }
                step();
            }
            assert!(readable(&inbox, PollTimeout::ZERO), "{stopped_before}");
            taken.extend(std::iter::from_fn(|| inbox.take()));
            assert_eq!(taken, [7], "{stopped_before}");
            assert!(!readable(&inbox, PollTimeout::ZERO), "{stopped_before}");
            outbox.put(8);
            assert!(readable(&inbox, PollTimeout::ZERO), "{stopped_before}");
            assert_eq!([inbox.take(), inbox.take()], [Some(8), None]);
        }
    }

    #[test]
    fn a_reader_that_sleeps_misses_nothing() {
        const ITEMS: u32 = 20_000;
        let (outbox, inbox) = doorbell(ITEMS as usize).expect("an eventfd");
        std::thread::scope(|scope| {
            scope.spawn(|| (0..ITEMS).for_each(|item| assert!(outbox.put(item))));
            let mut expected = 0;
            while expected < ITEMS {
                match inbox.take() {
                    Some(item) => {
                        assert_eq!(item, expected);
                        expected += 1;
                    }
                    None => {
                        assert!(readable(&inbox, PollTimeout::from(5_000_u16)), "slept for ever")
                    }
                }
            }
        });
    }
}
