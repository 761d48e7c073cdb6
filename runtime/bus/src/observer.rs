//! Who looks on while a member runs.

use understudy_wire::{Frame, Time};

use crate::journal::HostEvent;

/// Sees every frame that a member says or hears, copies included; changes nothing.
pub trait Observer: Send {
    /// One frame: before it is sent, or before the member is told.
    fn frame(&mut self, now: Time, frame: &Frame);

    /// The member was woken for one of its own times.
    fn woken(&mut self, _now: Time) {}

    /// The member has nothing left to do, and sleeps until its own next time, `until`, or until something comes.
    fn rests(&mut self, _now: Time, _until: Time) {}

    /// Whether it has seen all that it came for; the member stops then.
    fn satisfied(&self) -> bool {
        false
    }

    /// What it has to report when the member stops.
    fn finish(&mut self) -> Option<HostEvent>;
}

/// Nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    fn frame(&mut self, _now: Time, _frame: &Frame) {}

    fn finish(&mut self) -> Option<HostEvent> {
        None
    }
}
