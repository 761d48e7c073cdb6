use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{Rule, rare_event};

use crate::support::system;

#[test]
fn rare_failures_are_found_without_waiting_for_them() {
    for (controllers, spares) in [(3, 1), (20, 1), (5, 2), (3, 3)] {
        let chain =
            system(controllers, spares, Rule::AsBuilt, 10_000.0, 24.0).chain().expect("a chain");
        let exact = chain.mttf().expect("a mean");
        let runs: Vec<_> = (0..100)
            .map(|seed| {
                let mut random = Pcg64::seed_from_u64(seed);
                rare_event(&chain, 2_000, 0.95, &mut random).expect("an estimate")
            })
            .collect();
        let covered = runs.iter().filter(|run| run.mean_hours.covers(exact)).count();
        assert!(covered >= 86, "{controllers}, {spares}: {covered} of 100");
        let reduction = runs.iter().map(|run| run.variance_reduction).sum::<f64>() / 100.0;
        assert!(reduction > 5.0, "{controllers}, {spares}: {reduction}");
    }
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let chain = system(3, 1, Rule::AsBuilt, 10_000.0, 24.0).chain().expect("a chain");
    let mut random = Pcg64::seed_from_u64(1);
    assert_eq!(rare_event(&chain, 10, 0.95, &mut random).expect_err("too few").code(), "U0704");
    assert_eq!(
        rare_event(&chain, 1_000, 1.5, &mut random).expect_err("no confidence").code(),
        "U0703"
    );
}
