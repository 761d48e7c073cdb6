use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{
    BoxKind, Hours, Probability, Rule, System, ThreeState, rare_event, simulate,
};

fn model(controllers: u64, mttr: f64, coverage: f64) -> ThreeState {
    let coverage = Probability::new("coverage", coverage).expect("a coverage");
    ThreeState::with_coverage(controllers, 1e-4, 1.0 / mttr, coverage).expect("a model")
}

#[test]
fn the_interval_of_the_simulation_holds_the_closed_form() {
    for (controllers, mttr, coverage) in [
        (3, 24.0, 1.0),
        (20, 24.0, 1.0),
        (3, 5_000.0, 1.0),
        (1, 10_000.0, 0.5),
        (20, 24.0, 0.99),
        (2, 24.0, 0.0),
    ] {
        let model = model(controllers, mttr, coverage);
        let mission = model.mttf() / 2.0;
        let covered: Vec<(bool, bool)> = (0..200)
            .map(|seed| {
                let mut random = Pcg64::seed_from_u64(seed);
                let found = simulate(&model, 500, Some(mission), 0.95, &mut random).expect("means");
                let reliability = found.reliability.expect("a mission");
                (
                    found.mean_hours.covers(model.mttf()),
                    reliability.covers(model.reliability(mission)),
                )
            })
            .collect();
        let means = covered.iter().filter(|(mean, _)| *mean).count();
        let reliabilities = covered
            .iter()
            .filter(|(_, reliability)| *reliability)
            .count();
        // 95 % of 200 with three standard errors.
        assert!(
            (180..=200).contains(&means),
            "{controllers} {mttr} {coverage}: {means}"
        );
        assert!(
            (180..=200).contains(&reliabilities),
            "{controllers} {mttr} {coverage}: {reliabilities}"
        );
    }
}

/// The same chain, step by step.
fn naive(n: f64, lambda: f64, mu: f64, coverage: f64, random: &mut impl Rng) -> f64 {
    let mut hours = 0.0;
    loop {
        let first: f64 = Exp1.sample(random);
        hours += first / ((n + 1.0) * lambda);
        if random.random::<f64>() >= coverage {
            return hours;
        }
        let second: f64 = Exp1.sample(random);
        hours += second / (n * lambda + mu);
        if random.random::<f64>() * (n * lambda + mu) < n * lambda {
            return hours;
        }
    }
}

#[test]
fn paths_have_the_law_of_those_that_are_played_step_by_step() {
    let (n, mttr, coverage) = (3, 2_000.0, 0.9);
    let model = model(n, mttr, coverage);
    let mut random = Pcg64::seed_from_u64(7);
    let count = 20_000;
    let mut fast: Vec<f64> = (0..count).map(|_| model.draw(&mut random)).collect();
    let mut slow: Vec<f64> = (0..count)
        .map(|_| naive(n as f64, 1e-4, 1.0 / mttr, coverage, &mut random))
        .collect();
    fast.sort_by(f64::total_cmp);
    slow.sort_by(f64::total_cmp);
    for place in (500..count).step_by(500) {
        // Both against the closed form at their own quantiles: within four standard errors.
        let share = place as f64 / count as f64;
        let error = 4.0 * (share * (1.0 - share) / count as f64).sqrt();
        for times in [&fast, &slow] {
            let found = model.unreliability(times[place]);
            assert!((found - share).abs() < error, "{share}: {found}");
        }
    }
}

fn cluster(controllers: u32, spares: u32) -> System {
    let hours = |value| Hours::new("a time", value).expect("a time");
    let kind = |name: &str, count| BoxKind {
        name: name.into(),
        count,
        mtbf: hours(10_000.0),
        mttr: hours(24.0),
    };
    System {
        controllers: vec![kind("controllers", controllers)],
        understudies: kind("understudies", spares),
        groups: 1,
        rule: Rule::AsBuilt,
        crews: None,
        coverage: Probability::ONE,
        detection: None,
        common_cause: None,
        shared: Vec::new(),
    }
}

#[test]
fn rare_failures_are_found_without_waiting_for_them() {
    for (controllers, spares) in [(3, 1), (20, 1), (5, 2), (3, 3)] {
        let chain = cluster(controllers, spares).chain().expect("a chain");
        let exact = chain.mttf().expect("a mean");
        let runs: Vec<_> = (0..100)
            .map(|seed| {
                let mut random = Pcg64::seed_from_u64(seed);
                rare_event(&chain, 2_000, 0.95, &mut random).expect("an estimate")
            })
            .collect();
        let covered = runs
            .iter()
            .filter(|run| run.mean_hours.covers(exact))
            .count();
        assert!(covered >= 86, "{controllers}, {spares}: {covered} of 100");
        let reduction = runs.iter().map(|run| run.variance_reduction).sum::<f64>() / 100.0;
        assert!(reduction > 5.0, "{controllers}, {spares}: {reduction}");
    }
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let chain = cluster(3, 1).chain().expect("a chain");
    let mut random = Pcg64::seed_from_u64(1);
    assert_eq!(
        rare_event(&chain, 10, 0.95, &mut random)
            .expect_err("too few")
            .code(),
        "U0704"
    );
    assert_eq!(
        rare_event(&chain, 1_000, 1.5, &mut random)
            .expect_err("no confidence")
            .code(),
        "U0703"
    );
    let model = model(3, 24.0, 1.0);
    assert_eq!(
        simulate(&model, 1, None, 0.95, &mut random)
            .expect_err("too few")
            .code(),
        "U0704"
    );
}

#[test]
fn a_seed_is_a_result() {
    let run = || {
        let mut random = Pcg64::seed_from_u64(42);
        simulate(&model(3, 24.0, 1.0), 100, None, 0.95, &mut random).expect("means")
    };
    assert_eq!(run(), run());
}
