//! Members are killed and repaired, and the plants go on.

mod press_cell;

use understudy_cycle::Mode;
use understudy_simulator::{Action, Fault, Network, Simulation, Tally};
use understudy_wire::{Member, ProgramId, StationId};

fn fault(at_cycle: u64, phase: f64, rank: u8, action: Action) -> Fault {
    Fault { at_cycle, phase, member: Member::Station(StationId(rank)), action }
}

/// Runs the cell under `faults` for `cycles`; nothing wrong may be driven. Answers with what each remote I/O did.
fn run(mode: Mode, understudies: usize, faults: &[Fault], cycles: u64) -> (Vec<Tally>, u64) {
    let mut simulation =
        Simulation::new(press_cell::parts(mode, understudies), Network::default(), 1);
    for fault in faults {
        simulation.schedule(*fault);
    }
    simulation.run(cycles, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    let finished = simulation.field(ProgramId(1)).map_or(0, |field| field.finished);
    (simulation.tallies().to_vec(), finished)
}

/// One station at a time, at every tenth of a cycle: no cycle is held.
#[test]
fn no_cycle_is_held_for_one_killed_station() {
    for rank in 0..3 {
        for tenth in 0..10 {
            let phase = f64::from(tenth) / 10.0;
            let faults =
                [fault(100, phase, rank, Action::Crash), fault(227, phase, rank, Action::Restart)];
            let (tallies, _) = run(Mode::Full, 1, &faults, 300);
            for tally in &tallies {
                assert_eq!(
                    (tally.held, tally.fail_safe),
                    (0, 0),
                    "rank {rank}, phase {phase}: {tallies:?}"
                );
            }
            if rank < 2 {
                let restored = tallies[usize::from(rank)].reconstructed;
                assert!((120..=135).contains(&restored), "rank {rank}, phase {phase}: {tallies:?}");
            }
        }
    }
}

/// Table II.
#[test]
fn the_plants_stay_functional_through_table_two() {
    let faults = [
        fault(200, 0.0, 0, Action::Crash),
        fault(327, 0.0, 0, Action::Restart),
        fault(400, 0.0, 1, Action::Crash),
        fault(527, 0.0, 1, Action::Restart),
        fault(600, 0.0, 2, Action::Crash),
        fault(727, 0.0, 2, Action::Restart),
    ];
    let (tallies, finished) = run(Mode::Full, 1, &faults, 1000);
    let (quiet, finished_quiet) = run(Mode::Full, 1, &[], 1000);
    for tally in tallies.iter().chain(&quiet) {
        assert_eq!((tally.held, tally.fail_safe), (0, 0), "{tallies:?}");
    }
    assert_eq!(finished, finished_quiet);
    assert!(finished >= 19, "{finished}");
}
