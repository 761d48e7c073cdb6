//! Orders of persons that were refused before they became orders to a member: they name something that does not exist, or the person has no right
//! to them. A record is all that remains of them.

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use understudy_wire::{MAXIMUM_OWNER_LENGTH, MAXIMUM_REASON_LENGTH};

use crate::clock::Clock;

/// Characters of a name that are recorded.
const NAME_LENGTH: usize = 60;

/// Characters of the reason of a refusal that are recorded.
const WHY_LENGTH: usize = 300;

/// Refused orders of which each has a record, in a second; the others are counted.
const RECORDS_PER_SECOND: u32 = 10;

/// An order of a person that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedOrder {
    /// Member, or alarm, as the order names it.
    pub to: String,
    /// The order, such as `write` or `force`.
    pub order: String,
    /// Signal, as the order names it; empty for an order without one.
    pub signal: String,
    /// Person.
    pub owner: String,
    /// Reason that the person gave.
    pub reason: String,
    /// Why it was refused.
    pub why: String,
    /// Further orders that were refused before it and have no record of their own, because too many came.
    #[serde(default)]
    pub more: u64,
}

impl RefusedOrder {
    /// The order `order` of a person to a member or an alarm, which was refused for a reason.
    pub fn new(order: &str, to: &str, owner: &str, why: impl ToString) -> Self {
        Self {
            to: to.to_owned(),
            order: order.to_owned(),
            signal: String::new(),
            owner: owner.to_owned(),
            reason: String::new(),
            why: why.to_string(),
            more: 0,
        }
        .bounded()
    }

    /// The same with the signal and the reason that the person gave.
    #[must_use]
    pub fn with(self, signal: &str, reason: &str) -> Self {
        Self { signal: signal.to_owned(), reason: reason.to_owned(), ..self }.bounded()
    }

    /// The same with texts of a bounded length.
    #[must_use]
    pub(crate) fn bounded(self) -> Self {
        let cut = |text: String, most: usize| text.chars().take(most).collect();
        Self {
            to: cut(self.to, NAME_LENGTH),
            order: cut(self.order, NAME_LENGTH),
            signal: cut(self.signal, NAME_LENGTH),
            owner: cut(self.owner, MAXIMUM_OWNER_LENGTH),
            reason: cut(self.reason, MAXIMUM_REASON_LENGTH),
            why: cut(self.why, WHY_LENGTH),
            more: self.more,
        }
    }
}

/// Bounds the number of records of refused orders in a second, and their length.
#[derive(Debug)]
pub struct RefusedOrders {
    clock: Clock,
    window: Mutex<Window>,
}

#[derive(Debug, Default)]
struct Window {
    second: u64,
    records: u32,
    more: u64,
}

impl Default for RefusedOrders {
    fn default() -> Self {
        Self { clock: Clock::start(), window: Mutex::default() }
    }
}

impl RefusedOrders {
    /// The order as it is recorded; nothing where too many were refused in this second, and it is counted.
    pub fn admit(&self, order: RefusedOrder) -> Option<RefusedOrder> {
        let second = self.clock.now().0 / 1_000_000_000;
        let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
        if window.second != second {
            window.second = second;
            window.records = 0;
        }
        let more = order.more.saturating_add(std::mem::take(&mut window.more));
        if window.records == RECORDS_PER_SECOND {
            window.more = more.saturating_add(1);
            return None;
        }
        window.records += 1;
        Some(RefusedOrder { more, ..order.bounded() })
    }

    /// Counts an order that gets no record of its own.
    pub(crate) fn count(&self, order: RefusedOrder) {
        let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
        window.more = window.more.saturating_add(order.more).saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_counted_and_long_texts_are_cut() {
        let refused = RefusedOrders::default();
        let long = "ä".repeat(10_000);
        let order = RefusedOrder {
            to: long.clone(),
            order: long.clone(),
            signal: long.clone(),
            owner: long.clone(),
            reason: long.clone(),
            why: long.clone(),
            more: 0,
        };
        assert_eq!(
            RefusedOrder::new(&long, &long, &long, &long).with(&long, &long),
            order.clone().bounded()
        );
        let flood = 1000;
        let recorded: Vec<RefusedOrder> =
            (0..flood).filter_map(|_| refused.admit(order.clone())).collect();
        // The second may have ended meanwhile.
        let most = 2 * RECORDS_PER_SECOND as usize;
        assert!((RECORDS_PER_SECOND as usize..=most).contains(&recorded.len()));
        let lengths =
            recorded.iter().map(|order| serde_json::to_string(order).expect("JSON").len());
        assert!(lengths.max() < Some(2000));
        let counted: u64 = recorded.iter().map(|order| order.more + 1).sum();
        let uncounted = refused.window.lock().expect("no panic").more;
        assert_eq!(counted + uncounted, flood, "none is lost");
    }
}
