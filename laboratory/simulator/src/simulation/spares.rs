//! Spares of a simulated cluster, which wake by their rule.

use understudy_remote_io::Event;
use understudy_wire::{Member, ProgramId, StationId};

use super::Simulation;
use crate::fault::Fault;
use crate::spares::{SpareBeside, SpareTimes};

impl Simulation {
    /// From here on a spare for each slot wakes and retires by its rule.
    pub fn with_spares(&mut self, times: SpareTimes) {
        let agreement = &self.parts.stations[0].agreement;
        let slots = agreement.schedule.spare_slots();
        let spare = |slot| SpareBeside::new(&[(&**agreement, slot)], times);
        self.spares = slots.iter().map(spare).collect();
    }

    /// A remote I/O reports: a spare that follows it may wake or retire.
    pub(super) fn show_spares(&mut self, program: ProgramId, event: &Event) {
        let orders = self.spares.iter_mut().filter_map(|spare| spare.see(0, program, event));
        let orders: Vec<_> = orders.collect();
        for order in orders {
            // Its cycle is over, so it is done next.
            self.schedule(Fault {
                at_cycle: 0,
                phase: 0.0,
                member: Member::Station(order.slot),
                action: order.action,
            });
        }
    }

    /// The station of a slot was killed.
    pub(super) fn spare_ended(&mut self, slot: StationId) {
        self.spares.iter_mut().for_each(|spare| spare.ended(slot));
    }
}
