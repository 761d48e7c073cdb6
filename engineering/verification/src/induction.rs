//! Invariants by k-induction with a SAT solver: where diagrams grow too large, clauses may still do.
//!
//! ```text
//! base   from the first scan on, p holds in each of the first k scans
//! step   from any registers, k scans with p and with registers that all differ are followed by p
//! ```
//!
//! Both together prove AG p. A base that fails is a run that refutes it. Registers that differ make the method complete; k may become as
//! large as the longest run without repetition all the same, so there is a bound on it.

mod clauses;
mod equal;

use std::cell::Cell;

use understudy_logic::Circuit;

use crate::effort::{ALWAYS, GoOn};
use crate::property::{Formula, Path};
use crate::symbolic::{Cone, Resolved, Trace, rows};
use clauses::{Patience, Unrolling};
pub(crate) use equal::reduced;

/// What came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Induction {
    /// It holds in every run; k scans were enough.
    Holds(u32),
    /// It does not hold at the end of this run.
    Fails(Trace),
    /// Undecided. No run of this number of scans refutes it.
    Undecided(u32),
}

/// How far induction goes.
#[derive(Clone, Copy)]
pub struct Depth<'g> {
    /// The largest k.
    pub scans: u32,
    /// Steps of each search for an assignment.
    pub steps: u64,
    /// Whether anybody still waits.
    pub go_on: GoOn<'g>,
}

impl Depth<'_> {
    /// Up to k scans, however long it takes.
    pub fn of(scans: u32) -> Self {
        Self { scans, steps: u64::MAX, go_on: ALWAYS }
    }
}

/// Whether `invariant`, which speaks of one scan, holds in every scan that can be reached (AG), with k up to `most`.
///
/// Nothing for a formula that speaks of more than one scan.
pub fn prove_always(
    circuit: &Circuit,
    invariant: &Resolved,
    depth: Depth<'_>,
) -> Option<Induction> {
    if !invariant.is_of_one_scan() {
        return None;
    }
    let cone = Cone::of(circuit, [invariant]);
    let patience = Patience { go_on: depth.go_on, scans: 0, steps: Cell::new(depth.steps) };
    let mut base = Unrolling::new(circuit, &cone, true, patience.clone());
    let mut step = Unrolling::new(circuit, &cone, false, patience);
    for scans in 0..=depth.scans {
        if let Some(found) = base.breaks(circuit, &cone, invariant, scans) {
            return Some(found);
        }
        step.scan();
        let right = step.literal(invariant, scans as usize);
        step.differ(scans as usize);
        match step.satisfiable(!right) {
            Some(false) => return Some(Induction::Holds(scans)),
            Some(true) => step.require(right),
            None => return Some(Induction::Undecided(scans + 1)),
        }
    }
    Some(Induction::Undecided(depth.scans + 1))
}

/// Searches a run of at most `depth.scans` scans that ends with a scan without `invariant`, the shortest one.
///
/// Nothing for a formula over more than one scan.
pub fn search(circuit: &Circuit, invariant: &Resolved, depth: Depth<'_>) -> Option<Induction> {
    if !invariant.is_of_one_scan() {
        return None;
    }
    let cone = Cone::of(circuit, [invariant]);
    let patience = Patience { go_on: depth.go_on, scans: 0, steps: Cell::new(depth.steps) };
    let mut base = Unrolling::new(circuit, &cone, true, patience);
    for scans in 0..depth.scans {
        if let Some(found) = base.breaks(circuit, &cone, invariant, scans) {
            return Some(found);
        }
    }
    Some(Induction::Undecided(depth.scans))
}

impl Unrolling<'_> {
    /// One scan more: the run that breaks the invariant in it, or the end of the search; nothing where no run does.
    fn breaks(
        &mut self,
        circuit: &Circuit,
        cone: &Cone,
        invariant: &Resolved,
        scans: u32,
    ) -> Option<Induction> {
        self.scan();
        let right = self.literal(invariant, scans as usize);
        match self.satisfiable(!right) {
            Some(true) => {
                let inputs = (0..=scans as usize).map(|scan| self.inputs(scan));
                Some(Induction::Fails(rows(circuit, cone, inputs.collect())))
            }
            Some(false) => {
                self.require(right);
                None
            }
            None => Some(Induction::Undecided(scans)),
        }
    }
}

/// The part under AG of `formula`, where that speaks of one scan.
pub fn invariant(formula: &Resolved) -> Option<&Resolved> {
    match formula {
        Formula::Always(Path::All, inner) if inner.is_of_one_scan() => Some(inner),
        _ => None,
    }
}
