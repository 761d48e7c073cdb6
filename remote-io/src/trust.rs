//! Whom a remote I/O believes: who was found faulty, and who is accused.
//!
//! ```text
//!   votes agree ─────────────── driven; those who are accused of an output only are cleared
//!   a majority ──────────────── driven; the minority is excluded until the operator releases it
//!   a tie ───────────────────── all who vote are accused; the configured answer, until a third station
//!                               says who is right, or the operator releases them
//! ```
//!
//! Two that are accused of different states and agree later prove nothing: one may have taken the state of the other.

use understudy_wire::StationSet;

use crate::votes::{Finding, Vote, find};

/// Kept from cycle to cycle. Stations recall the excluded for a remote I/O that restarts; whom it has only accused, it accuses again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(crate) struct Trust {
    excluded: StationSet,
    accused: StationSet,
    /// Whether the accused differed in what they said only.
    in_outputs_only: bool,
}

/// What may be driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// Nobody votes.
    Silence,
    /// The vote at this place.
    Believed(usize),
    /// None of them can be believed.
    Doubted,
}

/// Who is wrong, where that is news.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Accusation {
    pub(crate) accused: StationSet,
    pub(crate) located: bool,
}

impl Trust {
    /// Of one that has found these stations faulty.
    pub(crate) fn excluding(excluded: StationSet) -> Self {
        Self {
            excluded,
            ..Self::default()
        }
    }

    /// Stations whose votes do not count.
    pub(crate) fn excluded(&self) -> StationSet {
        self.excluded
    }

    /// Whether no station is excluded or accused, so that an operator has nothing to release.
    pub(crate) fn is_complete(&self) -> bool {
        *self == Self::default()
    }

    /// The operator releases everybody.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }

    /// Judges the votes of one cycle, none of them of an excluded station.
    pub(crate) fn judge(&mut self, votes: &[Vote]) -> (Judgement, Option<Accusation>) {
        match find(votes) {
            Finding::Silence => (Judgement::Silence, None),
            Finding::Agreement => (self.agreed(votes), None),
            Finding::Majority { place, wrong } => {
                self.excluded = self.excluded.or(wrong);
                self.accused = StationSet::EMPTY;
                let accusation = Accusation {
                    accused: wrong,
                    located: true,
                };
                (Judgement::Believed(place), Some(accusation))
            }
            Finding::Tie { in_outputs_only } => {
                let voters: StationSet = votes.iter().map(|vote| vote.station).collect();
                let news = self.accused != voters;
                self.in_outputs_only =
                    in_outputs_only && (self.accused.is_empty() || self.in_outputs_only);
                self.accused = self.accused.or(voters);
                let accusation = Accusation {
                    accused: voters,
                    located: false,
                };
                (Judgement::Doubted, news.then_some(accusation))
            }
        }
    }

    fn agreed(&mut self, votes: &[Vote]) -> Judgement {
        if self.accused.is_empty() {
            return Judgement::Believed(0);
        }
        let accused = |vote: &&Vote| self.accused.contains(vote.station);
        let impartial = votes.iter().any(|vote| !accused(&vote));
        if votes.len() > 1 && (impartial || self.in_outputs_only) {
            self.accused = StationSet::EMPTY;
            return Judgement::Believed(0);
        }
        if impartial {
            return Judgement::Believed(0);
        }
        Judgement::Doubted
    }
}
