//! Two remote I/Os of each program: one of them fails, and the other one takes over; two never drive at one time.

mod press_cell;

use press_cell::{Gap, WIRINGS, Wire, applies_proved, fault};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation};
use understudy_wire::{Member, ProgramId, ProgramSet, StateChoice, StationId};

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
    let mut gap = Gap::default();
    let outcome = simulation.run(cycles, 200, &mut |now, cycle, member, record| {
        if cycle.is_some() && member == Member::Plant(ROBOT) && matches!(record, Record::Plant(..))
        {
            gap.driven(now);
        }
    });
    outcome.expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    let tally = &simulation.tallies()[ROBOT.index()];
    let missed = tally.held + tally.fail_safe;
    Outcome { gap: gap.periods_until(simulation.now()), missed, simulation }
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

const STATIONS: [Member; 3] =
    [Member::Station(StationId(0)), Member::Station(StationId(1)), Member::Station(StationId(2))];

/// The cell with twins, all of whose members fail in cycle 50 and return as is told; it is ready before.
fn after_power_failure(
    (wire, take_over_after): (Wire, u32),
    (seed, phase): (u64, f64),
    mut returns: impl FnMut(Member) -> Option<(u64, f64, Action)>,
) -> Simulation {
    let mut parts = press_cell::parts(Mode::Full, 1);
    wire(&mut parts, take_over_after);
    let mut simulation = Simulation::new(parts, Network::default(), seed);
    let pairs = [ROBOT, ProgramId(1)].map(|it| [Member::RemoteIo(it), Member::Twin(it)]);
    for member in STATIONS.into_iter().chain(pairs.concat()) {
        simulation.schedule(fault(50, phase, member, Action::Crash));
        if let Some((at, phase, action)) = returns(member) {
            simulation.schedule(fault(at, phase, member, action));
        }
    }
    simulation.run(0, 200, &mut |_, _, _, _| {}).expect("the cluster gets ready");
    simulation
}

/// Each wiring, with one of the two remote I/Os of the robot and one station.
fn with_one_of_each() -> impl Iterator<Item = (Wire, [Member; 2])> {
    let wired = WIRINGS.into_iter().flat_map(|wire| [FIRST, TWIN].map(|one| (wire, one)));
    wired.flat_map(|(wire, one)| STATIONS.map(|station| (wire, [one, station])))
}

/// After a power failure one of the two and one station stay away, or return with a wrong program: no member knows whether that station follows that one.
/// The remote I/O that is alone starts, or says why it does not, and then starts as the operator chooses.
#[test]
fn one_that_returns_with_a_part_of_the_stations_can_be_started() {
    let cases = with_one_of_each().flat_map(|case| (0..4).map(move |place| (case, place)));
    for ((wire, away), place) in cases {
        for returns in [None, Some(Action::RestartWrongProgram)] {
            let phase = f64::from(place) * 0.3;
            let mut simulation = after_power_failure((wire, 1), (1, phase), |member| {
                let action = if away.contains(&member) { returns } else { Some(Action::Restart) };
                action.map(|action| (60, phase, action))
            });
            let alone = if away[0] == FIRST { TWIN } else { FIRST };
            let (mut is_told, mut applied) = (false, [0; 2]);
            let mut observe = |_, cycle, member, record: Record<'_>| match record {
                _ if member != alone => {}
                Record::RemoteIo(
                    Event::StateLost { asks: true, .. } | Event::ConfigurationDisputed { .. },
                ) => is_told = true,
                record if applies_proved(&record) && cycle > Some(60) => {
                    applied[usize::from(cycle > Some(700))] += 1;
                }
                _ => {}
            };
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

/// After a power failure one of the two and one station return later than the other ones: all start by themselves, also where the operator was asked
/// meanwhile.
#[test]
fn members_that_return_one_after_another_start_by_themselves() {
    let cases = with_one_of_each().flat_map(|case| [10, 30, 100, 600].map(|later| (case, later)));
    for ((wire, late), later) in cases {
        let mut simulation = after_power_failure((wire, 1), (later, 0.3), |member| {
            let at = if late.contains(&member) { 60 + later } else { 60 };
            Some((at, 0.7, Action::Restart))
        });
        let mut applied = 0;
        simulation.go_to(260 + later, 0.0, &mut |_, cycle, member, record| {
            let is_late = [FIRST, TWIN].contains(&member) && cycle > Some(60 + later);
            applied += u32::from(is_late && applies_proved(&record));
        });
        let case = format!("{late:?} return {later} cycles later");
        assert_eq!(simulation.violations(), [], "{case}");
        assert!(applied > 100, "{case}: {applied}");
    }
}

/// All members return at times of their own within 0.8 s.
#[test]
fn members_that_return_in_any_order_start_by_themselves() {
    let mut random = Pcg64Mcg::seed_from_u64(36);
    for seed in 0..60 {
        let mut order = Vec::new();
        let wiring = (WIRINGS[seed as usize % 2], random.random_range(1..=3));
        let mut simulation = after_power_failure(wiring, (seed, 0.3), |member| {
            let (at, phase) = (random.random_range(60..140), random.random_range(0.0..1.0));
            order.push((member, at));
            Some((at, phase, Action::Restart))
        });
        let mut applied = [0; 2];
        simulation.go_to(400, 0.0, &mut |_, cycle, member, record| {
            if let Some(program) = member.sampled_program()
                && cycle > Some(140)
            {
                applied[program.index()] += u32::from(applies_proved(&record));
            }
        });
        assert_eq!(simulation.violations(), [], "{order:?}");
        assert!(applied.iter().all(|applied| *applied > 150), "{applied:?}: {order:?}");
    }
}
