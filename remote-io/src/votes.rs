//! The outputs of one program that stations publish in one cycle, and whether they agree.
//!
//! A station votes where it publishes from the true lineage; its vote is the digest of its state and the outputs.
//! Invariant *No guess* rests on equal lineages meaning equal states, which only a value fault can break; so votes that
//! differ prove a value fault, and a majority of them locates it, as long as there is no second one.
//!
//! A word over several programs is no evidence against a controller: it differs as well where another member was
//! changed on its way. An understudy that received another output than its own gives that program a word of its own.

use smallvec::SmallVec;
use understudy_wire::{Digest, Image, StationId, StationSet};

/// One station's vote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Vote {
    pub(crate) station: StationId,
    pub(crate) digest: Digest,
    pub(crate) outputs: Image,
    /// Whether it depends on no other station's words.
    pub(crate) independent: bool,
}

/// The votes of one cycle: the controller's first, then those of understudies by rank.
pub(crate) type Votes = SmallVec<[Vote; 3]>;

/// Result of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finding {
    /// No station votes.
    Silence,
    /// All votes are equal.
    Agreement,
    /// More than one vote, and more than any other, are equal; the other stations are wrong.
    Majority {
        /// The place of the first vote of the majority.
        place: usize,
        wrong: StationSet,
    },
    /// No majority exists.
    Tie {
        /// Whether all have the same state and only their outputs differ.
        in_outputs_only: bool,
    },
}

/// Compares them all; at most 72 stations vote.
pub(crate) fn find(votes: &[Vote]) -> Finding {
    let Some(first) = votes.first() else {
        return Finding::Silence;
    };
    let same =
        |one: &Vote, other: &Vote| one.digest == other.digest && one.outputs == other.outputs;
    if votes.iter().all(|vote| same(vote, first)) {
        return Finding::Agreement;
    }
    // A vote equal to the first independent one, which is that of the controller where it votes, supports it.
    let direct = votes.iter().find(|vote| vote.independent);
    let counts = |vote: &&Vote| vote.independent || direct.is_some_and(|direct| same(vote, direct));
    let support = |one: &Vote| votes.iter().filter(|vote| same(vote, one)).filter(counts).count();
    let (place, best) = votes
        .iter()
        .enumerate()
        .rev()
        .max_by_key(|(_, vote)| support(vote))
        .expect("there is a vote");
    let others = votes.iter().filter(|vote| !same(vote, best));
    let beaten = others.clone().all(|other| support(other) < support(best));
    if support(best) > 1 && beaten {
        let wrong = others.map(|vote| vote.station).collect();
        return Finding::Majority { place, wrong };
    }
    Finding::Tie { in_outputs_only: votes.iter().all(|vote| vote.digest == first.digest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(rank: u8, digest: u64, output: u64, independent: bool) -> Vote {
        Vote {
            station: StationId(rank),
            digest: Digest(digest),
            outputs: Image::from_words(1, &[output]).expect("a bit"),
            independent,
        }
    }

    /// Up to five independent stations, each with one of two states and one of two outputs: counted by hand.
    #[test]
    fn the_most_say_who_is_wrong() {
        for count in 0..=5_u32 {
            for votes in 0..4_u64.pow(count) {
                let vote_of = |rank: u32| votes / 4_u64.pow(rank) % 4;
                let votes: Vec<Vote> = (0..count)
                    .map(|rank| vote(rank as u8, vote_of(rank) / 2, vote_of(rank) % 2, true))
                    .collect();
                let tally = |what: u64| (0..count).filter(|&rank| vote_of(rank) == what).count();
                let mut counts = [0, 1, 2, 3].map(tally);
                counts.sort_unstable();
                match find(&votes) {
                    Finding::Silence => assert_eq!(count, 0),
                    Finding::Agreement => assert_eq!(counts[2], 0),
                    Finding::Majority { place, wrong } => {
                        assert!(counts[3] > 1 && counts[3] > counts[2] && counts[2] > 0);
                        let right = vote_of(place as u32);
                        assert_eq!(tally(right), counts[3]);
                        for rank in 0..count {
                            let accused = wrong.contains(StationId(rank as u8));
                            assert_eq!(accused, vote_of(rank) != right);
                        }
                    }
                    Finding::Tie { in_outputs_only } => {
                        assert!(counts[2] > 0 && (counts[3] == 1 || counts[3] == counts[2]));
                        let states = (0..count).map(|rank| vote_of(rank) / 2);
                        let low = states.clone().filter(|&state| state == 0).count();
                        assert_eq!(in_outputs_only, low == 0 || low == count as usize);
                    }
                }
            }
        }
    }

    /// Two words over several programs agree with each other and not with the controller: another member may be the
    /// cause.
    #[test]
    fn a_shared_word_is_no_evidence_against_a_controller() {
        let direct = vote(0, 7, 1, true);
        let shared = [vote(2, 7, 0, false), vote(3, 7, 0, false)];
        let [second, third] = shared;
        let tie = Finding::Tie { in_outputs_only: true };
        assert_eq!(find(&[direct.clone(), second.clone(), third]), tie);
        let for_it = vote(3, 7, 1, false);
        let located = Finding::Majority { place: 0, wrong: StationSet::only(StationId(2)) };
        assert_eq!(find(&[direct, second, for_it]), located);
    }
}
