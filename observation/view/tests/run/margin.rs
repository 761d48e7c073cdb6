//! The remaining redundancy against the simulator: failures that are foreseen as masked are masked, and the others are not.

use understudy_cycle::Mode;
use understudy_scenarios::{Action, Fault, Network, Scenario};
use understudy_simulator::{Simulation, parts};
use understudy_view::{Margin, Outcome};
use understudy_wire::{Member, StationId};

use crate::support::{line, model};

/// The cycle up to which the run is looked at, and the one in which the failure comes.
const LOOKED_AT: u64 = 40;
const FAILS_AT: u64 = 42;
const ENDS_AT: u64 = 60;

fn crash(station: StationId, at_cycle: u64, phase: f64) -> Fault {
    Fault { at_cycle, phase, member: Member::Station(station), action: Action::Crash }
}

/// Every station killed before or none, then every single and every pair of those that are left, at three places of a cycle.
fn check(controllers: usize, understudies: usize, mode: Mode) {
    let cluster = line(controllers, understudies, mode);
    let stations = controllers + understudies;
    let befores =
        std::iter::once(None).chain((0..stations as u8).map(|rank| Some(StationId(rank))));
    for before in befores {
        let steps: Vec<Fault> = before.map(|station| crash(station, 10, 0.0)).into_iter().collect();
        let scenario = Scenario {
            title: "before".into(),
            cycles: LOOKED_AT,
            steps: steps.clone(),
            ..Scenario::default()
        };
        let Margin { singles, pairs, .. } = model(&cluster, &scenario, 1).holders().margin();
        let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
        for step in steps {
            simulation.schedule(step);
        }
        simulation.run(LOOKED_AT, 1000, &mut |_, _, _, _| {}).expect("it comes into step");
        let of_stations = |outcome: &&Outcome| {
            outcome.failed.iter().all(|member| matches!(member, Member::Station(_)))
        };
        for outcome in singles.iter().filter(of_stations).chain(&pairs) {
            for phase in [0.0, 0.3, 0.5] {
                let context = format!(
                    "{controllers}+{understudies} {mode:?}, {before:?} before, {outcome:?} at {phase}"
                );
                happens(simulation.clone(), outcome, phase, &context);
            }
        }
    }
}

fn happens(mut simulation: Simulation, outcome: &Outcome, phase: f64, context: &str) {
    for member in &outcome.failed {
        if let Member::Station(station) = member {
            simulation.schedule(crash(*station, FAILS_AT, phase));
        }
    }
    let before: Vec<(u64, u64)> = losses(&simulation);
    simulation.go_on(ENDS_AT, &mut |_, _, _, _| {}, &mut || false);
    assert_eq!(simulation.violations(), [], "{context}");
    for (program, (before, after)) in before.iter().zip(losses(&simulation)).enumerate() {
        // What was lost already is none of this failure's.
        let was_lost = before.1 > 0;
        let lost = outcome.lost.iter().any(|loss| loss.program.index() == program);
        assert!(!(lost && was_lost), "{context}");
        if !was_lost {
            assert_eq!(
                after.0 + after.1 > before.0 + before.1,
                lost,
                "{context}, program {program}"
            );
        }
    }
}

/// Held and fail-safe cycles by program.
fn losses(simulation: &Simulation) -> Vec<(u64, u64)> {
    let tallies = simulation.tallies().iter();
    tallies.map(|tally| (tally.held, tally.fail_safe)).collect()
}

#[test]
fn it_is_what_happens_with_one_understudy() {
    check(2, 1, Mode::Full);
    check(3, 1, Mode::Full);
}

#[test]
fn it_is_what_happens_with_two_understudies() {
    check(2, 2, Mode::Full);
}

#[test]
fn it_is_what_happens_in_the_mode_of_the_paper() {
    check(2, 1, Mode::Paper);
    check(3, 1, Mode::Paper);
}
