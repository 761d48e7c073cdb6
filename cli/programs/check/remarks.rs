//! What nobody asked about a ladder or a cluster, within a budget of time: what is suspicious about its rungs, and whether its understudy is the sum of its
//! members. What takes next to nothing is done whatever the budget.

use std::time::{Duration, Instant};

use understudy_cluster::Cluster;
use understudy_diagnostic::{Diagnostic, Report};
use understudy_ladder::Program;
use understudy_logic::Circuit;
use understudy_verification::program::{Bounds, Subject};
use understudy_verification::{Refutation, Work, prove_parity_while};

/// States, with inputs, that are listed at most; more take longer than a check should.
const STATES: usize = 1 << 22;

/// Nodes for the proof of the understudy.
const NODES: usize = 100_000;

/// The budget of a check.
pub(super) struct Looking {
    end: Instant,
}

impl Looking {
    pub(super) fn new(budget: Duration) -> Self {
        Self {
            end: Instant::now() + budget,
        }
    }

    /// Adds what is suspicious about the rungs of the program; true where the time was over before all was looked at.
    pub(super) fn at_rungs(
        &self,
        program: &Program,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> bool {
        let go_on = |_: Work| Instant::now() < self.end;
        let bounds = Bounds {
            states: STATES,
            go_on: &go_on,
            ..Bounds::default()
        };
        // A program that does not become a circuit with this period is no matter of a check without one.
        let remarks = Subject::new(program, period)
            .and_then(|subject| subject.remarks(program, period, bounds));
        let Ok(remarks) = remarks else {
            return false;
        };
        let found = remarks.found.into_iter();
        diagnostics.extend(found.map(|remark| remark.diagnostic));
        diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
        remarks.undecided > 0
    }

    /// Adds it where the understudy is not the sum of its members; true where that was not decided.
    pub(super) fn at_understudy(&self, cluster: &Cluster, report: &mut Report) -> bool {
        let controllers = cluster.controllers().iter();
        let members: Vec<Circuit> = controllers
            .map(|controller| controller.circuit.clone())
            .collect();
        let go_on = |_: Work| Instant::now() < self.end;
        match prove_parity_while(&members, cluster.parity().circuit(), NODES, &go_on) {
            Ok(_) => false,
            Err(Refutation::Undecided { .. }) => true,
            Err(wrong) => {
                let found = Diagnostic::error(wrong.code(), wrong.to_string(), 0..0);
                report.diagnostics.push(found);
                false
            }
        }
    }
}
