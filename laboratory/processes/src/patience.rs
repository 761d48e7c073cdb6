//! How long the laboratory waits for what, and what it shows meanwhile.

use std::time::{Duration, Instant};

use understudy_journal::monotonic_ns;

use super::{Laboratory, LaboratoryError, Progress};
use crate::process::Process;

const READY_PATIENCE: Duration = Duration::from_secs(20);
const STEP_PATIENCE: Duration = Duration::from_secs(30);
const CYCLE_PATIENCE: Duration = Duration::from_secs(10);

impl Laboratory<'_> {
    pub(super) fn show_progress(&mut self, waits: &mut Waits) {
        let progress = match self.account.cycle() {
            Some(cycle) => Progress::Cycle {
                cycle: cycle.min(self.account.cycles),
                cycles: self.account.cycles,
            },
            None if self.ready.len() < self.processes.len() => {
                Progress::Starting { ready: self.ready.len(), members: self.processes.len() }
            }
            None => Progress::ComingIntoStep { names: self.names(self.account.awaited()) },
        };
        if waits.shown.as_ref() != Some(&progress) {
            (self.watch)(progress.clone());
            waits.shown = Some(progress);
        }
    }

    pub(super) fn check_patience(
        &self,
        waits: &mut Waits,
        now: Instant,
    ) -> Result<(), LaboratoryError> {
        let over = |since: Instant, patience: Duration| now.duration_since(since) > patience;
        // One that has ended is not waited for: what that means shows in the cycles.
        let living = self.processes.iter().filter(|(_, one)| !one.has_ended());
        let mut lacking = living
            .map(|(member, _)| *member)
            .filter(|member| !self.ready.contains(member))
            .peekable();
        if lacking.peek().is_some() && self.account.cycle().is_none() {
            if over(waits.started, READY_PATIENCE) {
                return Err(LaboratoryError::NotReady {
                    seconds: READY_PATIENCE.as_secs(),
                    names: self.names(lacking),
                });
            }
            waits.ready_since = now;
            return Ok(());
        }
        let Some(cycle) = self.account.cycle() else {
            let one_is_down = self.processes.values().any(Process::has_ended);
            if one_is_down && (self.commanded || self.recovery.is_pending()) {
                // It is started again, or whoever commands may do that.
                waits.ready_since = now;
            } else if over(waits.ready_since, STEP_PATIENCE) {
                return Err(LaboratoryError::NotInStep {
                    seconds: STEP_PATIENCE.as_secs(),
                    names: self.names(self.account.awaited()),
                });
            }
            return Ok(());
        };
        let comes_back = self.conductor.wait_for_time() || self.recovery.is_pending();
        let waits_on = self.commanded || comes_back;
        if waits.cycle != Some(cycle) || waits_on {
            waits.cycle = Some(cycle);
            waits.cycle_since = now;
        } else if over(waits.cycle_since, CYCLE_PATIENCE) {
            let behind = Duration::from_nanos(monotonic_ns().saturating_sub(self.newest_ns));
            let seconds = CYCLE_PATIENCE.as_secs();
            return Err(LaboratoryError::NoCycles { seconds, cycle, behind });
        }
        Ok(())
    }
}

/// Since when what is waited for.
pub(super) struct Waits {
    started: Instant,
    ready_since: Instant,
    cycle: Option<u64>,
    cycle_since: Instant,
    shown: Option<Progress>,
}

impl Waits {
    pub(super) fn new() -> Self {
        let now = Instant::now();
        Self { started: now, ready_since: now, cycle: None, cycle_since: now, shown: None }
    }
}
