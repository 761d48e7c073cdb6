//! The sets of states that satisfy formulas, as least and greatest fixed points.

use std::iter;

use understudy_logic::bdd::Diagram;

use super::core::Core;
use super::model::Model;
use super::trace::Tracer;
use super::{Resolved, Verdict};
use crate::effort::Stopped;

/// States of a search, and how they lead to those found before.
pub(super) struct Ring {
    pub(super) states: Diagram,
    /// Number of scans: 1 with any inputs, or more with unchanged inputs.
    pub(super) scans: usize,
}

impl Ring {
    fn single(states: Diagram) -> Self {
        Self { states, scans: 1 }
    }
}

/// See [`super::Checker::check`].
pub(super) fn check(model: &Model<'_>, property: &Resolved) -> Result<Verdict, Stopped> {
    let formula = Core::of(property);
    let holds = model.states(&formula)?;
    let fails = model.diagrams.not(&holds)?;
    let initial: Vec<bool> =
        model.circuit.registers().iter().map(|register| register.initial).collect();
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
                self.within(*scans, &end)?.pop().map_or(end, |ring| ring.states)
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
        let mut found = end.clone();
        self.search(hold, &end, &mut |_, states| found = states.clone())?;
        Ok(found)
    }

    /// E[hold U end] in rings: each holds the states that lead into the one before by its scans; the last ring is the fixed point.
    pub(super) fn rings(&self, hold: &Diagram, end: &Diagram) -> Result<Vec<Ring>, Stopped> {
        let mut rings = vec![Ring::single(end.clone())];
        self.search(hold, end, &mut |scans, states| {
            rings.push(Ring { states: states.clone(), scans });
        })?;
        Ok(rings)
    }

    /// Shows `found` the states of E[hold U end] each time that there are more, and the scans that lead to those before: one with any
    /// inputs, or several with unchanged inputs.
    fn search(
        &self,
        hold: &Diagram,
        end: &Diagram,
        found: &mut dyn FnMut(usize, &Diagram),
    ) -> Result<(), Stopped> {
        let mut known = end.clone();
        let mut ways = None;
        for step in 0.. {
            let next = self.enter(&known, hold, &self.before(&known)?)?;
            if next == known {
                break;
            }
            known = next;
            found(1, &known);
            if step < self.single {
                continue;
            }
            if ways.is_none() {
                ways = Some(self.ways(hold)?);
            }
            for (jump, way) in self.jumps()?.iter().zip(ways.iter().flatten()) {
                self.goes_on()?;
                let before = self.diagrams.substitute(&known, &jump.step)?;
                let next = self.enter(&known, way, &before)?;
                if next != known {
                    known = next;
                    found(jump.scans, &known);
                }
            }
        }
        Ok(())
    }

    /// `known`, and what of `hold` comes `before` it.
    fn enter(&self, known: &Diagram, hold: &Diagram, before: &Diagram) -> Result<Diagram, Stopped> {
        let entering = self.diagrams.and(hold, before)?;
        Ok(self.diagrams.or(known, &entering)?)
    }

    /// For each jump where all its scans are in `hold`.
    fn ways(&self, hold: &Diagram) -> Result<Vec<Diagram>, Stopped> {
        let mut ways: Vec<Diagram> = Vec::new();
        let jumps = self.jumps()?;
        let steps = jumps.iter().map(|jump| &jump.step);
        for step in iter::once(&self.step).chain(steps).take(jumps.len()) {
            let held = ways.last().unwrap_or(hold);
            let later = self.diagrams.substitute(held, step)?;
            ways.push(self.diagrams.and(held, &later)?);
        }
        Ok(ways)
    }

    /// The first rings of E[true U end], up to that of `scans` steps or the fixed point.
    pub(super) fn within(&self, scans: u32, end: &Diagram) -> Result<Vec<Ring>, Stopped> {
        let mut rings = vec![Ring::single(end.clone())];
        for _ in 0..scans {
            let last = &rings[rings.len() - 1].states;
            let next = self.diagrams.or(last, &self.before(last)?)?;
            if next == *last {
                break;
            }
            rings.push(Ring::single(next));
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
