//! Frames on their way, in the order in which they arrive.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use understudy_wire::{Audience, Frame, Time};

/// A frame and all who hear it at one time.
#[derive(Debug, Clone)]
pub(crate) struct Delivery {
    pub(crate) at: Time,
    order: u64,
    pub(crate) frame: Arc<Frame>,
    pub(crate) to: Audience,
}

/// Where every frame takes equally long, they arrive as they were sent and a plain queue serves; others are sorted.
#[derive(Debug, Clone, Default)]
pub(crate) struct Queue {
    even: VecDeque<Delivery>,
    uneven: BinaryHeap<Delivery>,
    sent: u64,
}

impl Queue {
    pub(crate) fn push(&mut self, at: Time, frame: Arc<Frame>, to: Audience) {
        self.sent += 1;
        let delivery = Delivery { at, order: self.sent, frame, to };
        if self.even.back().is_none_or(|last| last.at <= at) {
            self.even.push_back(delivery);
        } else {
            self.uneven.push(delivery);
        }
    }

    /// When the next one arrives.
    pub(crate) fn next_at(&self) -> Option<Time> {
        let even = self.even.front().map(|delivery| delivery.at);
        let uneven = self.uneven.peek().map(|delivery| delivery.at);
        match (even, uneven) {
            (Some(even), Some(uneven)) => Some(even.min(uneven)),
            (at, None) | (None, at) => at,
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Delivery> {
        match (self.even.front(), self.uneven.peek()) {
            (Some(even), Some(uneven)) if uneven > even => self.uneven.pop(),
            (Some(_), _) => self.even.pop_front(),
            (None, _) => self.uneven.pop(),
        }
    }
}

/// The earlier is the greater, because the heap gives its greatest first.
impl Ord for Delivery {
    fn cmp(&self, other: &Self) -> Ordering {
        (other.at, other.order).cmp(&(self.at, self.order))
    }
}

impl PartialOrd for Delivery {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Delivery {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Delivery {}

/// By what arrives and in which order, however it was stored.
impl Hash for Queue {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let mut deliveries: Vec<&Delivery> = self.even.iter().chain(&self.uneven).collect();
        deliveries.sort_unstable_by_key(|delivery| (delivery.at, delivery.order));
        for delivery in deliveries {
            (delivery.at, &delivery.frame, delivery.to).hash(hasher);
        }
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{
        Body, ClusterHash, ConfigurationHash, Header, Member, Moment, StationId,
    };

    use super::*;

    /// Every order of four arrival times comes out sorted, and equal times as they were sent.
    #[test]
    fn deliveries_come_in_the_order_of_their_times() {
        let frame = Arc::new(Frame {
            header: Header {
                cluster: ClusterHash(1),
                configuration: ConfigurationHash(1),
                prepared: None,
                moment: Moment::default(),
                sender: Member::Station(StationId(0)),
                alone: false,
            },
            body: Body::Sync,
        });
        for times in 0..4_u64.pow(5) {
            let times: Vec<u64> = (0..5).map(|place| times / 4_u64.pow(place) % 4).collect();
            let mut queue = Queue::default();
            for &time in &times {
                queue.push(Time(time), Arc::clone(&frame), Audience::default());
            }
            let mut expected: Vec<(u64, u64)> = times.iter().copied().zip(1..).collect();
            expected.sort_unstable();
            let mut found = Vec::new();
            while let Some(at) = queue.next_at() {
                let delivery = queue.pop().expect("there is a next one");
                assert_eq!(delivery.at, at);
                found.push((delivery.at.0, delivery.order));
            }
            assert_eq!(found, expected);
        }
    }
}
