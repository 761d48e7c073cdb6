//! A small comparison: the same twice, and with what no pair can have.

use understudy_cycle::Mode;
use understudy_testing::press_cell;

use super::*;
use crate::figure;

fn cell() -> Cluster {
    press_cell(Mode::Full)
}

#[test]
fn the_cluster_loses_no_cycle_to_a_failure() {
    let plan = ComparisonPlan { failures: 6, cycles: 300, copies: 2, seed: 1 };
    let comparison = compare(&cell(), &plan).expect("it comes into step");
    assert_eq!(compare(&cell(), &plan), Ok(comparison.clone()));
    let ours = &comparison.contenders[0];
    assert_eq!((ours.lost_worst, ours.wrong), (0, Some(0)));
    assert_eq!((ours.boxes, comparison.contenders[1].boxes), (3, 4));
    for contender in &comparison.contenders {
        assert!(contender.bytes_per_cycle > 0.0, "{}", contender.name);
        assert_eq!(contender.lost_share.len(), LOSSES.len());
    }
    let text = comparison.to_string();
    let drawn = figure(&comparison).expect("a figure");
    for contender in &comparison.contenders {
        assert!(text.contains(&contender.name) && drawn.contains(&contender.name));
    }
}

#[test]
fn copies_have_bounds() {
    let plan = ComparisonPlan { failures: 1, cycles: 1, copies: 9, seed: 1 };
    assert!(matches!(compare(&cell(), &plan), Err(CompareError::Schedule(_))));
}
