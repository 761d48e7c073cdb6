//! Times in which no station and no remote I/O ran, in the summary.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::Members;
use understudy_wire::Member;

use crate::account::{Outage, Start};

/// A time in which no station and no remote I/O ran, as after a power failure of the whole plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutageSummary {
    /// The first cycle whose deadline came after the last member had ended; nothing before the cluster was synchronised.
    pub from: Option<u64>,
    /// How programs started after it.
    pub starts: Vec<StartSummary>,
}

/// The start of a program after an outage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StartSummary {
    /// The remote I/O.
    pub name: String,
    /// The cycle in which it started; nothing before the cluster was synchronised.
    pub cycle: Option<u64>,
    /// Whether it started with retentive values that a station has kept.
    pub warm: bool,
    /// Of a warm start: the cycles with applied outputs whose retentive values are lost; nothing where that is not known.
    pub lost: Option<u64>,
}

impl OutageSummary {
    pub(super) fn new(outage: &Outage, members: &Members) -> Self {
        let start = |start: &Start| StartSummary {
            name: members.name(Member::RemoteIo(start.program)).to_owned(),
            cycle: start.cycle,
            warm: start.warm.is_some(),
            lost: start.warm.flatten(),
        };
        Self { from: outage.from, starts: outage.starts.iter().map(start).collect() }
    }
}

fn cycle_text(cycle: Option<u64>) -> String {
    cycle.map_or_else(|| "before cycle 0".to_owned(), |cycle| format!("in cycle {cycle}"))
}

impl fmt::Display for OutageSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.from {
            Some(from) => {
                write!(formatter, "no station and no remote I/O ran from cycle {from} on")?;
            }
            None => formatter.write_str("no station and no remote I/O ran before cycle 0")?,
        }
        if self.starts.is_empty() {
            return formatter.write_str("; no program has started since");
        }
        self.starts.iter().try_for_each(|start| write!(formatter, "; {start}"))
    }
}

impl fmt::Display for StartSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, cycle, warm, lost } = self;
        let cycle = cycle_text(*cycle);
        match (warm, lost) {
            (false, _) => write!(formatter, "{name} started cold {cycle}"),
            (true, Some(1)) => write!(formatter, "{name} started warm {cycle}, 1 cycle is lost"),
            (true, Some(lost)) => {
                write!(formatter, "{name} started warm {cycle}, {lost} cycles are lost")
            }
            (true, None) => write!(
                formatter,
                "{name} started warm {cycle}, it is not known how many cycles are lost"
            ),
        }
    }
}
