//! Each number once, in approximately ascending order.

/// Maximum distance of a number behind the newest: more frames than a member sends in five cycles, state transfers included, so that none is
/// dropped that only the slower one of two networks carries.
pub const WINDOW_FRAMES: u64 = 1024;

/// Frames of a life that ends that are still on their way, at most.
pub const ON_THEIR_WAY: u64 = 64;

const WORDS: usize = (WINDOW_FRAMES / 64) as usize;

/// Decision on a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It is accepted, for the first time.
    Taken,
    /// It was accepted before, or is too old.
    Again,
    /// It is of a life before the newest, of which frames still arrive.
    OfAnotherLife,
}

/// The numbers of one sender that were accepted.
///
/// Invariant: the bit of a number is at its remainder by [`WINDOW_FRAMES`]; it is set where that number of `newest - 1023` to `newest` was
/// accepted; nothing before these is accepted any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Window {
    life: u32,
    newest: u64,
    taken: Taken,
    /// The life before this one.
    earlier: Earlier,
}

/// A bit for each number of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Taken([u64; WORDS]);

impl Taken {
    fn only(number: u64) -> Self {
        let mut taken = Self::default();
        taken.insert(number);
        taken
    }

    /// False where it was there before.
    fn insert(&mut self, number: u64) -> bool {
        let (word, bit) = Self::place(number);
        let is_new = self.0[word] & bit == 0;
        self.0[word] |= bit;
        is_new
    }

    fn remove(&mut self, number: u64) {
        let (word, bit) = Self::place(number);
        self.0[word] &= !bit;
    }

    fn place(number: u64) -> (usize, u64) {
        ((number / 64) as usize % WORDS, 1 << (number % 64))
    }
}

/// A life that has ended, unless its numbers continue: at most [`ON_THEIR_WAY`] frames were on their way when it
/// ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Earlier {
    life: u32,
    /// A number up to here does not show that it continues.
    until: u64,
}

impl Window {
    /// Whether `life` would begin with this number.
    pub(crate) fn begins(&self, life: u32) -> bool {
        life > self.life
    }

    /// Decides on a number.
    pub(crate) fn take(&mut self, life: u32, number: u64) -> Verdict {
        if number == 0 {
            return Verdict::Again;
        }
        if life < self.life {
            return self.earlier.goes_on(life, number);
        }
        if life > self.life {
            *self = Self {
                life,
                newest: number,
                taken: Taken::only(number),
                earlier: Earlier::ends(self.life, self.newest),
            };
            return Verdict::Taken;
        }
        if number > self.newest {
            if number - self.newest < WINDOW_FRAMES {
                (self.newest + 1..number).for_each(|skipped| self.taken.remove(skipped));
                // Its bit may be that of a number that leaves the window.
                self.taken.insert(number);
            } else {
                self.taken = Taken::only(number);
            }
            self.newest = number;
            return Verdict::Taken;
        }
        let is_in_window = self.newest - number < WINDOW_FRAMES;
        match is_in_window && self.taken.insert(number) {
            true => Verdict::Taken,
            false => Verdict::Again,
        }
    }
}

impl Earlier {
    fn ends(life: u32, number: u64) -> Self {
        Self { life, until: number.saturating_add(ON_THEIR_WAY) }
    }

    fn goes_on(&mut self, life: u32, number: u64) -> Verdict {
        if life > self.life {
            *self = Self::ends(life, number);
        }
        if life < self.life || number <= self.until {
            return Verdict::Again;
        }
        // Each number shows it once.
        self.until = number;
        Verdict::OfAnotherLife
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// The naive implementation: remembers every number.
    #[derive(Default)]
    struct Memory {
        newest: (u32, u64),
        taken: BTreeSet<(u32, u64)>,
    }

    impl Memory {
        fn take(&mut self, life: u32, number: u64) -> bool {
            let (newest_life, newest) = self.newest;
            let stale =
                life < newest_life || (life == newest_life && number + WINDOW_FRAMES <= newest);
            if number == 0 || stale || !self.taken.insert((life, number)) {
                return false;
            }
            self.newest = self.newest.max((life, number));
            true
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_window_is_a_memory_with_an_end(
            // Up to three windows, and mostly close to each other.
            said in prop::collection::vec((1..3_u32, (0..40_u64, 0..80_u64).prop_map(|(far, near)| far * 80 + near)), 0..600)
        ) {
            let (mut window, mut memory) = (Window::default(), Memory::default());
            for (life, number) in said {
                let taken = window.take(life, number) == Verdict::Taken;
                prop_assert_eq!(taken, memory.take(life, number));
            }
        }

        /// A process that was replaced, with frames still on their way; and one that continues next to its successor.
        #[test]
        fn a_life_that_goes_on_is_told_from_one_that_has_ended(
            before in 1..500_u64,
            on_its_way in prop::collection::vec(1..=ON_THEIR_WAY, 0..100),
            goes_on in 1..200_u64,
        ) {
            let mut window = Window::default();
            for number in 1..=before {
                window.take(1, number);
            }
            prop_assert_eq!(window.take(2, 1), Verdict::Taken);
            for late in on_its_way {
                prop_assert_eq!(window.take(1, before + late), Verdict::Again);
            }
            for number in 1..=goes_on {
                let expected = if number <= ON_THEIR_WAY { Verdict::Again } else { Verdict::OfAnotherLife };
                prop_assert_eq!(window.take(1, before + number), expected);
                prop_assert_eq!(window.take(1, before + number), Verdict::Again, "replayed");
                prop_assert_eq!(window.take(2, 1 + number), Verdict::Taken);
            }
        }
    }

    #[test]
    fn the_ends_of_the_numbers_are_no_ends_of_the_window() {
        let mut window = Window::default();
        assert_eq!(window.take(1, u64::MAX), Verdict::Taken);
        assert_eq!(window.take(1, u64::MAX), Verdict::Again);
        assert_eq!(window.take(1, u64::MAX - (WINDOW_FRAMES - 1)), Verdict::Taken);
        assert_eq!(window.take(1, u64::MAX - WINDOW_FRAMES), Verdict::Again);
        assert_eq!(window.take(u32::MAX, 1), Verdict::Taken);
        assert_eq!(window.take(1, u64::MAX), Verdict::Again);
    }
}
