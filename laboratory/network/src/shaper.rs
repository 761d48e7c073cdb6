//! What becomes of each datagram, and when: one direction of one link.
//!
//! Time is an argument, in nanoseconds from any start, and randomness is seeded: the same datagrams at the same times have the same fate.
//!
//! Invariant: without [`Impairment::reorder`] what arrives arrives in the order in which it was sent.

use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::impairment::{Impairment, Share};

/// What a link of a rate lets wait, at most; then it drops what comes.
const MAXIMUM_WAIT: Duration = Duration::from_secs(1);

/// One that is overtaken is held back by at least so much.
const LEAST_HOLD: Duration = Duration::from_millis(1);

/// Something that arrives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Passed {
    /// When, on the clock of the caller.
    pub due_ns: u64,
    /// What.
    pub bytes: Vec<u8>,
}

/// One direction of one link.
#[derive(Debug, Clone)]
pub struct Shaper {
    impairment: Impairment,
    random: Pcg64Mcg,
    /// When the line is free again.
    free_ns: u64,
    /// When the last one arrives that kept its order.
    last_ns: u64,
}

impl Shaper {
    /// How much later a lost piece of a stream arrives: the least time after which Linux sends it again.
    pub const RETRANSMISSION: Duration = Duration::from_millis(200);

    /// A line that has carried nothing yet.
    pub fn new(impairment: Impairment, seed: u64) -> Self {
        Self { impairment, random: Pcg64Mcg::seed_from_u64(seed), free_ns: 0, last_ns: 0 }
    }

    /// A datagram that is sent at `now_ns`: nothing, once or twice what arrives.
    pub fn datagram(&mut self, now_ns: u64, bytes: &[u8]) -> impl Iterator<Item = Passed> + use<> {
        let copies = if self.happens(self.impairment.loss) {
            0
        } else {
            1 + usize::from(self.happens(self.impairment.duplicate))
        };
        let mut passed: [Option<Passed>; 2] = [None, None];
        for slot in passed.iter_mut().take(copies) {
            *slot = self.line(now_ns, bytes.len()).map(|sent_ns| {
                let due_ns = sent_ns + self.latency_ns();
                let due_ns = if self.happens(self.impairment.reorder) {
                    let hold = (self.impairment.delay + self.impairment.jitter).max(LEAST_HOLD);
                    due_ns + nanoseconds(hold)
                } else {
                    self.last_ns = self.last_ns.max(due_ns);
                    self.last_ns
                };
                Passed { due_ns, bytes: self.content(bytes) }
            });
        }
        passed.into_iter().flatten()
    }

    /// A piece of a stream, which always arrives, and in order.
    pub fn piece(&mut self, now_ns: u64, bytes: &[u8]) -> Passed {
        let lost = self.happens(self.impairment.loss);
        let again_ns = if lost { nanoseconds(Self::RETRANSMISSION) } else { 0 };
        self.free_ns = self.free_ns.max(now_ns) + self.on_the_line_ns(bytes.len());
        let due_ns = self.free_ns + self.latency_ns() + again_ns;
        self.last_ns = self.last_ns.max(due_ns);
        Passed { due_ns: self.last_ns, bytes: self.content(bytes) }
    }

    /// When it has left, or nothing where too much waits.
    fn line(&mut self, now_ns: u64, length: usize) -> Option<u64> {
        let start_ns = self.free_ns.max(now_ns);
        if start_ns - now_ns > nanoseconds(MAXIMUM_WAIT) {
            return None;
        }
        self.free_ns = start_ns + self.on_the_line_ns(length);
        Some(self.free_ns)
    }

    fn on_the_line_ns(&self, length: usize) -> u64 {
        let rate = self.impairment.rate;
        rate.map_or(0, |rate| nanoseconds(rate.time_of(length)))
    }

    fn latency_ns(&mut self) -> u64 {
        let (delay, jitter) =
            (nanoseconds(self.impairment.delay), nanoseconds(self.impairment.jitter));
        if jitter == 0 {
            return delay;
        }
        (delay + self.random.random_range(0..=2 * jitter)).saturating_sub(jitter)
    }

    fn content(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if self.happens(self.impairment.corrupt) && !bytes.is_empty() {
            let bit = self.random.random_range(0..bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        bytes
    }

    fn happens(&mut self, share: Share) -> bool {
        // Nothing is drawn for what never happens, so that one impairment does not move another.
        !share.is_never() && self.random.random_bool(share.get())
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX / 4)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::impairment::Rate;

    const MILLISECOND: u64 = 1_000_000;

    fn share(share: f64) -> Share {
        Share::new(share).expect("a share")
    }

    /// Sends `count` numbered datagrams a millisecond apart, and says when which arrive, by their arrival.
    fn arrivals(impairment: Impairment, count: u16) -> Vec<(u64, Vec<u8>)> {
        let mut shaper = Shaper::new(impairment, 7);
        let mut found: Vec<(u64, usize, Vec<u8>)> = Vec::new();
        for number in 0..count {
            let sent = u64::from(number) * MILLISECOND;
            for passed in shaper.datagram(sent, &number.to_be_bytes()) {
                assert!(passed.due_ns >= sent);
                found.push((passed.due_ns, found.len(), passed.bytes));
            }
        }
        found.sort();
        found.into_iter().map(|(due, _, bytes)| (due, bytes)).collect()
    }

    #[test]
    fn a_line_without_impairments_changes_nothing() {
        let found = arrivals(Impairment::default(), 100);
        let sent = (0..100_u16).map(|number| {
            let bytes = number.to_be_bytes().to_vec();
            (u64::from(number) * MILLISECOND, bytes)
        });
        assert_eq!(found, sent.collect::<Vec<_>>());
    }

    #[test]
    fn shares_come_out_as_asked() {
        let tenth = share(0.1);
        let lost = arrivals(Impairment { loss: tenth, ..Impairment::default() }, 10_000);
        assert!((8_800..9_200).contains(&lost.len()), "{}", lost.len());
        let duplicate = Impairment { duplicate: tenth, ..Impairment::default() };
        let doubled = arrivals(duplicate, 10_000);
        assert!((10_800..11_200).contains(&doubled.len()), "{}", doubled.len());
        let corrupted = arrivals(Impairment { corrupt: share(1.0), ..Impairment::default() }, 100);
        for (number, (_, bytes)) in corrupted.iter().enumerate() {
            let changed = u16::from_be_bytes([bytes[0], bytes[1]]) ^ number as u16;
            assert_eq!(changed.count_ones(), 1);
        }
    }

    #[test]
    fn only_reordering_reorders() {
        let jittered = Impairment {
            delay: Duration::from_millis(5),
            jitter: Duration::from_millis(5),
            ..Impairment::default()
        };
        let in_order = |found: &[(u64, Vec<u8>)]| found.windows(2).all(|two| two[0].1 <= two[1].1);
        assert!(in_order(&arrivals(jittered, 1000)));
        let reordered = Impairment { reorder: share(0.1), ..jittered };
        let found = arrivals(reordered, 1000);
        assert_eq!(found.len(), 1000);
        assert!(!in_order(&found));
    }

    #[test]
    fn a_rate_delays_and_then_drops() {
        let rate = Rate::new(1000);
        let found = arrivals(Impairment { rate, ..Impairment::default() }, 1000);
        // 16 bits take 16 ms, one comes every 1 ms: what would wait for more than a second is dropped.
        assert!(found.len() < 200, "{}", found.len());
        let gaps = found.windows(2).map(|two| two[1].0 - two[0].0);
        assert!(gaps.clone().all(|gap| gap >= 16 * MILLISECOND));
    }

    proptest! {
        #[test]
        fn a_stream_keeps_its_bytes_and_their_order(
            loss in 0.0..1.0,
            jitter_ms in 0_u64..20,
            gaps in proptest::collection::vec(0_u64..5_000_000, 1..100),
        ) {
            let impairment = Impairment {
                loss: share(loss),
                jitter: Duration::from_millis(jitter_ms),
                ..Impairment::default()
            };
            let mut shaper = Shaper::new(impairment, 1);
            let (mut now, mut last) = (0, 0);
            for gap in gaps {
                now += gap;
                let passed = shaper.piece(now, &[1, 2, 3]);
                prop_assert_eq!(passed.bytes, vec![1, 2, 3]);
                prop_assert!(passed.due_ns >= now && passed.due_ns >= last);
                last = passed.due_ns;
            }
        }
    }
}
