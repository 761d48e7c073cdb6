//! Two networks, of which one misbehaves for long, and one network that doubles and reorders every frame: every output is driven directly.
//!
//! Half a minute of the cell by default, and an hour in a release build:
//! `UNDERSTUDY_NETWORK_CYCLES=360000 cargo test --release -p understudy-simulator --test networks`.

mod press_cell;

use std::time::Duration;

use understudy_cycle::Mode;
use understudy_simulator::{Action, Fault, Network, Record, Simulation, Tally};
use understudy_wire::{Member, Time, Via};

/// Cycles from one change of a flapping network to the next: 50 ms.
const FLAP_CYCLES: u64 = 5;

/// Cycles until every member is synchronised, at most.
const PATIENCE: u64 = 200;

fn cycles() -> u64 {
    let cycles = std::env::var("UNDERSTUDY_NETWORK_CYCLES");
    cycles.map_or(3_000, |cycles| cycles.parse().expect("a number of cycles"))
}

fn cell(has_two_networks: bool, network: Network) -> Simulation {
    let mut parts = press_cell::parts(Mode::Full, 1);
    parts.has_two_networks = has_two_networks;
    Simulation::new(parts, network, 1)
}

fn nothing_seen(_: Time, _: Option<u64>, _: Member, _: Record<'_>) {}

/// All outputs of `cycles` were driven directly.
fn assert_all_direct(simulation: &Simulation, cycles: u64, what: &str) {
    assert_eq!(simulation.violations(), [], "{what}");
    for tally in simulation.tallies() {
        let expected = Tally { direct: tally.direct, ..Tally::default() };
        assert_eq!(*tally, expected, "{what}");
        assert!(tally.direct >= cycles, "{what}: {tally:?}");
    }
}

/// Either of two networks is so for the whole run, from before the members are synchronised.
#[test]
fn one_of_two_networks_that_loses_or_delays_frames_costs_no_cycle() {
    let late = Network { latency: press_cell::PERIOD * 5, ..Network::default() };
    let lossy = Network { loss: 0.3, ..Network::default() };
    let both = Network {
        latency: press_cell::PERIOD * 5,
        jitter: press_cell::PERIOD * 5,
        loss: 0.3,
        ..late
    };
    for (network, what) in [(late, "late"), (lossy, "lossy"), (both, "late and lossy")] {
        for over in Via::NETWORKS {
            let mut simulation = cell(true, Network { over: Some(over), ..network });
            simulation.run(cycles(), PATIENCE, &mut nothing_seen).expect("synchronised");
            assert_all_direct(&simulation, cycles(), what);
        }
    }
}

/// A network is down for the whole run, or goes down and comes back every 50 ms.
#[test]
fn one_of_two_networks_that_is_down_or_flaps_costs_no_cycle() {
    for (flaps, network) in
        [false, true].into_iter().flat_map(|it| Via::NETWORKS.map(|via| (it, via)))
    {
        let mut simulation = cell(true, Network::default());
        simulation.run(0, PATIENCE, &mut nothing_seen).expect("synchronised");
        let (down, up) = (Action::Unplug { network }, Action::Plug { network });
        for change in 0..cycles() / FLAP_CYCLES {
            let action = if flaps && change % 2 == 1 { up } else { down };
            let (at_cycle, phase) = (change * FLAP_CYCLES, (change % 10) as f64 / 10.0);
            if flaps || change == 0 {
                for member in press_cell::MEMBERS {
                    simulation.schedule(Fault { at_cycle, phase, member, action });
                }
            }
            simulation.go_to(at_cycle + FLAP_CYCLES, 0.0, &mut nothing_seen);
        }
        let what = if flaps { "flapping" } else { "down" };
        assert_all_direct(&simulation, cycles() - FLAP_CYCLES, what);
    }
}

/// One network doubles every frame, and frames overtake each other.
#[test]
fn a_network_that_doubles_and_reorders_every_frame_costs_no_cycle() {
    let network =
        Network { duplicate: 1.0, jitter: Duration::from_micros(500), ..Network::default() };
    let mut simulation = cell(false, network);
    simulation.run(cycles(), PATIENCE, &mut nothing_seen).expect("synchronised");
    assert_all_direct(&simulation, cycles(), "doubled and reordered");
}
