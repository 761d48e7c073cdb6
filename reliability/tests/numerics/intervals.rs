use understudy_reliability::{
    Hours, Interval, Rule, Stopped, acceleration_bias, mean_time, proportion, times_to_failure,
};

use crate::support::{check_within as check, fixture, number, system};

#[test]
fn mean_times_have_the_quantiles_of_chi_squared() {
    for row in fixture()["chi_squared"].as_array().expect("rows") {
        let (freedom, probability) = (number(row, "freedom"), number(row, "probability"));
        if probability != 0.025 && probability != 0.975 {
            continue;
        }
        let failures = (freedom / 2.0) as u64;
        let interval = mean_time(failures, 1_000.0, Stopped::AtFailure, 0.95).expect("an interval");
        let end =
            if probability == 0.025 { interval.upper.expect("an end") } else { interval.lower };
        check(end, 2_000.0 / number(row, "value"), 1e-10, &row.to_string());
    }
}

#[test]
fn proportions_have_the_quantiles_of_beta() {
    for row in fixture()["beta"].as_array().expect("rows") {
        let (a, b) = (number(row, "a") as u64, number(row, "b") as u64);
        let probability = number(row, "probability");
        // Lower end: I(x; k, n - k + 1); upper end: I(x; k + 1, n - k).
        let (found, what) = if probability == 0.025 {
            (proportion(a, a + b - 1, 0.95).expect("an interval").lower, "lower")
        } else {
            (
                proportion(a - 1, a + b - 1, 0.95).expect("an interval").upper.expect("an end"),
                "upper",
            )
        };
        check(found, number(row, "value"), 1e-10, &format!("{what} {row}"));
    }
}

#[test]
fn censoring_is_handled() {
    let none = mean_time(0, 5_000.0, Stopped::AtTime, 0.95).expect("a bound");
    assert_eq!((none.estimate, none.upper), (None, None));
    // The rule of three.
    check(none.lower, 5_000.0 / 2.995_732_273_553_991, 1e-12, "no failure");
    let all = times_to_failure(&[10.0, 20.0, 30.0], &[], 0.9).expect("an interval");
    assert_eq!(all.estimate, Some(20.0));
    let some = times_to_failure(&[10.0, 20.0], &[30.0], 0.9).expect("an interval");
    assert_eq!(some.estimate, Some(30.0));
    assert!(some.upper > all.upper, "two failures in the same time say less");
    assert!(some.covers(20.0) && !some.covers(5.0));
}

#[test]
fn measurements_that_say_nothing_are_refused() {
    let code = |result: Result<Interval, understudy_reliability::ReliabilityError>| {
        result.expect_err("refused").code()
    };
    assert_eq!(code(mean_time(0, 1.0, Stopped::AtFailure, 0.95)), "U0716");
    assert_eq!(code(mean_time(1, 0.0, Stopped::AtFailure, 0.95)), "U0701");
    assert_eq!(code(mean_time(1, 1.0, Stopped::AtFailure, 1.5)), "U0703");
    assert_eq!(code(mean_time(1, 1.0, Stopped::AtFailure, 1.0)), "U0716");
    assert_eq!(code(proportion(1, 0, 0.95)), "U0716");
    assert_eq!(code(proportion(3, 2, 0.95)), "U0716");
    assert_eq!(code(times_to_failure(&[f64::NAN], &[], 0.95)), "U0701");
}

/// The exact coverage of the exact interval, summed over all outcomes: never below what it promises.
#[test]
fn the_exact_interval_is_exact() {
    for trials in [1_u64, 5, 20] {
        let intervals: Vec<Interval> =
            (0..=trials).map(|k| proportion(k, trials, 0.9).expect("an interval")).collect();
        for step in 1..100 {
            let p = f64::from(step) / 100.0;
            let mut choose = 1.0;
            let mut covered = 0.0;
            for k in 0..=trials {
                let probability = choose * p.powi(k as i32) * (1.0 - p).powi((trials - k) as i32);
                if intervals[k as usize].covers(p) {
                    covered += probability;
                }
                choose *= (trials - k) as f64 / (k + 1) as f64;
            }
            assert!(covered >= 0.9 - 1e-12, "{trials} trials, {p}: {covered}");
        }
    }
}

#[test]
fn acceleration_is_honest_about_detection() {
    let system = system(2, 1, Rule::AsBuilt, 10_000.0, 24.0);
    let detection: Hours = "50ms".parse().expect("a time");
    let slow = acceleration_bias(&system, detection, 1.0, false).expect("a bias");
    assert_eq!(slow.relative, 0.0);
    let fast = acceleration_bias(&system, detection, 1e4, false).expect("a bias");
    // 50 ms at ten thousand times the speed are 500 s of the plant beside a repair of 24 h.
    assert!((-0.02..-0.001).contains(&fast.relative), "{fast:?}");
    let refused = acceleration_bias(&system, detection, 1e5, false).expect_err("too fast");
    assert_eq!(refused[0].code(), "U0717");
    assert!(
        acceleration_bias(&system, detection, 1e5, true).expect("forced").relative < fast.relative
    );
    assert_eq!(
        acceleration_bias(&system, detection, 0.5, true).expect_err("slower")[0].code(),
        "U0716"
    );
}
