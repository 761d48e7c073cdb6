//! Clusters whose cycle and epoch numbers are close to their end.

mod press_cell;

use understudy_cycle::{Mode, Turns};
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, Tally};
use understudy_wire::{Cycle, Epoch, Member, Moment, ProgramId, StationId};

/// Cycles until all members are synchronised, at most.
const READY_CYCLES: u64 = 100;

fn moment(epoch: u64, cycle: u64) -> Moment {
    Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) }
}

fn parts(founds: Moment, understudies: usize, turns: Turns) -> Parts {
    let mut parts = press_cell::parts(Mode::Full, understudies);
    for station in &mut parts.stations {
        station.founds = founds;
    }
    press_cell::take_turns(&mut parts, turns);
    parts
}

/// A run in which nothing wrong may be applied: what was applied, and the moments of the first remote I/O's outputs.
fn run(parts: Parts, faults: &[Fault], cycles: u64) -> (Vec<Tally>, Vec<Moment>) {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    faults.iter().for_each(|&fault| simulation.schedule(fault));
    let mut moments = Vec::new();
    let ready = simulation.run(cycles, READY_CYCLES, &mut |_, _, member, record| {
        if let (Member::RemoteIo(ProgramId(0)), Record::RemoteIo(Event::Applied { moment, .. })) =
            (member, record)
            && moment.epoch > Epoch(0)
        {
            moments.push(*moment);
        }
    });
    ready.expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    (simulation.tallies().to_vec(), moments)
}

fn crash(at_cycle: u64, rank: u8, action: Action) -> Fault {
    Fault { at_cycle, phase: 0.4, member: Member::Station(StationId(rank)), action }
}

/// The next epoch follows the last cycle of one: no cycle is held, also where one station is down or restarts in the cycles around it.
#[test]
fn an_epoch_follows_the_last_cycle() {
    for turns in [Turns::Token, Turns::Parallel] {
        for rank in 0..4 {
            for down in [20_u64, 48, 50, 52, 70] {
                let faults =
                    [crash(down, rank, Action::Crash), crash(down + 30, rank, Action::Restart)];
                let faults = if rank == 3 { &[][..] } else { &faults[..] };
                let first = moment(1 << 60, u64::MAX - 60);
                let (tallies, moments) = run(parts(first, 1, turns), faults, 200);
                for tally in &tallies {
                    assert_eq!(
                        (tally.held, tally.fail_safe),
                        (0, 0),
                        "{turns:?} {rank} {down}: {tallies:?}"
                    );
                }
                let crossed = moments.windows(2).filter(|pair| pair[0].epoch < pair[1].epoch);
                let crossed: Vec<&[Moment]> = crossed.collect();
                let [[last, next]] = crossed[..] else {
                    panic!("{turns:?} {rank} {down}: {crossed:?}");
                };
                assert_eq!((last.cycle, *next), (Cycle(u64::MAX), last.plus(1)));
                assert!(moments.is_sorted());
            }
        }
    }
}

/// Epochs close to their end: a cluster whose stations all restart founds later ones for as long as there are any.
#[test]
fn the_last_epochs_are_founded() {
    let faults: Vec<Fault> = (0..3)
        .flat_map(|rank| [crash(60, rank, Action::Crash), crash(80, rank, Action::Restart)])
        .collect();
    let (tallies, moments) = run(parts(moment(u64::MAX - 6, 0), 1, Turns::Token), &faults, 300);
    let epochs: Vec<u64> = moments.iter().map(|moment| moment.epoch.0).collect();
    assert!(epochs.is_sorted() && epochs.last() > epochs.first(), "{tallies:?}");
    for tally in &tallies {
        assert!(tally.direct > 200 && tally.fail_safe > 0, "{tallies:?}");
    }
}

/// No moment follows the last one: the outputs become fail-safe and stay so, whichever station is started again.
#[test]
fn after_the_last_moment_outputs_are_fail_safe() {
    let faults = [crash(120, 0, Action::Crash), crash(140, 0, Action::Restart)];
    let first = moment(u64::MAX, u64::MAX - 80);
    let (tallies, moments) = run(parts(first, 1, Turns::Token), &faults, 200);
    assert_eq!(moments.iter().max(), Some(&Moment::LAST));
    for tally in &tallies {
        assert!((50..=80).contains(&tally.direct), "{tallies:?}");
        assert!(tally.fail_safe > 100, "{tallies:?}");
    }
}
