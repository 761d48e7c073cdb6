//! What follows when the scenario is over: the run ends, or the cluster stays up for a visitor.

use std::time::Instant;

use understudy_journal::RunEvent;
use understudy_scenarios::Account;

use super::{Laboratory, Progress};

/// A cluster that stays up when its scenario is over, until the run is asked to end. What happens then is in the journal, and not in the account.
pub struct Afterwards<'a> {
    /// Judges the account of the scenario, and answers with the verdict in words.
    pub judge: Box<dyn FnMut(Account) -> String + 'a>,
    /// Whether commands are refused until then, so that they do not disturb the scenario.
    pub refuse_until_then: bool,
}

impl Laboratory<'_> {
    pub(super) fn is_over(&self, now: Instant) -> bool {
        // One cycle more, so that all remote I/Os have surely told of the last one.
        let told = self.account.cycle();
        self.conductor.is_over(now) || told.is_some_and(|cycle| cycle > self.account.cycles)
    }

    /// The scenario is over: whether the cluster stays up.
    pub(super) fn stays(&mut self) -> bool {
        let Some(afterwards) = &mut self.afterwards else {
            return false;
        };
        (self.watch)(Progress::Ending);
        let verdict = (afterwards.judge)(self.account.clone());
        self.judged = Some(self.account.clone());
        // From here on the cluster may stand still for as long as an operator wants.
        self.commanded = true;
        self.note(RunEvent::ScenarioOver { verdict });
        true
    }
}
