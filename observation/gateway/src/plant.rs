//! Metrics of a plant: its groups and spares. They are taken from the journals of the groups when they are asked for.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use understudy_view::{FollowedPlant, GroupState, PlantOverview, SpareState};

use crate::labels::{OfGroup, OfGroupState, OfSpareGroup, OfSpareState};

/// The metrics of a plant.
#[derive(Debug, Clone)]
pub struct PlantMetrics {
    plant: Arc<Mutex<FollowedPlant>>,
    runs: PathBuf,
}

impl PlantMetrics {
    /// Of the groups of a plant, whose runs processes record below `runs`.
    pub fn new(plant: FollowedPlant, runs: PathBuf) -> Self {
        Self { plant: Arc::new(Mutex::new(plant)), runs }
    }

    /// The metrics in the OpenMetrics text format.
    pub fn exposition(&self) -> String {
        let mut plant = self.plant.lock().unwrap_or_else(PoisonError::into_inner);
        exposition(&plant.look(&self.runs, Instant::now()))
    }
}

fn exposition(plant: &PlantOverview) -> String {
    let survivable: Family<OfGroup, Gauge> = Family::default();
    let group_states: Family<OfGroupState, Gauge> = Family::default();
    let spare_states: Family<OfSpareState, Gauge> = Family::default();
    let serves: Family<OfSpareGroup, Gauge> = Family::default();
    for group in &plant.groups {
        let name = || group.name.clone();
        if let Some(survives) = group.survives {
            survivable.get_or_create(&OfGroup { group: name() }).set(i64::from(survives));
        }
        for state in GroupState::ALL {
            let of_state = OfGroupState { group: name(), state: state.word() };
            group_states.get_or_create(&of_state).set(i64::from(state == group.state));
        }
    }
    for spare in &plant.spares {
        let name = || spare.name.clone();
        for state in SpareState::ALL {
            let of_state = OfSpareState { spare: name(), state: state.word() };
            spare_states.get_or_create(&of_state).set(i64::from(state == spare.state));
        }
        if let Some(group) = spare.group.clone() {
            serves.get_or_create(&OfSpareGroup { spare: name(), group }).set(1);
        }
    }
    let mut all = Registry::with_prefix("understudy_plant");
    let help = "Remaining redundancy of a group: any further failures of stations that would be masked; absent where it is not observed";
    all.register("survivable_failures", help, survivable);
    let help = "1 for the state of the group, 0 for the other states";
    all.register("group_state", help, group_states);
    let help = "1 for the state of the spare, 0 for the other states";
    all.register("spare_state", help, spare_states);
    all.register("spare_serves", "1 for the group in which a spare wakes or serves", serves);
    let mut text = String::new();
    // Writing to memory does not fail.
    let _ = encode(&mut text, &all);
    text
}
