//! Two remote I/Os of each program: one of them fails, and the other one takes over; two never drive at one time.

mod press_cell;

use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation};
use understudy_wire::{Member, ProgramId, ProgramSet, Source, StateChoice, StationId, Time};

const ROBOT: ProgramId = ProgramId(0);
const FIRST: Member = Member::RemoteIo(ROBOT);
const TWIN: Member = Member::Twin(ROBOT);

/// The cell with twins that take over after this number of cycles.
fn parts(take_over_after: u32) -> Parts {
    let mut parts = press_cell::parts(Mode::Full, 1);
    press_cell::pair(&mut parts, take_over_after);
    parts
}

/// What came of a run.
struct Outcome {
    simulation: Simulation,
    /// Cycles in a row in which the outputs of the robot were not driven, at most.
    gap: u32,
    /// Deadlines at which nothing was proved.
    missed: u64,
}

fn run(parts: Parts, faults: &[Fault], cycles: u64) -> Outcome {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    for fault in faults {
        simulation.schedule(*fault);
    }
    let mut last: Option<Time> = None;
    let mut longest = Duration::ZERO;
    let outcome = simulation.run(cycles, 200, &mut |now, cycle, member, record| {
        if cycle.is_some() && member == Member::Plant(ROBOT) && matches!(record, Record::Plant(..))
        {
            if let Some(last) = last {
                longest = longest.max(now.since(last));
            }
            last = Some(now);
        }
    });
    outcome.expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    let end = last.map_or(Duration::MAX, |last| simulation.now().since(last));
    let longest = longest.max(end.saturating_sub(press_cell::PERIOD));
    let gap = longest.as_secs_f64() / press_cell::PERIOD.as_secs_f64();
    let tally = &simulation.tallies()[ROBOT.index()];
    let missed = tally.held + tally.fail_safe;
    Outcome { gap: gap.round() as u32 - 1, missed, simulation }
}

fn fault(at_cycle: u64, phase: f64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase, member, action }
}

/// At each tenth of a cycle and for each `take_over_after`: the outputs stay for as many cycles and one more, and nothing wrong is driven.
#[test]
fn the_twin_takes_over_from_an_author_that_has_ended() {
    for after in 1..=3 {
        for tenth in 0..10 {
            for cycle in 100..102 {
                let phase = f64::from(tenth) / 10.0;
                let faults = [fault(cycle, phase, FIRST, Action::Crash)];
                let outcome = run(parts(after), &faults, 200);
                assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN), "{after} {cycle} {phase}");
                let held = outcome.gap as u64 + outcome.missed;
                assert!(held <= u64::from(after) + 1, "{after} {cycle} {phase}: {held}");
            }
        }
    }
}

/// The first one is back as a follower, and takes over again where the twin ends.
#[test]
fn one_that_returns_follows() {
    let faults = [
        fault(100, 0.3, FIRST, Action::Crash),
        fault(150, 0.3, FIRST, Action::Restart),
        fault(250, 0.3, TWIN, Action::Crash),
    ];
    let mut simulation = run(parts(1), &faults[..2], 240).simulation;
    assert_eq!(simulation.author(ROBOT), Some(TWIN));
    assert_eq!(simulation.tallies()[ROBOT.index()].fail_safe, 0);
    simulation.schedule(faults[2]);
    simulation.go_to(300, 0.0, &mut |_, _, _, _| {});
    assert_eq!((simulation.author(ROBOT), simulation.violations()), (Some(FIRST), &[][..]));
}

/// The loss of a follower, of one station, or of a station and the follower costs no cycle.
#[test]
fn a_follower_costs_no_cycle() {
    let station = Member::Station(StationId(0));
    let understudy = Member::Station(StationId(2));
    for lost in [&[TWIN][..], &[station], &[understudy], &[station, TWIN], &[understudy, TWIN]] {
        for tenth in 0..10 {
            let phase = f64::from(tenth) / 10.0;
            let crash = |member: &Member| fault(100, phase, *member, Action::Crash);
            let faults: Vec<Fault> = lost.iter().map(crash).collect();
            let outcome = run(parts(1), &faults, 200);
            assert_eq!((outcome.gap, outcome.missed), (0, 0), "{lost:?} {phase}");
            assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
        }
    }
}

/// An author that was suspended drives nothing when it continues, and follows.
#[test]
fn a_suspended_author_drives_nothing_when_it_goes_on() {
    for after in 1..=2 {
        for cycles in 1..12 {
            for tenth in 0..10 {
                let phase = f64::from(tenth) / 10.0;
                let faults = [
                    fault(100, phase, FIRST, Action::Stop),
                    fault(100 + cycles, phase, FIRST, Action::Continue),
                ];
                let outcome = run(parts(after), &faults, 200);
                let held = u64::from(outcome.gap) + outcome.missed;
                assert!(held <= u64::from(after) + 2, "{after} {cycles} {phase}: {held}");
                assert!(outcome.simulation.author(ROBOT).is_some(), "{after} {cycles} {phase}");
            }
        }
    }
}

/// The two do not receive each other, and the stations receive both: nothing happens.
#[test]
fn a_cut_between_the_two_changes_nothing() {
    let faults = [
        fault(100, 0.4, FIRST, Action::Cut { to: TWIN }),
        fault(100, 0.4, TWIN, Action::Cut { to: FIRST }),
    ];
    let outcome = run(parts(1), &faults, 200);
    assert_eq!((outcome.gap, outcome.missed), (0, 0));
    assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
}

/// The author and a station are lost at one time. A station that does not compute the program changes nothing; one that does may have followed the author
/// longer than any other one, so the operator is asked, nothing is driven meanwhile, and the program goes on when he has answered.
#[test]
fn the_author_and_a_station_at_once() {
    for wire in [press_cell::pair, press_cell::pair_parallel] {
        for (station, asks) in [(0, true), (1, false), (2, true)] {
            for tenth in 0..10 {
                let phase = f64::from(tenth) / 10.0;
                let mut parts = press_cell::parts(Mode::Full, 1);
                wire(&mut parts, 1);
                let lost = [FIRST, Member::Station(StationId(station))];
                let faults = lost.map(|member| fault(100, phase, member, Action::Crash));
                let mut simulation = run(parts, &faults, 250).simulation;
                assert_eq!(simulation.asking().contains(ROBOT), asks, "{station} {phase}");
                assert_eq!(simulation.author(ROBOT).is_none(), asks, "{station} {phase}");
                simulation.let_operator_choose();
                simulation.go_to(350, 0.0, &mut |_, _, _, _| {});
                assert_eq!(simulation.author(ROBOT), Some(TWIN), "{station} {phase}");
                assert_eq!(simulation.violations(), [], "{station} {phase}");
            }
        }
    }
}

/// The same, and the station is back before an operator has answered: it may have lost what it had followed, so the question stays.
#[test]
fn the_station_that_was_lost_with_the_author_answers_nothing() {
    let station = Member::Station(StationId(0));
    let faults = [
        fault(100, 0.3, FIRST, Action::Crash),
        fault(100, 0.3, station, Action::Crash),
        fault(150, 0.3, station, Action::Restart),
    ];
    let simulation = run(parts(1), &faults, 400).simulation;
    assert!(simulation.asking().contains(ROBOT));
    // One that was only suspended has all that it followed.
    let faults = [
        fault(100, 0.3, FIRST, Action::Crash),
        fault(100, 0.3, station, Action::Stop),
        fault(150, 0.3, station, Action::Continue),
    ];
    let simulation = run(parts(1), &faults, 400).simulation;
    assert_eq!((simulation.asking(), simulation.author(ROBOT)), (ProgramSet::EMPTY, Some(TWIN)));
}

/// After a power failure one of the two and one station stay away, or return with a wrong program: nobody knows whether that station follows that one. The
/// remote I/O that is alone starts, or says why it does not, and then starts as the operator chooses.
#[test]
fn one_that_returns_with_a_part_of_the_stations_can_be_started() {
    let stations = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
    let programs = [ROBOT, ProgramId(1)];
    let pairs = programs.map(|program| [Member::RemoteIo(program), Member::Twin(program)]);
    let wirings: [fn(&mut Parts, u32); 2] = [press_cell::pair, press_cell::pair_parallel];
    let cases = wirings.into_iter().flat_map(|wire| [FIRST, TWIN].map(|away| (wire, away)));
    let cases = cases.flat_map(|(wire, away)| stations.map(|station| (wire, [away, station])));
    for ((wire, away), place) in cases.flat_map(|case| (0..4).map(move |place| (case, place))) {
        for returns in [None, Some(Action::RestartWrongProgram)] {
            let phase = f64::from(place) * 0.3;
            let mut parts = press_cell::parts(Mode::Full, 1);
            wire(&mut parts, 1);
            let mut simulation = Simulation::new(parts, Network::default(), 1);
            for member in stations.into_iter().chain(pairs.concat()) {
                simulation.schedule(fault(50, phase, member, Action::Crash));
                let action = if away.contains(&member) { returns } else { Some(Action::Restart) };
                if let Some(action) = action {
                    simulation.schedule(fault(60, phase, member, action));
                }
            }
            let alone = if away[0] == FIRST { TWIN } else { FIRST };
            let (mut is_told, mut applied) = (false, [0; 2]);
            let mut observe = |_, cycle, member, record: Record<'_>| match record {
                Record::RemoteIo(
                    Event::StateLost { asks: true, .. } | Event::ConfigurationDisputed { .. },
                ) if member == alone => is_told = true,
                Record::RemoteIo(Event::Applied {
                    source: Source::Direct | Source::Reconstructed,
                    ..
                }) if member == alone && cycle > Some(60) => {
                    applied[usize::from(cycle > Some(700))] += 1;
                }
                _ => {}
            };
            simulation.run(60, 200, &mut observe).expect("the cluster gets ready");
            simulation.go_to(700, 0.0, &mut observe);
            let choice = StateChoice::Cold;
            simulation.schedule(fault(700, 0.5, alone, Action::Choose { choice }));
            simulation.go_to(760, 0.0, &mut observe);
            let case = format!("{away:?} are away, at {phase}, {returns:?}");
            assert_eq!(simulation.violations(), [], "{case}");
            assert!(is_told || applied[0] > 100, "{case}: {applied:?}");
            assert!(applied[1] > 50, "{case}: {applied:?}");
        }
    }
}

/// After a power failure one of the two and one station return later than the other ones: all start by themselves, also where the operator was asked meanwhile.
#[test]
fn members_that_return_one_after_another_start_by_themselves() {
    let stations = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
    let pairs = [ROBOT, ProgramId(1)].map(|it| [Member::RemoteIo(it), Member::Twin(it)]);
    let wirings: [fn(&mut Parts, u32); 2] = [press_cell::pair, press_cell::pair_parallel];
    let cases = wirings.into_iter().flat_map(|wire| [FIRST, TWIN].map(|late| (wire, late)));
    let cases = cases.flat_map(|(wire, late)| stations.map(|station| (wire, [late, station])));
    for ((wire, late), later) in cases.flat_map(|case| [10, 30, 100, 600].map(|it| (case, it))) {
        let mut parts = press_cell::parts(Mode::Full, 1);
        wire(&mut parts, 1);
        let mut simulation = Simulation::new(parts, Network::default(), later);
        for member in stations.into_iter().chain(pairs.concat()) {
            simulation.schedule(fault(50, 0.3, member, Action::Crash));
            let returns = if late.contains(&member) { 60 + later } else { 60 };
            simulation.schedule(fault(returns, 0.7, member, Action::Restart));
        }
        let mut applied = 0;
        let mut observe = |_, cycle, member, record: Record<'_>| match record {
            Record::RemoteIo(Event::Applied {
                source: Source::Direct | Source::Reconstructed,
                ..
            }) if [FIRST, TWIN].contains(&member) && cycle > Some(60 + later) => applied += 1,
            _ => {}
        };
        simulation.run(60, 200, &mut observe).expect("the cluster gets ready");
        simulation.go_to(260 + later, 0.0, &mut observe);
        let case = format!("{late:?} return {later} cycles later");
        assert_eq!(simulation.violations(), [], "{case}");
        assert!(applied > 100, "{case}: {applied}");
    }
}

/// All members return at times of their own within 0.8 s.
#[test]
fn members_that_return_in_any_order_start_by_themselves() {
    let mut random = Pcg64Mcg::seed_from_u64(36);
    let stations = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
    let pairs = [ROBOT, ProgramId(1)].map(|it| [Member::RemoteIo(it), Member::Twin(it)]);
    let wirings: [fn(&mut Parts, u32); 2] = [press_cell::pair, press_cell::pair_parallel];
    for seed in 0..60 {
        let mut parts = press_cell::parts(Mode::Full, 1);
        wirings[seed as usize % 2](&mut parts, random.random_range(1..=3));
        let mut simulation = Simulation::new(parts, Network::default(), seed);
        let mut order = Vec::new();
        for member in stations.into_iter().chain(pairs.concat()) {
            simulation.schedule(fault(50, 0.3, member, Action::Crash));
            let (at, phase) = (random.random_range(60..140), random.random_range(0.0..1.0));
            simulation.schedule(fault(at, phase, member, Action::Restart));
            order.push((member, at));
        }
        let mut applied = [0; 2];
        let mut observe = |_, cycle, member: Member, record: Record<'_>| match record {
            Record::RemoteIo(Event::Applied {
                source: Source::Direct | Source::Reconstructed,
                ..
            }) if cycle > Some(140) => {
                if let Some(program) = member.sampled_program() {
                    applied[program.index()] += 1;
                }
            }
            _ => {}
        };
        simulation.run(60, 200, &mut observe).expect("the cluster gets ready");
        simulation.go_to(400, 0.0, &mut observe);
        assert_eq!(simulation.violations(), [], "{order:?}");
        assert!(applied.iter().all(|applied| *applied > 150), "{applied:?}: {order:?}");
    }
}
