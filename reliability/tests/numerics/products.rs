use proptest::prelude::*;
use understudy_reliability::{Rule, Unit, at_most_down, poisson_binomial, product_reliability};

use crate::support::{check, check_within, kind, system};

fn units(count: usize, repaired: bool) -> Vec<Unit> {
    (0..count)
        .map(|k| {
            let scale = 1.0 + k as f64 / 7.0;
            let repair = if repaired {
                1.0 / (10.0 + k as f64)
            } else {
                0.0
            };
            Unit::new(1e-4 * scale, repair).expect("a unit")
        })
        .collect()
}

#[test]
fn units_that_are_not_repaired_are_poisson_binomial() {
    let units = units(8, false);
    for tolerated in 0..8 {
        let works = |mask: u32| mask.count_ones() as usize <= tolerated;
        let found = product_reliability(&units, works, 1_000.0).expect("a reliability");
        check_within(found, at_most_down(&units, tolerated, 1_000.0), 1e-11, "R");
    }
}

#[test]
fn every_subset_is_counted_once() {
    let down = [0.1, 0.25, 0.5, 0.9, 0.0, 1.0];
    let mut naive = vec![0.0; down.len() + 1];
    for mask in 0_u32..1 << down.len() {
        let factors = down.iter().enumerate();
        let probability: f64 = factors
            .map(|(bit, p)| if mask >> bit & 1 == 1 { *p } else { 1.0 - p })
            .product();
        naive[mask.count_ones() as usize] += probability;
    }
    for (found, expected) in poisson_binomial(&down).iter().zip(&naive) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
}

#[test]
fn the_product_is_the_cluster_of_unequal_controllers() {
    // Twelve controllers of three kinds and an understudy, as a product of 13 units and as a lumped chain.
    let mut unequal = system(12, 1, Rule::AsBuilt, 10_000.0, 24.0);
    unequal.controllers = vec![
        kind("a", 5, 10_000.0, 24.0),
        kind("b", 4, 5_000.0, 12.0),
        kind("c", 3, 20_000.0, 48.0),
    ];
    let chain = unequal.chain().expect("a chain");
    let mut units = Vec::new();
    for kind in unequal.controllers.iter().chain([&unequal.understudies]) {
        let unit = Unit::new(kind.mtbf.rate(), kind.mttr.rate()).expect("a unit");
        units.extend(std::iter::repeat_n(unit, kind.count as usize));
    }
    let works = |mask: u32| mask >> 12 & 1 == 0 || mask & 0xfff == 0;
    let found = product_reliability(&units, works, 400.0).expect("a reliability");
    check_within(
        found,
        chain.reliability(400.0).expect("a reliability"),
        1e-11,
        "R",
    );
}

#[test]
fn what_is_no_product_is_refused() {
    assert_eq!(
        Unit::new(0.0, 1.0).expect_err("no failures").code(),
        "U0702"
    );
    assert_eq!(Unit::new(1.0, -1.0).expect_err("negative").code(), "U0702");
    let none = product_reliability(&[], |_| true, 1.0).expect_err("no units");
    assert_eq!(none.code(), "U0704");
    let unit = Unit::new(1.0, 1e9).expect("a unit");
    let long = product_reliability(&[unit; 20], |_| true, 1e9).expect_err("too long");
    assert_eq!(long.code(), "U0713");
    assert_eq!(product_reliability(&[unit], |_| false, 1.0), Ok(0.0));
    check(
        Unit::new(1e-4, 0.0).expect("a unit").down(10_000.0),
        1.0 - (-1.0_f64).exp(),
        "down",
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn it_is_a_distribution(down in prop::collection::vec(0.0..=1.0_f64, 0..40)) {
        let counts = poisson_binomial(&down);
        prop_assert!((counts.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let mean: f64 = counts.iter().enumerate().map(|(k, p)| k as f64 * p).sum();
        prop_assert!((mean - down.iter().sum::<f64>()).abs() < 1e-10);
    }
}
