//! Slots of spares. A spare wakes at any time, whether it is needed or not: that is more than its rule allows.

use understudy_cycle::Turns;
use understudy_model_checking::{Budget, Start};
use understudy_wire::{Member, StationId};

use crate::cell::parts_with_spares;
use crate::{NONE, ONE, check_parts};

const CONTROLLER: Member = Member::Station(StationId(0));
const UNDERSTUDY: Member = Member::Station(StationId(2));

/// A station has crashed, and returns at any time.
fn lost(station: Member) -> Start {
    Start { down: vec![station], ..Start::default() }
}

fn check(start: Start, spares: usize, budget: Budget, states: usize) {
    check_parts(parts_with_spares(1, spares, Turns::Token), start, budget, states);
}

/// Any member crashes and starts again while the spare wakes.
#[test]
fn a_spare_wakes_while_a_station_fails_and_returns() {
    check(Start::default(), 1, Budget { crashes: 1, total: 1, cycles: 3, ..NONE }, 120_177);
}

/// One more fault of any kind while the failed station returns and the spare wakes.
#[test]
fn anything_happens_while_a_spare_wakes_and_the_station_returns() {
    check(lost(CONTROLLER), 1, Budget { cycles: 1, ..ONE }, 79_806);
}

#[test]
fn anything_happens_while_a_spare_wakes_and_the_understudy_returns() {
    check(lost(UNDERSTUDY), 1, Budget { cycles: 1, ..ONE }, 92_090);
}

#[test]
fn two_spares_wake_for_one_failure() {
    check(lost(CONTROLLER), 2, Budget { cycles: 3, ..NONE }, 121_249);
}
