//! Sessions of callers, with the newest write of each.
//!
//! ```text
//!   Taken ──► Sampled ──► InEffect, for REMEMBERED_FOR after it
//! ```
//!
//! Invariant *Room for each person*: a person has at most as many sessions as are left for the others, so no person
//! can lock out another one. A session that is decided takes no place of one that is not.

use smallvec::SmallVec;
use understudy_wire::{
    Lineage, MAXIMUM_SESSIONS, Moment, PointValue, Write, WriteId, WriteRefusal,
};

/// Sessions that are remembered. A sample carries the undecided and the newest of them.
const MEMORY: usize = 1024;

/// Sessions in the order of their identifiers.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub(super) struct Sessions(Vec<Session>);

/// The newest write of a session.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Session {
    pub(super) id: WriteId,
    /// Person or program that writes; `None` where only stations recall the write.
    owner: Option<Box<str>>,
    /// Index of its operator input; `None` where only stations recall the write.
    pub(super) input: Option<usize>,
    pub(super) value: Option<PointValue>,
    pub(super) progress: Progress,
    /// Whether its input is gone by an online change, or is another one.
    pub(super) is_orphaned: bool,
    /// Cycles since the write.
    idle: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Progress {
    /// Taken, and not sampled yet.
    Taken,
    /// In a sample of which no output was applied yet.
    Sampled {
        /// First sample with the value.
        first: Moment,
        /// Lineage after it.
        after: Lineage,
    },
    /// An output with it was applied.
    InEffect {
        /// First sample with the value.
        since: Moment,
    },
}

impl Session {
    /// A write that was taken.
    pub(super) fn taken(write: &Write, input: usize) -> Self {
        Self {
            id: write.id,
            owner: Some(write.owner.as_str().into()),
            input: Some(input),
            value: Some(write.value),
            progress: Progress::Taken,
            is_orphaned: false,
            idle: 0,
        }
    }

    /// A write that stations recall.
    pub(super) fn recalled(id: WriteId) -> Self {
        let progress = Progress::Taken;
        Self { id, owner: None, input: None, value: None, progress, is_orphaned: false, idle: 0 }
    }

    /// Whether a caller has asked for the write since this remote I/O started.
    pub(super) fn has_caller(&self) -> bool {
        self.owner.is_some()
    }

    pub(super) fn is_decided(&self) -> bool {
        matches!(self.progress, Progress::InEffect { .. })
    }
}

/// Whether a person with `count` of the places that are taken gets one more of those that are `free`.
fn has_share(count: usize, free: usize) -> bool {
    count < free
}

impl Sessions {
    pub(super) fn recalled(writes: impl IntoIterator<Item = WriteId>) -> Self {
        Self(writes.into_iter().take(MAXIMUM_SESSIONS).map(Session::recalled).collect())
    }

    /// The session of that identifier.
    pub(super) fn get(&self, session: u64) -> Option<&Session> {
        let place = self.0.binary_search_by_key(&session, |it| it.id.session);
        place.ok().map(|place| &self.0[place])
    }

    /// Adds the write of a session, or replaces the one before it, which is decided.
    pub(super) fn put(&mut self, session: Session) -> Result<(), WriteRefusal> {
        let undecided = || {
            let undecided = self.0.iter().filter(|it| !it.is_decided());
            undecided.filter(|it| it.owner.is_some())
        };
        let of_person = |it: &&Session| it.owner == session.owner;
        let free = MAXIMUM_SESSIONS.saturating_sub(undecided().count());
        if !has_share(undecided().filter(of_person).count(), free) {
            return Err(WriteRefusal::Busy);
        }
        match self.0.binary_search_by_key(&session.id.session, |it| it.id.session) {
            Ok(place) => self.0[place] = session,
            Err(place) => {
                let free = MEMORY.saturating_sub(self.0.len());
                if !has_share(self.0.iter().filter(of_person).count(), free) {
                    return Err(WriteRefusal::Busy);
                }
                self.0.insert(place, session);
            }
        }
        Ok(())
    }

    /// The caller of a write that stations recall asks for its outcome.
    pub(super) fn asked_again(&mut self, write: &Write) {
        if let Ok(place) = self.0.binary_search_by_key(&write.id.session, |it| it.id.session) {
            self.0[place].owner.get_or_insert_with(|| write.owner.as_str().into());
        }
    }

    /// Forgets decided sessions that have not written for `cycles`.
    pub(super) fn forget(&mut self, cycles: u32) {
        self.0.retain(|session| session.idle < cycles || !session.is_decided());
    }

    /// The writes that a sample carries: first those that are not decided, then the newest.
    pub(super) fn ids(&self) -> SmallVec<[WriteId; 1]> {
        if self.0.len() <= MAXIMUM_SESSIONS {
            return self.0.iter().map(|session| session.id).collect();
        }
        let mut all: Vec<&Session> = self.0.iter().collect();
        all.sort_by_key(|session| (session.is_decided(), session.owner.is_none(), session.idle));
        let mut ids: SmallVec<[WriteId; 1]> =
            all.iter().take(MAXIMUM_SESSIONS).map(|session| session.id).collect();
        ids.sort_unstable();
        ids
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Session> {
        self.0.iter()
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Session> {
        self.0.iter_mut()
    }

    /// The number of a write without an effect is free again.
    pub(super) fn drop_void(&mut self, void: &[(WriteId, WriteRefusal)], moment: Moment) {
        self.0.retain_mut(|session| {
            if void.iter().any(|(id, _)| *id == session.id) {
                session.id.number -= 1;
                session.value = None;
                session.input = None;
                session.is_orphaned = false;
                // The one before it was decided.
                session.progress = Progress::InEffect { since: moment };
            }
            session.id.number > 0
        });
    }

    /// Ends a cycle.
    pub(super) fn close_cycle(&mut self) {
        for session in &mut self.0 {
            session.idle = session.idle.saturating_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::Role;

    use super::*;

    fn write(owner: &str, session: u64) -> Session {
        let write = Write {
            id: WriteId { session, number: 1 },
            input: 0,
            value: true.into(),
            role: Role::Operator,
            owner: owner.to_owned(),
            reason: "a test".to_owned(),
            points: None,
        };
        Session::taken(&write, 0)
    }

    /// The number of writes of each person that are taken, where each opens `each` sessions, one person after the other.
    fn flood(sessions: &mut Sessions, persons: &[&str], each: u64) -> Vec<usize> {
        let mut session = 0;
        let mut taken = Vec::new();
        for person in persons {
            let put = (0..each).filter(|_| {
                session += 1;
                sessions.put(write(person, session)).is_ok()
            });
            taken.push(put.count());
        }
        taken
    }

    #[test]
    fn undecided_writes_of_one_person_leave_room_for_others() {
        let mut sessions = Sessions::default();
        let persons = ["anna", "ben", "carl", "dora", "emil", "fritz"];
        assert_eq!(flood(&mut sessions, &persons, 40), [8, 4, 2, 1, 1, 0]);
        // A sample carries all of them.
        assert_eq!(sessions.ids().len(), MAXIMUM_SESSIONS);
    }

    #[test]
    fn writes_that_only_stations_recall_take_no_room() {
        let recalled = (0..20).map(|session| WriteId { session: 1000 + session, number: 7 });
        let mut sessions = Sessions::recalled(recalled);
        assert_eq!(flood(&mut sessions, &["anna", "ben"], 40), [8, 4]);
        let ids = sessions.ids();
        assert_eq!((ids.len(), ids.is_sorted()), (MAXIMUM_SESSIONS, true));
        assert_eq!(ids.iter().filter(|id| id.session < 1000).count(), 12);
    }

    #[test]
    fn a_decided_session_is_remembered_and_takes_no_room_in_the_samples() {
        let mut sessions = Sessions::default();
        for session in 1..=400 {
            assert!(sessions.put(write("anna", session)).is_ok(), "{session}");
            for it in sessions.iter_mut() {
                it.progress = Progress::InEffect { since: Moment::default() };
            }
            sessions.close_cycle();
        }
        assert!(sessions.get(1).is_some());
        let newest: Vec<u64> = sessions.ids().iter().map(|id| id.session).collect();
        assert_eq!(newest, (385..=400).collect::<Vec<u64>>());
        sessions.forget(100);
        assert!(sessions.get(301).is_none() && sessions.get(302).is_some());
    }
}
