//! What a cluster is compared with: each controller by itself with copies of its kind, of which one may be down. With two boxes for
//! each it is the full duplex of (21), with three TMR. Controllers may differ; a controller's copies are like it.
//!
//! Units of one kind are alike, so only how many of each kind lack a box is kept: the chain is exactly lumped. Where each controller has
//! a repair crew, controllers are independent of each other, and R(t) is the product of those of single controllers.

use crate::chain::{Chain, explore};
use crate::error::ReliabilityError;
use crate::system::{CommonCause, CommonCauseConvention, MAXIMUM_MODEL_STATES, System};
use crate::transient::AfterFailure;

/// Units of one kind that lack a box: not noticed, and noticed.
type State = Vec<(u32, u32)>;

struct Kind {
    units: u32,
    failure_rate: f64,
    repair_rate: f64,
}

/// Whether a system works at some time, with the digits of both probabilities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survival {
    /// Probability of no failure until then.
    pub working: f64,
    /// Probability of a failure until then.
    pub failed: f64,
    /// Density of the first failure at that time, per hour.
    pub density: f64,
}

impl System {
    /// Chain with `copies` controllers in place of each, of which one may be down at a time.
    ///
    /// # Errors
    /// The errors of [`System::chain`].
    pub fn copies_chain(&self, copies: u32) -> Result<Chain, Vec<ReliabilityError>> {
        self.check()?;
        self.chain_of_copies(&self.copied(), self.lethal_to_copies(), copies)
    }

    /// Whether [`System::copies_chain`] has failed by `hours`.
    ///
    /// # Errors
    /// The errors of [`System::chain`] and [`Chain::transients`].
    pub fn copies_survival(
        &self,
        copies: u32,
        hours: f64,
    ) -> Result<Survival, Vec<ReliabilityError>> {
        self.check()?;
        let (kinds, lethal) = (self.copied(), self.lethal_to_copies());
        let at = |chain: Chain| match chain.transient(hours, AfterFailure::Final) {
            Ok(found) => Ok((chain.failure_density(&found), found)),
            Err(error) => Err(vec![error]),
        };
        let independent = self.crews.is_none_or(|crews| crews >= self.controller_count());
        if !independent {
            let (density, found) = at(self.chain_of_copies(&kinds, lethal, copies)?)?;
            return Ok(Survival { working: found.working, failed: found.failed, density });
        }
        let mut logarithm = -lethal * hours;
        let mut hazard = lethal;
        for kind in kinds {
            let units = f64::from(kind.units);
            let alone = self.chain_of_copies(&[Kind { units: 1, ..kind }], 0.0, copies)?;
            let (density, found) = at(alone)?;
            logarithm += units * found.log_working();
            hazard += units * density / found.working;
        }
        let working = logarithm.exp();
        Ok(Survival { working, failed: -logarithm.exp_m1(), density: working * hazard })
    }

    /// Controllers by kind; kinds that cannot be told apart are one.
    fn copied(&self) -> Vec<Kind> {
        let alone = match self.common_cause {
            Some(CommonCause { beta, convention: CommonCauseConvention::Split }) => {
                1.0 - beta.get()
            }
            _ => 1.0,
        };
        let mut kinds: Vec<Kind> = Vec::new();
        for kind in &self.controllers {
            let (failure_rate, repair_rate) = (kind.mtbf.rate() * alone, kind.mttr.rate());
            let known = kinds.iter_mut().find(|known| {
                (known.failure_rate, known.repair_rate) == (failure_rate, repair_rate)
            });
            match known {
                Some(known) => known.units += kind.count,
                None => kinds.push(Kind { units: kind.count, failure_rate, repair_rate }),
            }
        }
        kinds
    }

    /// Rate of what fails all controllers at once.
    fn lethal_to_copies(&self) -> f64 {
        let shared: f64 = self.shared.iter().map(|part| part.mtbf.rate()).sum();
        let rates = self.controllers.iter().map(|kind| kind.mtbf.rate());
        let fastest = rates.fold(0.0, f64::max);
        shared + self.common_cause.map_or(0.0, |cause| cause.beta.get() * fastest)
    }

    fn chain_of_copies(
        &self,
        kinds: &[Kind],
        lethal: f64,
        copies: u32,
    ) -> Result<Chain, Vec<ReliabilityError>> {
        let first = vec![(0, 0); kinds.len()];
        let (chain, _) = explore(
            first,
            MAXIMUM_MODEL_STATES,
            |_: &State| String::new(),
            |state, found| {
                if lethal > 0.0 {
                    found.push((None, lethal));
                }
                self.copies_successors(kinds, copies, state, found);
            },
        )?;
        Ok(chain)
    }

    fn copies_successors(
        &self,
        kinds: &[Kind],
        copies: u32,
        state: &State,
        found: &mut Vec<(Option<State>, f64)>,
    ) {
        let noticed: u32 = state.iter().map(|(_, noticed)| noticed).sum();
        // Each box that is down is as likely to be worked on as any other.
        let attended = match self.crews {
            Some(crews) if crews < noticed => f64::from(crews) / f64::from(noticed),
            _ => 1.0,
        };
        let mut go = |index: usize, to: (u32, u32), rate: f64| {
            if rate > 0.0 {
                let mut after = state.clone();
                after[index] = to;
                found.push((Some(after), rate));
            }
        };
        let coverage = self.coverage.get();
        let mut failing = 0.0;
        for (index, (kind, &(hidden, noticed))) in kinds.iter().zip(state).enumerate() {
            let whole = f64::from(kind.units - hidden - noticed) * f64::from(copies);
            let lacking = f64::from(hidden + noticed) * f64::from(copies - 1);
            let masked = match self.detection {
                Some(_) => (hidden + 1, noticed),
                None => (hidden, noticed + 1),
            };
            go(index, masked, whole * kind.failure_rate * coverage);
            failing += (whole * (1.0 - coverage) + lacking) * kind.failure_rate;
            if let Some(latency) = self.detection
                && hidden > 0
            {
                let rate = f64::from(hidden) * latency.rate();
                go(index, (hidden - 1, noticed + 1), rate);
            }
            if noticed > 0 {
                let rate = f64::from(noticed) * kind.repair_rate * attended;
                go(index, (hidden, noticed - 1), rate);
            }
        }
        if failing > 0.0 {
            found.push((None, failing));
        }
    }
}
