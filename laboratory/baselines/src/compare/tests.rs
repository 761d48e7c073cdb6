//! A small comparison: the same twice, and with what no pair can have.

use understudy_cluster::press_cell;

use super::*;
use crate::figure;

fn cell() -> Cluster {
    let files = press_cell();
    let loaded = understudy_cluster::read(files[0].name, files[0].text, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        let text = file.map(|file| file.text.to_owned());
        text.ok_or_else(|| "no such file".to_owned())
    });
    loaded.cluster.expect("the press cell is right")
}

#[test]
fn the_cluster_loses_no_cycle_to_a_failure() {
    let plan = ComparisonPlan {
        failures: 6,
        cycles: 300,
        copies: 2,
        seed: 1,
    };
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
    let plan = ComparisonPlan {
        failures: 1,
        cycles: 1,
        copies: 9,
        seed: 1,
    };
    assert!(matches!(
        compare(&cell(), &plan),
        Err(CompareError::Schedule(_))
    ));
}
