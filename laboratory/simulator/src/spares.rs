//! Spares beside a simulated cluster, or beside several that share them.
//!
//! They follow the deadlines of the same witnesses, and the same rule, as a spare that is a process. What they decide is an order to start or to
//! end the station of a slot; whoever runs the simulation carries it out.

use understudy_cycle::Agreement;
use understudy_cycle::spare::{Attention, Order, Rule, WITNESSES};
use understudy_remote_io::Event;
use understudy_wire::{ProgramId, StationId};

use crate::fault::Action;

/// When spares wake and retire, in cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpareTimes {
    /// Cycles for which a station must be flagged.
    pub spare_after: u32,
    /// Cycles for which a group must be complete before a spare retires.
    pub retire_after: u32,
}

/// A spare with a slot in each of some groups.
#[derive(Debug, Clone, Hash)]
pub struct SpareBeside {
    groups: Vec<Attention>,
    slots: Vec<StationId>,
    rule: Rule,
    /// The group in which it is awake.
    post: Option<usize>,
    /// Whether its machine works.
    works: bool,
}

/// What happens to the station of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpareOrder {
    /// The group.
    pub group: usize,
    /// The slot.
    pub slot: StationId,
    /// [`Action::Restart`] where the spare wakes, [`Action::Crash`] where it retires.
    pub action: Action,
}

impl SpareBeside {
    /// An idle spare. For each group: what its members agree on, and the slot of the spare.
    pub fn new(groups: &[(&Agreement, StationId)], times: SpareTimes) -> Self {
        let attention = |(agreement, slot): &(&Agreement, StationId)| {
            Attention::new(agreement, *slot, times.spare_after)
        };
        Self {
            groups: groups.iter().map(attention).collect(),
            slots: groups.iter().map(|(_, slot)| *slot).collect(),
            rule: Rule {
                fits: vec![true; groups.len()],
                retire_after: vec![times.retire_after; groups.len()],
            },
            post: None,
            works: true,
        }
    }

    /// The group in which it is awake.
    pub fn post(&self) -> Option<usize> {
        self.post
    }

    /// Whether its station publishes.
    pub fn publishes(&self) -> bool {
        self.post.is_some_and(|group| self.groups[group].standing().publishes)
    }

    /// Takes what a remote I/O of a group reports; a deadline of a witness may call for an order.
    pub fn see(&mut self, group: usize, program: ProgramId, event: &Event) -> Option<SpareOrder> {
        let Event::Applied { heard, .. } = event else {
            return None;
        };
        if program.index() >= WITNESSES {
            return None;
        }
        self.groups[group].deadline(program.index(), *heard);
        self.order()
    }

    /// The station of a slot has ended; where the spare is still needed, it wakes again.
    pub fn ended(&mut self, slot: StationId) {
        self.post.take_if(|group| self.slots[*group] == slot);
    }

    /// Its machine fails, or works again: the station that it runs ends with it.
    pub fn works(&mut self, works: bool) -> Option<SpareOrder> {
        self.works = works;
        let group = self.post.take_if(|_| !works)?;
        Some(SpareOrder { group, slot: self.slots[group], action: Action::Crash })
    }

    fn order(&mut self) -> Option<SpareOrder> {
        if !self.works {
            return None;
        }
        let standings: Vec<_> = self.groups.iter().map(Attention::standing).collect();
        let (group, action) = match self.rule.order(self.post, &standings) {
            Order::Stay => return None,
            Order::Wake(group) => {
                self.post = Some(group);
                (group, Action::Restart)
            }
            Order::Retire(group) => {
                self.post = None;
                (group, Action::Crash)
            }
        };
        Some(SpareOrder { group, slot: self.slots[group], action })
    }
}
