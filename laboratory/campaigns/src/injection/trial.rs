//! One run with one faultload, from a cluster that is already synchronised.
//!
//! Coming into step on a quiet network draws no random number. So a copy of a cluster synchronised, given the run's seed, goes on
//! exactly as a run that started from nothing with that seed: a scenario file repeats what the campaign saw.

use std::cell::RefCell;

use understudy_cluster::Cluster;
use understudy_simulator::{Network, NotReady, Simulation, SpareTimes, Tally, parts};
use understudy_wire::Member;

use super::faultload::Faultload;
use super::property::Property;

/// Cycles that the cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 10_000;

/// The first cycle in which a fault may strike, so that the frames that a replay repeats are of the run.
pub(super) const FIRST_CYCLE: u64 = 20;

/// A cluster synchronised, ready to be copied.
#[derive(Clone)]
pub(super) struct Bench {
    synchronised: Simulation,
}

/// How a run violated its property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Symptom {
    /// The first cycle in which it did.
    pub(super) cycle: u64,
    /// At which member; none of all of them.
    pub(super) member: Option<Member>,
    /// In words.
    pub(super) what: String,
}

/// What one run came to.
pub(super) struct Outcome {
    pub(super) symptom: Option<Symptom>,
    pub(super) tallies: Vec<Tally>,
}

impl Bench {
    pub(super) fn new(cluster: &Cluster, spare_after: Option<u32>) -> Result<Self, NotReady> {
        let mut synchronised = Simulation::new(parts(cluster), Network::default(), 0);
        if let Some(spare_after) = spare_after {
            synchronised.with_spares(SpareTimes { spare_after, retire_after: spare_after });
        }
        synchronised.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
        Ok(Self { synchronised })
    }

    /// `cycles` cycles under `faultload`, with all chance in the network from `seed`.
    pub(super) fn run(
        &self,
        faultload: &Faultload,
        cycles: u64,
        seed: u64,
        property: Property,
    ) -> Outcome {
        let mut simulation = self.synchronised.clone();
        simulation.reseed(seed);
        if let Some(disturbance) = &faultload.network {
            simulation.disturb(disturbance.clone());
        }
        for fault in faultload.steps() {
            if fault.at_cycle < cycles {
                simulation.schedule(fault);
            }
        }
        let first: RefCell<Option<Symptom>> = RefCell::new(None);
        simulation.go_on(
            cycles,
            &mut |_, cycle, member, record| {
                let mut first = first.borrow_mut();
                if first.is_none()
                    && let Some(what) = property.violated_by(&record)
                {
                    *first =
                        Some(Symptom { cycle: cycle.unwrap_or(0), member: Some(member), what });
                }
            },
            &mut || false,
        );
        let mut symptom = first.into_inner();
        if property == Property::Unprotected && !simulation.synchronised() {
            symptom = Some(Symptom {
                cycle: cycles.saturating_sub(1),
                member: None,
                what: "not everybody is synchronised again".to_owned(),
            });
        }
        Outcome { symptom, tallies: simulation.tallies().to_vec() }
    }
}
