//! Random faults over all parties: whatever happens, nothing wrong is driven, and protection comes back.

mod press_cell;

use std::time::Duration;

use proptest::prelude::*;
use understudy_simulator::{Action, Fault, Network, Simulation};
use understudy_wire::{Mode, Party, ProgramId, StationId};

/// Something is taken away from a party, and given back later.
#[derive(Debug, Clone)]
struct Outage {
    party: Party,
    stops: bool,
    at_cycle: u64,
    phase: f64,
    cycles: u64,
}

fn outage() -> impl Strategy<Value = Outage> {
    let party = prop_oneof![
        4 => (0..4_u8).prop_map(|rank| Party::Station(StationId(rank))),
        1 => (0..2_u8).prop_map(|program| Party::RemoteIo(ProgramId(program))),
    ];
    let cycles = prop_oneof![0..3_u64, 3..40_u64];
    (party, any::<bool>(), 0..150_u64, 0.0..1.0_f64, cycles).prop_map(
        |(party, stops, at_cycle, phase, cycles)| Outage {
            party,
            stops,
            at_cycle,
            phase,
            cycles,
        },
    )
}

fn network() -> impl Strategy<Value = Network> {
    let share = prop_oneof![2 => Just(0.0), 1 => 0.0..0.2_f64];
    (share.clone(), share, 0..3000_u64).prop_map(|(loss, duplicate, jitter)| Network {
        loss,
        duplicate,
        jitter: Duration::from_micros(jitter),
        ..Network::default()
    })
}

fn check(mode: Mode, understudies: usize, outages: &[Outage], network: Network, seed: u64) {
    let mut simulation = Simulation::new(press_cell::parts(mode, understudies), network, seed);
    for outage in outages {
        let (taken, given) = if outage.stops {
            (Action::Stop, Action::Continue)
        } else {
            (Action::Crash, Action::Restart)
        };
        for (action, at_cycle) in [
            (taken, outage.at_cycle),
            (given, outage.at_cycle + outage.cycles),
        ] {
            simulation.schedule(Fault {
                at_cycle,
                phase: outage.phase,
                party: outage.party,
                action,
            });
        }
    }
    simulation
        .run(200, 2000, &mut |_, _, _, _| {})
        .expect("the cluster gets ready");
    assert_eq!(simulation.violations().first(), None);
    // All are back by now: everybody comes into step again without help.
    simulation
        .run(10, 2000, &mut |_, _, _, _| {})
        .expect("protection comes back");
    assert_eq!(simulation.violations().first(), None);
}

/// A longer campaign is asked for with `PROPTEST_CASES`.
fn cases() -> u32 {
    let asked = std::env::var("PROPTEST_CASES").ok();
    asked.and_then(|cases| cases.parse().ok()).unwrap_or(300)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nothing_wrong_is_driven(
        outages in prop::collection::vec(outage(), 0..6),
        network in network(),
        understudies in 0..3_usize,
        paper in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let mode = if paper { Mode::Paper } else { Mode::Full };
        check(mode, understudies, &outages, network, seed);
    }
}
