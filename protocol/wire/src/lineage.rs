//! Equality of states, without sending or hashing a state.
//!
//! L(i)(0) = H(program, birth), or H(program, birth, retained lineage) of a warm start; L(i)(t+1) = H(L(i)(t), u(i)(t)),
//! where a change mark makes L(i)(t) to H(L(i)(t), new program) before. A state is a function of its first state and of the inputs since, so equal lineages mean equal states, up to a
//! collision of 64 bits and to a value fault; a [`Digest`] of the state itself is sent with it, and differs between
//! replicas of equal lineage only after a value fault.

use std::fmt;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::frame::Step;
use crate::identifier::{Moment, ProgramHash};
use crate::image::Image;

/// Identifies an initial state and all inputs since.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Lineage(pub u64);

/// What a warm start adds to its genesis: "warm" in ASCII, and no width of an image.
const WARM: u64 = 0x7761_726d_0000_0000;

/// What a change mark adds: "change" in ASCII, and no width of an image.
const CHANGE: u64 = 0x6368_616e_6765_0000;

impl Lineage {
    /// L(i)(0): the initial state of a program that its remote I/O started cold at `born`.
    pub fn genesis(program: ProgramHash, born: Moment) -> Self {
        [program.0, born.epoch.0, born.cycle.0].into_iter().fold(Self(0), Self::fold)
    }

    /// L(i)(0) of a warm start: the initial state with the retentive values of the state of lineage `retained`.
    pub fn warm(program: ProgramHash, born: Moment, retained: Self) -> Self {
        // A constant tells it from every lineage of samples and of cold starts.
        [WARM, retained.0].into_iter().fold(Self::genesis(program, born), Self::fold)
    }

    /// L(i)(t+1), from L(i)(t) and u(i)(t).
    #[must_use]
    pub fn after(self, inputs: &Image) -> Self {
        // A program without inputs steps too, and each of its states has its own lineage.
        let first = self.fold(inputs.width() as u64);
        inputs.words().iter().copied().fold(first, Self::fold)
    }

    /// L(i)(t) where the program changes to `program` before it takes u(i)(t): its first state is a function of the state before and of both
    /// programs.
    #[must_use]
    pub fn changed(self, program: ProgramHash) -> Self {
        [CHANGE, program.0].into_iter().fold(self, Self::fold)
    }

    /// L(i)(t+1), after a step.
    #[must_use]
    pub fn after_step(self, step: &Step) -> Self {
        step.change.map_or(self, |program| self.changed(program)).after(&step.inputs)
    }

    fn fold(self, word: u64) -> Self {
        Self(xxh3_64_with_seed(&word.to_le_bytes(), self.0))
    }
}

/// Hash of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Digest(pub u64);

impl Digest {
    /// The digest of x(i).
    pub fn of(state: &Image) -> Self {
        let words = state.words().iter();
        Self(words.fold(0, |digest, word| xxh3_64_with_seed(&word.to_le_bytes(), digest)))
    }
}

impl fmt::Display for Lineage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:016x}", self.0)
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::identifier::{Cycle, Epoch};

    #[test]
    fn every_history_of_four_two_bit_inputs_has_its_own_name() {
        let inputs: Vec<Image> =
            (0..4).map(|word| Image::from_words(2, &[word]).expect("two bits")).collect();
        let born = Moment { epoch: Epoch(1), cycle: Cycle(0) };
        let mut generation = vec![Lineage::genesis(ProgramHash(7), born)];
        let mut seen: HashSet<Lineage> = generation.iter().copied().collect();
        let mut expected = 1;
        for _ in 0..4 {
            generation = generation
                .iter()
                .flat_map(|lineage| inputs.iter().map(|input| lineage.after(input)))
                .collect();
            seen.extend(&generation);
            expected += generation.len();
        }
        assert_eq!(seen.len(), expected);
    }

    #[test]
    fn a_second_birth_is_another_lineage() {
        let born = Moment::default();
        let again = born.plus(1);
        assert_ne!(Lineage::genesis(ProgramHash(7), born), Lineage::genesis(ProgramHash(7), again));
        assert_ne!(Lineage(3).after(&Image::zero(0)), Lineage(3));
    }
}
