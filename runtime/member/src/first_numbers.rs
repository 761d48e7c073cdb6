//! The numbers with which a member starts, for tests of counters near their end.

use std::time::{SystemTime, UNIX_EPOCH};

use understudy_wire::{Cycle, Epoch, Moment};

use crate::error::MemberError;

/// `EPOCH:CYCLE:FRAME`: the first moment of an epoch that a station founds, and the number of the last frame that the member has sealed.
/// Only tests set it.
const VARIABLE: &str = "UNDERSTUDY_FIRST_NUMBERS";

/// Where a member starts to count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FirstNumbers {
    /// First moment of an epoch that a station founds: later than any epoch that the cluster has had.
    pub(crate) founds: Moment,
    /// Frames of this life that are taken for sealed.
    pub(crate) sealed: u64,
}

impl FirstNumbers {
    /// Those of the clock, or those that a test asks for.
    ///
    /// # Errors
    /// [`MemberError::FirstNumbers`] if the test asks for something else.
    pub(crate) fn now() -> Result<Self, MemberError> {
        let Some(text) = std::env::var_os(VARIABLE) else {
            let since = SystemTime::now().duration_since(UNIX_EPOCH);
            let epoch =
                since.map_or(1, |since| u64::try_from(since.as_micros()).unwrap_or(u64::MAX));
            return Ok(Self { founds: Moment { epoch: Epoch(epoch), cycle: Cycle(0) }, sealed: 0 });
        };
        tracing::warn!(variable = VARIABLE, value = ?text, "the member starts with the numbers of a test");
        let numbers = text.to_str().and_then(Self::parse);
        numbers.ok_or_else(|| MemberError::FirstNumbers(text.to_string_lossy().into_owned()))
    }

    fn parse(text: &str) -> Option<Self> {
        let mut numbers = text.split(':').map(|number| number.parse::<u64>().ok());
        let [epoch, cycle, sealed] = [numbers.next()??, numbers.next()??, numbers.next()??];
        let founds = Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) };
        numbers.next().is_none().then_some(Self { founds, sealed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_numbers_are_read() {
        let largest = format!("{0}:{0}:{0}", u64::MAX);
        let expected = FirstNumbers { founds: Moment::LAST, sealed: u64::MAX };
        assert_eq!(FirstNumbers::parse(&largest), Some(expected));
        for other in ["", "1", "1:2", "1:2:3:4", "1:2:x", "-1:2:3", "1:2:18446744073709551616"] {
            assert_eq!(FirstNumbers::parse(other), None, "{other}");
        }
    }
}
