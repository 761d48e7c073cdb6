//! Optional checks within a time limit: suspicious rungs, and whether the understudy is the sum of its
//! members.

use std::str::FromStr;
use std::time::{Duration, Instant};

use understudy_cluster::{Cluster, Controller};
use understudy_executable::Interface;
use understudy_ladder::Program;
use understudy_text::{Diagnostic, Report};
use understudy_typed::Elementary;
use understudy_verification::program::{Bounds, Subject};
use understudy_verification::property::Asked;
use understudy_verification::{Refutation, Work, prove_parity_while};

use crate::files;

/// Maximum number of listed states with inputs.
const STATES: usize = 1 << 22;

/// Maximum number of nodes for the proof of the understudy.
const NODES: usize = 100_000;

/// Time limit of a check.
pub(super) struct Looking {
    end: Instant,
    rung_size: Option<RungSize>,
}

/// The largest rung that a target takes.
#[derive(Debug, Clone, Copy)]
pub(super) struct RungSize {
    /// Elements one behind the other.
    across: usize,
    /// Lines below each other.
    down: usize,
}

impl FromStr for RungSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok().filter(|number| *number > 0);
        let sizes = text.split_once(['x', '×']);
        let sizes = sizes.and_then(|(across, down)| Some((number(across)?, number(down)?)));
        let (across, down) =
            sizes.ok_or("expected the elements across and the lines down, such as 11x7")?;
        Ok(Self { across, down })
    }
}

impl Looking {
    pub(super) fn new(budget: Duration, rung_size: Option<RungSize>) -> Self {
        Self { end: Instant::now() + budget, rung_size }
    }

    /// Reports rungs that are larger than the target takes.
    fn at_sizes(&self, program: &Program, diagnostics: &mut Vec<Diagnostic>) {
        if let Some(RungSize { across, down }) = self.rung_size {
            diagnostics.extend(program.size_warnings(across, down));
        }
    }

    /// Reports suspicious rungs of the program; true if the time limit ended the search.
    pub(super) fn at_rungs(
        &self,
        program: &Program,
        period: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> bool {
        self.at_sizes(program, diagnostics);
        let go_on = |_: Work| Instant::now() < self.end;
        let has_rungs = program.rungs.iter().any(|rung| !rung.coils.is_empty());
        if Instant::now() >= self.end {
            return has_rungs;
        }
        let bounds = Bounds { states: STATES, go_on: &go_on, ..Bounds::default() };
        // A check without a period ignores programs that cannot be lowered with the default one.
        let remarks = Subject::new(program, period, &Asked::default())
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
        // Numbers take long to follow: `verify` does.
        let points = |controller: &Controller| {
            let Interface { inputs, outputs } = &controller.interface;
            inputs.iter().chain(outputs.iter()).all(|point| point.of == Elementary::Bool)
        };
        if !cluster.controllers().iter().all(points) || Instant::now() >= self.end {
            return false;
        }
        let Ok((members, parity)) = files::understudy_of(cluster) else {
            return false;
        };
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
