//! Times of a cycle, from the clock of the records: comparable among the processes of one host only.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cycle::Schedule;
use understudy_wire::Moment;

/// Cycles that are open, at most: lines of different members come a few cycles apart.
const OPEN: usize = 8;

/// Times of one cycle, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CycleTiming {
    /// From the origin of the run.
    pub cycle: i64,
    /// From the first sample to the last turn: how long the token took.
    pub token_ns: u64,
    /// From the last turn to the deadline; negative where it came too late.
    pub margin_ns: i64,
    /// From the start of the cycle before to this one's.
    pub cycle_ns: Option<u64>,
}

#[derive(Debug, Clone, Copy)]
struct Open {
    moment: Moment,
    cycle: Option<i64>,
    first_sample: Option<u64>,
    last_turn: Option<u64>,
}

/// The newest cycles.
#[derive(Debug, Clone)]
pub(crate) struct Timings {
    open: VecDeque<Open>,
    closed: VecDeque<CycleTiming>,
    most: usize,
    deadline_ns: u64,
    period_ns: u64,
    started: Option<(i64, u64)>,
}

impl Timings {
    pub(crate) fn new(schedule: &Schedule, most: usize) -> Self {
        let ns = |time: std::time::Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        Self {
            open: VecDeque::new(),
            closed: VecDeque::new(),
            most: most.max(1),
            deadline_ns: ns(schedule.deadline()),
            period_ns: ns(schedule.period()),
            started: None,
        }
    }

    pub(crate) fn sampled(&mut self, moment: Moment, at_ns: u64) {
        if let Some(open) = self.of(moment) {
            open.first_sample = Some(open.first_sample.map_or(at_ns, |first| first.min(at_ns)));
        }
    }

    pub(crate) fn published(&mut self, moment: Moment, at_ns: u64) {
        if let Some(open) = self.of(moment) {
            open.last_turn = Some(open.last_turn.map_or(at_ns, |last| last.max(at_ns)));
        }
    }

    pub(crate) fn decided(&mut self, moment: Moment, cycle: i64) {
        if let Some(open) = self.of(moment) {
            open.cycle = Some(cycle);
        }
    }

    fn of(&mut self, moment: Moment) -> Option<&mut Open> {
        let place = self.open.iter().position(|open| open.moment == moment);
        let place = match place {
            Some(place) => place,
            None => {
                if self.open.len() == OPEN {
                    self.close_oldest();
                }
                self.open.push_back(Open {
                    moment,
                    cycle: None,
                    first_sample: None,
                    last_turn: None,
                });
                self.open.len() - 1
            }
        };
        self.open.get_mut(place)
    }

    fn close_oldest(&mut self) {
        let Some(open) = self.open.pop_front() else {
            return;
        };
        let (Some(cycle), Some(start)) = (open.cycle, open.first_sample) else {
            return;
        };
        let before = self.started.filter(|(last, _)| last.checked_add(1) == Some(cycle));
        self.started = Some((cycle, start));
        let Some(turn) = open.last_turn else {
            return;
        };
        let token_ns = turn.saturating_sub(start);
        // Clocks of other hosts say nothing here.
        if token_ns > self.period_ns.saturating_mul(2)
            || start > turn.saturating_add(self.period_ns)
        {
            return;
        }
        let signed = |ns: u64| i64::try_from(ns).unwrap_or(i64::MAX);
        if self.closed.len() == self.most {
            self.closed.pop_front();
        }
        self.closed.push_back(CycleTiming {
            cycle,
            token_ns,
            margin_ns: signed(self.deadline_ns) - signed(token_ns),
            cycle_ns: before.map(|(_, before)| start.saturating_sub(before)),
        });
    }

    pub(crate) fn shift(&mut self, by: i64) {
        for open in &mut self.open {
            open.cycle = open.cycle.map(|cycle| cycle.saturating_add(by));
        }
        self.closed.iter_mut().for_each(|closed| closed.cycle = closed.cycle.saturating_add(by));
        self.started = self.started.map(|(cycle, at)| (cycle.saturating_add(by), at));
    }

    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = &CycleTiming> {
        self.closed.iter()
    }
}
