//! Two programs, one understudy, two remote I/Os: every schedule of a few faults over a few cycles.

mod cell;
mod changes;
mod shards;
mod spares;
mod starts;
mod twins;

use understudy_cycle::Turns;
use understudy_model_checking::{Budget, Model, Start, Step, check};
use understudy_simulator::{Parts, Tally};

use cell::{linked, paired, parts, sharing};

/// All that can be done once, and nothing of anything.
const ONE: Budget = Budget {
    losses: 1,
    delays: 1,
    duplicates: 1,
    crashes: 1,
    stops: 1,
    total: 1,
    cycles: 4,
    ..NONE
};
const NONE: Budget = Budget {
    losses: 0,
    delays: 0,
    duplicates: 0,
    crashes: 0,
    stops: 0,
    cuts: 0,
    links: 0,
    total: 0,
    cycles: 0,
};

/// Everything within the budget holds with each kind of turns, in so many states.
fn check_all(understudies: usize, budget: Budget, states: [usize; 2]) {
    let [token, parallel] = states;
    check_from(Start::default(), understudies, budget, token);
    check_turns(Turns::Parallel, Start::default(), understudies, budget, parallel);
}

fn check_from(start: Start, understudies: usize, budget: Budget, states: usize) {
    check_turns(Turns::Token, start, understudies, budget, states);
}

fn check_turns(turns: Turns, start: Start, understudies: usize, budget: Budget, states: usize) {
    check_parts(parts(understudies, turns), start, budget, states);
}

fn check_parts(parts: Parts, start: Start, budget: Budget, states: usize) {
    let model = Model::new(parts, start, budget).expect("it comes into step");
    let verdict = check(model, 2);
    assert_eq!(verdict.counterexamples, []);
    assert_eq!(verdict.states, states, "a protocol that has changed has other states");
}

#[test]
fn one_of_each_in_four_cycles() {
    check_all(1, ONE, [28_975, 29_107]);
}

#[test]
fn one_of_each_with_two_understudies() {
    check_all(2, Budget { cycles: 3, ..ONE }, [19_187, 19_450]);
}

#[test]
fn two_losses_in_two_cycles() {
    let budget = Budget { losses: 2, total: 2, cycles: 2, ..NONE };
    check_all(1, budget, [11_609, 12_095]);
}

#[test]
fn a_crash_and_a_stop_in_two_cycles() {
    let budget = Budget { crashes: 1, stops: 1, total: 2, cycles: 2, ..NONE };
    check_all(1, budget, [563_495, 575_355]);
}

#[test]
fn a_crash_and_a_loss_in_two_cycles() {
    let budget = Budget { losses: 1, crashes: 1, total: 2, cycles: 2, ..NONE };
    check_all(1, budget, [91_823, 96_017]);
}

/// Without an understudy a lost station does cost a cycle: the checker finds it, and the simulator replays what it found.
#[test]
fn a_counterexample_is_found_and_replayed() {
    let model =
        || Model::new(parts(0, Turns::Token), Start::default(), ONE).expect("it comes into step");
    let verdict = check(model(), 1);
    let [example] = &verdict.counterexamples[..] else {
        panic!("{:?}", verdict.counterexamples);
    };
    assert_eq!(example.property, "one lost station costs no cycle");
    assert!(matches!(example.steps[0], Step::Crash(_) | Step::Stop(_)));
    let mut simulation = model().replay(&example.faults);
    simulation.go_to(10, 0.0, &mut |_, _, _, _| {});
    let untrue = |tally: &Tally| tally.held + tally.fail_safe > 0;
    assert!(simulation.tallies().iter().any(untrue));
    assert_eq!(simulation.violations(), []);
}
