//! When a member that ended unexpectedly is started again by itself (`--restart`).
//!
//! The first time after [`FIRST`], then after twice as long each time, up to [`LONGEST`]. A member that ran for [`SETTLED`] starts again at
//! [`FIRST`].

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use understudy_wire::Member;

const FIRST: Duration = Duration::from_millis(500);
/// Shorter than the laboratory waits for a cycle where no remote I/O is left.
const LONGEST: Duration = Duration::from_secs(8);
const SETTLED: Duration = Duration::from_secs(30);

#[derive(Debug, Default)]
pub(super) struct Recovery {
    due: BTreeMap<Member, Instant>,
    lives: BTreeMap<Member, Life>,
}

/// The last restart of a member.
#[derive(Debug, Clone, Copy)]
struct Life {
    started: Instant,
    /// How long it was down before.
    after: Duration,
}

impl Recovery {
    /// The member has ended; answers with the time after which it is started again.
    pub(super) fn ended(&mut self, member: Member, now: Instant) -> Duration {
        let after = match self.lives.get(&member) {
            Some(life) if now.duration_since(life.started) < SETTLED => {
                (life.after * 2).min(LONGEST)
            }
            _ => FIRST,
        };
        let started = now + after;
        self.lives.insert(member, Life { started, after });
        self.due.insert(member, started);
        after
    }

    /// The member was started by someone else: nothing is due any more.
    pub(super) fn started(&mut self, member: Member) {
        self.due.remove(&member);
    }

    /// Whether a member is still to be started.
    pub(super) fn is_pending(&self) -> bool {
        !self.due.is_empty()
    }

    pub(super) fn next_due(&self) -> Option<Instant> {
        self.due.values().min().copied()
    }

    pub(super) fn take_due(&mut self, now: Instant) -> Option<Member> {
        let due = self.due.iter().find(|(_, at)| **at <= now);
        let member = due.map(|(member, _)| *member)?;
        self.due.remove(&member);
        Some(member)
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    const MEMBER: Member = Member::Station(StationId(1));

    /// Each time the member lives for so many seconds; the answers are the milliseconds that it was down before the next life.
    fn check(lives: &[u64], expected: &[u64]) {
        let mut recovery = Recovery::default();
        let mut now = Instant::now();
        let down = lives.iter().map(|&seconds| {
            now += Duration::from_secs(seconds);
            let after = recovery.ended(MEMBER, now);
            assert_eq!(recovery.next_due(), Some(now + after));
            assert_eq!(recovery.take_due(now), None);
            now += after;
            assert_eq!(recovery.take_due(now), Some(MEMBER));
            assert!(!recovery.is_pending());
            after.as_millis() as u64
        });
        assert_eq!(down.collect::<Vec<_>>(), expected, "{lives:?}");
    }

    #[test]
    fn a_member_that_ends_again_and_again_is_started_less_and_less_often() {
        check(&[0, 0, 0, 0, 0, 0, 0], &[500, 1000, 2000, 4000, 8000, 8000, 8000]);
        check(&[100, 100, 100], &[500, 500, 500]);
        check(&[0, 0, 29, 30, 0], &[500, 1000, 2000, 500, 1000]);
    }

    #[test]
    fn a_member_that_was_started_by_hand_is_not_started_again() {
        let mut recovery = Recovery::default();
        let now = Instant::now();
        recovery.ended(MEMBER, now);
        recovery.started(MEMBER);
        assert_eq!(recovery.take_due(now + LONGEST), None);
        assert_eq!(recovery.next_due(), None);
    }
}
