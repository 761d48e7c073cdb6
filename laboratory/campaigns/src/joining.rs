//! How long a cluster takes to come into step, and a station to come back, where frames are lost.

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cycle::Schedule;
use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, StationId};

use understudy_scenarios::{Presence, Scenario, Summary};

/// Cycles within which everybody has to be synchronised again.
pub const JOIN_CYCLES: u64 = 100;

/// When the station of a trial is killed, and when it is started again.
const KILLED_AT: u64 = 20;
const RESTARTED_AT: u64 = 40;

/// A trial: the cluster starts, and then one station, another one in each trial, is killed and comes back.
pub fn join_trial(trial: u64, schedule: &Schedule) -> (StationId, Scenario) {
    let station = StationId((trial % schedule.stations() as u64) as u8);
    let step = |at_cycle, action| Fault {
        at_cycle,
        phase: 0.0,
        member: Member::Station(station),
        action,
    };
    let scenario = Scenario {
        title: format!("trial {trial}: a cluster starts, and a station joins"),
        cycles: RESTARTED_AT + JOIN_CYCLES + KILLED_AT,
        steps: vec![
            step(KILLED_AT, Action::Crash),
            step(RESTARTED_AT, Action::Restart),
        ],
        ..Scenario::default()
    };
    (station, scenario)
}

/// What came of a trial; times in cycles, nothing where it never happened.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Joined {
    /// From the first cycle that the cluster counted to the first one in which everybody was synchronised.
    pub start: Option<u64>,
    /// From the restart of the station to its first turn.
    pub join: Option<u64>,
    /// What must never be driven and was.
    pub wrong: u64,
}

impl Joined {
    /// Of a run of [`join_trial`].
    pub fn new(station: StationId, summary: &Summary) -> Self {
        let restart = summary.steps.last().map(|step| step.measured);
        let intervals = summary.stations.get(station.index());
        let join = restart.zip(intervals).and_then(|(restart, found)| {
            let mut on = found
                .intervals
                .iter()
                .filter(|interval| interval.state == Presence::On);
            let first = on.find(|interval| interval.to > restart)?;
            Some(first.from.saturating_sub(restart))
        });
        // As `epoch:cycle`, where an epoch counts from 0.
        let origin = summary.origin.as_deref();
        let start = origin.and_then(|origin| origin.rsplit_once(':')?.1.parse().ok());
        Self {
            start,
            join: join.filter(|_| summary.steps.len() == 2),
            wrong: summary.violation_count,
        }
    }

    /// Whether everything came in time and nothing was wrong.
    pub fn is_in_time(&self) -> bool {
        self.wrong == 0
            && self.start.is_some_and(|start| start <= JOIN_CYCLES)
            && self.join.is_some_and(|join| join <= JOIN_CYCLES)
    }
}
