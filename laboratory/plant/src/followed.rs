//! A terminal that follows a sensor of another plant.

use smallvec::SmallVec;
use understudy_wire::{Field, Moment, ProgramId};

/// Source of a following terminal, in the order of the names given to [`crate::Plant::following`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Followed {
    /// Program of the plant that is followed.
    pub from: ProgramId,
    /// The first bit of u(from) that its sensor drives.
    pub sensor: usize,
    /// How many bits its sensor drives.
    pub bits: usize,
}

impl Followed {
    /// What the sensor shows, bit by bit.
    pub fn shown(self, field: &Field) -> SmallVec<[bool; 1]> {
        let bits = self.sensor..self.sensor + self.bits;
        bits.map(|bit| field.sensors.get(bit)).collect()
    }
}

/// Last received state of a followed plant. Lost frames cost time only: each frame carries the whole state.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hearing {
    heard: Moment,
}

impl Hearing {
    /// Value of the sensor, where this frame is not older than the last one.
    ///
    /// Cycles order frames within an epoch only. A frame of another epoch counts as new, also of an older one, because
    /// epochs are given up; and one without a moment is of a plant that has just started.
    pub(crate) fn hear(
        &mut self,
        followed: Followed,
        moment: Moment,
        field: &Field,
    ) -> Option<SmallVec<[bool; 1]>> {
        let old = moment.epoch == self.heard.epoch && moment.cycle < self.heard.cycle;
        if old && moment != Moment::default() {
            return None;
        }
        self.heard = moment;
        Some(followed.shown(field))
    }
}
