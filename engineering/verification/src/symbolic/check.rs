//! The sets of states that satisfy formulas, as least and greatest fixed points.

use understudy_logic::bdd::Diagram;

use super::core::Core;
use super::model::Model;
use super::trace::Tracer;
use super::{Resolved, Verdict};
use crate::effort::Stopped;

/// See [`super::Checker::check`].
pub(super) fn check(model: &Model<'_>, property: &Resolved) -> Result<Verdict, Stopped> {
    let formula = Core::of(property);
    let holds = model.states(&formula)?;
    let fails = model.diagrams.not(&holds)?;
    let initial: Vec<bool> = model
        .circuit
        .registers()
        .iter()
        .map(|register| register.initial)
        .collect();
    let failing = model.with_registers(&fails, &initial)?;
    let tracer = Tracer::new(model);
    if failing.is_constant(false) {
        let first = model.with_registers(&holds, &initial)?;
        return Ok(Verdict::Holds(tracer.trace(&formula, &initial, &first)?));
    }
    let refuted = formula.not();
    Ok(Verdict::Fails(tracer.trace(&refuted, &initial, &failing)?))
}

impl Model<'_> {
    /// The states that satisfy `formula`, ways on being fair ones.
    pub(super) fn states(&self, formula: &Core) -> Result<Diagram, Stopped> {
        let diagrams = &self.diagrams;
        Ok(match formula {
            Core::Constant(value) => diagrams.constant(*value),
            Core::Signal(signal) => self.signal(*signal).clone(),
            Core::Not(inner) => diagrams.not(&self.states(inner)?)?,
            Core::And(left, right) => diagrams.and(&self.states(left)?, &self.states(right)?)?,
            Core::Next(inner) => self.before(&self.fair_only(&self.states(inner)?)?)?,
            Core::Until(hold, end) => {
                let (hold, end) = (self.states(hold)?, self.fair_only(&self.states(end)?)?);
                self.until(&hold, end)?
            }
            Core::Always(inner) => self.always(&self.states(inner)?)?,
            Core::Reaches(scans, inner) => {
                let end = self.fair_only(&self.states(inner)?)?;
                self.within(*scans, &diagrams.constant(true), &end)?
                    .pop()
                    .unwrap_or(end)
            }
            Core::Stays(scans, inner) => {
                let inner = self.states(inner)?;
                self.stays(*scans, &inner)?.pop().unwrap_or(inner)
            }
        })
    }

    /// Those of `set` from which a fair run goes on.
    pub(super) fn fair_only(&self, set: &Diagram) -> Result<Diagram, Stopped> {
        match &self.fair_states {
            None => Ok(set.clone()),
            Some(fair) => Ok(self.diagrams.and(set, fair)?),
        }
    }

    /// E[hold U end]. Each step goes back from all that was found, not only from what came last: that is mostly the simpler set, and most of the step is
    /// remembered from the one before.
    fn until(&self, hold: &Diagram, end: Diagram) -> Result<Diagram, Stopped> {
        let mut found = end;
        loop {
            let entering = self.diagrams.and(hold, &self.before(&found)?)?;
            let next = self.diagrams.or(&found, &entering)?;
            if next == found {
                return Ok(found);
            }
            found = next;
        }
    }

    /// E[hold U end] by the number of steps: ring k holds the states that need at most k; the last ring is the fixed point.
    pub(super) fn rings(&self, hold: &Diagram, end: &Diagram) -> Result<Vec<Diagram>, Stopped> {
        self.within(u32::MAX, hold, end)
    }

    /// The first rings of E[hold U end], up to that of `scans` steps or the fixed point.
    pub(super) fn within(
        &self,
        scans: u32,
        hold: &Diagram,
        end: &Diagram,
    ) -> Result<Vec<Diagram>, Stopped> {
        let mut rings = vec![end.clone()];
        for _ in 0..scans {
            let last = &rings[rings.len() - 1];
            let entering = self.diagrams.and(hold, &self.before(last)?)?;
            let next = self.diagrams.or(last, &entering)?;
            if next == *last {
                break;
            }
            rings.push(next);
        }
        Ok(rings)
    }

    /// `stays(n)[k]`: from here `set` can be kept for k more scans, fairly after that.
    pub(super) fn stays(&self, scans: u32, set: &Diagram) -> Result<Vec<Diagram>, Stopped> {
        let mut kept = vec![self.fair_only(set)?];
        for _ in 0..scans {
            let last = &kept[kept.len() - 1];
            let next = self.diagrams.and(set, &self.before(last)?)?;
            if next == *last {
                break;
            }
            kept.push(next);
        }
        Ok(kept)
    }

    /// EG `set` on fair runs: the greatest Z = set ∧ ⋀ EX E[set U (Z ∧ condition)] over the conditions, after Emerson and Lei.
    pub(super) fn always(&self, set: &Diagram) -> Result<Diagram, Stopped> {
        let diagrams = &self.diagrams;
        let mut kept = set.clone();
        loop {
            let mut next = kept.clone();
            if self.fair.is_empty() {
                next = diagrams.and(&next, &self.before(&kept)?)?;
            }
            for condition in &self.fair {
                let end = diagrams.and(&next, condition)?;
                let to_end = self.until(set, end)?;
                next = diagrams.and(&next, &self.before(&to_end)?)?;
            }
            if next == kept {
                return Ok(kept);
            }
            kept = next;
        }
    }
}
