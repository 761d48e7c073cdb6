//! Optional checks within a time limit: suspicious rungs, and whether the understudy is the sum of its
//! members.

use std::time::{Duration, Instant};

use understudy_cluster::Cluster;
use understudy_ladder::Program;
use understudy_logic::Circuit;
use understudy_text::{Diagnostic, Report};
use understudy_verification::program::{Bounds, Subject};
use understudy_verification::{Refutation, Work, prove_parity_while};

/// Maximum number of listed states with inputs.
const STATES: usize = 1 << 22;

/// Maximum number of nodes for the proof of the understudy.
const NODES: usize = 100_000;

/// Time limit of a check.
pub(super) struct Looking {
    end: Instant,
}

impl Looking {
    pub(super) fn new(budget: Duration) -> Self {
        Self { end: Instant::now() + budget }
    }

    /// Reports suspicious rungs of the program; true if the time limit ended the search.
    pub(super) fn at_rungs(
        &self,
        program: &Program,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> bool {
        let go_on = |_: Work| Instant::now() < self.end;
        let has_rungs = program.rungs.iter().any(|rung| !rung.coils.is_empty());
        if Instant::now() >= self.end {
            return has_rungs;
        }
        let bounds = Bounds { states: STATES, go_on: &go_on, ..Bounds::default() };
        // A check without a period ignores programs that cannot be lowered with the default one.
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

    /// Reports an understudy that is not the sum of its members; true if undecided.
    pub(super) fn at_understudy(&self, cluster: &Cluster, report: &mut Report) -> bool {
        let Some(parity) = cluster.parity() else {
            return false;
        };
        let controllers = cluster.controllers().iter();
        let members: Vec<Circuit> =
            controllers.filter_map(|controller| controller.circuit().cloned()).collect();
        let go_on = |_: Work| Instant::now() < self.end;
        match prove_parity_while(&members, parity.circuit(), NODES, &go_on) {
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
