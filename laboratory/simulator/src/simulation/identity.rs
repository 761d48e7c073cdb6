//! When two simulations are the same state.

use std::hash::{Hash, Hasher};

use super::Simulation;

/// Two simulations of equal parts on a network that leaves nothing to chance go on alike if they hash alike. What has happened in the past counts only as far as it acts on.
impl Hash for Simulation {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            parts: _,
            links,
            now: _,
            stations,
            remote_ios,
            twins,
            driven_by,
            // It is what the slots say.
            wakeups: _,
            plants,
            modules,
            disks,
            referees,
            // They only judge.
            input_reports: _,
            signals: _,
            knowable: _,
            tallies: _,
            ready,
            arrived,
            holders,
            misled,
            unannounced,
            violations,
            faults,
            spares,
            pace,
            founded,
        } = self;
        (twins, driven_by).hash(hasher);
        (links, stations, remote_ios, plants, modules, disks, referees).hash(hasher);
        (ready, arrived, holders, misled, unannounced).hash(hasher);
        (violations.len(), spares, pace, founded).hash(hasher);
        for fault in faults {
            (fault.at_cycle, fault.phase.to_bits(), fault.member, fault.action).hash(hasher);
        }
    }
}
