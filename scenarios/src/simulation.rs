//! A scenario in virtual time: the same account as in the laboratory, from a seed.

use std::cell::Cell;

use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record, RunEvent};
use understudy_plant::{Event as PlantEvent, Pace};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::{Network, NotReady, Record as Simulated, Simulation};
use understudy_wire::{Field, Image, Member, Moment, Time};

use crate::account::{Account, OriginRule, Terms};
use crate::scenario::Scenario;
use crate::terms::parts;

/// Cycles that the cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 10_000;

/// The cluster did not come into step in virtual time.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotInStep(#[from] NotReady);

/// Runs `scenario` from `seed`; every record goes to `journal` as it is made.
///
/// # Errors
/// [`NotInStep`] where the cluster never comes into step; the account holds what happened until then.
pub fn simulate(
    cluster: &Cluster,
    scenario: &Scenario,
    seed: u64,
    journal: &mut dyn FnMut(&Record),
) -> Result<Account, NotInStep> {
    let terms = Terms::of(cluster);
    let members = terms.members.clone();
    let mut account = Account::new(terms, scenario, OriginRule::Told);
    let mut simulation = Simulation::new(parts(cluster), Network::default(), seed);
    if let Some(disturbance) = scenario.disturbance() {
        simulation.disturb(disturbance);
    }
    if let Some(times) = scenario.spare_times() {
        simulation.with_spares(times);
    }
    for fault in &scenario.steps {
        simulation.schedule(*fault);
    }
    // What a plant shows is told just before the deadline that drives it is.
    let mut fields: Vec<Option<(Image, Field)>> = vec![None; cluster.controllers().len()];
    let told = Cell::new(None);
    let mut take = |record: &Record, origin: Option<(Moment, u64)>| {
        journal(record);
        account.observe(record);
        told.set(account.cycle());
        if let Some((moment, cycle)) = origin
            && account.origin_is(moment, cycle)
        {
            let origin = RunEvent::Origin { moment, cycle };
            let record = Record::of_run(record.at_ns, origin);
            journal(&record);
            account.observe(&record);
        }
    };
    let mut observe = |now: Time, cycle: Option<u64>, member: Member, record: Simulated<'_>| {
        let happening = match record {
            Simulated::Station(event) => Happening::Station(event.clone()),
            Simulated::RemoteIo(event) => Happening::RemoteIo(event.clone()),
            Simulated::Fault(fault) => Happening::Run(RunEvent::Fault {
                action: fault.action,
                member,
                asked: fault.at_cycle,
            }),
            Simulated::Plant(outputs, field) => {
                if let Member::Plant(program) = member {
                    fields[program.index()] = Some((outputs.clone(), field.clone()));
                }
                return;
            }
            // The account has referees of its own.
            Simulated::Violation(_) => return,
        };
        let applied = applied(&happening);
        let record = match happening {
            Happening::Run(event) => Record::of_run(now.0, event),
            happening => Record::of_member(now.0, member, &members, happening),
        };
        take(&record, applied.zip(cycle));
        let (Some(moment), Some(program)) = (applied, member.sampled_program()) else {
            return;
        };
        if let Some((outputs, field)) = fields[program.index()].take() {
            let event = Happening::Plant(PlantEvent::Stepped {
                moment,
                pace: Pace::Driven,
                outputs,
                field,
            });
            let plant = Member::Plant(program);
            take(&Record::of_member(now.0, plant, &members, event), None);
        }
    };
    simulation.run(scenario.cycles, PATIENCE_CYCLES, &mut observe)?;
    // Cycles in which no remote I/O runs are not counted.
    if told.get().is_none_or(|cycle| cycle + 1 < scenario.cycles) {
        let most = scenario.cycles.saturating_mul(2).saturating_add(PATIENCE_CYCLES);
        simulation.go_on(most, &mut observe, &mut || {
            told.get().is_some_and(|cycle| cycle >= scenario.cycles)
        });
    }
    Ok(account)
}

/// The moment of a deadline that a remote I/O has passed with outputs.
fn applied(happening: &Happening) -> Option<Moment> {
    match happening {
        Happening::RemoteIo(RemoteIoEvent::Applied { moment, .. }) => Some(*moment),
        _ => None,
    }
}
