//! The pairs do what such pairs are bought for; otherwise a comparison with them would prove nothing.

use understudy_cycle::Mode;
use understudy_testing::press_cell;

use super::*;

fn cell() -> Cluster {
    press_cell(Mode::Full)
}

fn pairs(redundancy: Redundancy, network: Network) -> Pairs {
    let cell = cell();
    Pairs::new(&cell, cell.agreement(), redundancy, network, 3)
}

fn every_redundancy() -> Vec<Redundancy> {
    let standby = (1..6).map(|misses| Redundancy::HotStandby { misses });
    standby.chain([Redundancy::ActiveActive]).collect()
}

/// Undisturbed, each deadline is served, by one master.
#[test]
fn a_quiet_pair_serves_every_cycle() {
    for redundancy in every_redundancy() {
        let mut pairs = pairs(redundancy, Network::default());
        pairs.run(3.0);
        pairs.take_account();
        pairs.run(1000.0);
        let account = pairs.take_account();
        assert_eq!(account.deadlines, 2000, "{redundancy:?}");
        let bad = (account.lost, account.two_masters, account.differing, account.false_take_overs);
        assert_eq!(bad, (0, 0, 0, 0), "{redundancy:?}");
        // The plants work: the robot feeds the press.
        let fields = pairs.cells.iter().filter_map(|cell| cell.shown.as_ref());
        assert!(fields.map(|field| field.finished).sum::<u64>() > 0, "{redundancy:?}");
    }
}

/// A crash costs a hot standby the cycles that it waits, and no more; an active-active pair none. Then all is as before.
#[test]
fn a_crash_costs_what_the_standby_waits() {
    for redundancy in every_redundancy() {
        for phase in [0.02, 0.3, 0.6, 0.9] {
            let mut pairs = pairs(redundancy, Network::default());
            pairs.run(20.0 + phase);
            pairs.take_account();
            let rank = pairs.crash_a_driver(0);
            pairs.run(20.0);
            pairs.repair(0, rank);
            pairs.run(40.0);
            let account = pairs.take_account();
            let most = match redundancy {
                Redundancy::HotStandby { misses } => u64::from(misses) - 1,
                Redundancy::ActiveActive => 0,
            };
            assert!(account.lost <= most, "{redundancy:?} at {phase}: {account:?}");
            assert_eq!((account.false_take_overs, account.two_masters), (0, 0));
            // The other box can fail now.
            let other = pairs.crash_a_driver(0);
            pairs.run(20.0);
            assert_eq!(redundancy == Redundancy::ActiveActive, other == rank || other == 0);
            assert!(pairs.take_account().lost <= most);
        }
    }
}

/// An impatient standby takes lost frames for a dead partner.
#[test]
fn an_impatient_standby_takes_over_by_mistake() {
    let lossy = Network { loss: 0.3, ..Network::default() };
    let mistakes = |misses| {
        let mut pairs = pairs(Redundancy::HotStandby { misses }, lossy);
        pairs.run(2000.0);
        pairs.take_account().false_take_overs
    };
    let (one, three, five) = (mistakes(1), mistakes(3), mistakes(5));
    assert!(one > three && three >= five, "{one} {three} {five}");
    assert!(one > 0);
}
