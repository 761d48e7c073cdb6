//! What the living members can know of the stations that could have a state whose outputs were applied.

use understudy_wire::{Body, Frame, Moment, ProgramId, StationId, StationSet};

/// Cycles in which the last samples tell all members that a station is gone, at most.
pub(super) const CYCLES_TO_TELL: u32 = 6;

/// What the members can know, for all programs.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Knowable {
    programs: Vec<Synchronised>,
    /// For each station, the newest cycle in which a frame of another member reached it.
    received_in: Vec<Moment>,
    /// For each station, the newest cycle in which it has sent: a frame of an earlier one is late for it.
    sent_in: Vec<Moment>,
}

/// Stations that had the state of a program when outputs of it were last applied.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Synchronised {
    /// For each station, the deadlines with proved outputs since it last had the state, or ran without it.
    absent_for: Vec<u32>,
    /// Stations that have crashed since.
    crashed: StationSet,
    /// Stations that no other member has reached for a cycle since: they do not know what the others did meanwhile.
    isolated: StationSet,
}

impl Knowable {
    pub(super) fn new(stations: usize, programs: usize) -> Self {
        let none = Synchronised {
            absent_for: vec![u32::MAX; stations],
            crashed: StationSet::EMPTY,
            isolated: StationSet::EMPTY,
        };
        let never = vec![Moment::default(); stations];
        Self { programs: vec![none; programs], received_in: never.clone(), sent_in: never }
    }

    /// A station sends a frame of a cycle.
    pub(super) fn sent(&mut self, station: StationId, moment: Moment) {
        let newest = &mut self.sent_in[station.index()];
        *newest = moment.max(*newest);
    }

    /// A frame of another member reaches a station.
    pub(super) fn reached(&mut self, station: StationId, frame: &Frame) {
        if !matches!(frame.body, Body::Sample(_) | Body::Turn(_) | Body::Join(_)) {
            return;
        }
        let moment = frame.header.moment;
        if moment < self.sent_in[station.index()] {
            return;
        }
        let newest = &mut self.received_in[station.index()];
        if moment > newest.plus(1) {
            self.programs.iter_mut().for_each(|it| it.isolated.insert(station));
        }
        *newest = moment.max(*newest);
    }

    /// Proved outputs of a program were applied while `holders` had the state, and `running` ran, with it or without.
    pub(super) fn applied(&mut self, program: ProgramId, holders: StationSet, running: StationSet) {
        let Synchronised { absent_for, crashed, isolated } = &mut self.programs[program.index()];
        *isolated = StationSet::EMPTY;
        for (rank, absent_for) in (0..).zip(absent_for) {
            let station = StationId(rank);
            // It has received a sample since it started.
            if holders.contains(station) && *absent_for == 0 {
                crashed.remove(station);
            }
            *absent_for = match (holders.contains(station), running.contains(station)) {
                (true, _) => 0,
                // The others do not know that it has no state.
                (false, true) => 1,
                (false, false) => absent_for.saturating_add(1),
            };
        }
    }

    /// A station loses its memory.
    pub(super) fn crash(&mut self, program: ProgramId, station: StationId, has_state: bool) {
        let of = &mut self.programs[program.index()];
        of.crashed.insert(station);
        if has_state {
            of.absent_for[station.index()] = 1;
        }
    }

    /// Of `candidates`, the stations that could have a state whose outputs were applied, as far as the others know in the cycle `moment`; none where one
    /// of them has lost its memory, or where one is absent and each of the others was isolated since: it may have come back, and have gone again.
    pub(super) fn in_doubt(
        &self,
        program: ProgramId,
        candidates: StationSet,
        (moment, known_after): (Moment, u32),
    ) -> StationSet {
        let of = &self.programs[program.index()];
        let is_near = |station: &StationId| of.absent_for[station.index()] < known_after;
        let near: StationSet = candidates.iter().filter(is_near).collect();
        let is_isolated = |station: StationId| {
            of.isolated.contains(station) || self.received_in[station.index()].plus(1) < moment
        };
        let may_know = near == candidates || near.iter().any(|station| !is_isolated(station));
        if may_know && near.and(of.crashed).is_empty() { near } else { StationSet::EMPTY }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use understudy_wire::{
        ClusterHash, ConfigurationHash, Cycle, Epoch, Header, Join, Member, ProgramSet,
    };

    use super::*;

    const PROGRAM: ProgramId = ProgramId(0);
    /// The cycle of the question.
    const ASKED: u64 = 10;

    fn moment(cycle: u64) -> Moment {
        Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
    }

    fn frame(cycle: u64) -> Arc<Frame> {
        let header = Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            prepared: None,
            moment: moment(cycle),
            sender: Member::Station(StationId(9)),
            alone: false,
        };
        let join = Join {
            wants: ProgramSet::EMPTY,
            holdings: Vec::new().into(),
            retained: Vec::new(),
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            partial: Vec::new(),
        };
        Arc::new(Frame { header, body: Body::Join(join) })
    }

    /// Stations 0 and 1 have the state; `stations` could. Each of them receives a frame in these cycles after outputs were applied in cycle 3.
    fn check(stations: u8, crashes: &[u8], received: [&[u64]; 2], expected: &[u8]) {
        let set = |ranks: &[u8]| ranks.iter().map(|rank| StationId(*rank)).collect::<StationSet>();
        let mut knowable = Knowable::new(usize::from(stations), 1);
        for cycle in 1..=3 {
            (0..2).for_each(|rank| knowable.reached(StationId(rank), &frame(cycle)));
            knowable.applied(PROGRAM, set(&[0, 1]), set(&[0, 1]));
        }
        for rank in crashes {
            knowable.crash(PROGRAM, StationId(*rank), *rank < 2);
        }
        for (rank, cycles) in (0..).zip(received) {
            cycles.iter().for_each(|cycle| knowable.reached(StationId(rank), &frame(*cycle)));
        }
        let candidates = set(&(0..stations).collect::<Vec<_>>());
        let in_doubt = knowable.in_doubt(PROGRAM, candidates, (moment(ASKED), 9));
        assert_eq!(in_doubt, set(expected), "{stations} {crashes:?} {received:?}");
    }

    /// A frame that comes after the station has sent in a later cycle does not count.
    #[test]
    fn a_late_frame_reaches_no_station() {
        let mut knowable = Knowable::new(3, 1);
        let all: StationSet = (0..3).map(StationId).collect();
        let near = all.without(StationSet::only(StationId(2)));
        for (cycle, sent) in [(1, 1), (2, 2), (3, 4), (4, 4)] {
            knowable.applied(PROGRAM, near, near);
            for station in near.iter() {
                knowable.sent(station, moment(sent));
                knowable.reached(station, &frame(cycle));
            }
        }
        assert_eq!(knowable.in_doubt(PROGRAM, all, (moment(5), 9)), StationSet::EMPTY);
    }

    #[test]
    fn an_absent_station_is_accounted_for_by_one_that_was_not_isolated() {
        let (all, late) = ([4, 5, 6, 7, 8, 9, 10], [4, 5, 7, 8, 9, 10]);
        // No station is absent: each tells of itself.
        check(2, &[], [&all, &all], &[0, 1]);
        check(2, &[], [&late, &late], &[0, 1]);
        // The third one is absent.
        check(3, &[], [&all, &all], &[0, 1]);
        check(3, &[], [&all, &late], &[0, 1]);
        check(3, &[], [&late, &all], &[0, 1]);
        check(3, &[], [&late, &late], &[]);
        check(3, &[], [&late, &[]], &[]);
        // One of those that have the state has lost its memory.
        check(3, &[1], [&all, &all], &[]);
    }
}
