//! Two remote I/Os of each program that are both wired to the plant: outputs through diodes, inputs read twice.

mod press_cell;

use press_cell::Gap;
use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation};
use understudy_wire::{Member, ProgramId, StationId, Time};

const ROBOT: ProgramId = ProgramId(0);
const FIRST: Member = Member::RemoteIo(ROBOT);
const TWIN: Member = Member::Twin(ROBOT);

fn parts(take_over_after: u32) -> Parts {
    let mut parts = press_cell::parts(Mode::Full, 1);
    press_cell::pair_parallel(&mut parts, take_over_after);
    parts
}

/// What came of a run.
struct Outcome {
    simulation: Simulation,
    /// Cycles in a row in which the plant of the robot was not driven, at most.
    gap: u32,
    /// Deadlines at which nothing was proved.
    missed: u64,
    /// What the remote I/Os of the robot have told of its inputs.
    told: Vec<(u64, Event)>,
}

/// Things done to the inputs of a module: from a cycle on, at a remote I/O, an input, what it shows.
type Stuck = (u64, Member, u16, Option<bool>);

fn run(parts: Parts, faults: &[Fault], stuck: &[Stuck], cycles: u64) -> Outcome {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    for fault in faults {
        simulation.schedule(*fault);
    }
    for (cycle, member, input, value) in stuck {
        let action = match value {
            Some(value) => Action::StickInput { input: *input, value: *value },
            None => Action::FreeInput { input: *input },
        };
        simulation.schedule(fault(*cycle, 0.0, *member, action));
    }
    let (mut told, mut gap) = (Vec::new(), Gap::default());
    let mut observe = |now: Time, cycle: Option<u64>, member: Member, record: Record<'_>| match (
        cycle, member, record,
    ) {
        (Some(_), Member::Plant(ROBOT), Record::Plant(..)) => {
            gap.driven(now);
        }
        (Some(cycle), FIRST | TWIN, Record::RemoteIo(event)) => {
            let is_of_inputs = matches!(
                event,
                Event::InputsDiffer { .. }
                    | Event::InputExcluded { .. }
                    | Event::InputsAgree { .. }
                    | Event::PartnerLost { .. }
            );
            if is_of_inputs {
                told.push((cycle, event.clone()));
            }
        }
        _ => {}
    };
    simulation.run(0, 200, &mut observe).expect("the cluster gets ready");
    simulation.go_to(cycles, 0.0, &mut observe);
    assert_eq!(simulation.violations(), []);
    let tally = &simulation.tallies()[ROBOT.index()];
    let missed = tally.held + tally.fail_safe;
    Outcome { gap: gap.periods(), missed, told, simulation }
}

fn fault(at_cycle: u64, phase: f64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase, member, action }
}

fn finished(outcome: &Outcome) -> u64 {
    outcome.simulation.field(ProgramId(1)).map_or(0, |field| field.finished)
}

/// At each tenth of a cycle: the author fails, its modules and those of the follower keep the outputs until the follower has taken over.
#[test]
fn the_outputs_stay_while_the_follower_takes_over() {
    for after in 1..=3 {
        for tenth in 0..10 {
            for action in [Action::Crash, Action::Stop] {
                let phase = f64::from(tenth) / 10.0;
                let outcome = run(parts(after), &[fault(100, phase, FIRST, action)], &[], 200);
                assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN), "{after} {phase}");
                assert_eq!(outcome.missed, 0, "{after} {phase} {action:?}");
                assert!(outcome.gap <= 1, "{after} {phase} {action:?}: {}", outcome.gap);
            }
        }
    }
}

/// The loss of a follower, of one station, or of a station and the follower costs no cycle, and is reported.
#[test]
fn a_follower_costs_no_cycle() {
    let station = Member::Station(StationId(0));
    for lost in [&[TWIN][..], &[station], &[station, TWIN]] {
        for tenth in 0..10 {
            let phase = f64::from(tenth) / 10.0;
            let crash = |member: &Member| fault(100, phase, *member, Action::Crash);
            let faults: Vec<Fault> = lost.iter().map(crash).collect();
            let outcome = run(parts(1), &faults, &[], 200);
            assert_eq!((outcome.gap, outcome.missed), (0, 0), "{lost:?} {phase}");
            assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
            let reported =
                outcome.told.iter().any(|(_, it)| matches!(it, Event::PartnerLost { .. }));
            assert_eq!(reported, lost.contains(&TWIN), "{lost:?}");
        }
    }
}

/// A follower that receives everything late drives nothing old, and the author reports that its own failure would not be masked.
#[test]
fn a_late_follower_releases_its_modules() {
    let by = press_cell::PERIOD * 5;
    for faults in [
        vec![fault(100, 0.3, TWIN, Action::Slow { by })],
        vec![fault(100, 0.3, FIRST, Action::Delay { to: TWIN, by })],
        vec![fault(100, 0.3, TWIN, Action::Delay { to: FIRST, by })],
    ] {
        let outcome = run(parts(1), &faults, &[], 300);
        assert_eq!((outcome.gap, outcome.missed), (0, 0), "{faults:?}");
        let lost = outcome.told.iter().find(|(_, it)| matches!(it, Event::PartnerLost { .. }));
        assert!(lost.is_some_and(|(cycle, _)| *cycle < 200), "{faults:?}: {:?}", outcome.told);
    }
}

/// Both are author and follower in turn, and the cell works.
#[test]
fn the_cell_works_whichever_drives() {
    let faults = [
        fault(100, 0.3, FIRST, Action::Crash),
        fault(150, 0.3, FIRST, Action::Restart),
        fault(300, 0.3, TWIN, Action::Stop),
        fault(320, 0.3, TWIN, Action::Continue),
    ];
    let quiet = finished(&run(parts(1), &[], &[], 600));
    let outcome = run(parts(1), &faults, &[], 600);
    assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
    assert!(quiet > 0 && finished(&outcome) + 1 >= quiet, "{quiet} {}", finished(&outcome));
}

/// An input module that is stuck at either remote I/O: an alarm first, then it is excluded at the next edge, and never the other one. Where no edge comes,
/// since the program waits for one, the alarm stays.
#[test]
fn a_stuck_input_module_is_excluded_and_never_the_other_one() {
    let quiet = finished(&run(parts(1), &[], &[], 600));
    let (mut alarms, mut exclusions) = (0, 0);
    for (input, member, value) in (0..5).flat_map(|input| {
        [FIRST, TWIN].into_iter().flat_map(move |it| [false, true].map(|value| (input, it, value)))
    }) {
        let stuck = [(100, member, input, Some(value))];
        let outcome = run(parts(1), &[], &stuck, 600);
        assert_eq!(outcome.missed, 0);
        let told: Vec<_> = outcome.told.iter().map(|(_, event)| event).collect();
        alarms += u32::from(!told.is_empty());
        match told[..] {
            [] => {}
            [Event::InputsDiffer { input: of, .. }] => assert_eq!(*of, input),
            [Event::InputsDiffer { .. }, Event::InputExcluded { input: of, at, .. }] => {
                assert_eq!((*of, *at), (input, member));
                assert!(finished(&outcome) + 2 >= quiet, "{input} {member:?} {value}");
                exclusions += 1;
            }
            _ => panic!("{input} {member:?} {value}: {told:?}"),
        }
    }
    assert_eq!((alarms, exclusions), (18, 3));
}

/// A stuck module that no edge has excluded yet: the alarm lasts while the other remote I/O is down and when it is back, and an author that takes over raises
/// it anew. The referee finds a report that ends while the modules differ.
#[test]
fn a_doubt_lasts_without_the_other_one_and_over_a_switchover() {
    let doubted = |outcome: &Outcome| {
        let told: Vec<_> = outcome.told.iter().map(|(_, event)| event).collect();
        matches!(told[..], [Event::InputsDiffer { .. }])
    };
    let mut doubts = 0;
    for (input, member, value) in (0..5).flat_map(|input| {
        [FIRST, TWIN].into_iter().flat_map(move |it| [false, true].map(|value| (input, it, value)))
    }) {
        let stuck = [(100, member, input, Some(value))];
        if !doubted(&run(parts(1), &[], &stuck, 300)) {
            continue;
        }
        doubts += 1;
        // The intact one is alone and goes on; its plant may move then, and the stuck one is back.
        let other = if member == FIRST { TWIN } else { FIRST };
        for lost in [member, other] {
            let faults =
                [fault(300, 0.3, lost, Action::Crash), fault(400, 0.3, lost, Action::Restart)];
            let outcome = run(parts(1), &faults, &stuck, 700);
            let mut told = outcome.told.iter().filter(|(cycle, _)| *cycle >= 300);
            let switched = outcome.simulation.author(ROBOT) == Some(TWIN);
            assert_eq!(switched, lost == FIRST, "{input} {member:?} {value}");
            let first = told.find(|(_, it)| !matches!(it, Event::PartnerLost { .. }));
            let is_right = match first {
                // A new author says it at once.
                Some((cycle, Event::InputsDiffer { input: of, .. })) => {
                    switched && *cycle < 310 && *of == input
                }
                Some((cycle, event)) => {
                    let is_over =
                        matches!(event, Event::InputsAgree { .. } | Event::InputExcluded { .. });
                    !switched && *cycle >= 400 && is_over
                }
                None => !switched,
            };
            assert!(is_right, "{input} {member:?} {value} {lost:?}: {:?}", outcome.told);
        }
    }
    assert!(doubts > 5, "{doubts}");
}

/// What the author has excluded stays excluded where the other one takes over, until an operator releases it.
#[test]
fn an_exclusion_lasts_until_it_is_released() {
    let stuck = [(100, FIRST, 1, Some(false)), (700, FIRST, 1, None)];
    let faults = [
        fault(600, 0.3, FIRST, Action::Stop),
        fault(610, 0.3, FIRST, Action::Continue),
        fault(800, 0.3, TWIN, Action::Release),
    ];
    let outcome = run(parts(1), &faults, &stuck, 900);
    assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN));
    let told: Vec<_> = outcome.told.iter().filter(|(cycle, _)| *cycle >= 600).collect();
    let as_expected = matches!(
        told[..],
        [(600..700, Event::InputExcluded { at: FIRST, .. }), (800, Event::InputsAgree { .. })]
    );
    assert!(as_expected, "{told:?}");
}

/// A follower that was suspended, and takes over before it receives the author again, goes on with what that one has excluded.
#[test]
fn a_follower_that_was_suspended_knows_what_is_excluded() {
    let stuck = [(100, FIRST, 1, Some(false))];
    let faults = [
        fault(600, 0.3, TWIN, Action::Stop),
        fault(605, 0.3, FIRST, Action::Crash),
        fault(610, 0.3, TWIN, Action::Continue),
    ];
    let outcome = run(parts(1), &faults, &stuck, 700);
    assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN));
    let told = outcome.told.iter().filter(|(cycle, _)| *cycle >= 600);
    let told: Vec<_> = told.filter(|(_, it)| !matches!(it, Event::PartnerLost { .. })).collect();
    let is_known =
        matches!(told[..], [(610..700, Event::InputExcluded { at: FIRST, input: 1, .. })]);
    assert!(is_known, "{told:?}");
}
