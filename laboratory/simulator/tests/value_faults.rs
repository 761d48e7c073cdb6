//! Value faults: every bit of x, u and y, in every station.
//!
//! With one understudy a fault is seen, both who can be wrong are named, and the configured answer is taken. With two it is
//! located, masked, and the station is excluded until the operator releases it. With none nobody can see it.

mod press_cell;

use understudy_cycle::Mode;
use understudy_remote_io::{Event, ValueFault};
use understudy_simulator::{Action, Fault, Network, Record, Simulation, Tally, Violation};
use understudy_wire::{Member, ProgramId, StationId, StationSet};

const AT: u64 = 20;
const CYCLES: u64 = 60;

/// What a run came to.
struct Outcome {
    simulation: Simulation,
    tallies: Vec<Tally>,
    violations: Vec<Violation>,
    /// By whom, at which cycle, who, and whether it was located.
    accusations: Vec<(ProgramId, u64, StationSet, bool)>,
}

fn run(understudies: usize, answer: ValueFault, faults: &[(u64, f64, Member, Action)]) -> Outcome {
    let mut parts = press_cell::parts(Mode::Full, understudies);
    for settings in &mut parts.remote_ios {
        settings.fallback.value_fault = answer;
    }
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    for &(at_cycle, phase, member, action) in faults {
        simulation.schedule(Fault { at_cycle, phase, member, action });
    }
    let mut accusations = Vec::new();
    let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| {
        if let Record::RemoteIo(Event::ValueFault { accused, located, .. }) = record
            && let Member::RemoteIo(program) = member
        {
            accusations.push((program, cycle.unwrap_or(0), *accused, *located));
        }
    };
    simulation.run(CYCLES, 100, &mut observe).expect("the cluster gets ready");
    Outcome {
        tallies: simulation.tallies().to_vec(),
        violations: simulation.violations().to_vec(),
        simulation,
        accusations,
    }
}

fn station(rank: usize) -> Member {
    Member::Station(StationId(rank as u8))
}

fn untrue(tally: &Tally) -> u64 {
    tally.held + tally.fail_safe
}

fn both(one: usize, other: usize) -> StationSet {
    [one, other].map(|rank| StationId(rank as u8)).into_iter().collect()
}

/// Every bit of x(i), in the controller and in each understudy: program, station, and the fault.
fn state_flips(understudies: usize) -> impl Iterator<Item = (usize, usize, Action)> {
    let parts = press_cell::parts(Mode::Full, understudies);
    let widths = parts.stations[0].programs.iter().map(|it| it.executable.state_count());
    let widths: Vec<usize> = widths.collect();
    (0..2).flat_map(move |program| {
        let holders = [program].into_iter().chain(2..2 + understudies);
        let bits = 0..widths[program] as u16;
        holders.flat_map(move |rank| {
            bits.clone().map(move |bit| {
                let id = ProgramId(program as u8);
                (program, rank, Action::FlipState { program: id, bit })
            })
        })
    })
}

/// Whether the fault went out by itself before anybody said an output of that state.
fn unseen(outcome: &Outcome) -> bool {
    outcome.accusations.is_empty() && outcome.tallies.iter().all(|tally| untrue(tally) == 0)
}

#[test]
fn one_understudy_sees_a_flipped_state_and_holds() {
    for (program, rank, action) in state_flips(1) {
        // The operator restarts the controller or the understudy, whichever is wrong, and releases the outputs.
        let remote_io = Member::RemoteIo(ProgramId(program as u8));
        let outcome = run(
            1,
            ValueFault::Hold,
            &[
                (AT, 0.8, station(rank), action),
                (AT + 10, 0.1, station(rank), Action::Crash),
                (AT + 10, 0.2, station(rank), Action::Restart),
                (AT + 30, 0.2, remote_io, Action::Release),
            ],
        );
        let what = format!("{action:?} in station {rank}");
        assert_eq!(outcome.violations, [], "{what}");
        let accused = (ProgramId(program as u8), AT + 1, both(program, 2), false);
        assert_eq!(outcome.accusations, [accused], "{what}");
        assert!(untrue(&outcome.tallies[program]) > 0, "{what}");
        assert_eq!(untrue(&outcome.tallies[1 - program]), 0, "{what}");
        let mut simulation = outcome.simulation;
        let back = simulation.run(1, 20, &mut |_, _, _, _| {});
        assert_eq!(back, Ok(()), "{what}");
        assert_eq!(simulation.violations(), [], "{what}");
    }
}

/// The controller's own outputs are driven: right where the understudy is wrong.
#[test]
fn an_alarm_stops_nothing() {
    for (program, rank, action) in state_flips(1) {
        let outcome = run(1, ValueFault::Alarm, &[(AT, 0.8, station(rank), action)]);
        let accused = (ProgramId(program as u8), AT + 1, both(program, 2), false);
        assert_eq!(outcome.accusations, [accused]);
        assert!(outcome.tallies.iter().all(|tally| untrue(tally) == 0));
        if rank == 2 {
            assert_eq!(outcome.violations, []);
        }
    }
}

#[test]
fn fail_safe_is_at_once_and_until_the_operator_releases_it() {
    let action = Action::FlipWord { bit: 0, frames: 2 };
    for rank in 0..2 {
        let remote_io = Member::RemoteIo(ProgramId(rank as u8));
        let outcome = run(
            1,
            ValueFault::FailSafe,
            &[(AT, 0.0, station(rank), action), (AT + 10, 0.0, remote_io, Action::Release)],
        );
        assert_eq!(outcome.violations, []);
        let tally = &outcome.tallies[rank];
        assert_eq!((tally.held, tally.fail_safe), (0, 10), "station {rank}");
    }
}

/// A word that differs in one cycle only holds that cycle only.
#[test]
fn one_understudy_sees_a_flipped_word() {
    for rank in 0..3 {
        for bit in 0..8 {
            let action = Action::FlipWord { bit, frames: 2 };
            let outcome = run(1, ValueFault::Hold, &[(AT, 0.0, station(rank), action)]);
            assert_eq!(outcome.violations, [], "bit {bit} of station {rank}");
            for (program, tally) in outcome.tallies.iter().enumerate() {
                let touched = rank == 2 || rank == program;
                assert!(untrue(tally) <= u64::from(touched), "{rank} {bit} {tally:?}");
            }
            assert!(!outcome.accusations.is_empty(), "bit {bit} of station {rank}");
        }
    }
}

#[test]
fn two_understudies_locate_a_flipped_state_and_exclude_its_station() {
    for (program, rank, action) in state_flips(2) {
        let outcome = run(2, ValueFault::Hold, &[(AT, 0.8, station(rank), action)]);
        let what = format!("{action:?} in station {rank}");
        assert_eq!(outcome.violations, [], "{what}");
        let wrong = StationSet::only(StationId(rank as u8));
        let accused = (ProgramId(program as u8), AT + 1, wrong, true);
        assert_eq!(outcome.accusations, [accused], "{what}");
        assert!(outcome.tallies.iter().all(|tally| untrue(tally) == 0), "{what}");
        if rank < 2 {
            assert!(outcome.tallies[program].reconstructed > CYCLES - AT - 5, "{what}");
        }
        let mut simulation = outcome.simulation;
        if rank < 2 {
            let excluded = simulation.run(1, 50, &mut |_, _, _, _| {});
            assert!(excluded.is_err(), "{what}: nobody has released it");
        }
        simulation.schedule(Fault {
            at_cycle: 0,
            phase: 0.0,
            member: Member::RemoteIo(ProgramId(program as u8)),
            action: Action::Release,
        });
        let back = simulation.run(1, 20, &mut |_, _, _, _| {});
        assert_eq!(back, Ok(()), "{what}");
        assert_eq!(simulation.violations(), [], "{what}");
    }
}

/// The stations recall for a remote I/O that restarts whom it had excluded.
#[test]
fn who_is_excluded_stays_so_when_the_remote_io_restarts() {
    for (program, rank, action) in state_flips(2) {
        let remote_io = Member::RemoteIo(ProgramId(program as u8));
        let outcome = run(
            2,
            ValueFault::Hold,
            &[
                (AT, 0.8, station(rank), action),
                (AT + 10, 0.3, remote_io, Action::Crash),
                (AT + 12, 0.3, remote_io, Action::Restart),
            ],
        );
        let what = format!("{action:?} in station {rank}");
        assert_eq!(outcome.violations, [], "{what}");
        let wrong = StationSet::only(StationId(rank as u8));
        let accused = (ProgramId(program as u8), AT + 1, wrong, true);
        assert_eq!(outcome.accusations, [accused], "{what}");
        let mut simulation = outcome.simulation;
        let readmitted = |simulation: &mut Simulation, cycles| {
            let mut count = 0;
            let synchronised = simulation.run(1, cycles, &mut |_, _, _, record| {
                let is_back =
                    matches!(record, Record::Station(understudy_node::Event::Readmitted { .. }));
                count += u64::from(is_back);
            });
            (synchronised.is_ok(), count, simulation.violations().len())
        };
        // Nobody waits for an understudy that is excluded.
        assert_eq!(readmitted(&mut simulation, 50), (rank >= 2, 0, 0), "{what}");
        simulation.schedule(Fault {
            at_cycle: 0,
            phase: 0.0,
            member: remote_io,
            action: Action::Release,
        });
        assert_eq!(readmitted(&mut simulation, 20), (true, 1, 0), "{what}");
    }
}

#[test]
fn two_understudies_mask_a_flipped_word() {
    for rank in 0..4 {
        for bit in 0..8 {
            let action = Action::FlipWord { bit, frames: 2 };
            let outcome = run(2, ValueFault::Hold, &[(AT, 0.0, station(rank), action)]);
            assert_eq!(outcome.violations, [], "bit {bit} of station {rank}");
            assert!(outcome.tallies.iter().all(|tally| untrue(tally) == 0));
            let wrong = StationSet::only(StationId(rank as u8));
            assert!(!outcome.accusations.is_empty());
            for (_, _, accused, located) in &outcome.accusations {
                assert_eq!((*accused, *located), (wrong, true), "bit {bit} of station {rank}");
            }
        }
    }
}

/// A sample says the lineage that it leads to, so one that was changed is as one that was lost.
#[test]
fn a_flipped_sample_is_a_lost_one() {
    for understudies in 0..3 {
        for member in [0, 1, 2, 3]
            .map(station)
            .into_iter()
            .chain([0, 1].map(|program| Member::RemoteIo(ProgramId(program))))
        {
            if matches!(member, Member::Station(id) if id.index() >= 2 + understudies) {
                continue;
            }
            for bit in 0..10 {
                for frames in [1, 2, 7, 40] {
                    let action = Action::FlipSample { bit, frames };
                    let outcome = run(understudies, ValueFault::Hold, &[(AT, 0.0, member, action)]);
                    assert_eq!(outcome.violations, [], "{member:?} {action:?}");
                    assert_eq!(outcome.accusations, [], "{member:?} {action:?}");
                    let held: u64 = outcome.tallies.iter().map(untrue).sum();
                    let masked = understudies > 0 && matches!(member, Member::Station(_));
                    // A copy serves where one frame was changed.
                    let most = if masked { 0 } else { u64::from(frames) / 2 };
                    assert!(held <= most, "{member:?} {action:?} {held}");
                    let mut simulation = outcome.simulation;
                    let back = simulation.run(1, 20, &mut |_, _, _, _| {});
                    assert_eq!(back, Ok(()), "{member:?} {action:?}");
                }
            }
        }
    }
}

/// A cluster without an understudy computes each output once: there is nothing to compare.
#[test]
fn nobody_sees_a_value_fault_alone() {
    for (_, rank, action) in state_flips(0) {
        let outcome = run(0, ValueFault::Hold, &[(AT, 0.8, station(rank), action)]);
        assert!(unseen(&outcome));
    }
}
