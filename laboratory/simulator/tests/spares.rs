//! The slot of a spare: empty without an alarm, and one more understudy once its station is started.

use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Record, Simulation, SpareTimes, parts};
use understudy_testing::CELL_WITH_SPARE;
use understudy_wire::{Member, ProgramId, StationId};

const CONTROLLER: Member = Member::Station(StationId(0));
const UNDERSTUDY: Member = Member::Station(StationId(2));
const SPARE: Member = Member::Station(StationId(3));

/// What the remote I/O of the robot reported.
#[derive(Debug, Default, PartialEq, Eq)]
struct Outcome {
    /// Cycles in which no remote I/O had a provable output.
    missed: u64,
    /// `protected` and `unprotected`, with the cycle.
    protection: Vec<(u64, bool)>,
}

fn check(steps: &[(u64, Member, Action)], cycles: u64) -> Outcome {
    let cluster = understudy_testing::cluster(CELL_WITH_SPARE, Mode::Full);
    let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
    for &(at_cycle, member, action) in steps {
        simulation.schedule(Fault { at_cycle, phase: 0.3, member, action });
    }
    let mut protection = Vec::new();
    let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| {
        if member != Member::RemoteIo(ProgramId(0)) {
            return;
        }
        match (record, cycle) {
            (Record::RemoteIo(Event::Protected { .. }), Some(cycle)) => {
                protection.push((cycle, true));
            }
            (Record::RemoteIo(Event::Unprotected { .. }), Some(cycle)) => {
                protection.push((cycle, false));
            }
            _ => {}
        }
    };
    simulation.run(cycles, 200, &mut observe).expect("the cell starts without its spare");
    assert_eq!(simulation.violations().first(), None);
    let missed = simulation.tallies().iter().map(|tally| tally.held + tally.fail_safe).sum();
    Outcome { missed, protection }
}

#[test]
fn an_empty_slot_is_neither_waited_for_nor_an_alarm() {
    let outcome = check(&[], 300);
    assert_eq!(outcome, Outcome { missed: 0, protection: Vec::new() });
}

/// A remote I/O that restarts waits for the stations of its group, and not for an empty slot.
#[test]
fn a_remote_io_that_restarts_does_not_wait_for_an_empty_slot() {
    let remote_io = Member::RemoteIo(ProgramId(0));
    let steps = [(50, remote_io, Action::Crash), (50, remote_io, Action::Restart)];
    let outcome = check(&steps, 200);
    assert!((1..=8).contains(&outcome.missed), "{outcome:?}");
}

/// Without the spare the second failure ends the proof of the robot's outputs; with it no output is held.
#[test]
fn a_spare_that_is_awake_masks_the_second_failure() {
    let crash = |at, member| (at, member, Action::Crash);
    let without = check(&[crash(20, CONTROLLER), crash(100, UNDERSTUDY)], 200);
    assert!(without.missed > 50, "{without:?}");
    let wakes = (40, SPARE, Action::Restart);
    let with = check(&[crash(20, CONTROLLER), wakes, crash(100, UNDERSTUDY)], 200);
    assert_eq!(with.missed, 0, "{with:?}");
}

/// Any one of the three stations and the spare may fail at any time after the spare publishes.
#[test]
fn with_a_spare_any_second_station_may_fail() {
    let stations = [CONTROLLER, Member::Station(StationId(1)), UNDERSTUDY];
    for first in stations {
        for second in stations.into_iter().chain([SPARE]).filter(|second| *second != first) {
            let steps = [
                (20, first, Action::Crash),
                (40, SPARE, Action::Restart),
                (70, second, Action::Crash),
            ];
            assert_eq!(check(&steps, 150).missed, 0, "{first:?}, {second:?}");
        }
    }
}

/// The program is protected again within 20 cycles of the start of the spare.
#[test]
fn protection_returns_within_twenty_cycles_and_stays_when_the_spare_retires() {
    let steps = [
        (20, CONTROLLER, Action::Crash),
        (40, SPARE, Action::Restart),
        (100, CONTROLLER, Action::Restart),
        (150, SPARE, Action::Crash),
        (200, CONTROLLER, Action::Crash),
    ];
    let outcome = check(&steps, 300);
    assert_eq!(outcome.missed, 0);
    let [(lost, false), (back, true), (_, false)] = outcome.protection[..] else {
        panic!("{outcome:?}");
    };
    assert!((20..=24).contains(&lost), "{outcome:?}");
    assert!((41..=60).contains(&back), "{outcome:?}");
}

/// What happens to the slot when the spare follows its rule: the cycle, and whether it starts.
fn by_its_rule(steps: &[(u64, Member, Action)], cycles: u64) -> (Vec<(u64, bool)>, u64) {
    let cluster = understudy_testing::cluster(CELL_WITH_SPARE, Mode::Full);
    let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
    simulation.with_spares(SpareTimes { spare_after: 20, retire_after: 30 });
    for &(at_cycle, member, action) in steps {
        simulation.schedule(Fault { at_cycle, phase: 0.3, member, action });
    }
    let mut woke = Vec::new();
    let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| {
        if let (SPARE, Record::Fault(fault), Some(cycle)) = (member, record, cycle) {
            woke.push((cycle, fault.action == Action::Restart));
        }
    };
    simulation.run(cycles, 200, &mut observe).expect("the cell starts without its spare");
    assert_eq!(simulation.violations().first(), None);
    let missed = simulation.tallies().iter().map(|tally| tally.held + tally.fail_safe).sum();
    (woke, missed)
}

/// It wakes 20 cycles after the failure of any station, masks the second failure, and retires 30 cycles after both are back.
#[test]
fn a_spare_in_the_simulator_wakes_and_retires_by_the_rule() {
    for first in [CONTROLLER, Member::Station(StationId(1)), UNDERSTUDY] {
        let second = if first == UNDERSTUDY { CONTROLLER } else { UNDERSTUDY };
        let steps = [
            (50, first, Action::Crash),
            (100, second, Action::Crash),
            (150, first, Action::Restart),
            (160, second, Action::Restart),
        ];
        let (woke, missed) = by_its_rule(&steps, 300);
        let [(wakes, true), (retires, false)] = woke[..] else { panic!("{first:?}: {woke:?}") };
        assert!((70..=72).contains(&wakes), "{first:?}: {woke:?}");
        assert!((190..=215).contains(&retires), "{first:?}: {woke:?}");
        assert_eq!(missed, 0, "{first:?}");
    }
}

/// A station that flaps, each time back within `spare_after`, wakes no spare; neither does a remote I/O that is gone.
#[test]
fn what_wakes_no_spare_in_the_simulator() {
    let mut flaps = Vec::new();
    for number in 0..10 {
        flaps.push((50 + 40 * number, CONTROLLER, Action::Crash));
        flaps.push((62 + 40 * number, CONTROLLER, Action::Restart));
    }
    assert_eq!(by_its_rule(&flaps, 500).0, []);
    let remote_io = [(50, Member::RemoteIo(ProgramId(1)), Action::Crash)];
    assert_eq!(by_its_rule(&remote_io, 200).0, []);
}

/// A station that fails again and again for longer than `spare_after` wakes the spare once: it stays until the cluster is complete for long enough.
#[test]
fn a_station_that_fails_and_returns_keeps_its_spare() {
    let mut steps = Vec::new();
    for number in 0..6 {
        steps.push((50 + 60 * number, CONTROLLER, Action::Crash));
        steps.push((90 + 60 * number, CONTROLLER, Action::Restart));
    }
    let (woke, missed) = by_its_rule(&steps, 600);
    assert!(matches!(woke[..], [(_, true), (_, false)]), "{woke:?}");
    assert_eq!(missed, 0);
}
