//! The chain against closed forms, the chain of one group, and a simulation machine by machine.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::options::Options;

fn hours(hours: f64) -> Hours {
    Hours::new("a time", hours).expect("in range")
}

fn plant(groups: u32, controllers: u32, spares: u32) -> SharedSpares {
    SharedSpares {
        groups,
        too_large: 0,
        controllers,
        spares,
        mtbf: hours(10_000.0),
        mttr: hours(24.0),
        wake: hours(1.0 / 3600.0),
        coverage: Probability::ONE,
    }
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found / wanted - 1.0).abs() < tolerance, "{found} in place of {wanted}");
}

/// One group without a spare is the system that `reliability` calculates; G groups fail G times as often, but for the first repair time.
#[test]
fn without_spares_it_is_the_model_of_a_group() {
    for controllers in [1, 2, 12] {
        let options = Options::new(controllers, hours(10_000.0), hours(24.0));
        let system = options.system().expect("a system");
        let group = system.chain().expect("a chain").mttf().expect("a mean");
        near(plant(1, controllers, 0).mttf().expect("a mean"), group, 1e-3);
        near(plant(25, controllers, 0).mttf().expect("a mean"), group / 25.0, 5e-3);
    }
}

/// A spare that never wakes in time, or never wakes, changes nothing.
#[test]
fn a_spare_that_does_not_wake_is_none() {
    let none = plant(8, 12, 0).mttf().expect("a mean");
    let slow = SharedSpares { wake: hours(1e9), ..plant(8, 12, 2) };
    near(slow.mttf().expect("a mean"), none, 1e-3);
    let dead =
        SharedSpares { coverage: Probability::new("c", 1e-12).expect("one"), ..plant(8, 12, 2) };
    near(dead.mttf().expect("a mean"), none, 1e-3);
}

/// For each of one group a spare of its own that wakes at once is a second understudy, but for its share of the failures.
#[test]
fn a_spare_of_one_group_is_almost_a_second_understudy() {
    let spare = SharedSpares { wake: hours(1e-6), ..plant(1, 12, 1) }.mttf().expect("a mean");
    let mut options = Options::new(12, hours(10_000.0), hours(24.0));
    options.spares = 2;
    let second = options.system().expect("a system").chain().expect("a chain");
    near(spare, second.mttf().expect("a mean"), 0.05);
}

#[test]
fn more_spares_a_faster_wake_up_and_more_capacity_are_better() {
    let mean = |plant: &SharedSpares| plant.mttf().expect("a mean");
    let by_spares: Vec<f64> = (0..3).map(|spares| mean(&plant(25, 12, spares))).collect();
    assert!(by_spares.windows(2).all(|pair| pair[0] < pair[1]), "{by_spares:?}");
    let by_wake =
        [10.0, 1.0, 0.01].map(|wake| mean(&SharedSpares { wake: hours(wake), ..plant(8, 12, 2) }));
    assert!(by_wake.is_sorted(), "{by_wake:?}");
    let by_capacity = [7, 4, 0].map(|too_large| {
        mean(&SharedSpares { groups: 8 - too_large, too_large, ..plant(8, 12, 2) })
    });
    assert!(by_capacity.is_sorted(), "{by_capacity:?}");
}

#[test]
fn numbers_out_of_their_bounds_are_reported_together() {
    let errors = plant(0, 0, 9).mttf().expect_err("three of them");
    assert_eq!(errors.len(), 3, "{errors:?}");
}

/// Every station and spare on its own, without the conditions and the bound of the chain.
fn simulated(plant: &SharedSpares, runs: u32, seed: u64) -> f64 {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (groups, controllers) = (plant.groups as usize, plant.controllers as usize);
    let (fails, repaired) = (plant.mtbf.rate(), plant.mttr.rate());
    let mut sum = 0.0;
    for _ in 0..runs {
        // Stations of each group that have failed; the last one is the understudy.
        let mut down = vec![vec![false; controllers + 1]; groups];
        // Each spare: failed, and the group that it serves, with whether it is awake.
        let mut spares: Vec<(bool, Option<(usize, bool)>)> =
            vec![(false, None); plant.spares as usize];
        let mut now = 0.0;
        loop {
            for (failed, post) in &mut spares {
                let over = post.is_some_and(|(group, _)| !down[group].contains(&true));
                if *failed || over {
                    *post = None;
                }
            }
            for place in 0..spares.len() {
                let served: Vec<usize> =
                    spares.iter().filter_map(|it| it.1.map(|post| post.0)).collect();
                let waits = |group: &usize| down[*group].contains(&true) && !served.contains(group);
                let waiting: Vec<usize> = (0..groups).filter(waits).collect();
                if spares[place] == (false, None) && !waiting.is_empty() {
                    spares[place].1 = Some((waiting[random.random_range(0..waiting.len())], false));
                }
            }
            let has_failed = |group: usize| {
                let awake = spares.iter().any(|it| it.1 == Some((group, true)));
                let stations = &down[group];
                stations[controllers] && !awake && stations[..controllers].contains(&true)
            };
            if (0..groups).any(has_failed) {
                break;
            }
            // The next event by its rate: each station, each spare, each wake-up.
            let mut events: Vec<(f64, usize, usize)> = Vec::new();
            for (group, stations) in down.iter().enumerate() {
                let of = |failed: &bool| if *failed { repaired } else { fails };
                events
                    .extend(stations.iter().enumerate().map(|(place, it)| (of(it), group, place)));
            }
            for (place, (failed, post)) in spares.iter().enumerate() {
                events.push((if *failed { repaired } else { fails }, groups, place));
                if post.is_some_and(|(_, awake)| !awake) {
                    events.push((plant.wake.rate(), groups + 1, place));
                }
            }
            let total: f64 = events.iter().map(|event| event.0).sum();
            now -= (1.0 - random.random::<f64>()).ln() / total;
            let mut at = random.random::<f64>() * total;
            let found = events.iter().find(|event| {
                at -= event.0;
                at <= 0.0
            });
            let &(_, group, place) = found.unwrap_or(&events[0]);
            if group < groups {
                down[group][place] = !down[group][place];
            } else if group == groups {
                spares[place].0 = !spares[place].0;
            } else if random.random::<f64>() < plant.coverage.get() {
                spares[place].1 = spares[place].1.map(|(group, _)| (group, true));
            } else {
                spares[place].0 = true;
            }
        }
        sum += now;
    }
    sum / f64::from(runs)
}

/// 2,000 lives each; their mean has a standard deviation of 2.2 %.
#[test]
fn it_agrees_with_a_simulation_machine_by_machine() {
    let often = |spares, wake, coverage| SharedSpares {
        mtbf: hours(1000.0),
        mttr: hours(10.0),
        wake: hours(wake),
        coverage: Probability::new("c", coverage).expect("one"),
        ..plant(4, 3, spares)
    };
    for (plant, seed) in [(often(0, 1.0, 1.0), 1), (often(1, 0.5, 1.0), 2), (often(2, 2.0, 0.8), 3)]
    {
        near(plant.mttf().expect("a mean"), simulated(&plant, 2000, seed), 0.07);
    }
}
