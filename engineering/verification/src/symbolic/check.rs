//! The sets of states that satisfy formulas, as least and greatest fixed points.

use std::iter;

use understudy_logic::bdd::{BddError, Diagram};

use super::core::Core;
use super::model::Model;
use super::trace::Tracer;
use super::{Resolved, Verdict};
use crate::effort::Stopped;

/// Nodes of a set that is simple, whatever it is compared with.
const SMALL: usize = 100;

/// How many times fewer nodes the states have that no step has gone back from, so that a step goes back from them alone.
const SMALLER: usize = 4;

fn is_much_smaller(set: &Diagram, other: &Diagram) -> bool {
    set.node_count() * SMALLER < other.node_count()
}

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

    /// E[hold U end].
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
    ///
    /// A step goes back from all that was found, of which most is remembered from the step before, or from the states that no step has gone back from
    /// yet, where these are a much simpler set: with each scan that timers count, all that was found has one more time for each of them.
    fn search(
        &self,
        hold: &Diagram,
        end: &Diagram,
        found: &mut dyn FnMut(usize, &Diagram),
    ) -> Result<(), Stopped> {
        let mut known = end.clone();
        let mut fresh = Some(end.clone());
        let mut ways = None;
        for step in 0.. {
            let from = fresh.as_ref().filter(|fresh| is_much_smaller(fresh, &known));
            let next = self.enter(&known, hold, &self.before(from.unwrap_or(&known))?)?;
            if next == known {
                break;
            }
            if fresh.is_some() {
                fresh = self.fresh(None, &next, &known)?;
            }
            known = next;
            found(1, &known);
            if step < self.single {
                continue;
            }
            if ways.is_none() {
                ways = Some(self.ways(hold)?);
            }
            // The shortest first: a run that is shown waits no longer than needed.
            let jumps = self.jumps()?.iter().zip(ways.as_deref().unwrap_or_default());
            for (jump, way) in jumps {
                self.goes_on()?;
                let before = self.diagrams.substitute(&known, &jump.step);
                let Ok(next) = before.and_then(|before| self.enter(&known, way, &before)) else {
                    // Single scans find the same states, with smaller sets on their way.
                    ways = Some(Vec::new());
                    break;
                };
                if next != known {
                    if fresh.is_some() {
                        fresh = self.fresh(fresh, &next, &known)?;
                    }
                    known = next;
                    found(jump.scans, &known);
                }
            }
        }
        Ok(())
    }

    /// `before`, and the states of `next` that are not in `known`; nothing where these are no simpler set than `known`, as in lines of stations that
    /// work at the same time, because the next ones would be less simple still.
    fn fresh(
        &self,
        before: Option<Diagram>,
        next: &Diagram,
        known: &Diagram,
    ) -> Result<Option<Diagram>, Stopped> {
        let diagrams = &self.diagrams;
        let mut fresh = diagrams.and(next, &diagrams.not(known)?)?;
        if let Some(before) = before {
            fresh = diagrams.or(&before, &fresh)?;
        }
        let is_simple = fresh.node_count() <= 2 * known.node_count() + SMALL;
        Ok(is_simple.then_some(fresh))
    }

    /// `known`, and what of `hold` comes `before` it.
    fn enter(
        &self,
        known: &Diagram,
        hold: &Diagram,
        before: &Diagram,
    ) -> Result<Diagram, BddError> {
        let entering = self.diagrams.and(hold, before)?;
        self.diagrams.or(known, &entering)
    }

    /// For each jump where all its scans are in `hold`; for the longest ones nothing, where this is too large.
    fn ways(&self, hold: &Diagram) -> Result<Vec<Diagram>, Stopped> {
        let mut ways: Vec<Diagram> = Vec::new();
        let jumps = self.jumps()?;
        let steps = jumps.iter().map(|jump| &jump.step);
        for step in iter::once(&self.step).chain(steps).take(jumps.len()) {
            let held = ways.last().unwrap_or(hold);
            let later = self.diagrams.substitute(held, step);
            let Ok(way) = later.and_then(|later| self.diagrams.and(held, &later)) else {
                break;
            };
            ways.push(way);
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
