//! Parts in series with the stations: remote I/Os, networks, power. The system needs each of them.
//!
//! ```text
//!   stations ── remote I/O 1 ── … ── remote I/O N ── network
//!                 │ twin 1            │ twin N         │ network 2
//! ```
//!
//! A part that is single fails the system with its first failure. A part of a pair does so when the other one is down, when the switchover fails,
//! or together with the other one. [`Positions`] counts pairs that are alike by how many of them lack one, so their chain is exactly lumped; the
//! controllers of hot-standby pairs are positions too.

use serde::Serialize;

use crate::chain::{Chain, explore};
use crate::error::ReliabilityError;
use crate::quantity::{Hours, Probability};
use crate::system::{MAXIMUM_BOXES, MAXIMUM_MODEL_STATES};

/// Parts that are alike, of which the system needs each one: its power supply, its remote I/Os, its networks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedPart {
    /// Name of the part.
    pub name: String,
    /// Number of positions: the system needs all of them.
    pub count: u32,
    /// Mean time between failures of one.
    pub mtbf: Hours,
    /// The second part of each position; nothing: the first failure is that of the system.
    pub pair: Option<Pair>,
}

/// Two parts in one position, of which one may be down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pair {
    /// Mean time to repair one.
    pub mttr: Hours,
    /// Probability that the other part continues where the one that is in charge fails; the failure of the other one needs none.
    pub switchover: Probability,
    /// Common-cause factor β: both parts fail together at β λ, in addition to the failures of each at λ.
    pub beta: Probability,
}

/// Name of the part that is all remote I/Os with a twin.
pub const REMOTE_IO_PAIR: &str = "remote I/O pair";

/// Remote I/Os of a cell, each for one program.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RemoteIos {
    /// Programs.
    pub count: u32,
    /// Programs whose remote I/O has a twin.
    pub twins: u32,
    /// Mean time between failures of one.
    pub mtbf: Hours,
    /// Mean time to repair one.
    pub mttr: Hours,
    /// Probability that the twin takes over.
    pub switchover: f64,
    /// Common-cause factor β of the two.
    pub beta: f64,
}

/// Networks of each group of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Networks {
    /// One or two.
    pub count: u32,
    /// Mean time between failures of one.
    pub mtbf: Hours,
    /// Mean time to repair one.
    pub mttr: Hours,
    /// Common-cause factor β of the two.
    pub beta: f64,
}

impl RemoteIos {
    /// Machines: remote I/Os and twins.
    pub fn boxes(&self) -> u32 {
        self.count.saturating_add(self.twins)
    }

    /// The parts of the model: remote I/Os without a twin, and pairs. Errors are added to `errors`.
    pub(crate) fn parts(&self, errors: &mut Vec<ReliabilityError>) -> Vec<SharedPart> {
        let what = "the number of remote I/Os with a twin";
        within(errors, what, self.twins, 0, self.count);
        within(errors, "the number of remote I/Os", self.count, 1, MAXIMUM_BOXES);
        let switchover = Probability::new("the coverage of the switchover", self.switchover);
        let pair = pair(self.mttr, switchover, self.beta, errors);
        let single = self.count.saturating_sub(self.twins);
        let part = |name: &str, count, pair| (count > 0).then(|| self.part(name, count, pair));
        let parts = [part("remote I/O", single, None), part(REMOTE_IO_PAIR, self.twins, pair)];
        parts.into_iter().flatten().collect()
    }

    fn part(&self, name: &str, count: u32, pair: Option<Pair>) -> SharedPart {
        SharedPart { name: name.to_owned(), count, mtbf: self.mtbf, pair }
    }
}

impl Networks {
    /// The part of the model, for `groups` groups with networks of their own. Errors are added to `errors`.
    pub(crate) fn part(&self, groups: u32, errors: &mut Vec<ReliabilityError>) -> SharedPart {
        within(errors, "the number of networks", self.count, 1, 2);
        // Every frame is sent over both, so nothing is switched over.
        let pair = pair(self.mttr, Ok(Probability::ONE), self.beta, errors);
        let (name, pair) = if self.count > 1 { ("network pair", pair) } else { ("network", None) };
        SharedPart { name: name.to_owned(), count: groups, mtbf: self.mtbf, pair }
    }
}

fn within(errors: &mut Vec<ReliabilityError>, what: &str, count: u32, minimum: u32, maximum: u32) {
    if !(minimum..=maximum).contains(&count) {
        errors.push(ReliabilityError::Count {
            what: what.to_owned(),
            count: u64::from(count),
            minimum: u64::from(minimum),
            maximum: u64::from(maximum),
        });
    }
}

fn pair(
    mttr: Hours,
    switchover: Result<Probability, ReliabilityError>,
    beta: f64,
    errors: &mut Vec<ReliabilityError>,
) -> Option<Pair> {
    let beta = Probability::new("the share beta of common causes of a pair", beta);
    match (switchover, beta) {
        (Ok(switchover), Ok(beta)) => Some(Pair { mttr, switchover, beta }),
        (switchover, beta) => {
            errors.extend([switchover, beta].into_iter().filter_map(Result::err));
            None
        }
    }
}

impl SharedPart {
    /// A single part.
    pub fn single(name: impl Into<String>, mtbf: Hours) -> Self {
        Self { name: name.into(), count: 1, mtbf, pair: None }
    }

    /// Rate of what fails the system from every state: of single parts each failure, of pairs those of both together.
    pub(crate) fn lethal_rate(&self) -> f64 {
        let share = self.pair.map_or(1.0, |pair| pair.beta.get());
        f64::from(self.count) * self.mtbf.rate() * share
    }

    /// The pairs of this part.
    pub(crate) fn positions(&self) -> Option<Positions> {
        let pair = self.pair?;
        let (rate, switchover) = (self.mtbf.rate(), pair.switchover.get());
        Some(Positions {
            count: self.count,
            masked: rate * (1.0 + switchover),
            unmasked: rate * (1.0 - switchover),
            lacking: rate,
            repair_rate: pair.mttr.rate(),
            detected_at_once: true,
        })
    }
}

/// Positions that are alike, each with several boxes of which one may be down. Rates are those of one position, per hour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Positions {
    /// Number of positions.
    pub(crate) count: u32,
    /// Rate of failures of a complete position that are masked.
    pub(crate) masked: f64,
    /// Rate of failures of a complete position that fail the system.
    pub(crate) unmasked: f64,
    /// Rate of failures of a position that lacks a box.
    pub(crate) lacking: f64,
    /// Rate of repair, while a crew is there.
    pub(crate) repair_rate: f64,
    /// Whether repair starts at the failure, whatever the time to detect a failed station is: the other one reports it within a second.
    pub(crate) detected_at_once: bool,
}

/// By kind: positions that lack a box, not detected and detected.
pub(crate) type Lacking = Vec<(u32, u32)>;

/// Chain of parts alone, with a crew for each box.
pub(crate) fn chain_of(parts: &[SharedPart]) -> Result<Chain, Vec<ReliabilityError>> {
    let pairs: Vec<Positions> = parts.iter().filter_map(SharedPart::positions).collect();
    let lethal: f64 = parts.iter().map(SharedPart::lethal_rate).sum();
    let first = vec![(0, 0); pairs.len()];
    let (chain, _) = explore(
        first,
        MAXIMUM_MODEL_STATES,
        |_| String::new(),
        |state, found| {
            if lethal > 0.0 {
                found.push((None, lethal));
            }
            steps(&pairs, state, 1.0, None, found);
        },
    )?;
    Ok(chain)
}

/// Boxes of positions that wait for a repair or are repaired.
pub(crate) fn detected(state: &Lacking) -> u32 {
    state.iter().map(|(_, detected)| detected).sum()
}

/// The steps out of a state: to another one, or to the failure of the system. `attended` is the share of failed boxes with a crew, `detection` the rate
/// of detecting a failed station.
pub(crate) fn steps(
    kinds: &[Positions],
    state: &Lacking,
    attended: f64,
    detection: Option<f64>,
    found: &mut Vec<(Option<Lacking>, f64)>,
) {
    let mut failing = 0.0;
    for (index, (kind, &(hidden, known))) in kinds.iter().zip(state).enumerate() {
        let mut go = |to: (u32, u32), rate: f64| {
            if rate > 0.0 {
                let mut after = state.clone();
                after[index] = to;
                found.push((Some(after), rate));
            }
        };
        let complete = f64::from(kind.count - hidden - known);
        let detection = detection.filter(|_| !kind.detected_at_once);
        let masked = match detection {
            Some(_) => (hidden + 1, known),
            None => (hidden, known + 1),
        };
        go(masked, complete * kind.masked);
        failing += complete * kind.unmasked + f64::from(hidden + known) * kind.lacking;
        if let (Some(rate), true) = (detection, hidden > 0) {
            go((hidden - 1, known + 1), f64::from(hidden) * rate);
        }
        if known > 0 {
            go((hidden, known - 1), f64::from(known) * kind.repair_rate * attended);
        }
    }
    if failing > 0.0 {
        found.push((None, failing));
    }
}
