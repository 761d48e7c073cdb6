//! Each number once, in about ascending order.

/// How far a number may lie behind the newest: copies and reordering of a network fit in many times over.
pub const WINDOW_FRAMES: u64 = 64;

/// How a number stands to those that were taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It may be taken.
    New,
    /// The first of a later life.
    NextLife,
    /// It was taken, or is too late.
    Past,
    /// The life before this one goes on: it says numbers that no delay explains.
    EarlierLife,
}

/// The numbers of one sender that were taken.
///
/// Invariant: bit k of `taken` says whether `newest - k` was taken; nothing at or before `newest - 64` is taken any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Window {
    life: u32,
    newest: u64,
    taken: u64,
    /// The life before this one and its newest number.
    earlier: (u32, u64),
}

impl Window {
    /// Whether a number may be taken.
    pub(crate) fn standing(&self, life: u32, number: u64) -> Standing {
        if number == 0 {
            return Standing::Past;
        }
        if life < self.life {
            let (earlier, newest) = self.earlier;
            let goes_on = life == earlier && number > newest.saturating_add(WINDOW_FRAMES);
            return if goes_on {
                Standing::EarlierLife
            } else {
                Standing::Past
            };
        }
        if life > self.life {
            return Standing::NextLife;
        }
        let behind = self.newest.saturating_sub(number);
        let is_past =
            number <= self.newest && (behind >= WINDOW_FRAMES || self.taken & (1 << behind) != 0);
        if is_past {
            Standing::Past
        } else {
            Standing::New
        }
    }

    /// Takes a number that stands as [`Standing::New`] or [`Standing::NextLife`].
    pub(crate) fn take(&mut self, life: u32, number: u64) {
        if life != self.life {
            *self = Self {
                life,
                newest: number,
                taken: 1,
                earlier: (self.life, self.newest),
            };
        } else if number > self.newest {
            let ahead = number - self.newest;
            self.taken = if ahead < WINDOW_FRAMES {
                (self.taken << ahead) | 1
            } else {
                1
            };
            self.newest = number;
        } else {
            self.taken |= 1 << (self.newest - number);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// The naive one: remembers everything.
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

    fn takes(window: &mut Window, life: u32, number: u64) -> bool {
        let is_free = matches!(
            window.standing(life, number),
            Standing::New | Standing::NextLife
        );
        if is_free {
            window.take(life, number);
        }
        is_free
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_window_is_a_memory_with_an_end(
            said in prop::collection::vec((1..3_u32, 0..200_u64), 0..300)
        ) {
            let (mut window, mut memory) = (Window::default(), Memory::default());
            for (life, number) in said {
                prop_assert_eq!(takes(&mut window, life, number), memory.take(life, number));
            }
        }
    }

    #[test]
    fn the_ends_of_the_numbers_are_no_ends_of_the_window() {
        let mut window = Window::default();
        assert!(takes(&mut window, 1, u64::MAX));
        assert!(!takes(&mut window, 1, u64::MAX));
        assert!(takes(&mut window, 1, u64::MAX - 63));
        assert!(!takes(&mut window, 1, u64::MAX - 64));
        assert!(takes(&mut window, u32::MAX, 1));
        assert!(!takes(&mut window, 1, u64::MAX));
    }
}
