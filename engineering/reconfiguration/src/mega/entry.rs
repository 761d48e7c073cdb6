//! Where Θ is entered by a ladder that took part of what happened for all of it.
//!
//! Module 2 is transparent while one state is possible, and then it reads that state from the ladder. In the scan in
//! which several inputs change, one of them on a failed channel, the ladder sees the others alone. If these are events of
//! their own in the state where it was, it comes to the state where they lead. The plant is in another one, and nothing
//! that happens later tells this. So what stands for such a state contains both.

use std::collections::{BTreeMap, BTreeSet};

use super::{Analysis, Builder, Label, MegaController, Question};
use crate::controller::Controller;

/// Two moves from one state: the smaller one is what the ladder sees of the larger one while `missed` are failed.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Overlap {
    source: u32,
    /// Where the ladder is.
    seen: u32,
    /// Where the plant is.
    true_state: u32,
    /// Channels of the question, as bits: those that the ladder must see, and those that it must not.
    shown: u64,
    missed: u64,
}

/// A state of S in which the ladder is, the failed channels, and whether one of them has failed in this scan.
pub(super) type Entry = (u32, u64, bool);

/// All overlaps of S.
pub(super) fn overlaps(controller: &Controller, question: &Question) -> BTreeSet<Overlap> {
    let mut found = BTreeSet::new();
    for source in 0..controller.states().len() {
        let moves = controller.moves(source);
        for part in moves.iter().filter(|step| !step.events.is_empty()) {
            for whole in moves.iter().filter(|step| step.target != part.target) {
                if !part.events.iter().all(|event| whole.events.contains(event)) {
                    continue;
                }
                let (mut shown, mut missed, mut all) = (0, 0, true);
                for event in &whole.events {
                    let is_channel = |&known: &usize| event.channel() == Some(known);
                    let bit = question.channels.iter().position(is_channel).map(|bit| 1_u64 << bit);
                    match bit {
                        bit if part.events.contains(event) => shown |= bit.unwrap_or_default(),
                        Some(bit) => missed |= bit,
                        None => all = false,
                    }
                }
                if all && missed != 0 {
                    found.insert(Overlap {
                        source: source as u32,
                        seen: part.target as u32,
                        true_state: whole.target as u32,
                        shown,
                        missed,
                    });
                }
            }
        }
    }
    found
}

impl Builder<'_> {
    /// Puts the entries that overlaps need among the states; whether there is a new one.
    pub(super) fn enter(&mut self, overlaps: &BTreeSet<Overlap>) -> bool {
        let mut transparent: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
        for state in self.states.iter().filter(|state| state.command.is_none()) {
            if let [one] = state.members[..] {
                transparent.entry(one).or_default().push(state.failed);
            }
        }
        let mut wanted: BTreeMap<Entry, Vec<u32>> = BTreeMap::new();
        for overlap in overlaps {
            for &before in transparent.get(&overlap.source).into_iter().flatten() {
                for entry in self.entries_of(overlap, before) {
                    wanted.entry(entry).or_default().push(overlap.true_state);
                }
            }
        }
        let known = self.states.len();
        for (entry, others) in wanted {
            let (state, failed, fresh) = entry;
            let mut seed = match fresh {
                true => self.broken(state, failed).unwrap_or_else(|| vec![state]),
                false => vec![state],
            };
            seed.extend(others);
            if let Some(place) = self.place(seed, failed) {
                self.entries.insert(entry, place);
            }
        }
        self.states.len() > known
    }

    /// Where the ladder may be taken in after an overlap that began with the channels of `before` failed.
    fn entries_of(&self, overlap: &Overlap, before: u64) -> Vec<Entry> {
        let bits = (0..self.question.channels.len()).map(|bit| 1_u64 << bit);
        let one_more = bits.map(|bit| before | bit).filter(|&failed| failed != before);
        let afterwards = std::iter::once(before).chain(one_more);
        let is_late = self.question.analysis == Analysis::Late;
        let is_met = |&failed: &u64| {
            failed.count_ones() as usize <= self.question.simultaneous
                && overlap.missed & !failed == 0
                && overlap.shown & failed == 0
                && (is_late || overlap.missed & !before == 0)
        };
        let entry = |failed: u64| (overlap.seen, failed, failed != before);
        afterwards.filter(is_met).map(entry).collect()
    }

    /// The members of Θ after the channels of `failed` have failed while the ladder was in `state`.
    fn broken(&self, state: u32, failed: u64) -> Option<Vec<u32>> {
        let mut place = *self.places.get(&(vec![state], 0))?;
        for bit in (0..self.question.channels.len()).filter(|bit| failed >> bit & 1 == 1) {
            let edges = self.edges[place].iter();
            let mut found = edges.filter(|(label, _)| *label == Label::Break(bit));
            place = found.next()?.1;
        }
        Some(self.states[place].members.clone())
    }
}

impl MegaController {
    /// The state of Θ that stands for a ladder in `state` with these channels failed, where it stands for another one
    /// as well; `fresh` if one of them has failed in this scan.
    pub fn entry(&self, state: u32, failed: u64, fresh: bool) -> Option<usize> {
        self.entries.get(&(state, failed, fresh)).copied()
    }
}
