//! Times in which no station and no remote I/O ran, as after a power failure of the whole plant, and how each program started after them.

use std::collections::BTreeSet;

use understudy_simulator::Action;
use understudy_wire::{Member, ProgramId};

/// Outages that are listed, at most; all are counted.
const MAXIMUM_OUTAGES: usize = 100;

/// A time in which no station and no remote I/O ran.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Outage {
    /// The first cycle whose deadline came after the last member had ended; nothing before the origin.
    pub(crate) from: Option<u64>,
    /// How programs started after it.
    pub(crate) starts: Vec<Start>,
}

/// The start of a program after an outage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Start {
    pub(crate) program: ProgramId,
    /// The cycle in which it started; nothing before the origin.
    pub(crate) cycle: Option<u64>,
    /// Warm, with the cycles with applied outputs that are lost, where that is known; nothing for a cold start.
    pub(crate) warm: Option<Option<u64>>,
}

/// Follows which members run.
#[derive(Debug, Clone)]
pub(crate) struct Outages {
    down: BTreeSet<Member>,
    members: usize,
    listed: Vec<Outage>,
    pub(crate) count: u64,
}

impl Outages {
    /// All members run but those of `down`.
    pub(super) fn new(members: usize, down: impl IntoIterator<Item = Member>) -> Self {
        Self { down: down.into_iter().collect(), members, listed: Vec::new(), count: 0 }
    }

    /// Something is done to a member, or happens to it, before the deadline of a cycle.
    pub(super) fn step(&mut self, from: Option<u64>, member: Member, action: Action) {
        if matches!(member, Member::Plant(_)) {
            return;
        }
        match action {
            Action::Crash => {
                let is_last = self.down.insert(member) && self.down.len() == self.members;
                if is_last {
                    self.count += 1;
                    if self.listed.len() < MAXIMUM_OUTAGES {
                        self.listed.push(Outage { from, starts: Vec::new() });
                    }
                }
            }
            Action::Restart
            | Action::RestartInEpoch { .. }
            | Action::RestartMisconfigured
            | Action::RestartWrongProgram => {
                self.down.remove(&member);
            }
            _ => {}
        }
    }

    /// A program starts; the first start after an outage belongs to it.
    pub(super) fn started(&mut self, start: Start) {
        let is_listed = self.listed.len() as u64 == self.count;
        let last = self.listed.last_mut().filter(|_| is_listed);
        if let Some(outage) = last
            && outage.starts.iter().all(|other| other.program != start.program)
        {
            outage.starts.push(start);
        }
    }

    /// The first of them.
    pub(crate) fn listed(&self) -> &[Outage] {
        &self.listed
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    const STATION: Member = Member::Station(StationId(0));
    const SLOT: Member = Member::Station(StationId(1));
    const REMOTE_IO: Member = Member::RemoteIo(ProgramId(0));

    fn start(cycle: u64) -> Start {
        Start { program: ProgramId(0), cycle: Some(cycle), warm: Some(Some(0)) }
    }

    /// An empty slot of a spare does not run anyway, and a suspended member is not off.
    #[test]
    fn an_outage_begins_with_the_last_member_that_ends() {
        let mut outages = Outages::new(3, [SLOT]);
        outages.started(start(0));
        outages.step(Some(5), STATION, Action::Crash);
        outages.step(Some(6), REMOTE_IO, Action::Stop);
        outages.step(Some(7), Member::Plant(ProgramId(0)), Action::Crash);
        assert_eq!(outages.count, 0);
        outages.step(Some(8), REMOTE_IO, Action::Crash);
        outages.step(Some(9), REMOTE_IO, Action::Crash);
        outages.step(Some(20), REMOTE_IO, Action::Restart);
        outages.step(Some(21), STATION, Action::Restart);
        outages.started(start(25));
        outages.started(start(40));
        assert_eq!(outages.count, 1);
        assert_eq!(outages.listed(), [Outage { from: Some(8), starts: vec![start(25)] }]);
    }
}
