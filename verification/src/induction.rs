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

use understudy_logic::Circuit;

use crate::property::{Formula, Path};
use crate::symbolic::{Cone, Resolved, Trace, rows};
use clauses::Unrolling;

/// What came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Induction {
    /// It holds in every run; k scans were enough.
    Holds(u32),
    /// It does not hold at the end of this run.
    Fails(Trace),
    /// Neither was proved with so many scans; no run of that length refutes it.
    Undecided(u32),
}

/// Whether `invariant`, which speaks of one scan, holds in every scan that can be reached (AG), with k up to `most`.
///
/// Nothing for a formula that speaks of more than one scan.
pub fn prove_always(circuit: &Circuit, invariant: &Resolved, most: u32) -> Option<Induction> {
    if !invariant.is_of_one_scan() {
        return None;
    }
    let cone = Cone::of(circuit, [invariant]);
    let mut base = Unrolling::new(circuit, &cone, true);
    let mut step = Unrolling::new(circuit, &cone, false);
    for scans in 0..=most {
        base.scan();
        let wrong = base.literal(invariant, scans as usize);
        if base.satisfiable(!wrong) {
            let inputs = (0..=scans as usize).map(|scan| base.inputs(scan));
            return Some(Induction::Fails(rows(circuit, &cone, inputs.collect())));
        }
        base.require(wrong);
        step.scan();
        let right = step.literal(invariant, scans as usize);
        step.differ(scans as usize);
        if !step.satisfiable(!right) {
            return Some(Induction::Holds(scans));
        }
        step.require(right);
    }
    Some(Induction::Undecided(most))
}

/// The part under AG of `formula`, where that speaks of one scan.
pub fn invariant(formula: &Resolved) -> Option<&Resolved> {
    match formula {
        Formula::Always(Path::All, inner) if inner.is_of_one_scan() => Some(inner),
        _ => None,
    }
}
