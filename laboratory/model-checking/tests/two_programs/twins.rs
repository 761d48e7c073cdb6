//! One program with two remote I/Os, a controller and an understudy: every schedule of two faults.

use understudy_remote_io::Wiring;

use super::*;

/// Everything within the budget holds where the other remote I/O takes over after one cycle, in this number of states.
fn check_pair(budget: Budget, states: usize) {
    check_wired(Wiring::Exclusive, budget, states);
}

fn check_wired(wiring: Wiring, budget: Budget, states: usize) {
    check_from(Start::default(), paired(wiring), budget, states);
}

fn check_from(start: Start, parts: Parts, budget: Budget, states: usize) {
    let model = Model::new(parts, start, budget);
    let verdict = check(model.expect("it synchronises"), 2);
    assert_eq!(verdict.counterexamples, []);
    assert_eq!(verdict.states, states, "a protocol that has changed has other states");
}

#[test]
fn one_fault_in_four_cycles() {
    check_pair(Budget { cuts: 1, ..ONE }, 42_522);
}

/// All that is not a loss, in two cycles.
const TWO: Budget = Budget { crashes: 2, stops: 2, cuts: 1, total: 2, cycles: 2, ..NONE };

#[test]
fn two_faults_in_one_cycle() {
    check_pair(Budget { losses: 2, cycles: 1, ..TWO }, 170_068);
}

#[test]
#[ignore = "it takes a minute"]
fn two_crashes_or_stops_in_two_cycles() {
    check_pair(Budget { cuts: 0, ..TWO }, 672_889);
}

#[test]
#[ignore = "it takes two minutes"]
fn a_cut_and_a_crash_or_a_stop_in_two_cycles() {
    check_pair(Budget { crashes: 1, stops: 1, ..TWO }, 1_278_667);
}

#[test]
#[ignore = "it takes two minutes"]
fn a_loss_and_another_fault_in_two_cycles() {
    check_pair(Budget { losses: 2, crashes: 1, stops: 1, ..TWO }, 1_505_706);
}

/// Both wired to the plant: what one of the two drives next to the author is what the author drove in one of the last six cycles, or nothing.
const PARALLEL: Wiring = Wiring::Parallel { discrepancy_cycles: 2 };

#[test]
fn one_fault_of_two_that_are_both_wired() {
    check_wired(PARALLEL, Budget { cuts: 1, ..ONE }, 44_081);
}

#[test]
fn two_faults_of_two_that_are_both_wired() {
    check_wired(PARALLEL, Budget { losses: 2, cycles: 1, ..TWO }, 171_598);
}

#[test]
#[ignore = "it takes a minute"]
fn two_crashes_or_stops_of_two_that_are_both_wired() {
    check_wired(PARALLEL, Budget { cuts: 0, ..TWO }, 689_704);
}

/// Two of all faults, of which one cuts the network, or pulls the direct link that joins the two.
#[test]
fn two_faults_of_two_with_a_direct_link() {
    let budget = Budget { losses: 1, links: 1, cycles: 1, ..TWO };
    check_from(Start::default(), linked(Wiring::Exclusive), budget, 159_390);
    check_from(Start::default(), linked(PARALLEL), budget, 160_826);
}

/// Each of the two drives half of the number.
fn check_sharing(budget: Budget, states: usize) {
    let start = Start { quiet_cycles: 20, ..Start::default() };
    check_from(start, sharing(), budget, states);
}

/// A number that modules of both drive together is never driven with more than its value, and what one of the two drives next to the author is a part of
/// what the author has driven.
#[test]
fn one_fault_of_two_that_share_a_number() {
    check_sharing(Budget { cuts: 1, ..ONE }, 44_186);
}

#[test]
fn two_faults_of_two_that_share_a_number() {
    check_sharing(Budget { losses: 2, cycles: 1, ..TWO }, 171_598);
}
