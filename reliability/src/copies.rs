//! What a cluster is compared with: each controller by itself with copies of its kind, of which one may be down. With two boxes for
//! each it is the full duplex of (21), with three TMR. Controllers may differ; a controller's copies are like it.
//!
//! Where each box has a repair crew, positions are independent of each other, and R(t) is the product of those of single ones.

use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::positions::{PairRates, Positions, chain_of};
use crate::quantity::Hours;
use crate::system::{CommonCause, CommonCauseConvention, System};
use crate::transient::AfterFailure;

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
        chain_of(&self.copied(copies), self.lethal_to_copies(), |waiting| self.attended(waiting))
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
        let (kinds, lethal) = (self.copied(copies), self.lethal_to_copies());
        let at = |chain: Chain| match chain.transient(hours, AfterFailure::Final) {
            Ok(found) => Ok((chain.failure_density(&found), found)),
            Err(error) => Err(vec![error]),
        };
        let most: u32 = kinds.iter().map(Positions::most_waiting).sum();
        let independent = self.crews.is_none_or(|crews| crews >= most);
        if !independent {
            let (density, found) = at(chain_of(&kinds, lethal, |waiting| self.attended(waiting))?)?;
            return Ok(Survival { working: found.working, failed: found.failed, density });
        }
        let mut logarithm = -lethal * hours;
        let mut hazard = lethal;
        for kind in kinds {
            let units = f64::from(kind.count);
            let alone = chain_of(&[kind.one()], 0.0, |_| 1.0)?;
            let (density, found) = at(alone)?;
            logarithm += units * found.log_working();
            hazard += units * density / found.working;
        }
        let working = logarithm.exp();
        Ok(Survival { working, failed: -logarithm.exp_m1(), density: working * hazard })
    }

    /// Controllers by kind, with `copies` for each; kinds that cannot be told apart are one. Then the pairs of shared parts.
    fn copied(&self, copies: u32) -> Vec<Positions> {
        let alone = match self.common_cause {
            Some(CommonCause { beta, convention: CommonCauseConvention::Split }) => {
                1.0 - beta.get()
            }
            _ => 1.0,
        };
        let (all, coverage) = (f64::from(copies), self.coverage.get());
        let controllers = self.controllers.iter().map(|kind| {
            let rate = kind.mtbf.rate() * alone;
            let rates = PairRates {
                masked: all * rate * coverage,
                unmasked: all * rate * (1.0 - coverage),
                lacking: (all - 1.0) * rate,
                repair: kind.mttr.rate(),
                detection: self.detection.map(Hours::rate),
            };
            Positions::pairs(kind.count, rates)
        });
        let mut kinds: Vec<Positions> = Vec::new();
        for kind in controllers {
            let known = kinds.iter_mut().find(|known| known.are_like(&kind));
            match known {
                Some(known) => known.count += kind.count,
                None => kinds.push(kind),
            }
        }
        kinds.extend(self.pairs());
        kinds
    }

    /// Rate of what fails all controllers at once.
    fn lethal_to_copies(&self) -> f64 {
        let rates = self.controllers.iter().map(|kind| kind.mtbf.rate());
        let fastest = rates.fold(0.0, f64::max);
        self.lethal_rate_of_parts()
            + self.common_cause.map_or(0.0, |cause| cause.beta.get() * fastest)
    }
}
