//! Stations that a remote I/O has found faulty, and stations that it suspects.
//!
//! ```text
//!   votes agree ─────────────── applied; stations suspected for an output only are cleared
//!   a majority ──────────────── applied; the minority is excluded until the operator releases it
//!   a tie ───────────────────── all voters are suspected; the configured reaction, until a third station
//!                               makes a majority, or the operator releases them
//! ```
//!
//! Two stations that differed in their states and agree later prove nothing: one may have adopted the state of the
//! other.

use understudy_wire::StationSet;

use crate::votes::{Finding, Vote, find};

/// Kept from cycle to cycle. Stations recall the excluded ones for a remote I/O that restarts; the suspected ones are
/// found again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(crate) struct Trust {
    excluded: StationSet,
    accused: StationSet,
    /// Whether the suspected stations differed in their outputs only.
    in_outputs_only: bool,
}

/// The vote that may be applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// No station votes.
    Silence,
    /// The vote at this place.
    Believed(usize),
    /// None: the votes differ and no majority exists.
    Doubted,
}

/// A value fault that was not known before: the stations that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Accusation {
    pub(crate) accused: StationSet,
    pub(crate) located: bool,
}

impl Trust {
    /// For a remote I/O that has found these stations faulty.
    pub(crate) fn excluding(excluded: StationSet) -> Self {
        Self { excluded, ..Self::default() }
    }

    /// Stations whose votes do not count.
    pub(crate) fn excluded(&self) -> StationSet {
        self.excluded
    }

    /// Whether no station is excluded or suspected, so that an operator has nothing to release.
    pub(crate) fn is_complete(&self) -> bool {
        *self == Self::default()
    }

    /// Whether stations are suspected and no majority has located the fault.
    pub(crate) fn suspects(&self) -> bool {
        !self.accused.is_empty()
    }

    /// The operator releases all stations.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }

    /// Judges the votes of one cycle; no excluded station votes.
    pub(crate) fn judge(&mut self, votes: &[Vote]) -> (Judgement, Option<Accusation>) {
        match find(votes) {
            Finding::Silence => (Judgement::Silence, None),
            Finding::Agreement => (self.agreed(votes), None),
            Finding::Majority { place, wrong } => {
                self.excluded = self.excluded.or(wrong);
                self.accused = StationSet::EMPTY;
                let accusation = Accusation { accused: wrong, located: true };
                (Judgement::Believed(place), Some(accusation))
            }
            Finding::Tie { in_outputs_only } => {
                let voters: StationSet = votes.iter().map(|vote| vote.station).collect();
                let news = self.accused != voters;
                self.in_outputs_only =
                    in_outputs_only && (self.accused.is_empty() || self.in_outputs_only);
                self.accused = self.accused.or(voters);
                let accusation = Accusation { accused: voters, located: false };
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
