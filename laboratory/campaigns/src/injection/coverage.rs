//! What was injected: kind of fault × role × phase of the cycle.

use serde::{Deserialize, Serialize};
use understudy_cycle::Schedule;

use super::faultload::Faultload;
use super::kind::{Kind, Phase, Role};

/// How often one kind struck one role, by phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoverageRow {
    /// What.
    pub kind: Kind,
    /// Whom.
    pub role: Role,
    /// In the order of [`Phase::ALL`]; the phase is that in which it began. What disturbs the network for whole cycles counts in each.
    pub counts: [u64; Phase::ALL.len()],
}

/// All rows that can be, also those that are still empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Coverage(Vec<CoverageRow>);

impl Coverage {
    pub(super) fn of(kinds: &[Kind]) -> Self {
        let rows = kinds.iter().flat_map(|&kind| {
            kind.roles().iter().map(move |&role| CoverageRow {
                kind,
                role,
                counts: [0; Phase::ALL.len()],
            })
        });
        Self(rows.collect())
    }

    pub(super) fn count(&mut self, faultload: &Faultload, schedule: &Schedule) {
        for injection in &faultload.injections {
            let Some(first) = injection.steps.first() else {
                continue;
            };
            let phase = Phase::at(first.phase, schedule);
            if let Some(row) = self.row(injection.kind, injection.role) {
                row.counts[phase as usize] += 1;
            }
        }
        let Some(disturbance) = &faultload.network else {
            return;
        };
        for kind in Kind::of_network(&disturbance.network) {
            if let Some(row) = self.row(kind, Role::Network) {
                row.counts.iter_mut().for_each(|count| *count += 1);
            }
        }
    }

    fn row(&mut self, kind: Kind, role: Role) -> Option<&mut CoverageRow> {
        self.0.iter_mut().find(|row| row.kind == kind && row.role == role)
    }

    pub(super) fn add(&mut self, rows: &[CoverageRow]) {
        for other in rows {
            if let Some(row) = self.row(other.kind, other.role) {
                let counts = row.counts.iter_mut().zip(other.counts);
                counts.for_each(|(count, more)| *count += more);
            }
        }
    }

    pub(super) fn into_rows(self) -> Vec<CoverageRow> {
        self.0
    }

    pub(super) fn rows(&self) -> &[CoverageRow] {
        &self.0
    }
}
