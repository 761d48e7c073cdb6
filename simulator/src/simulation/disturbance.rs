//! What a fault does to a party. Links do their own part in [`crate::links`].

use std::sync::Arc;

use understudy_node::Station;
use understudy_remote_io::RemoteIo;
use understudy_wire::{
    Agreement, ConfigurationHash, Epoch, Frame, Input, Machine, Party, ProgramId, StationId,
};

use super::{Observe, Record, Simulation};
use crate::fault::{Action, Fault};
use crate::slot::Slot;

impl Simulation {
    pub(super) fn apply(&mut self, fault: &Fault, observe: &mut Observe<'_>) {
        let cycle = self.pace.cycle();
        observe(self.now, cycle, fault.party, Record::Fault(fault));
        self.links.disturb(self.now, fault.party, fault.action);
        match fault.party {
            Party::Station(station) if station.index() < self.stations.len() => {
                self.disturb_station(station, fault.action, observe);
            }
            Party::RemoteIo(program) if program.index() < self.remote_ios.len() => {
                self.disturb_remote_io(program, fault.action, observe);
            }
            Party::Plant(program) if program.index() < self.remote_ios.len() => {
                match fault.action {
                    Action::Crash => self.plants.crash(program),
                    Action::Restart => self.plants.restart(program),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    fn disturb_station(&mut self, station: StationId, action: Action, observe: &mut Observe<'_>) {
        let slot = &mut self.stations[station.index()];
        match action {
            Action::Restart | Action::RestartMisconfigured | Action::RestartInEpoch { .. } => {
                self.founded += 1;
                let mut settings = self.parts.stations[station.index()].clone();
                settings.epoch = match action {
                    Action::RestartInEpoch { epoch } => Epoch(epoch),
                    _ => Epoch(self.founded),
                };
                if action == Action::RestartMisconfigured {
                    settings.agreement = Arc::new(misconfigured(&settings.agreement));
                }
                slot.restart(Station::new(self.now, settings));
            }
            Action::FlipState { program, bit } => {
                if let Some(machine) = slot.machine() {
                    machine.flip_state(program, usize::from(bit));
                }
            }
            _ => {
                let waiting = disturb(slot, action);
                for frame in waiting {
                    self.give(Party::Station(station), Input::Frame(&frame), observe);
                }
            }
        }
    }

    fn disturb_remote_io(&mut self, program: ProgramId, action: Action, observe: &mut Observe<'_>) {
        let party = Party::RemoteIo(program);
        let slot = &mut self.remote_ios[program.index()];
        match action {
            Action::Restart | Action::RestartMisconfigured | Action::RestartInEpoch { .. } => {
                let mut settings = self.parts.remote_ios[program.index()].clone();
                if action == Action::RestartMisconfigured {
                    settings.agreement = Arc::new(misconfigured(&settings.agreement));
                }
                slot.restart(RemoteIo::new(self.now, settings));
                self.show_field(program);
            }
            Action::Release => self.give(party, Input::Release, observe),
            _ => {
                let waiting = disturb(slot, action);
                for frame in waiting {
                    self.give(party, Input::Frame(&frame), observe);
                }
            }
        }
    }
}

fn misconfigured(agreement: &Agreement) -> Agreement {
    Agreement {
        configuration: ConfigurationHash(!agreement.configuration.0),
        ..agreement.clone()
    }
}

fn disturb<M: Machine>(
    slot: &mut Slot<M>,
    action: Action,
) -> impl IntoIterator<Item = Arc<Frame>> + use<M> {
    match action {
        Action::Crash => slot.crash(),
        Action::Stop => slot.stop(),
        Action::Continue => return slot.go_on(),
        Action::Slow { by } => slot.slow_down(by),
        _ => {}
    }
    Default::default()
}
