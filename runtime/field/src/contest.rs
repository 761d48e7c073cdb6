//! Whether somebody else writes the outputs of a device.
//!
//! Before some of its writes the remote I/O reads what the device holds. On one connection that is what it wrote last, unless another master
//! writes too. One difference proves nothing: a device may set an output back by itself. Several of the last few do.

use std::time::Duration;

/// From one reading to the next.
pub(crate) const READ_BACK_EVERY: Duration = Duration::from_millis(250);

/// Of the last eight readings; the outputs are the remote I/O's own again when none of them differs.
const DIFFERENCES: u32 = 3;

/// What the last readings showed, newest in the lowest bit.
#[derive(Debug, Default)]
pub(crate) struct Contest {
    differed: u8,
    contested: bool,
}

impl Contest {
    /// Takes a reading; whether the outputs are contested.
    pub(crate) fn compare<T: PartialEq>(&mut self, written: &T, read: &T) -> bool {
        self.differed = self.differed << 1 | u8::from(written != read);
        self.contested = match self.contested {
            false => self.differed.count_ones() >= DIFFERENCES,
            true => self.differed != 0,
        };
        self.contested
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(readings: &str, expected: &str) {
        let (written, other) = ([0], [1]);
        let mut contest = Contest::default();
        let found: String = readings
            .chars()
            .map(|reading| if reading == '=' { &written } else { &other })
            .map(|read| if contest.compare(&written, read) { '!' } else { '.' })
            .collect();
        assert_eq!(found, expected, "{readings}");
    }

    #[test]
    fn a_second_master_is_found_and_a_single_difference_is_not_one() {
        check("=========", ".........");
        check("=x=======x=======x", "..................");
        check("=xxx", "...!");
        check("x=x=x=========x", "....!!!!!!!!...");
    }
}
