//! Which stations published in this cycle, and which were not received for too long: the paper's failure flags θ.
//!
//! Detection is by turns alone. Each member keeps its own view. It decides only which slots are closed, which stations
//! the successor of the cycle master waits for, and which stations count as living.

use understudy_wire::{StationId, StationSet};

/// One member's view of all stations.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Attendance {
    flag_after: u32,
    /// Cycles in a row without a turn, by rank; at `flag_after` a station is flagged, and the count stays there.
    silent: Vec<u32>,
    flagged: StationSet,
    published: StationSet,
    /// Published as other stations say, in this cycle.
    attested: StationSet,
}

/// A flag that changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// θ became 1.
    Flagged(StationId),
    /// θ became 0.
    Cleared(StationId),
}

impl Attendance {
    /// No station has published yet, so all `stations` are flagged.
    pub fn new(stations: usize, flag_after: u32) -> Self {
        Self {
            flag_after,
            silent: vec![flag_after; stations],
            flagged: StationSet::first(stations),
            published: StationSet::EMPTY,
            attested: StationSet::EMPTY,
        }
    }

    /// Notes that these stations published in this cycle, as the turn of another one says.
    pub fn attest(&mut self, stations: StationSet) {
        let known = StationSet::first(self.silent.len());
        self.attested = self.attested.or(stations.and(known));
    }

    /// Notes that a turn of this cycle was received; true for the first one of a station in a cycle.
    pub fn receive_turn(&mut self, station: StationId) -> bool {
        let first = station.index() < self.silent.len() && !self.published.contains(station);
        if first {
            self.published.insert(station);
        }
        first
    }

    /// Stations that published in this cycle.
    pub fn published(&self) -> StationSet {
        self.published.or(self.attested)
    }

    /// Whether any of these stations published in the last cycle, as this one or another one received it.
    pub fn published_last(&self, stations: StationSet) -> bool {
        stations.iter().any(|station| self.silent.get(station.index()) == Some(&0))
    }

    /// Flagged stations: not received for too long up to the last cycle, and not in this one.
    pub fn flagged(&self) -> StationSet {
        self.flagged.without(self.published())
    }

    /// Ends a cycle that this member took part in; calls `change` with every flag that changes.
    pub fn close_cycle(&mut self, mut change: impl FnMut(Change)) {
        let published = self.published();
        for (rank, silent) in self.silent.iter_mut().enumerate() {
            let station = StationId(rank as u8);
            if published.contains(station) {
                *silent = 0;
                if self.flagged.contains(station) {
                    self.flagged.remove(station);
                    change(Change::Cleared(station));
                }
            } else if *silent < self.flag_after {
                *silent += 1;
                if *silent == self.flag_after {
                    self.flagged.insert(station);
                    change(Change::Flagged(station));
                }
            }
        }
        self.published = StationSet::EMPTY;
        self.attested = StationSet::EMPTY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pattern of eight cycles of one station against counting by hand.
    #[test]
    fn a_station_is_flagged_after_flag_after_cycles_of_silence() {
        for flag_after in 1..=4_u32 {
            for pattern in 0..1_u32 << 8 {
                let mut attendance = Attendance::new(1, flag_after);
                let mut silence = flag_after;
                for cycle in 0..8 {
                    if pattern >> cycle & 1 == 1 {
                        assert!(attendance.receive_turn(StationId(0)));
                        assert!(!attendance.receive_turn(StationId(0)));
                        silence = 0;
                    } else {
                        silence += 1;
                    }
                    let before = attendance.flagged.is_empty();
                    let mut changes = 0;
                    attendance.close_cycle(|_| changes += 1);
                    let after = silence < flag_after;
                    assert_eq!(attendance.flagged().is_empty(), after);
                    assert_eq!(changes, i32::from(before != after));
                }
            }
        }
    }

    /// What others say counts for the flags, and a turn that comes after it is still the first one.
    #[test]
    fn stations_are_attested() {
        let mut attendance = Attendance::new(3, 2);
        for _ in 0..3 {
            attendance.attest(StationSet::from_bits(0b1010));
            assert_eq!(attendance.published(), StationSet::only(StationId(1)));
            assert!(attendance.receive_turn(StationId(1)));
            attendance.close_cycle(|_| ());
            assert!(attendance.published_last(StationSet::from_bits(0b1011)));
            assert!(!attendance.published_last(StationSet::from_bits(0b1101)));
        }
        let flagged = StationSet::from_bits(0b101);
        assert_eq!(attendance.flagged(), flagged);
        assert_eq!(attendance.published(), StationSet::EMPTY);
    }

    #[test]
    fn a_station_that_is_not_in_the_cluster_is_not_counted() {
        assert!(!Attendance::new(2, 3).receive_turn(StationId(2)));
    }
}
