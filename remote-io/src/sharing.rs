//! Which part of the numbers that two modules drive together each of them drives, as the author decides it.
//!
//! | modules of use | own part | part of the other one |
//! |---|---|---|
//! | both, or neither | half | half |
//! | those of the author | the whole | nothing |
//! | those of the other one | nothing | the whole |
//!
//! A module may drive what it was told last until its watchdog has run out. So a part grows only when the module of the other side must have given up what
//! is over: it was told less for that time.
//!
//! Invariant: what both modules may drive at a time is at most the whole.

use std::time::Duration;

use understudy_wire::{Share, Time};

/// Periods that outputs may be under way to the other remote I/O, and one until they are driven.
const UNDER_WAY: u32 = 3;

/// How long a module may drive what it was told.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lasts {
    /// The own module, from the deadline on.
    pub(crate) own: Duration,
    /// The module of the other one.
    pub(crate) other: Duration,
}

impl Lasts {
    /// Where modules and followers keep outputs for `lasting` periods, and a device takes `delay` periods to drive them.
    pub(crate) fn of(period: Duration, lasting: u32, delay: u32) -> Self {
        // A follower keeps what it has received, and its module keeps that for as long, where the follower ends.
        let other = lasting.saturating_mul(2).saturating_add(UNDER_WAY).saturating_add(delay);
        Self {
            own: period * lasting.saturating_add(1).saturating_add(delay),
            other: period * other,
        }
    }
}

/// When one of two modules was told last to drive some part, and the whole.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
struct Told {
    some: Option<Time>,
    whole: Option<Time>,
}

impl Told {
    fn note(&mut self, now: Time, share: Share) {
        if share != Share::Nothing {
            self.some = Some(now);
        }
        if share == Share::Whole {
            self.whole = Some(now);
        }
    }

    fn with(now: Time, share: Share) -> Self {
        let mut told = Self::default();
        told.note(now, share);
        told
    }

    /// What the module may drive now.
    fn may_drive(self, now: Time, lasts: Duration) -> Share {
        let is_within = |at: Option<Time>| at.is_some_and(|at| now.since(at) <= lasts);
        match (is_within(self.some), is_within(self.whole)) {
            (_, true) => Share::Whole,
            (true, false) => Share::Half,
            (false, false) => Share::Nothing,
        }
    }
}

/// The parts of both modules.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Sharing {
    own: Told,
    other: Told,
}

impl Sharing {
    /// Nothing is known of either module: each may drive the whole.
    pub(crate) fn unknown(now: Time) -> Self {
        let whole = Told::with(now, Share::Whole);
        Self { own: whole, other: whole }
    }

    /// The author before has lately told the own module to drive this part.
    pub(crate) fn following(now: Time, share: Share) -> Self {
        Self { own: Told::with(now, share), other: Told::with(now, share.rest()) }
    }

    /// The own part and that of the other one from now on; `is_of_use`: whether the modules of either drive what they are told.
    pub(crate) fn decide(&mut self, now: Time, is_of_use: [bool; 2], lasts: Lasts) -> [Share; 2] {
        let [wanted, wanted_of_other] = match is_of_use {
            [true, false] => [Share::Whole, Share::Nothing],
            [false, true] => [Share::Nothing, Share::Whole],
            [true, true] | [false, false] => [Share::Half; 2],
        };
        let own = wanted.min(self.other.may_drive(now, lasts.other).rest());
        self.own.note(now, own);
        let other = wanted_of_other.min(self.own.may_drive(now, lasts.own).rest());
        self.other.note(now, other);
        [own, other]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);

    fn halves(share: Share) -> u32 {
        match share {
            Share::Nothing => 0,
            Share::Half => 1,
            Share::Whole => 2,
        }
    }

    /// Every sequence of modules that are of use or not, in steps of different length: each module drives what it was told, or keeps any of what it was
    /// told as long as it may, and both together drive at most the whole.
    #[test]
    fn both_together_drive_at_most_the_whole() {
        let lasts = Lasts { own: PERIOD * 2, other: PERIOD * 4 };
        let starts = [
            Sharing::unknown(Time(0)),
            Sharing::following(Time(0), Share::Half),
            Sharing::following(Time(0), Share::Nothing),
            Sharing::following(Time(0), Share::Whole),
        ];
        let mut most_seen = [0; 3];
        for start in starts {
            for word in 0..1_u32 << 16 {
                let mut sharing = start.clone();
                let mut told: Vec<[Share; 2]> = Vec::new();
                for step in 0..8_u32 {
                    let is_of_use = [word >> (2 * step) & 1 == 1, word >> (2 * step + 1) & 1 == 1];
                    told.push(sharing.decide(Time(0) + PERIOD * (step + 1), is_of_use, lasts));
                    let kept = |place: usize, periods: usize| {
                        let lately = told.iter().rev().take(periods + 1);
                        lately.map(|parts| halves(parts[place])).max().unwrap_or(0)
                    };
                    let both = kept(0, 2) + kept(1, 4);
                    assert!(both <= 2, "{word:b} {told:?}");
                    most_seen[both as usize] += 1;
                }
            }
        }
        assert!(most_seen.iter().all(|seen| *seen > 1000), "{most_seen:?}");
    }

    /// The other one fails: its part is free when its module must have run out. It is back: both have halves when the own module must have given up the rest.
    #[test]
    fn the_whole_is_driven_again_after_a_bounded_time() {
        let lasts = Lasts::of(PERIOD, 4, 0);
        assert_eq!((lasts.own, lasts.other), (PERIOD * 5, PERIOD * 11));
        let mut sharing = Sharing::following(Time(0), Share::Half);
        let mut parts = Vec::new();
        for cycle in 1..=40_u32 {
            let is_of_use = [true, !(10..30).contains(&cycle)];
            let found = sharing.decide(Time(0) + PERIOD * cycle, is_of_use, lasts);
            parts.push(found.map(halves));
        }
        let when = |found: [u32; 2]| -> Vec<usize> {
            (1..).zip(&parts).filter(|(_, it)| **it == found).map(|(cycle, _)| cycle).collect()
        };
        assert_eq!(when([1, 1]), (1..10).chain(35..=40).collect::<Vec<_>>());
        assert_eq!(when([1, 0]), (10..21).chain(30..35).collect::<Vec<_>>());
        assert_eq!(when([2, 0]), (21..30).collect::<Vec<_>>());
    }
}
