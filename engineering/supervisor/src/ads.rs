//! TCT's format .ADS: an automaton as lists of numbers under headings.
//!
//! What is accepted is what TCT and those who imitate it write: either spelling of the first heading, headings in any
//! capitals, any line ends, blank lines and `#` comments anywhere, `*` for "all states are marked", several numbers of a list on
//! one line, vocal states. A list ends where the next heading begins. Labels are 0 to 999, and the label alone says what is
//! controllable. The alphabet is what stands on the transitions, those of unreachable states included: that is how TCT is
//! told of an event that never happens.

mod read;
mod write;

pub use read::{Read, read_ads};
pub use write::{AdsError, write_ads};

use crate::automaton::State;

/// Maximum number of states of the format.
pub const MAXIMUM_STATES: usize = 2_000_000;

/// The highest label of the format.
pub const MAXIMUM_LABEL: u32 = 999;

/// A vocal state: one that says something to a higher level. Synthesis ignores it; reading and writing keep it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vocal {
    /// The state.
    pub state: State,
    /// What it says, 10 to 99.
    pub output: u8,
}
