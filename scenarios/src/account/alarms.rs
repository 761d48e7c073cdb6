//! Alarms on signals: how often each was raised.

use std::sync::Arc;

use understudy_cluster::AlarmDeclaration;
use understudy_journal::{AlarmChange, AlarmFold, AlarmTransition};

/// How often an alarm was raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct AlarmFinding {
    /// Times that it was raised.
    pub(crate) raised: u64,
    /// The number of the cycle in which it was raised first.
    pub(crate) first: Option<i64>,
    /// Whether it is active; nothing where that is unknown.
    pub(crate) active: Option<bool>,
}

/// The alarms of a run.
#[derive(Debug, Clone)]
pub(super) struct Alarms {
    pub(super) fold: AlarmFold,
    pub(super) findings: Vec<AlarmFinding>,
}

impl Alarms {
    pub(super) fn new(alarms: &Arc<[AlarmDeclaration]>, programs: usize) -> Self {
        Self {
            fold: AlarmFold::new(Arc::clone(alarms), programs),
            findings: vec![AlarmFinding::default(); alarms.len()],
        }
    }

    /// Takes what a record of a cycle has changed.
    pub(super) fn changed(&mut self, changes: &[AlarmChange], number: i64) {
        for change in changes {
            let Some(finding) = self.findings.get_mut(change.alarm) else {
                continue;
            };
            finding.active = change.active;
            if let Some(AlarmTransition::Raised { .. }) = change.transition {
                finding.raised += 1;
                finding.first = finding.first.or(Some(number));
            }
        }
    }
}
