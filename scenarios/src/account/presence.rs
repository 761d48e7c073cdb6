//! When each station was on, off or joining: Table II as measured.
//!
//! *On* in a cycle in which a remote I/O has heard its turn. A station that is silent is *off* from its first silent cycle on
//! when its process was down or stood still, and *joining* when its process ran; a silence shorter than the flag (θ) needs
//! is a lost frame and no state.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use understudy_simulator::Action;
use understudy_wire::{Member, StationId, StationSet};

use understudy_journal::Process;

/// What a station was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Presence {
    /// It took its turns.
    On,
    /// It was silent, and its process was down or stood still.
    Off,
    /// It was silent, and its process ran.
    Joining,
}

/// A range of cycles, from the origin, in which something was the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Interval<T> {
    /// The first cycle.
    pub from: u64,
    /// The first cycle after it.
    pub to: u64,
    /// What was the same.
    pub state: T,
}

/// Intervals of one thing, at most; the rest is only counted.
const MAXIMUM_INTERVALS: usize = 10_000;

/// Appends cycle `at` to the intervals; false where their bound is reached.
pub(crate) fn extend<T: PartialEq>(intervals: &mut Vec<Interval<T>>, at: u64, state: T) -> bool {
    if let Some(last) = intervals.last_mut()
        && last.state == state
        && last.to == at
    {
        last.to = at + 1;
        return true;
    }
    if intervals.len() == MAXIMUM_INTERVALS {
        return false;
    }
    intervals.push(Interval { from: at, to: at + 1, state });
    true
}

/// One station.
#[derive(Debug, Clone)]
struct Track {
    down: bool,
    silent_since: Option<u64>,
    silent_cycles: u64,
    intervals: Vec<Interval<Presence>>,
}

/// All stations.
#[derive(Debug, Clone)]
pub(crate) struct Presences {
    flag_after: u64,
    tracks: Vec<Track>,
    /// Changes of processes that lie ahead, by cycle.
    changes: Vec<(u64, StationId, bool)>,
}

impl Presences {
    pub(crate) fn new(stations: usize, flag_after: u32) -> Self {
        let track =
            Track { down: false, silent_since: None, silent_cycles: 0, intervals: Vec::new() };
        Self {
            flag_after: u64::from(flag_after),
            tracks: vec![track; stations],
            changes: Vec::new(),
        }
    }

    /// A step of the scenario, first felt in cycle `at`.
    pub(crate) fn step(&mut self, at: u64, member: Member, action: Action) {
        let Member::Station(station) = member else {
            return;
        };
        if let Some(process) = Process::after(action) {
            self.changes.push((at, station, !process.is_running()));
        }
    }

    /// Cycle `at` is over; cycles come in order.
    pub(crate) fn close_cycle(&mut self, at: u64, heard: StationSet) {
        let tracks = &mut self.tracks;
        self.changes.retain(|&(from, station, down)| {
            let due = from <= at;
            if due && let Some(track) = tracks.get_mut(station.index()) {
                track.turn(down, from);
            }
            !due
        });
        for (rank, track) in self.tracks.iter_mut().enumerate() {
            track.close_cycle(at, heard.contains(StationId(rank as u8)), self.flag_after);
        }
    }

    /// By rank: the intervals, and how many cycles it was silent.
    pub(crate) fn finish(mut self, end: u64) -> Vec<(Vec<Interval<Presence>>, u64)> {
        for track in &mut self.tracks {
            if let Some(since) = track.silent_since {
                // Too short for a flag up to the end of the run.
                let state = if track.down { Presence::Off } else { Presence::On };
                track.fill(since, end, state);
            }
        }
        self.tracks.into_iter().map(|track| (track.intervals, track.silent_cycles)).collect()
    }
}

impl Track {
    /// The process goes down or comes up.
    fn turn(&mut self, down: bool, at: u64) {
        // What was silent before belongs to the state before.
        if let Some(since) = self.silent_since.take() {
            self.fill(since, at, self.silence());
        }
        self.down = down;
    }

    fn silence(&self) -> Presence {
        if self.down { Presence::Off } else { Presence::Joining }
    }

    fn fill(&mut self, from: u64, to: u64, state: Presence) {
        for cycle in from..to {
            extend(&mut self.intervals, cycle, state);
        }
    }

    fn close_cycle(&mut self, at: u64, heard: bool, flag_after: u64) {
        self.silent_cycles += u64::from(!heard);
        let since = self.silent_since.take().unwrap_or(at);
        if heard {
            // Too short for a flag: the station was on, and a frame was lost.
            self.fill(since, at + 1, Presence::On);
            return;
        }
        let last = self.intervals.last().map(|interval| interval.state);
        let already_silent = since == at && last.is_some_and(|last| last != Presence::On);
        if already_silent || self.down || at + 1 - since >= flag_after {
            self.fill(since, at + 1, self.silence());
        } else {
            self.silent_since = Some(since);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATION: StationId = StationId(0);

    /// `turns` has a `1` for each cycle in which the station was heard; the answer is a letter for each interval.
    fn check(turns: &str, steps: &[(u64, Action)], expected: &str) {
        let mut presences = Presences::new(1, 3);
        for &(at, action) in steps {
            presences.step(at, Member::Station(STATION), action);
        }
        for (at, turn) in turns.chars().enumerate() {
            let heard = if turn == '1' { StationSet::only(STATION) } else { StationSet::EMPTY };
            presences.close_cycle(at as u64, heard);
        }
        let found = presences.finish(turns.len() as u64);
        let text: Vec<String> = found[0]
            .0
            .iter()
            .map(|interval| format!("{:?} {}-{}", interval.state, interval.from, interval.to))
            .collect();
        assert_eq!(text.join(", "), expected, "{turns} {steps:?}");
    }

    #[test]
    fn a_station_that_always_speaks_is_on() {
        check("11111", &[], "On 0-5");
    }

    #[test]
    fn a_lost_frame_is_no_state() {
        check("1101001", &[], "On 0-7");
        check("110", &[], "On 0-3");
    }

    #[test]
    fn a_long_silence_counts_from_its_start() {
        check("1100011", &[], "On 0-2, Joining 2-5, On 5-7");
    }

    #[test]
    fn a_crash_and_its_repair() {
        check(
            "1100000111",
            &[(2, Action::Crash), (5, Action::Restart)],
            "On 0-2, Off 2-5, Joining 5-7, On 7-10",
        );
        check("110", &[(2, Action::Crash)], "On 0-2, Off 2-3");
    }

    #[test]
    fn a_crash_that_is_felt_a_cycle_later() {
        check(
            "1110000111",
            &[(2, Action::Crash), (5, Action::Restart)],
            "On 0-3, Off 3-5, Joining 5-7, On 7-10",
        );
    }
}
