//! Writes of operators on their way to the member, and the answers on their way back.
//!
//! The member answers when it knows the outcome, which can take cycles; a caller waits for it here. Invariants: the member
//! never waits for a caller, and no caller can send more than [`WRITES_PER_SECOND`] in all.

use std::collections::BTreeMap;
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

/// A person gets at most this many times the places that are left for the others.
const SHARE: u32 = 4;

/// Bounds the number of writes in a second, and leaves a fifth of them to other persons than the one who writes most.
#[derive(Debug)]
pub struct WriteLimiter {
    clock: Clock,
    per_second: u32,
    window: Mutex<Window>,
    refused: AtomicU64,
}

/// Writes of one second, by person.
#[derive(Debug, Default)]
struct Window {
    second: u64,
    total: u32,
    by_person: BTreeMap<String, u32>,
}

impl WriteLimiter {
    /// Admits `per_second` writes.
    pub fn new(per_second: u32) -> Self {
        Self {
            clock: Clock::start(),
            per_second,
            window: Mutex::default(),
            refused: AtomicU64::new(0),
        }
    }

    /// Whether one more of this person is taken; counts it where it is not.
    pub fn admits(&self, person: &str) -> bool {
        let second = self.clock.now().0 / 1_000_000_000;
        let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
        if window.second != second {
            *window = Window { second, ..Window::default() };
        }
        let free = self.per_second.saturating_sub(window.total);
        let count = window.by_person.get(person).copied().unwrap_or_default();
        let admits = count < free.saturating_mul(SHARE);
        if admits {
            window.total += 1;
            window.by_person.insert(person.to_owned(), count + 1);
        } else {
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
    person: String,
    query: Query,
    key: String,
    since: Time,
}

impl Callers {
    /// Lets a caller wait for the outcome of its write, in the place of its earlier attempt if there is one; false where
    /// too many of this person wait.
    pub(crate) fn wait(&self, write: &Write, query: &Query, key: &str, now: Time) -> bool {
        let mut callers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        callers.retain(|caller| caller.id != write.id && now.since(caller.since) < FORGOTTEN_AFTER);
        let of_person = callers.iter().filter(|caller| caller.person == write.owner).count();
        let fits = of_person < WAITING_CALLERS.saturating_sub(callers.len());
        if fits {
            callers.push(Caller {
                id: write.id,
                person: write.owner.clone(),
                query: query.clone(),
                key: key.to_owned(),
                since: now,
            });
        }
        fits
    }

    /// Waits no longer for the outcome of a write.
    pub(crate) fn forget(&self, id: WriteId) {
        let mut callers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        callers.retain(|caller| caller.id != id);
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
        let persons = ["anna", "ben", "carl"];
        let flood = |person| (0..1000).filter(|_| limiter.admits(person)).count();
        let admitted = persons.map(flood);
        // The second may have ended meanwhile.
        let (all, bound) = (admitted.iter().sum::<usize>(), 2 * WRITES_PER_SECOND as usize);
        assert!((WRITES_PER_SECOND as usize..=bound).contains(&all), "{admitted:?}");
        assert!(admitted.iter().all(|&count| count > 0), "a person is locked out: {admitted:?}");
        assert_eq!(limiter.take_refused(), 3000 - all as u64);
        assert_eq!(limiter.take_refused(), 0);
    }
}
