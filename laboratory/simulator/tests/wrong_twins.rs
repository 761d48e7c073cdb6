//! Two remote I/Os of one program, of which one starts again with a wrong program: what each of them applies is judged by its own program.

mod press_cell;

use press_cell::{WIRINGS, Wire, fault};
use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, Violation};
use understudy_wire::{Member, ProgramId, Source, StationId};

const ROBOT: ProgramId = ProgramId(0);
const FIRST: Member = Member::RemoteIo(ROBOT);
const TWIN: Member = Member::Twin(ROBOT);
const CONTROLLER: Member = Member::Station(StationId(0));

/// What is done, in which cycle and where in it, and to whom.
type Step = (u64, f64, Member, Action);

fn parts(wire: Wire, programs: usize) -> Parts {
    let mut parts = press_cell::line(programs, Mode::Full, 1);
    wire(&mut parts, 1);
    parts
}

/// What came of a run.
struct Outcome {
    violations: Vec<Violation>,
    /// Proved outputs that each of the two remote I/Os of the robot has applied with a wrong program, and with the right one after the first step.
    wrong: u64,
    right: [u64; 2],
}

fn run(parts: Parts, steps: &[Step], cycles: u64) -> Outcome {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    let first = steps.iter().map(|step| step.0).min().unwrap_or(0);
    for &(at_cycle, phase, member, action) in steps {
        simulation.schedule(fault(at_cycle, phase, member, action));
    }
    let (mut has_wrong, mut wrong, mut right) = ([false; 2], 0, [0; 2]);
    let place = |member| [FIRST, TWIN].iter().position(|it| *it == member);
    let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| match record {
        Record::Fault(Fault { member, action, .. }) => {
            if let (Some(place), true) = (place(*member), *action != Action::Crash) {
                has_wrong[place] = *action == Action::RestartWrongProgram;
            }
        }
        Record::RemoteIo(Event::Applied {
            source: Source::Direct | Source::Reconstructed, ..
        }) if cycle >= Some(first) => {
            if let Some(place) = place(member) {
                match has_wrong[place] {
                    true => wrong += 1,
                    false => right[place] += 1,
                }
            }
        }
        _ => {}
    };
    simulation.run(0, 200, &mut observe).expect("the cluster gets ready");
    simulation.go_to(cycles, 0.0, &mut observe);
    Outcome { violations: simulation.violations().to_vec(), wrong, right }
}

fn other(member: Member) -> Member {
    if member == FIRST { TWIN } else { FIRST }
}

fn understudy(programs: usize) -> Member {
    Member::Station(StationId(programs as u8))
}

fn again(cycle: u64, phase: f64, member: Member, action: Action) -> [Step; 2] {
    [(cycle, phase, member, Action::Crash), (cycle, phase, member, action)]
}

/// After a power failure one of the two has a wrong program, the other one starts the program, and the first one gets the right program again: what the other
/// one has started is known then. Found by a campaign.
#[test]
fn what_the_other_one_has_started_is_known_when_the_program_is_right_again() {
    let cases = [FIRST, TWIN].into_iter().flat_map(|wrong| [(wrong, 1), (wrong, 2)]);
    for ((wrong, programs), wire) in cases.flat_map(|case| WIRINGS.map(|wire| (case, wire))) {
        for tenth in 0..10 {
            let phase = f64::from(tenth) / 10.0;
            let stations = (0..=programs).map(|rank| Member::Station(StationId(rank as u8)));
            let all: Vec<Member> = stations.chain([FIRST, TWIN]).collect();
            let mut steps: Vec<Step> = Vec::new();
            for &member in &all {
                let action =
                    if member == wrong { Action::RestartWrongProgram } else { Action::Restart };
                steps.push((50, phase, member, Action::Crash));
                steps.push((60, phase, member, action));
            }
            steps.extend(again(100, phase, wrong, Action::Restart));
            let outcome = run(parts(wire, programs), &steps, 150);
            let case = format!("{wrong:?} of {programs} programs at {phase}");
            assert_eq!(outcome.violations, [], "{case}");
            let right = outcome.right[usize::from(other(wrong) == TWIN)];
            assert!(outcome.wrong == 0 && right > 50, "{case}: {:?}", outcome.right);
        }
    }
}

/// The wrong program of one is no excuse for the other one.
#[test]
fn wrong_outputs_of_the_other_one_are_found() {
    for (wire, wrong) in WIRINGS.into_iter().flat_map(|wire| [FIRST, TWIN].map(|it| (wire, it))) {
        let mut steps: Vec<Step> = Vec::new();
        let stations = [CONTROLLER, understudy(1)];
        for member in stations.into_iter().chain([FIRST, TWIN]) {
            let action =
                if member == wrong { Action::RestartWrongProgram } else { Action::Restart };
            steps.push((50, 0.3, member, Action::Crash));
            steps.push((60, 0.3, member, action));
        }
        // Both stations compute from the same wrong state.
        for bit in 0..12 {
            let flips = Action::FlipState { program: ROBOT, bit };
            steps.extend(stations.map(|station| (120, 0.0, station, flips)));
        }
        let outcome = run(parts(wire, 1), &steps, 150);
        let is_wrong = |violation: &Violation| matches!(violation, Violation::Wrong { .. });
        assert!(outcome.violations.iter().any(is_wrong), "{wrong:?}: {:?}", outcome.violations);
    }
}

/// While everybody runs, one of the two and a station start again with one and the same wrong program, and later with the right one.
#[test]
fn a_wrong_program_of_one_of_two_drives_nothing() {
    for (wire, programs) in WIRINGS.into_iter().flat_map(|wire| [(wire, 1), (wire, 2)]) {
        for (wrong, station) in [FIRST, TWIN]
            .into_iter()
            .flat_map(|wrong| [CONTROLLER, understudy(programs)].map(|it| (wrong, it)))
        {
            for (one, two) in [(wrong, station), (station, wrong)] {
                for (apart, phase) in [(0, 0.1), (0, 0.6), (1, 0.1), (1, 0.6), (40, 0.6)] {
                    let mut steps = Vec::new();
                    steps.extend(again(50, phase, one, Action::RestartWrongProgram));
                    steps.extend(again(50 + apart, phase, two, Action::RestartWrongProgram));
                    steps.extend(again(150 + apart, phase, wrong, Action::Restart));
                    steps.extend(again(150 + apart, phase, station, Action::Restart));
                    let outcome = run(parts(wire, programs), &steps, 300);
                    let case = format!("{one:?} and {apart} cycles later {two:?}, at {phase}");
                    assert_eq!(outcome.violations, [], "{case}");
                    assert_eq!(outcome.wrong, 0, "{case}");
                }
            }
        }
    }
}

/// After a power failure one of the two and a station start with one and the same wrong program, the others with the right one, in any order: nothing is driven
/// until all have the right one, and then that.
#[test]
fn a_wrong_program_after_a_power_failure_drives_nothing() {
    for (wire, wrong) in WIRINGS.into_iter().flat_map(|wire| [FIRST, TWIN].map(|it| (wire, it))) {
        for order in (0..256_usize).step_by(7) {
            let after = |place: usize| [0, 2, 30, 120][order >> (2 * place) & 3];
            let (station, right) = match order % 2 == 0 {
                true => (CONTROLLER, understudy(1)),
                false => (understudy(1), CONTROLLER),
            };
            let phase = (order % 10) as f64 / 10.0;
            let all = [wrong, station, other(wrong), right];
            let mut steps: Vec<Step> = Vec::new();
            for (place, member) in all.into_iter().enumerate() {
                let action = if place < 2 { Action::RestartWrongProgram } else { Action::Restart };
                steps.push((50, phase, member, Action::Crash));
                steps.push((60 + after(place), phase, member, action));
            }
            steps.extend(again(260, phase, wrong, Action::Restart));
            steps.extend(again(260, phase, station, Action::Restart));
            let outcome = run(parts(wire, 1), &steps, 360);
            let case = format!("{wrong:?} and {station:?} in the order {order}");
            assert_eq!(outcome.violations, [], "{case}");
            let right: u64 = outcome.right.iter().sum();
            assert!(outcome.wrong == 0 && (50..=100).contains(&right), "{case}: {right}");
        }
    }
}
