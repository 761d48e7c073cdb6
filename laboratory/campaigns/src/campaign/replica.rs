//! One replica in virtual time: from a whole cluster to the failure of the system.

use std::cell::RefCell;

use understudy_cluster::Cluster;
use understudy_simulator::{Action, Fault, Network, NotReady, Record, Simulation};
use understudy_wire::{Member, Time};

use super::CampaignPlan;
use super::lives::{Lives, Order, Run};
use super::parts::{Parts, PartsFound};
use super::seen::{Deadlines, Seen, of_station};
use understudy_simulator::parts;

/// Cycles that the cluster gets to come into step.
pub(super) const PATIENCE_CYCLES: u64 = 10_000;

/// Runs replica `number` of `plan`.
pub(super) fn simulated(
    cluster: &Cluster,
    plan: &CampaignPlan,
    number: u64,
) -> Result<(Run, PartsFound), NotReady> {
    let mut series = Parts::new(cluster, plan, number);
    let mut lives = Lives::new(cluster, plan, number);
    let mut simulation = Simulation::new(parts(cluster), Network::default(), lives.draw_seed());
    simulation.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
    let origin = simulation.now();
    lives.begin();
    series.begin(|program| simulation.author(program));
    carry_out(&mut simulation, lives.take_orders());
    carry_out(&mut simulation, series.take_orders());
    let mut deadlines = Deadlines::new(cluster.controllers().len());
    let seen = RefCell::new(Vec::new());
    let mut observe = |now: Time, _: Option<u64>, member: Member, record: Record<'_>| {
        let found = look(now, member, record, &mut deadlines);
        seen.borrow_mut().extend(found.map(|found| (now, found)));
    };
    let mut over = || !seen.borrow().is_empty();
    while simulation.go_on(plan.maximum_cycles, &mut observe, &mut over) {
        for (now, found) in seen.take() {
            if let Some((since, cause)) = series.see(now, &found) {
                let run = lives.end(since, since.0 - origin.0, true);
                let cause = cause.or(run.cause);
                return Ok((Run { cause, ..run }, series.into_found()));
            }
            if let Seen::Lost(since) = found {
                return Ok((lives.end(since, since.0 - origin.0, true), series.into_found()));
            }
            if !(found == Seen::Missed && series.explains(now)) {
                lives.see(now, found);
            }
        }
        carry_out(&mut simulation, lives.take_orders());
        carry_out(&mut simulation, series.take_orders());
    }
    let now = simulation.now();
    Ok((lives.end(now, now.0 - origin.0, false), series.into_found()))
}

pub(super) fn carry_out(simulation: &mut Simulation, orders: Vec<Order>) {
    for order in orders {
        match order {
            Order::Do { member, action, after_cycles } => {
                let at = simulation.cycle_time().unwrap_or(0.0) + after_cycles;
                simulation.schedule(Fault {
                    at_cycle: at as u64,
                    phase: at.fract(),
                    member,
                    action,
                });
            }
            Order::Forget(member) => simulation.forget(member),
        }
    }
}

/// What of a record concerns the campaign.
pub(super) fn look(
    now: Time,
    member: Member,
    record: Record<'_>,
    deadlines: &mut Deadlines,
) -> Option<Seen> {
    match (member, record) {
        (Member::Station(station), Record::Fault(fault)) => match fault.action {
            Action::Crash => Some(Seen::Crashed(station)),
            Action::Restart => Some(Seen::Restarted(station)),
            // A network fails for all members, of which this is the first.
            Action::Unplug { network } if station.0 == 0 => Some(Seen::Network(network, false)),
            Action::Plug { network } if station.0 == 0 => Some(Seen::Network(network, true)),
            _ => None,
        },
        (_, Record::Violation(violation)) => Some(Seen::Violation(violation.to_string())),
        (Member::Station(station), Record::Station(event)) => of_station(station, event),
        (Member::RemoteIo(_) | Member::Twin(_), Record::Fault(fault)) => match fault.action {
            Action::Crash => Some(Seen::Gone(member)),
            Action::Restart => Some(Seen::Back(member)),
            _ => None,
        },
        (_, Record::RemoteIo(event)) => deadlines.look(now, member, event),
        _ => None,
    }
}
