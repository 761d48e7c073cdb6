//! What a run came to.

use std::collections::BTreeMap;

use serde::Serialize;
use understudy_remote_io::{Event, Missing};
use understudy_wire::Source;

/// Deadlines by source, for one remote I/O.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// From the controller itself.
    pub direct: u64,
    /// By (12).
    pub reconstructed: u64,
    /// The last true output.
    pub held: u64,
    /// The configured values.
    pub fail_safe: u64,
    /// Why, where they were held or fail-safe.
    pub missing: BTreeMap<Missing, u64>,
}

impl Tally {
    /// Counts a deadline.
    pub fn count(&mut self, event: &Event) {
        if let Event::Applied { source, missing, .. } = event {
            *match source {
                Source::Direct => &mut self.direct,
                Source::Reconstructed => &mut self.reconstructed,
                Source::Held => &mut self.held,
                Source::FailSafe => &mut self.fail_safe,
            } += 1;
            if let Some(missing) = missing {
                *self.missing.entry(*missing).or_default() += 1;
            }
        }
    }

    /// All deadlines.
    pub fn deadlines(&self) -> u64 {
        self.direct + self.reconstructed + self.held + self.fail_safe
    }
}
