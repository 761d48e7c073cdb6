//! The history of one program as its remote I/O has made it: the truth about u(i), and so about x(i).
//!
//! Invariant *The plant decides history*: only this remote I/O samples u(i), so only it can extend the chain of
//! lineages
//!
//! ```text
//!   base ──u──► L ──u──► L ──u──► head          at most `capacity` samples, all of them in every Sample frame
//!            ▲
//!            └ the newest that a living station has reported to hold
//! ```
//!
//! When the window is full, samples that no station has followed and of which no output was applied become void, and
//! the program continues from the newest state that is left. Invariant *Never back*: samples up to the newest applied
//! one (the
//! *floor*) never become void.

use std::collections::VecDeque;

use smallvec::SmallVec;
use understudy_wire::{Image, Lineage, MAXIMUM_CHANGE_MARKS, Moment, ProgramHash, Sample, Step};

/// The last samples of a program and their lineages.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct History {
    born: Moment,
    base: Lineage,
    /// The program of the state at the base; none where that was adopted from a station and not changed since.
    program: Option<ProgramHash>,
    samples: VecDeque<(Step, Lineage)>,
    /// Samples from the base up to the newest lineage that any station has reported to hold.
    confirmed: usize,
    capacity: usize,
}

impl History {
    /// A program that starts from its initial state at `born`.
    pub(crate) fn genesis(program: ProgramHash, born: Moment, capacity: usize) -> Self {
        Self::from(born, (Some(program), Lineage::genesis(program, born)), capacity)
    }

    /// A program that goes on from a lineage, of a state of that program where it is known.
    pub(crate) fn from(
        born: Moment,
        (program, base): (Option<ProgramHash>, Lineage),
        capacity: usize,
    ) -> Self {
        let samples = VecDeque::with_capacity(capacity);
        Self { born, base, program, samples, confirmed: 0, capacity }
    }

    /// The program that takes the next sample, unless that changes it; none where it is not known.
    pub(crate) fn program(&self) -> Option<ProgramHash> {
        self.samples.iter().rev().find_map(|(step, _)| step.change).or(self.program)
    }

    /// Whether its samples have as many change marks as they may.
    pub(crate) fn is_full_of_changes(&self) -> bool {
        // The oldest sample leaves where the window is full, and may be one with a mark; this is on the safe side.
        let marks = self.samples.iter().filter(|(step, _)| step.change.is_some());
        marks.count() >= MAXIMUM_CHANGE_MARKS
    }

    /// Whether all its states are of this program.
    pub(crate) fn is_of(&self, program: ProgramHash) -> bool {
        self.program == Some(program) && self.samples.iter().all(|(step, _)| step.change.is_none())
    }

    /// A station holds a state with a lineage, and it is one of this program: where that is in this history, and no sample changes the program, all are.
    pub(crate) fn learn(&mut self, program: ProgramHash, lineage: Lineage) {
        let is_one = self.samples.iter().all(|(step, _)| step.change.is_none());
        if self.program.is_none() && is_one && self.place(lineage).is_some() {
            self.program = Some(program);
        }
    }

    /// A program that continues from a lineage in the history of a sample that was received; nothing where it is not in there.
    pub(crate) fn received(sample: &Sample, lineage: Lineage, capacity: usize) -> Option<Self> {
        let mut history = Self::from(sample.born, (None, sample.base), capacity);
        for step in sample.history.iter().take(capacity) {
            if history.head() == lineage {
                break;
            }
            history.push(step.clone());
        }
        history.confirmed = history.samples.len();
        (history.head() == lineage).then_some(history)
    }

    pub(crate) fn born(&self) -> Moment {
        self.born
    }

    pub(crate) fn base(&self) -> Lineage {
        self.base
    }

    /// L(i)(t+1): after the newest sample.
    pub(crate) fn head(&self) -> Lineage {
        self.samples.back().map_or(self.base, |(_, after)| *after)
    }

    /// L(i)(t): before the newest sample.
    pub(crate) fn before(&self) -> Lineage {
        let last = self.samples.len().saturating_sub(1);
        self.lineage_after(last)
    }

    /// u(i)(t).
    pub(crate) fn newest(&self) -> Option<&Image> {
        self.samples.back().map(|(step, _)| &step.inputs)
    }

    pub(crate) fn samples(&self) -> SmallVec<[Step; 2]> {
        self.samples.iter().map(|(step, _)| step.clone()).collect()
    }

    /// How many samples from the base lead to `lineage`; none where it is not of this history.
    pub(crate) fn place(&self, lineage: Lineage) -> Option<usize> {
        (0..=self.samples.len()).rev().find(|&place| self.lineage_after(place) == lineage)
    }

    /// Whether the samples up to `place`, where that was before [`Self::make_room`], are not void after it. One that leaves the window is part of
    /// every later state. A void sample that is made again with equal inputs has the same lineage, and is another sample.
    pub(crate) fn keeps(&self, place: usize) -> bool {
        place <= self.samples.len()
    }

    /// A station holds the state at `place`.
    pub(crate) fn confirm(&mut self, place: usize) {
        self.confirmed = self.confirmed.max(place);
    }

    /// Makes room for this cycle's sample; answers with how many older ones become void by it.
    ///
    /// `living` are the oldest and the newest place that living stations hold, where one does; `floor` is the lineage
    /// after the newest applied sample.
    pub(crate) fn make_room(
        &mut self,
        living: Option<(usize, usize)>,
        floor: Option<Lineage>,
    ) -> usize {
        if self.samples.len() < self.capacity {
            return 0;
        }
        let floor = floor.and_then(|floor| self.place(floor)).unwrap_or(0);
        let newest = living.map_or(self.confirmed, |(_, newest)| newest).max(floor);
        // Sliding on would lose the oldest living station, and nothing is lost by void samples.
        let keeps_oldest = living.is_some_and(|(oldest, _)| oldest == 0);
        if newest > 0 && (newest == self.samples.len() || !keeps_oldest) {
            return 0;
        }
        let void = self.samples.len() - newest;
        self.samples.truncate(newest);
        self.confirmed = self.confirmed.min(newest);
        void
    }

    /// Appends this cycle's sample. Where the window is full the oldest one leaves it.
    pub(crate) fn push(&mut self, step: Step) {
        if self.samples.len() == self.capacity
            && let Some((oldest, after)) = self.samples.pop_front()
        {
            self.program = oldest.change.or(self.program);
            self.base = after;
            self.confirmed = self.confirmed.saturating_sub(1);
        }
        let after = self.head().after_step(&step);
        self.samples.push_back((step, after));
    }

    fn lineage_after(&self, samples: usize) -> Lineage {
        match samples.checked_sub(1) {
            None => self.base,
            Some(last) => self.samples[last].1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(word: u64) -> Image {
        Image::from_words(8, &[word]).expect("eight bits")
    }

    fn history(capacity: usize) -> History {
        History::genesis(ProgramHash(1), Moment::default(), capacity)
    }

    /// Appends a sample; answers with how many became void.
    fn push(
        history: &mut History,
        inputs: &Image,
        living: Option<(usize, usize)>,
        floor: Option<Lineage>,
    ) -> usize {
        let void = history.make_room(living, floor);
        history.push(Step::of(inputs.clone()));
        void
    }

    #[test]
    fn a_followed_history_slides() {
        let mut history = history(3);
        let mut lineages = vec![history.head()];
        for cycle in 0..10 {
            let living = history.place(lineages[cycle]).expect("the last head");
            history.confirm(living);
            let void = push(&mut history, &input(cycle as u64), Some((living, living)), None);
            assert_eq!(void, 0);
            lineages.push(history.head());
            assert_eq!(history.before(), lineages[cycle]);
            assert_eq!(history.base(), lineages[(cycle + 1).saturating_sub(3)]);
        }
    }

    /// Whichever sample was the last that a station followed, an isolated history comes back to it and never loses it.
    #[test]
    fn samples_that_no_station_received_are_void() {
        for followed in 0..6 {
            let mut history = history(3);
            let mut last = history.head();
            for cycle in 0..followed {
                let living = history.place(last).map(|place| (place, place));
                push(&mut history, &input(cycle), living, None);
                last = history.head();
                history.confirm(history.place(last).expect("the head"));
            }
            for cycle in 0..20 {
                push(&mut history, &input(cycle), None, None);
                assert!(history.place(last).is_some(), "{followed} followed, then {cycle} alone");
            }
        }
    }

    /// Every floor, and every place of a living station from there on or behind: the history never loses the state at
    /// the floor, or a newer one that it continues from, and a living station at its oldest state stays in it.
    #[test]
    fn an_applied_sample_never_becomes_void() {
        let check = |floor: usize, held: Option<usize>| {
            let mut history = history(4);
            let mut lineages = vec![history.head()];
            for cycle in 0..4 {
                push(&mut history, &input(cycle), Some((0, cycle as usize)), None);
                lineages.push(history.head());
            }
            history.confirm(floor);
            let mut states = lineages[..=floor].to_vec();
            for cycle in 4..30 {
                let place = held.and_then(|held| history.place(lineages[held]));
                let living = place.map(|place| (place, place));
                push(&mut history, &input(cycle), living, Some(lineages[floor]));
                states.push(history.head());
                let base = history.base();
                assert!(
                    !lineages[..floor].contains(&base) || history.place(lineages[floor]).is_some()
                );
                if let Some(held) = held.filter(|_| place == Some(0) && floor < 4) {
                    let place = history.place(lineages[held]);
                    assert!(place.is_some(), "{floor} {held} {cycle}");
                }
            }
        };
        for floor in 0..=4 {
            check(floor, None);
            (0..=4).for_each(|living| check(floor, Some(living)));
        }
    }
}
