//! The exchange of a cycle by the number of controllers: with the token it grows by a hop for each, with turns in parallel it has four hops.

use std::collections::BTreeSet;
use std::time::Duration;

use understudy_cluster::{Overrides, press_cell, read_with_files};
use understudy_cycle::Turns;
use understudy_node::Event;
use understudy_simulator::{Action, Fault, Network, Record, Simulation, parts};
use understudy_wire::{Member, StationId, Time};

/// A blocking receiver on one machine is woken so long after a datagram is sent.
const HOP: Duration = Duration::from_micros(37);
const CYCLES: u64 = 20;
/// In the first cycles the members learn who is there.
const SETTLED_AFTER: u64 = 5;
const PATIENCE_CYCLES: u64 = 200;

fn simulation(controllers: usize, turns: Turns) -> Simulation {
    let mut text = "[cluster]\nname = \"turns\"\nperiod = \"10ms\"\n".to_owned();
    for place in 1..=controllers {
        text += &format!("[[controller]]\nname = \"c{place}\"\nladder = \"press.ladder\"\n");
        text += &format!("[[remote_io]]\ncontroller = \"c{place}\"\n");
    }
    let overrides = Overrides { turns: Some(turns), ..Overrides::default() };
    let cluster = read_with_files(&text, press_cell(), overrides);
    let cluster = cluster.cluster.expect("it has no errors");
    let network = Network { latency: HOP, ..Network::default() };
    Simulation::new(parts(&cluster), network, 1)
}

/// The longest time from the start of a cycle until the last turn was received, in hops.
fn hops(controllers: usize, turns: Turns) -> u128 {
    let mut simulation = simulation(controllers, turns);
    let understudy = Member::Station(StationId(controllers as u8));
    let (mut sampled, mut longest) = (Time::default(), Duration::ZERO);
    simulation
        .run(CYCLES, PATIENCE_CYCLES, &mut |now, cycle, member, record| match record {
            // One hop after the start of the cycle.
            Record::RemoteIo(understudy_remote_io::Event::Sampled { .. }) => sampled = now,
            Record::Station(Event::Published { .. })
                if member == understudy && cycle > Some(SETTLED_AFTER) =>
            {
                longest = longest.max(HOP + now.since(sampled) + HOP);
            }
            _ => {}
        })
        .expect("the cluster is synchronised");
    assert_eq!(simulation.violations(), []);
    longest.as_nanos() / HOP.as_nanos()
}

/// Stations that a remote I/O or a station of higher rank flags while `rank` is down for thirty cycles, and the cycles in which outputs were held.
fn flagged(controllers: usize, turns: Turns, rank: u8) -> (BTreeSet<StationId>, u64) {
    let mut simulation = simulation(controllers, turns);
    for (at_cycle, action) in [(10, Action::Crash), (40, Action::Restart)] {
        let member = Member::Station(StationId(rank));
        simulation.schedule(Fault { at_cycle, phase: 0.3, member, action });
    }
    let mut flagged = BTreeSet::new();
    simulation
        .run(80, PATIENCE_CYCLES, &mut |_, cycle, member, record| match record {
            Record::Station(Event::Flagged { station, .. })
            | Record::RemoteIo(understudy_remote_io::Event::Flagged { station, .. })
                if cycle.is_some() && member > Member::Station(*station) =>
            {
                flagged.insert(*station);
            }
            _ => {}
        })
        .expect("the cluster is synchronised");
    assert_eq!(simulation.violations(), []);
    assert!(simulation.synchronised());
    (flagged, simulation.tallies().iter().map(|tally| tally.held + tally.fail_safe).sum())
}

#[test]
fn the_exchange_grows_with_the_token_and_does_not_with_turns_in_parallel() {
    let found = [4, 8, 16, 32, 64].map(|controllers| {
        (controllers, hops(controllers, Turns::Token), hops(controllers, Turns::Parallel))
    });
    let expected = [(4, 7, 4), (8, 11, 4), (16, 19, 4), (32, 35, 4), (64, 67, 4)];
    assert_eq!(found, expected);
}

/// Most turns of other controllers come to a controller through the understudy only. Without one it learns from the chain who is before it, and flags
/// none of them that lives: it counts on them to start the cycles.
#[test]
fn no_living_station_is_flagged() {
    const CONTROLLERS: usize = 8;
    for turns in [Turns::Token, Turns::Parallel] {
        for rank in 0..=CONTROLLERS as u8 {
            let alone = BTreeSet::from([StationId(rank)]);
            assert_eq!(flagged(CONTROLLERS, turns, rank), (alone, 0), "{turns:?} {rank}");
        }
    }
}
