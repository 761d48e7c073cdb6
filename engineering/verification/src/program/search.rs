//! Whether something that is asked of one scan can be so in any run: what is seen happens, and what is seen nowhere is proved never to happen.

use understudy_logic::Circuit;

use super::Bounds;
use super::sampled::Sampled;
use crate::effort::{Stopped, Work};
use crate::explicit::{Explicit, ExplicitError, Extent};
use crate::induction::{Depth, Induction, prove_always};
use crate::property::Formula;
use crate::symbolic::{Checker, Resolved, Signal, Verdict};

/// The first list has this share of the states that count as few: most programs have fewer, and for those with long timers diagrams do more.
const FIRST: usize = 64;
/// Nodes for one question: these are many, and none of them was asked for.
const NODES: usize = 200_000;
/// Questions for which diagrams may grow too large before they are given up.
const REFUSED: u32 = 3;
/// Questions that clauses are tried on, the scans of their runs, and the steps of each search.
const BY_CLAUSES: u32 = 200;
const SCANS: u32 = 2;
const STEPS: u64 = 50_000;

/// What one question came to.
pub(super) enum Found {
    Never,
    /// In the last of these scans.
    Yes(Vec<Vec<bool>>),
    Unknown,
}

/// Answers questions about one circuit, whose outputs they are.
pub(super) struct Search<'a> {
    circuit: &'a Circuit,
    bounds: Bounds<'a>,
    sampled: Sampled,
    listed: Explicit,
    /// The first state of the list in which each question is so.
    seen: Vec<Option<usize>>,
    error: Option<ExplicitError>,
    /// Whether as many states were listed as allowed.
    all_listed: bool,
    checker: Checker<'a>,
    refused: u32,
    by_clauses: u32,
}

impl<'a> Search<'a> {
    pub(super) fn new(circuit: &'a Circuit, bounds: Bounds<'a>) -> Self {
        let count = circuit.outputs().len();
        let questions: Vec<Resolved> = (0..count).map(asked).collect();
        let few = (Explicit::few(circuit) / FIRST).min(bounds.states);
        let (listed, seen, error) = list(circuit, few, bounds);
        Self {
            circuit,
            bounds,
            sampled: Sampled::new(circuit, &questions),
            listed,
            seen,
            error,
            all_listed: few == bounds.states,
            checker: Checker::new(circuit, Vec::new(), NODES.min(bounds.nodes))
                .while_wanted(bounds.go_on)
                .in_fixed_order(),
            refused: 0,
            by_clauses: 0,
        }
    }

    /// Whether it was seen, so that nothing needs a proof.
    pub(super) fn is_seen(&self, question: usize) -> bool {
        self.seen[question].is_some() || self.sampled.seen(question).is_some()
    }

    /// Whether it is ever so; with a run as short as can be, or with any where that is too much work.
    pub(super) fn ask(&mut self, question: usize) -> Found {
        if let Some(found) = self.in_list(question) {
            return found;
        }
        if let Some(found) = self.by_diagrams(question) {
            return found;
        }
        if let Some(seen) = self.sampled.seen(question) {
            return Found::Yes(self.sampled.inputs(seen));
        }
        let wanted = (self.bounds.go_on)(Work::Scans(0));
        let too_many = matches!(self.error, Some(ExplicitError::States { .. }));
        if wanted && too_many && !self.all_listed {
            self.all_listed = true;
            (self.listed, self.seen, self.error) =
                list(self.circuit, self.bounds.states, self.bounds);
            if let Some(found) = self.in_list(question) {
                return found;
            }
        }
        if wanted { self.by_clauses(question) } else { Found::Unknown }
    }

    fn in_list(&self, question: usize) -> Option<Found> {
        match self.seen[question] {
            Some(state) => Some(Found::Yes(self.listed.run_to(state))),
            None if self.error.is_none() => Some(Found::Never),
            None => None,
        }
    }

    fn by_diagrams(&mut self, question: usize) -> Option<Found> {
        if self.refused >= REFUSED {
            return None;
        }
        // `EF` asks it of every first scan, and one is enough here.
        match self.checker.check(&asked(question).negated().always()) {
            Ok(Verdict::Fails(Some(trace))) => {
                let scans = trace.scans.into_iter();
                Some(Found::Yes(scans.map(|scan| scan.inputs).collect()))
            }
            Ok(Verdict::Holds(_)) => Some(Found::Never),
            Ok(Verdict::Fails(None)) => None,
            Err(Stopped::Time) => {
                self.refused = REFUSED;
                None
            }
            Err(Stopped::Diagrams(_)) => {
                self.refused += 1;
                None
            }
        }
    }

    fn by_clauses(&mut self, question: usize) -> Found {
        if self.by_clauses >= BY_CLAUSES {
            return Found::Unknown;
        }
        self.by_clauses += 1;
        let depth = Depth { scans: SCANS, steps: STEPS, go_on: self.bounds.go_on };
        match prove_always(self.circuit, &asked(question).negated(), depth) {
            Some(Induction::Holds(_)) => Found::Never,
            Some(Induction::Fails(trace)) => {
                let scans = trace.scans.into_iter();
                Found::Yes(scans.map(|scan| scan.inputs).collect())
            }
            _ => Found::Unknown,
        }
    }
}

fn asked(question: usize) -> Resolved {
    Formula::Signal(Signal::Output(question))
}

type List = (Explicit, Vec<Option<usize>>, Option<ExplicitError>);

/// Lists states and notes where each question is so for the first time.
fn list(circuit: &Circuit, bound: usize, bounds: Bounds<'_>) -> List {
    let mut seen: Vec<Option<usize>> = vec![None; circuit.outputs().len()];
    let mut open: Vec<usize> = (0..seen.len()).collect();
    let extent = Extent::of(bound);
    let (listed, error) = Explicit::explore(circuit, extent, bounds.go_on, &mut |scan| {
        open.retain(|&question| {
            seen[question] = scan.first(question);
            seen[question].is_none()
        });
    });
    (listed, seen, error)
}
