use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{Hours, Observed, Options, System, outlook};

fn hours(value: f64) -> Hours {
    Hours::new("a time", value).expect("a time")
}

fn system() -> System {
    Options::new(3, hours(1.0), hours(1.0)).system().expect("a system")
}

/// A year of four boxes, with failures at `failures_at`.
fn observed(failures_at: Vec<f64>) -> Observed {
    let count = failures_at.len() as u64;
    Observed {
        hours: 8_760.0,
        working_hours: 35_000.0,
        failures_at,
        asked: count,
        masked: count,
        repairs: count,
        repairing_hours: 24.0 * (count as f64 + 0.5),
        detection_hours: Vec::new(),
    }
}

fn even(count: u32) -> Vec<f64> {
    (1..=count).map(|k| 8_760.0 * f64::from(k) / f64::from(count + 1)).collect()
}

#[test]
fn what_was_seen_narrows_what_is_expected() {
    let look = |observed: &Observed| {
        let mut random = Pcg64::seed_from_u64(3);
        outlook(observed, &system(), hours(1_000.0), 0.9, 400, &mut random).expect("an outlook")
    };
    let few = look(&observed(even(4)));
    let mut long = observed(even(40));
    long.working_hours *= 10.0;
    let many = look(&long);
    let width = |outlook: &understudy_reliability::Outlook| {
        outlook.reliability.upper.expect("an end") - outlook.reliability.lower
    };
    assert!(width(&many) < 0.5 * width(&few), "{} {}", width(&many), width(&few));
    assert!(few.failure_rate.covers(4.0 / 35_000.0) && few.coverage.covers(0.95), "{few:?}");
    assert_eq!(few.detection_rate, None);
    let mut slow = observed(even(4));
    slow.detection_hours = vec![500.0; 4];
    assert!(look(&slow).reliability.estimate < few.reliability.estimate);
    let mut leaky = observed(even(4));
    leaky.masked = 2;
    assert!(look(&leaky).reliability.estimate < few.reliability.estimate);
}

#[test]
fn credible_intervals_hold_the_rate_as_often_as_they_say() {
    let (mut covered, trials) = (0, 400);
    for seed in 0..trials {
        let mut random = Pcg64::seed_from_u64(seed);
        let (mut at, mut failures_at) = (0.0, Vec::new());
        loop {
            let gap: f64 = Exp1.sample(&mut random);
            at += 1_000.0 * gap;
            if at > 8_760.0 {
                break;
            }
            failures_at.push(at);
        }
        let observed = Observed { working_hours: 8_760.0, ..observed(failures_at) };
        let found =
            outlook(&observed, &system(), hours(1.0), 0.9, 100, &mut random).expect("an outlook");
        covered += u32::from(found.failure_rate.covers(1e-3));
    }
    // 90 % of 400 with four standard errors.
    assert!((336..=384).contains(&covered), "{covered}");
}

#[test]
fn an_assumption_that_fails_is_named() {
    let doubts = |failures_at: Vec<f64>| {
        let mut random = Pcg64::seed_from_u64(5);
        let found = outlook(&observed(failures_at), &system(), hours(10.0), 0.9, 100, &mut random);
        found.expect("an outlook").doubts
    };
    assert!(doubts(even(20)).is_empty());
    let wearing: Vec<f64> = (1..=20).map(|k| 8_760.0 * (f64::from(k) / 21.0).powf(0.25)).collect();
    assert!(doubts(wearing)[0].contains("became more frequent"));
    let bunched: Vec<f64> =
        (0..20).map(|k| 2_000.0 * f64::from(1 + k / 6) + f64::from(k)).collect();
    assert!(doubts(bunched).iter().any(|doubt| doubt.contains("clustered")));
}

#[test]
fn observations_that_contradict_themselves_are_refused() {
    let code = |change: &dyn Fn(&mut Observed), draws: usize| {
        let mut observed = observed(even(4));
        change(&mut observed);
        let mut random = Pcg64::seed_from_u64(1);
        outlook(&observed, &system(), hours(10.0), 0.9, draws, &mut random).expect_err("refused")[0]
            .code()
    };
    assert_eq!(code(&|observed| observed.masked = 5, 100), "U0716");
    assert_eq!(code(&|observed| observed.failures_at.reverse(), 100), "U0716");
    assert_eq!(code(&|observed| observed.working_hours = 0.0, 100), "U0701");
    assert_eq!(code(&|observed| observed.detection_hours = vec![-1.0], 100), "U0701");
    assert_eq!(code(&|_| {}, 10), "U0704");
}
