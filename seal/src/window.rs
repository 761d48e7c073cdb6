//! Each number once, in about ascending order.

/// How far a number may lie behind the newest: copies and reordering of a network fit in many times over.
pub const WINDOW_FRAMES: u64 = 64;

/// The numbers of one sender that were taken.
///
/// Invariant: bit k of `taken` says whether `newest - k` was taken; nothing at or before `newest - 64` is taken any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Window {
    life: u32,
    newest: u64,
    taken: u64,
}

impl Window {
    /// Takes a number, once; false where it must not count.
    pub(crate) fn take(&mut self, life: u32, number: u64) -> bool {
        if life < self.life || number == 0 {
            return false;
        }
        if life > self.life {
            *self = Self {
                life,
                newest: number,
                taken: 1,
            };
            return true;
        }
        if number > self.newest {
            let ahead = number - self.newest;
            self.taken = if ahead < WINDOW_FRAMES {
                (self.taken << ahead) | 1
            } else {
                1
            };
            self.newest = number;
            return true;
        }
        let behind = self.newest - number;
        if behind >= WINDOW_FRAMES || self.taken & (1 << behind) != 0 {
            return false;
        }
        self.taken |= 1 << behind;
        true
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

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_window_is_a_memory_with_an_end(
            said in prop::collection::vec((1..3_u32, 0..200_u64), 0..300)
        ) {
            let (mut window, mut memory) = (Window::default(), Memory::default());
            for (life, number) in said {
                prop_assert_eq!(window.take(life, number), memory.take(life, number));
            }
        }
    }

    #[test]
    fn the_ends_of_the_numbers_are_no_ends_of_the_window() {
        let mut window = Window::default();
        assert!(window.take(1, u64::MAX));
        assert!(!window.take(1, u64::MAX));
        assert!(window.take(1, u64::MAX - 63));
        assert!(!window.take(1, u64::MAX - 64));
        assert!(window.take(u32::MAX, 1));
        assert!(!window.take(1, u64::MAX));
    }
}
