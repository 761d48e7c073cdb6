//! Repair: a station asks for the states that it lacks, and transfers those that others lack.
//!
//! The first station that holds a state answers: its controller, then the understudies by rank. A transferred state is
//! checked by [`crate::replica::Replica::adopt`]: it must lead to the last sample that was received. A wide state comes in segments.

use understudy_wire::{Body, Join, ProgramSet, StationId, Time, Transfer};

use super::{Rest, Role, Station, replica_mut};
use crate::event::Event;
use crate::replica::{Replica, SEGMENTS_A_CYCLE};

impl Station {
    pub(super) fn receive_join(&mut self, station: StationId, join: &Join) {
        if self.cycle.joiners.contains(station) {
            return;
        }
        self.cycle.joiners.insert(station);
        self.take_recalled(&join.recalled);
        self.receive_holdings(station, &join.holdings, &join.recalled);
        self.relay.lack(join.lacks);
        let mut budget = SEGMENTS_A_CYCLE.saturating_sub(self.cycle.segments);
        for program in join.wants.iter() {
            let others_give = self.cycle.others_have.contains(program) && self.own().0 != program.0;
            let Some(replica) = replica_mut(&mut self.replicas, program) else {
                continue;
            };
            let partial = join.partial.iter().find(|partial| partial.program == program);
            if partial.is_none() {
                replica.asked(station);
            }
            if others_give {
                continue;
            }
            for transfer in replica.transfer(station, partial, &mut budget) {
                self.member.send(Body::Transfer(transfer));
            }
        }
        self.cycle.segments = SEGMENTS_A_CYCLE - budget;
    }

    pub(super) fn adopt(&mut self, from: StationId, transfer: &Transfer) {
        if transfer.to != self.own() {
            return;
        }
        let Some(replica) = replica_mut(&mut self.replicas, transfer.program) else {
            return;
        };
        let versions = self.settings.versions(&self.member, transfer.program);
        let shadow_cycles = self.settings.agreement.shadow_cycles;
        if versions.of(transfer.hash).is_none() {
            let moment = self.member.moment();
            return self.miss_program(moment, transfer.program, transfer.hash);
        }
        if replica.adopt(versions, &mut self.scratch, (from, transfer), shadow_cycles) {
            let event = Event::Adopted {
                moment: self.member.moment(),
                program: transfer.program,
                lineage: replica.lineage().unwrap_or(transfer.lineage),
                from: Some(from),
            };
            self.report(event);
        }
        self.hand_over_retained(transfer.program);
    }

    pub(super) fn ask(&mut self) {
        self.cycle.rest = Rest::Begun;
        let Some(moment) = self.member.clock.moment() else {
            return;
        };
        let wanting = || self.replicas.iter().filter(|replica| replica.wants_state());
        let wants: ProgramSet = wanting().map(Replica::id).collect();
        let partial = wanting().filter_map(Replica::partial).collect();
        if wants != self.wanted {
            self.wanted = wants;
            if !wants.is_empty() {
                self.report(Event::Joins { moment, wants });
            }
        }
        if !wants.is_empty() || !self.publishes() {
            let holdings = self.holdings();
            let recalled = self.recalled(moment);
            self.member.send(Body::Join(Join {
                wants,
                holdings,
                retained: self.replicas.iter().filter_map(Replica::retained).collect(),
                recalled,
                lacks: self.lacks(),
                partial,
            }));
        }
    }

    pub(super) fn asks_at(&self) -> Option<Time> {
        let due = self.member.clock.anchor() + self.settings.agreement.schedule.rest();
        (self.role != Role::Listening && self.cycle.rest == Rest::Ahead).then_some(due)
    }
}
