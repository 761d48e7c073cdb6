//! Copies of cyclic frames that are still to be sent.
//!
//! Bounded: a member has at most two kinds of cyclic frames, and an older frame's copies are dropped when a newer one
//! of the same kind is sent.

use std::sync::Arc;

use smallvec::SmallVec;

use crate::schedule::Schedule;
use understudy_wire::{Frame, Time};

/// Frames of this cycle, each with the times of its copies.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Copies {
    pending: SmallVec<[Pending; 2]>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Pending {
    due: Time,
    left: u32,
    frame: Arc<Frame>,
}

impl Copies {
    /// Notes that `frame` was sent at `now` for the first time.
    pub fn sent(&mut self, now: Time, frame: &Arc<Frame>, schedule: &Schedule) {
        let same_kind = |pending: &Pending| {
            std::mem::discriminant(&pending.frame.body) == std::mem::discriminant(&frame.body)
        };
        self.pending.retain(|pending| !same_kind(pending));
        if schedule.copies() > 1 {
            self.pending.push(Pending {
                due: now + schedule.copy_spacing(),
                left: schedule.copies() - 1,
                frame: Arc::clone(frame),
            });
        }
    }

    /// Takes the next frame whose copy is due at `now`.
    pub fn take_due(&mut self, now: Time, schedule: &Schedule) -> Option<Arc<Frame>> {
        let place = self.pending.iter().position(|pending| pending.due <= now)?;
        let pending = &mut self.pending[place];
        pending.left -= 1;
        pending.due = pending.due + schedule.copy_spacing();
        if pending.left == 0 {
            return Some(self.pending.remove(place).frame);
        }
        Some(Arc::clone(&pending.frame))
    }

    /// Time of the next copy.
    pub fn wakeup(&self) -> Option<Time> {
        self.pending.iter().map(|pending| pending.due).min()
    }

    /// Drops all copies: the cycle that they belong to is over.
    pub fn clear(&mut self) {
        self.pending.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use understudy_wire::{
        Body, ClusterHash, ConfigurationHash, Header, Member, Moment, StationId,
    };

    #[test]
    fn a_frame_leaves_as_often_as_configured() {
        for copies in 1..=4 {
            let schedule = Schedule::new(Duration::from_millis(10), 2, 1, copies).expect("bounds");
            let frame = Arc::new(Frame {
                header: Header {
                    cluster: ClusterHash(1),
                    configuration: ConfigurationHash(2),
                    prepared: None,
                    moment: Moment::default(),
                    sender: Member::Station(StationId(0)),
                    alone: false,
                },
                body: Body::Sync,
            });
            let mut queue = Copies::default();
            queue.sent(Time(0), &frame, &schedule);
            let mut times = 1;
            while let Some(due) = queue.wakeup() {
                assert!(queue.take_due(Time(due.0 - 1), &schedule).is_none());
                assert!(queue.take_due(due, &schedule).is_some());
                times += 1;
            }
            assert_eq!(times, copies);
        }
    }
}
