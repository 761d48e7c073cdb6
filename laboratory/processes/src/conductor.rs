//! Who says what is done to the members of a laboratory, and when its run is over: the steps of a scenario, or chance.

use std::time::Instant;

use understudy_journal::Record;
use understudy_simulator::Fault;

/// Told what happens, and asked what is to be done.
pub trait Conductor {
    /// A record, in the order in which they are read.
    fn hear(&mut self, record: &Record, now: Instant);

    /// `cycle` is the newest that was decided, counted from the origin; none before everybody was synchronised.
    fn follow(&mut self, cycle: Option<u64>, now: Instant);

    /// When the next thing is due.
    fn next_due(&self) -> Option<Instant>;

    /// The next thing that is due.
    fn take_due(&mut self, now: Instant) -> Option<Fault>;

    /// Whether something is still to come that may bring the cycles back where there are none.
    fn wait_for_time(&self) -> bool;

    /// Whether the run ends before its cycles do.
    fn is_over(&self, now: Instant) -> bool;
}
