//! What an account and the two worlds need of a cluster.

use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_journal::{Members, Present};
use understudy_simulator::Referee;
pub use understudy_simulator::parts;
use understudy_wire::{ProgramId, ProgramSet};

use crate::account::Terms;
use crate::figure::Signals;

impl Terms {
    /// Of a cluster.
    pub fn of(cluster: &Cluster) -> Self {
        let programs = (0..cluster.controllers().len()).map(|index| ProgramId(index as u8));
        let referees = programs.filter_map(|program| {
            let settings = cluster.remote_io_settings(program)?;
            let scan = cluster.programs()[program.index()].executable.clone();
            Some(Referee::new(&settings, scan))
        });
        let signals = cluster.controllers().iter().enumerate();
        let signals = signals.map(|(index, controller)| Signals {
            positions: cluster
                .plant_settings(ProgramId(index as u8))
                .map(|settings| settings.plant.position_names().to_vec())
                .unwrap_or_default(),
            sourced: !cluster.remote_ios()[index].inputs.is_empty(),
            inputs: controller.interface.inputs.bit_names(),
            outputs: controller.interface.outputs.bit_names(),
            input_points: controller.interface.inputs.clone(),
            output_points: vec![(0, controller.interface.outputs.clone())],
        });
        let mut plants = ProgramSet::default();
        for (program, plant) in cluster.plants().iter().enumerate() {
            if plant.is_some() {
                plants.insert(ProgramId(program as u8));
            }
        }
        Self {
            members: Members::of(cluster),
            agreement: cluster.agreement().clone(),
            referees: referees.collect(),
            signals: signals.collect(),
            alarms: Arc::clone(cluster.alarms()),
            plants,
            present: Present::of(Arc::new(cluster.clone())),
        }
    }
}
