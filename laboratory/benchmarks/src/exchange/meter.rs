//! The measuring point, at the cycle master.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{StationId, StationSet, Time};

/// Duration of the exchanges, in nanoseconds; 0 if no cycle was complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Exchange {
    /// Cycles in which a turn was not received.
    pub(crate) incomplete_cycles: u64,
    pub(crate) p50_ns: u64,
    pub(crate) p99_ns: u64,
}

/// Measures from the first frame of a cycle that is sent or received here to the last of its turns.
#[derive(Debug, Clone)]
pub(crate) struct Meter {
    stations: usize,
    /// Complete cycles that are still left out.
    skip: u64,
    /// Number of cycles to measure.
    wanted: usize,
    /// Current cycle, counted from 1.
    cycle: u64,
    first: Time,
    published: StationSet,
    durations_ns: Vec<u64>,
    incomplete: u64,
}

impl Meter {
    /// Waits for the turns of `stations` stations in each cycle. The first `skip` complete cycles are left out, and the incomplete ones
    /// before them; then `wanted` complete cycles are measured.
    pub(crate) fn new(stations: usize, skip: u64, wanted: usize) -> Self {
        Self {
            stations,
            skip,
            wanted,
            cycle: 0,
            first: Time::default(),
            published: StationSet::EMPTY,
            durations_ns: Vec::with_capacity(wanted),
            incomplete: 0,
        }
    }

    /// A frame of a cycle that is sent or received: the turn of a station, or another one. The duration of the exchange that it completes.
    pub(crate) fn frame(
        &mut self,
        now: Time,
        cycle: u64,
        turn: Option<StationId>,
    ) -> Option<Duration> {
        if cycle > self.cycle {
            self.begin(now, cycle);
        }
        let station = turn?;
        let first = self.cycle == cycle && !self.published.contains(station);
        if first {
            self.published.insert(station);
        }
        let complete = first && self.published.len() == self.stations;
        complete.then(|| self.complete(now))
    }

    /// Cycles in which a turn was not received.
    pub(crate) fn incomplete(&self) -> u64 {
        self.incomplete
    }

    fn begin(&mut self, now: Time, cycle: u64) {
        let complete = self.published.len() == self.stations;
        if self.cycle > 0 && !complete && self.skip == 0 {
            self.incomplete += 1;
        }
        self.cycle = cycle;
        self.first = now;
        self.published = StationSet::EMPTY;
    }

    fn complete(&mut self, now: Time) -> Duration {
        let duration = now.since(self.first);
        if self.skip > 0 {
            self.skip -= 1;
        } else if self.durations_ns.len() < self.wanted {
            self.durations_ns.push(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX));
        }
        duration
    }

    /// The result, once enough cycles are measured.
    pub(crate) fn result(&self) -> Option<Exchange> {
        if self.durations_ns.len() < self.wanted {
            return None;
        }
        let mut sorted = self.durations_ns.clone();
        sorted.sort_unstable();
        let quantile = |percent: usize| sorted.get(sorted.len() * percent / 100).copied();
        Some(Exchange {
            incomplete_cycles: self.incomplete,
            p50_ns: quantile(50).unwrap_or_default(),
            p99_ns: quantile(99).unwrap_or_default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One frame: its time, its cycle, and the station whose turn it is.
    type Sent = (u64, u64, Option<u8>);

    fn check(skip: u64, sent: &[Sent], durations_ns: &[u64], incomplete: u64) {
        let mut meter = Meter::new(2, skip, durations_ns.len() + 1);
        for &(at, cycle, turn) in sent {
            meter.frame(Time(at), cycle, turn.map(StationId));
            assert_eq!(meter.result(), None);
        }
        assert_eq!(
            (meter.durations_ns.as_slice(), meter.incomplete),
            (durations_ns, incomplete),
            "{sent:?}"
        );
    }

    #[test]
    fn an_exchange_is_from_the_first_frame_to_the_last_turn() {
        let one = [(10, 1, None), (12, 1, Some(0)), (15, 1, Some(1))];
        check(0, &one, &[5], 0);
        // A copy after the end, a stale turn, and a cycle whose Sync was lost.
        let more = [(16, 1, Some(1)), (20, 2, Some(0)), (21, 1, Some(1)), (29, 2, Some(1))];
        check(0, &[&one[..], &more].concat(), &[5, 9], 0);
    }

    #[test]
    fn a_cycle_with_a_turn_missing_is_incomplete() {
        let missing =
            [(10, 1, None), (12, 1, Some(0)), (20, 2, None), (21, 2, Some(0)), (24, 2, Some(1))];
        check(0, &missing, &[4], 1);
        check(1, &missing, &[], 0);
        check(0, &[], &[], 0);
    }
}
