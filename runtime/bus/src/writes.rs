//! Writes of operators on their way to the member, and the answers on their way back.
//!
//! The member answers when it knows the outcome, which can take cycles; a caller waits for it here. Invariants: the member
//! never waits for a caller, and no caller can send more than [`WRITES_PER_SECOND`] in all.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use understudy_wire::{Time, Write, WriteAnswer, WriteId};
use zenoh::Wait;
use zenoh::query::Query;

use crate::clock::Clock;

/// Writes that a member takes in a second, of all callers together; the others are refused at once.
pub const WRITES_PER_SECOND: u32 = 50;

/// Answers that wait to be sent; the caller of one that finds no room asks again.
const WAITING_ANSWERS: usize = 64;

/// Callers that wait for an answer.
const WAITING_CALLERS: usize = 64;

/// Time after which a caller is no longer waited for.
const FORGOTTEN_AFTER: Duration = Duration::from_secs(30);

/// Bounds the number of writes in a second.
#[derive(Debug)]
pub struct WriteLimiter {
    clock: Clock,
    per_second: u32,
    window: Mutex<(u64, u32)>,
    refused: AtomicU64,
}

impl WriteLimiter {
    /// Admits `per_second` writes.
    pub fn new(per_second: u32) -> Self {
        Self {
            clock: Clock::start(),
            per_second,
            window: Mutex::new((0, 0)),
            refused: AtomicU64::new(0),
        }
    }

    /// Whether one more is taken; counts it where it is not.
    pub fn admits(&self) -> bool {
        let second = self.clock.now().0 / 1_000_000_000;
        let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
        if window.0 != second {
            *window = (second, 0);
        }
        window.1 = window.1.saturating_add(1);
        let admits = window.1 <= self.per_second;
        if !admits {
            self.refused.fetch_add(1, Ordering::Relaxed);
        }
        admits
    }

    /// Writes that were not taken since this was last asked.
    pub(crate) fn take_refused(&self) -> u64 {
        self.refused.swap(0, Ordering::Relaxed)
    }
}

/// The member's end: answers that it gives.
#[derive(Debug, Clone)]
pub(crate) struct Answers(SyncSender<WriteAnswer>);

impl Answers {
    /// Never waits.
    pub(crate) fn give(&self, answer: WriteAnswer) {
        let _ = self.0.try_send(answer);
    }
}

/// Both ends of a queue of answers.
pub(crate) fn answers() -> (Answers, Receiver<WriteAnswer>) {
    let (sender, receiver) = sync_channel(WAITING_ANSWERS);
    (Answers(sender), receiver)
}

/// Callers that wait for the outcomes of their writes.
#[derive(Clone, Default)]
pub(crate) struct Callers(Arc<Mutex<Vec<Caller>>>);

struct Caller {
    id: WriteId,
    query: Query,
    key: String,
    since: Time,
}

impl Callers {
    /// Lets a caller wait for the outcome of its write; false where too many wait.
    pub(crate) fn wait(&self, write: &Write, query: &Query, key: &str, now: Time) -> bool {
        let mut callers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        callers.retain(|caller| now.since(caller.since) < FORGOTTEN_AFTER);
        let fits = callers.len() < WAITING_CALLERS;
        if fits {
            callers.push(Caller {
                id: write.id,
                query: query.clone(),
                key: key.to_owned(),
                since: now,
            });
        }
        fits
    }

    /// Sends an answer to all who wait for it.
    pub(crate) fn answer(&self, answer: WriteAnswer) {
        let mut callers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (answered, waiting) =
            std::mem::take(&mut *callers).into_iter().partition(|caller| caller.id == answer.id);
        *callers = waiting;
        drop(callers);
        let answered: Vec<Caller> = answered;
        for Caller { query, key, .. } in answered {
            if let Err(error) = query.reply(key, text(&answer)).wait() {
                tracing::debug!(%error, "an answer was not sent");
            }
        }
    }
}

/// An answer as callers read it.
pub(crate) fn text(answer: &WriteAnswer) -> String {
    serde_json::to_string(answer).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_bounded_and_counted() {
        let limiter = WriteLimiter::new(WRITES_PER_SECOND);
        let admitted = (0..1000).filter(|_| limiter.admits()).count();
        // The second may have ended meanwhile.
        let bound = 2 * WRITES_PER_SECOND as usize;
        assert!((WRITES_PER_SECOND as usize..=bound).contains(&admitted));
        assert_eq!(limiter.take_refused(), 1000 - admitted as u64);
        assert_eq!(limiter.take_refused(), 0);
    }
}
