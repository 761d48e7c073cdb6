use proptest::prelude::*;
use understudy_reliability::{Probability, ReliabilityError, ThreeState};

use crate::support::{check, check_within, fixture, number, rows, whole};

#[test]
fn twelve_digits_for_every_size_rate_and_time() {
    let fixture = fixture();
    let mut worst: f64 = 0.0;
    for row in rows(&fixture, "three_state") {
        let coverage = Probability::new("coverage", number(row, "coverage")).expect("a coverage");
        let model = ThreeState::with_coverage(
            u64::from(whole(row, "controllers")),
            number(row, "failure_rate"),
            number(row, "repair_rate"),
            coverage,
        )
        .expect("a model");
        let what = format!(
            "{} controllers, repair {}",
            row["controllers"], row["repair_rate"]
        );
        check(model.mttf(), number(row, "mttf"), &what);
        check(model.variance(), number(row, "variance"), &what);
        for at in rows(row, "times") {
            let hours = number(at, "hours");
            let what = format!("{what}, {hours} h");
            let found = model.probabilities(hours);
            let values = [
                (found.p0, "p0"),
                (found.p1, "p1"),
                (found.p2, "p2"),
                (model.density(hours), "density"),
            ];
            for (value, key) in values {
                let expected = number(at, key);
                worst = worst.max((value / expected - 1.0).abs());
                check(value, expected, &format!("{what}, {key}"));
            }
            if let Some(hazard) = at["hazard"].as_f64() {
                check(model.hazard(hours), hazard, &format!("{what}, hazard"));
            }
            check(
                model.reliability(hours),
                number(at, "p0") + number(at, "p1"),
                &what,
            );
        }
    }
    assert!(worst > 0.0, "the fixture has rows");
}

#[test]
fn nothing_overflows_where_the_printed_equations_do() {
    let model = ThreeState::new(3, 1e-4, 1.0 / 24.0).expect("a model");
    for hours in [16_754.0, 16_755.0, 1e6, 1e9, 1e300] {
        let found = model.probabilities(hours);
        assert!(
            (0.0..=1.0).contains(&found.p0) && (0.0..=1.0).contains(&found.p2),
            "{found:?}"
        );
        assert!(model.hazard(hours).is_finite() && model.log_reliability(hours) < 0.0);
    }
    check(model.probabilities(0.0).p0, 1.0, "at the start");
    assert_eq!(model.probabilities(0.0).p2, 0.0);
}

#[test]
fn the_paper_s_mean_is_the_one_that_is_printed() {
    let model = ThreeState::new(20, 1e-4, 1.0 / 24.0).expect("a model");
    // (20): ((2N+1) MTTR + MTBF) MTBF/(N (N+1) MTTR)
    check(
        model.mttf(),
        (41.0 * 24.0 + 10_000.0) * 10_000.0 / (20.0 * 21.0 * 24.0),
        "(20)",
    );
    assert_eq!(model.mttf().round(), 10_897.0);
}

#[test]
fn what_is_no_model_is_refused_with_its_value() {
    for (lambda, mu) in [
        (0.0, 1.0),
        (-1.0, 1.0),
        (1.0, f64::INFINITY),
        (f64::NAN, 1.0),
        (1.0, 0.0),
    ] {
        assert!(matches!(
            ThreeState::new(3, lambda, mu),
            Err(ReliabilityError::Rate { .. })
        ));
    }
    let none = ThreeState::new(0, 1.0, 1.0).expect_err("no controllers");
    assert!(none.to_string().contains("is 0;"), "{none}");
    let error = Probability::new("coverage", 1.5).expect_err("not a probability");
    assert_eq!(
        error.to_string(),
        "U0703: coverage is 1.5; a probability lies between 0 and 1"
    );
    let tiny = ThreeState::new(3, 1e-300, 1e300).expect_err("beyond the arithmetic");
    assert_eq!(tiny.code(), "U0715");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn quantiles_are_the_inverse(
        controllers in 1_u64..1000,
        ratio in 0.0_f64..8.0,
        probability in prop_oneof![1e-12..1e-3_f64, 0.001..0.999_f64],
        coverage in prop_oneof![Just(1.0), 0.0..1.0_f64],
    ) {
        let coverage = Probability::new("c", coverage).unwrap();
        let model = ThreeState::with_coverage(controllers, 1e-4, 1e-4 * 10_f64.powf(ratio), coverage).unwrap();
        let hours = model.quantile(Probability::new("p", probability).unwrap());
        let back = if probability > 0.5 { 1.0 - model.reliability(hours) } else { model.unreliability(hours) };
        check_within(back, probability, 1e-10, "there and back");
    }

    #[test]
    fn the_parts_make_the_whole(
        controllers in 1_u64..1000,
        ratio in -2.0_f64..8.0,
        scale in -6.0_f64..1.5,
        coverage in prop_oneof![Just(1.0), Just(0.0), 0.0..1.0_f64],
    ) {
        let coverage = Probability::new("c", coverage).unwrap();
        let model = ThreeState::with_coverage(controllers, 1e-4, 1e-4 * 10_f64.powf(ratio), coverage).unwrap();
        let hours = model.mttf() * 10_f64.powf(scale);
        let found = model.probabilities(hours);
        prop_assert!((found.p0 + found.p1 + found.p2 - 1.0).abs() < 1e-12);
        check_within(model.reliability(hours), found.p0 + found.p1, 1e-12, "R = P0 + P1");
        check_within(model.hazard(hours) * model.reliability(hours), model.density(hours), 1e-12, "h R = f");
        prop_assert!(model.unreliability(hours * 1.01) >= found.p2);
    }
}
