//! Parts in series with the stations: remote I/Os, field devices, networks, power. The system needs each of them.
//!
//! ```text
//!   stations ── remote I/O 1 ── device 1 ── … ── remote I/O N ── module N ───── network
//!                 │ twin 1 ──────┘                 │ twin N ──── module N'      │ network 2
//!                 `exclusive`: one device          `parallel`: a module each
//! ```
//!
//! A part that is single fails the system with its first failure. A part of a pair does so when the other one is down, when the switchover fails,
//! or together with the other one. Two remote I/Os with modules of their own are two lanes, of which one is needed.

use serde::Serialize;

use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::positions::{LaneBox, PairRates, Positions, chain_of};
use crate::quantity::{Hours, Probability};
use crate::system::MAXIMUM_BOXES;

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
    /// Probability that the other part continues where one that is in charge fails.
    pub switchover: Probability,
    /// Which of the two are in charge; the failure of the other one is masked.
    pub in_charge: InCharge,
    /// Common-cause factor β: both parts fail together at β λ, in addition to the failures of each at λ.
    pub beta: Probability,
    /// Modules of each of the two remote I/Os; nothing where they have none of their own.
    pub modules: Option<LaneModules>,
}

/// Which of two parts are in charge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum InCharge {
    /// One of them, such as the author of two remote I/Os.
    One,
    /// Both, such as two modules that read the same sensors.
    Both,
}

/// Modules that each of two remote I/Os has, as one part: without it that remote I/O is of no use, and without the remote I/O its modules are not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LaneModules {
    /// Mean time between failures of the modules of one remote I/O.
    pub mtbf: Hours,
    /// Mean time to repair them.
    pub mttr: Hours,
    /// Probability that a failure is masked.
    pub coverage: Probability,
    /// Common-cause factor β of the modules of both.
    pub beta: Probability,
}

/// Name of the part that is all remote I/Os with a twin.
pub const REMOTE_IO_PAIR: &str = "remote I/O pair";

const WITH_MODULES: &str = "the number of twins with modules of their own";

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

/// Field devices of a cell: what has the terminals of a program.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FieldDevices {
    /// Programs.
    pub count: u32,
    /// Programs of which each of the two remote I/Os has a device of its own (`wiring = "parallel"`).
    pub redundant: u32,
    /// Mean time between failures of one.
    pub mtbf: Hours,
    /// Mean time to repair one.
    pub mttr: Hours,
    /// Probability that the failure of one of two is masked.
    pub coverage: f64,
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

    /// The parts of the model: remote I/Os without a twin, pairs at one device, and pairs with modules of their own. Errors are added to `errors`.
    pub(crate) fn parts(
        &self,
        devices: Option<&FieldDevices>,
        errors: &mut Vec<ReliabilityError>,
    ) -> Vec<SharedPart> {
        let what = "the number of remote I/Os with a twin";
        within(errors, what, self.twins, 0, self.count);
        within(errors, "the number of remote I/Os", self.count, 1, MAXIMUM_BOXES);
        let with_modules = devices.map_or(0, |devices| devices.redundant);
        within(errors, WITH_MODULES, with_modules, 0, self.twins.min(self.count));
        let switchover = Probability::new("the coverage of the switchover", self.switchover);
        let pair = pair(self.mttr, switchover, self.beta, errors);
        let modules = devices.and_then(|devices| devices.modules(errors));
        let lanes = pair.map(|pair| Pair { modules, ..pair });
        let single = self.count.saturating_sub(self.twins);
        let at_one_device = self.twins.saturating_sub(with_modules);
        let part = |name: &str, count, pair| (count > 0).then(|| self.part(name, count, pair));
        let parts = [
            part("remote I/O", single, None),
            part(REMOTE_IO_PAIR, at_one_device, pair),
            part("remote I/O pair with modules", with_modules, lanes),
        ];
        parts.into_iter().flatten().collect()
    }

    fn part(&self, name: &str, count: u32, pair: Option<Pair>) -> SharedPart {
        SharedPart { name: name.to_owned(), count, mtbf: self.mtbf, pair }
    }
}

impl FieldDevices {
    /// Devices, those of both remote I/Os counted.
    pub fn boxes(&self) -> u32 {
        self.count.saturating_add(self.redundant)
    }

    /// The parts of the model that are not with their remote I/Os: single devices; and pairs of them, where remote I/Os do not fail. Errors are added to
    /// `errors`.
    pub(crate) fn parts(
        &self,
        remote_ios_fail: bool,
        errors: &mut Vec<ReliabilityError>,
    ) -> Vec<SharedPart> {
        let single = self.count.saturating_sub(self.redundant);
        let part = |name: &str, count, pair| SharedPart {
            name: name.to_owned(),
            count,
            mtbf: self.mtbf,
            pair,
        };
        let mut parts = vec![part("field device", single, None)];
        if !remote_ios_fail {
            within(errors, WITH_MODULES, self.redundant, 0, self.count);
            let pair = self.modules(errors).map(|modules| Pair {
                mttr: modules.mttr,
                switchover: modules.coverage,
                in_charge: InCharge::Both,
                beta: modules.beta,
                modules: None,
            });
            parts.push(part("field device pair", self.redundant, pair));
        }
        parts.retain(|part| part.count > 0);
        parts
    }

    fn modules(&self, errors: &mut Vec<ReliabilityError>) -> Option<LaneModules> {
        let coverage = Probability::new("the coverage of two field devices", self.coverage);
        let pair = pair(self.mttr, coverage, self.beta, errors)?;
        let Pair { mttr, switchover: coverage, beta, .. } = pair;
        Some(LaneModules { mtbf: self.mtbf, mttr, coverage, beta })
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
        (Ok(switchover), Ok(beta)) => {
            Some(Pair { mttr, switchover, in_charge: InCharge::One, beta, modules: None })
        }
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
        let modules = self.pair.and_then(|pair| pair.modules);
        let of_modules = modules.map_or(0.0, |them| them.mtbf.rate() * them.beta.get());
        f64::from(self.count) * (self.mtbf.rate() * share + of_modules)
    }

    /// The pairs of this part.
    pub(crate) fn positions(&self) -> Option<Positions> {
        let pair = self.pair?;
        let (rate, switchover) = (self.mtbf.rate(), pair.switchover.get());
        if let Some(modules) = pair.modules {
            let remote_io =
                LaneBox { failure: rate, repair: pair.mttr.rate(), coverage: switchover };
            return Some(Positions::lanes(self.count, remote_io, modules.lane_box()));
        }
        let in_charge = match pair.in_charge {
            InCharge::One => 1.0,
            InCharge::Both => 2.0,
        };
        let unmasked = in_charge * rate * (1.0 - switchover);
        let rates = PairRates {
            masked: 2.0 * rate - unmasked,
            unmasked,
            lacking: rate,
            repair: pair.mttr.rate(),
            // The other one reports it within a second.
            detection: None,
        };
        Some(Positions::pairs(self.count, rates))
    }
}

impl LaneModules {
    fn lane_box(&self) -> LaneBox {
        LaneBox {
            failure: self.mtbf.rate(),
            repair: self.mttr.rate(),
            coverage: self.coverage.get(),
        }
    }
}

/// Chain of parts alone, with a crew for each box.
pub(crate) fn chain_of_parts(parts: &[SharedPart]) -> Result<Chain, Vec<ReliabilityError>> {
    let pairs: Vec<Positions> = parts.iter().filter_map(SharedPart::positions).collect();
    chain_of(&pairs, parts.iter().map(SharedPart::lethal_rate).sum(), |_| 1.0)
}
