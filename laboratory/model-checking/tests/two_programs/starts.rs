//! Runs that do not begin synchronised: everybody or some have just restarted, or stood still for a cycle, and something more happens.

use understudy_cycle::Turns;
use understudy_model_checking::{Budget, Start};
use understudy_wire::{Member, ProgramId, StationId};

use crate::{NONE, ONE, check_from, check_turns};

pub(crate) const STATIONS: [Member; 3] = [station(0), station(1), station(2)];
pub(crate) const REMOTE_IOS: [Member; 2] = [remote_io(0), remote_io(1)];

pub(crate) const fn station(rank: u8) -> Member {
    Member::Station(StationId(rank))
}

pub(crate) const fn remote_io(program: u8) -> Member {
    Member::RemoteIo(ProgramId(program))
}

fn restarted(members: &[Member]) -> Start {
    Start { restarted: members.to_vec(), ..Start::default() }
}

fn behind(member: Member) -> Start {
    Start { behind: vec![member], ..Start::default() }
}

/// Anything once, and a crash besides, after links were broken for longer than the history of a sample.
fn check_broken(broken: &[(Member, Member)], states: usize) {
    let start = Start { broken: broken.to_vec(), ..Start::default() };
    let budget = Budget { crashes: 2, losses: 1, total: 2, cycles: 2, ..NONE };
    check_from(start, 1, budget, states);
}

#[test]
fn the_understudy_did_not_receive_a_remote_io() {
    check_broken(&[(remote_io(0), station(2))], 345_740);
}

#[test]
fn the_understudy_received_neither_a_remote_io_nor_a_station() {
    let deaf = [remote_io(0), station(0), station(1)];
    check_broken(&deaf.map(|from| (from, station(2))), 430_389);
}

#[test]
fn a_controller_did_not_receive_its_remote_io() {
    check_broken(&[(remote_io(0), station(0))], 345_718);
}

/// Anything once, in so many cycles.
fn one_in(cycles: u64) -> Budget {
    Budget { cycles, ..ONE }
}

#[test]
fn everybody_starts_together() {
    let everybody = [&STATIONS[..], &REMOTE_IOS[..]].concat();
    check_from(restarted(&everybody), 1, one_in(5), 35_214);
    check_turns(Turns::Parallel, restarted(&everybody), 1, one_in(5), 35_316);
}

#[test]
fn all_stations_start_and_the_remote_ios_run() {
    check_from(restarted(&STATIONS), 1, one_in(3), 11_452);
}

#[test]
fn all_remote_ios_start_and_the_stations_run() {
    check_from(restarted(&REMOTE_IOS), 1, one_in(3), 14_894);
}

#[test]
fn a_remote_io_has_restarted() {
    check_from(restarted(&[remote_io(0)]), 1, one_in(3), 14_325);
}

#[test]
fn the_cycle_master_has_restarted() {
    check_from(restarted(&[station(0)]), 1, one_in(3), 14_711);
}

#[test]
fn the_understudy_has_restarted_with_a_controller() {
    check_from(restarted(&[station(1), station(2)]), 1, one_in(3), 12_995);
}

/// A remote I/O and one of its stations start again with one and the same wrong program, in any order and with anything else that happens: as
/// long as they receive as many members with the right one, their program drives nothing.
fn check_misled(station: Member, states: usize) {
    let start = Start { misled: vec![remote_io(0), station], ..Start::default() };
    let budget = Budget { crashes: 1, stops: 1, losses: 1, total: 1, cycles: 9, ..NONE };
    check_from(start, 1, budget, states);
}

#[test]
fn a_remote_io_and_its_controller_have_a_wrong_program() {
    check_misled(station(0), 165_045);
}

#[test]
fn a_remote_io_and_the_understudy_have_a_wrong_program() {
    check_misled(station(2), 137_814);
}

#[test]
fn a_controller_is_a_cycle_behind() {
    check_from(behind(station(0)), 1, one_in(3), 14_355);
}

#[test]
fn the_understudy_is_a_cycle_behind_and_a_controller_crashes_under_loss() {
    let budget = Budget { losses: 1, crashes: 1, total: 2, cycles: 1, ..NONE };
    check_from(behind(station(2)), 1, budget, 12_660);
}

#[test]
fn a_remote_io_is_a_cycle_behind() {
    check_from(behind(remote_io(1)), 1, one_in(3), 16_486);
}
