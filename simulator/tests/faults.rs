//! Every kind of fault on its own: what the cell does about it, and that nothing wrong is driven.

mod press_cell;

use std::time::Duration;

use understudy_node::Event;
use understudy_simulator::{Action, Fault, Network, Record, Simulation, Tally};
use understudy_wire::{ConfigurationHash, Mode, Party, ProgramId, StationId};

const ROBOT: Party = Party::Station(StationId(0));
const UNDERSTUDY: Party = Party::Station(StationId(2));
const ROBOT_IO: Party = Party::RemoteIo(ProgramId(0));
const PARTIES: [Party; 5] = [
    ROBOT,
    Party::Station(StationId(1)),
    UNDERSTUDY,
    ROBOT_IO,
    Party::RemoteIo(ProgramId(1)),
];

/// What a run came to.
struct Outcome {
    tallies: Vec<Tally>,
    refused_frames: u64,
    /// Who refused whom, with both hashes.
    refusals: Vec<(Party, Party, ConfigurationHash, ConfigurationHash)>,
}

/// 200 cycles with the given faults, then all is well again: nothing wrong is driven, and protection is back.
fn check(network: Network, faults: &[(u64, f64, Party, Action)]) -> Outcome {
    let mut simulation = Simulation::new(press_cell::parts(Mode::Full, 1), network, 1);
    for &(at_cycle, phase, party, action) in faults {
        simulation.schedule(Fault {
            at_cycle,
            phase,
            party,
            action,
        });
    }
    let mut refusals = Vec::new();
    let mut observe = |_, _, party, record: Record<'_>| {
        let refused = match record {
            Record::Station(Event::Refused {
                party: other,
                theirs,
                ours,
            })
            | Record::RemoteIo(understudy_remote_io::Event::Refused {
                party: other,
                theirs,
                ours,
            }) => Some((party, *other, *theirs, *ours)),
            _ => None,
        };
        refusals.extend(refused);
    };
    simulation
        .run(200, 100, &mut observe)
        .expect("the cluster gets ready");
    let tallies = simulation.tallies().to_vec();
    simulation
        .run(5, 100, &mut observe)
        .expect("protection comes back");
    assert_eq!(simulation.violations().first(), None, "{faults:?}");
    Outcome {
        tallies,
        refused_frames: simulation.refused_frames(),
        refusals,
    }
}

fn quiet(faults: &[(u64, f64, Party, Action)]) -> Outcome {
    check(Network::default(), faults)
}

fn untrue(outcome: &Outcome) -> u64 {
    let tallies = outcome.tallies.iter();
    tallies.map(|tally| tally.held + tally.fail_safe).sum()
}

#[test]
fn a_corrupted_frame_is_refused_and_its_copy_serves() {
    for party in PARTIES {
        let outcome = quiet(&[(50, 0.0, party, Action::Corrupt { frames: 1 })]);
        assert_eq!(outcome.refused_frames, 1, "{party:?}");
        assert_eq!(untrue(&outcome), 0, "{party:?}");
    }
}

#[test]
fn a_network_that_corrupts_is_as_one_that_loses() {
    let network = Network {
        corruption: 0.05,
        ..Network::default()
    };
    assert!(check(network, &[]).refused_frames > 0);
}

/// Old frames of everybody, at every tenth of a cycle, from within the cycle back to the start of the run.
#[test]
fn a_replayed_frame_is_harmless() {
    for party in PARTIES {
        for age in [1, 2, 3, 5, 20, 150] {
            let replays: Vec<_> = (0..10)
                .map(|tenth| {
                    let phase = f64::from(tenth) / 10.0;
                    (60 + tenth as u64, phase, party, Action::Replay { age })
                })
                .collect();
            assert_eq!(untrue(&quiet(&replays)), 0, "{party:?}, {age} frames ago");
        }
    }
}

/// While a party is down, others hear what it said before, as if it lived.
#[test]
fn a_replayed_frame_does_not_stand_in_for_the_dead() {
    for party in PARTIES {
        for age in [1, 2, 3, 5, 20, 150] {
            let mut faults = vec![(50, 0.3, party, Action::Crash)];
            faults.extend((0..40).map(|cycle| {
                let phase = cycle as f64 * 0.37 % 1.0;
                (51 + cycle, phase, party, Action::Replay { age })
            }));
            faults.push((91, 0.3, party, Action::Restart));
            faults.extend((0..10).map(|cycle| {
                let phase = cycle as f64 * 0.37 % 1.0;
                (91 + cycle, phase, party, Action::Replay { age })
            }));
            quiet(&faults);
        }
    }
}

/// Each of its neighbours names it once, with both hashes; its program is carried by the understudy.
#[test]
fn a_misconfigured_station_is_refused_with_both_hashes() {
    let outcome = quiet(&[
        (50, 0.0, ROBOT, Action::Crash),
        (60, 0.0, ROBOT, Action::RestartMisconfigured),
        (150, 0.0, ROBOT, Action::Restart),
    ]);
    assert_eq!(untrue(&outcome), 0);
    let (right, wrong) = (ConfigurationHash(2), ConfigurationHash(!2));
    let mut named: Vec<_> = PARTIES[1..]
        .iter()
        .flat_map(|&other| [(other, ROBOT, wrong, right), (ROBOT, other, right, wrong)])
        .collect();
    named.sort_unstable();
    let mut refusals = outcome.refusals;
    refusals.sort_unstable();
    assert_eq!(refusals, named);
}

/// Up to a slot and far beyond it: a slow station is late, then silent, and never wrong.
#[test]
fn a_slow_station_is_late_and_then_silent() {
    for party in PARTIES {
        for tenths_of_a_millisecond in [1, 5, 10, 30, 60, 100, 250, 1000] {
            let by = Duration::from_micros(tenths_of_a_millisecond * 100);
            let outcome = quiet(&[
                (50, 0.0, party, Action::Slow { by }),
                (150, 0.0, party, Action::Slow { by: Duration::ZERO }),
            ]);
            if matches!(party, Party::Station(_)) {
                assert_eq!(untrue(&outcome), 0, "{party:?} slow by {by:?}");
            }
        }
    }
}

/// A station that is started again and again before it is in step costs nothing but its own protection.
#[test]
fn a_restart_storm_costs_no_cycle() {
    for party in [ROBOT, UNDERSTUDY] {
        for every in [1, 2, 3, 5, 8] {
            let storm: Vec<_> = (0..100 / every)
                .flat_map(|restart| {
                    let cycle = 50 + restart * every;
                    [
                        (cycle, 0.2, party, Action::Crash),
                        (cycle, 0.6, party, Action::Restart),
                    ]
                })
                .collect();
            assert_eq!(untrue(&quiet(&storm)), 0, "{party:?} every {every} cycles");
        }
    }
}
