//! The measuring point.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use understudy_wire::{Body, Frame, Member, Moment, StationSet, Time};

use crate::journal::HostEvent;
use crate::observer::Observer;

/// Longer exchanges count as this long.
const LONGEST_NS: u64 = 10_000_000_000;

/// What was measured, in nanoseconds; all 0 where no cycle was complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Exchange {
    /// Cycles in which every turn was heard.
    pub complete_cycles: u64,
    /// Cycles in which one was not.
    pub incomplete_cycles: u64,
    /// Half of the complete ones took no longer.
    pub p50_ns: u64,
    /// 99 of 100 took no longer.
    pub p99_ns: u64,
    /// The longest.
    pub longest_ns: u64,
}

/// Measures from the first frame of a cycle that is said or heard here to the last of the turns.
#[derive(Debug, Clone)]
pub struct ExchangeMeter {
    stations: usize,
    skip: u64,
    enough: u64,
    moment: Option<Moment>,
    first: Time,
    published: StationSet,
    durations: Histogram<u64>,
    incomplete: u64,
}

impl ExchangeMeter {
    /// Waits for the turns of `stations` stations in each cycle; the first `skip` complete cycles are left out, and what is
    /// incomplete before them. Satisfied with `enough` complete ones.
    ///
    /// # Panics
    /// Never: the bounds of the histogram are constants that it takes.
    pub fn new(stations: usize, skip: u64, enough: u64) -> Self {
        Self {
            stations,
            skip,
            enough,
            moment: None,
            first: Time::default(),
            published: StationSet::EMPTY,
            durations: Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("constant bounds"),
            incomplete: 0,
        }
    }

    /// What was measured so far.
    pub fn exchange(&self) -> Exchange {
        if self.durations.is_empty() {
            return Exchange {
                incomplete_cycles: self.incomplete,
                ..Exchange::default()
            };
        }
        Exchange {
            complete_cycles: self.durations.len(),
            incomplete_cycles: self.incomplete,
            p50_ns: self.durations.value_at_quantile(0.5),
            p99_ns: self.durations.value_at_quantile(0.99),
            longest_ns: self.durations.max(),
        }
    }

    fn begin(&mut self, now: Time, moment: Moment) {
        let complete = self.published.len() == self.stations;
        if self.moment.is_some() && !complete && self.skip == 0 {
            self.incomplete += 1;
        }
        self.moment = Some(moment);
        self.first = now;
        self.published = StationSet::EMPTY;
    }

    fn complete(&mut self, now: Time) {
        if self.skip > 0 {
            self.skip -= 1;
        } else {
            let duration_ns = u64::try_from(now.since(self.first).as_nanos());
            self.durations
                .saturating_record(duration_ns.unwrap_or(LONGEST_NS).max(1));
        }
    }
}

impl Observer for ExchangeMeter {
    fn frame(&mut self, now: Time, frame: &Frame) {
        if !matches!(frame.body, Body::Sync | Body::Sample(_) | Body::Turn(_)) {
            return;
        }
        let moment = frame.header.moment;
        if self.moment.is_none_or(|current| moment > current) {
            self.begin(now, moment);
        }
        let (Body::Turn(_), Member::Station(station)) = (&frame.body, frame.header.sender) else {
            return;
        };
        if self.moment == Some(moment) && !self.published.contains(station) {
            self.published.insert(station);
            if self.published.len() == self.stations {
                self.complete(now);
            }
        }
    }

    fn satisfied(&self) -> bool {
        self.durations.len() >= self.enough
    }

    fn finish(&mut self) -> Option<HostEvent> {
        Some(HostEvent::Exchange(self.exchange()))
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{
        ClusterHash, ConfigurationHash, Cycle, Epoch, Header, ProgramSet, StationId, Turn,
    };

    use super::*;

    /// One frame: at this time, of this cycle, a turn of this station or the Sync.
    type Said = (u64, u64, Option<u8>);

    fn check(skip: u64, said: &[Said], complete: u64, incomplete: u64, longest_ns: u64) {
        let mut meter = ExchangeMeter::new(2, skip, complete + 1);
        for &(at, cycle, turn) in said {
            let frame = Frame {
                header: Header {
                    cluster: ClusterHash(1),
                    configuration: ConfigurationHash(1),
                    moment: Moment {
                        epoch: Epoch(1),
                        cycle: Cycle(cycle),
                    },
                    sender: Member::Station(StationId(turn.unwrap_or(0))),
                    alone: false,
                },
                body: turn.map_or(Body::Sync, |_| {
                    Body::Turn(Turn {
                        heard: StationSet::EMPTY,
                        holdings: [].into_iter().collect(),
                        words: [].into_iter().collect(),
                        recalled: Vec::new(),
                        lacks: ProgramSet::EMPTY,
                        relayed: Vec::new(),
                    })
                }),
            };
            meter.frame(Time(at), &frame);
            assert!(!meter.satisfied());
        }
        let exchange = meter.exchange();
        assert_eq!(
            (
                exchange.complete_cycles,
                exchange.incomplete_cycles,
                exchange.longest_ns
            ),
            (complete, incomplete, longest_ns),
            "{said:?}"
        );
    }

    #[test]
    fn an_exchange_is_from_the_first_frame_to_the_last_turn() {
        check(
            0,
            &[(10, 1, None), (12, 1, Some(0)), (15, 1, Some(1))],
            1,
            0,
            5,
        );
        // A copy after the end, a stale turn, and a cycle whose Sync was lost.
        check(
            0,
            &[
                (10, 1, None),
                (12, 1, Some(0)),
                (15, 1, Some(1)),
                (16, 1, Some(1)),
                (20, 2, Some(0)),
                (21, 1, Some(1)),
                (29, 2, Some(1)),
            ],
            2,
            0,
            9,
        );
    }

    #[test]
    fn a_cycle_with_a_turn_missing_is_incomplete() {
        let missing = [
            (10, 1, None),
            (12, 1, Some(0)),
            (20, 2, None),
            (21, 2, Some(0)),
            (24, 2, Some(1)),
        ];
        check(0, &missing, 1, 1, 4);
        check(1, &missing, 0, 0, 0);
        check(0, &[], 0, 0, 0);
    }
}
