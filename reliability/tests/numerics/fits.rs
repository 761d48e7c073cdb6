use rand::RngExt;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{AfterFailure, Law, Null, Rule, fit};

use crate::support::system;

/// The law of the paper's model with three controllers, MTBF 10,000 h.
fn law(mttr: f64) -> Law {
    let system = system(3, 1, Rule::Paper, 10_000.0, mttr);
    Law::of_chain(&system.chain().expect("a chain")).expect("a law")
}

fn sample(law: &Law, count: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| law.quantile(random.random::<f64>())).collect()
}

#[test]
fn critical_values_are_those_of_the_literature_where_there_are_any() {
    // At long odds the law is exponential. Stephens (1974): A² at 5 % is 2.492 where the law is known and 1.321/(1 + 0.6/n) where its
    // mean was fitted; D is 1.358/√n where known (n large), and about 1.094/√n (Lilliefors 1969) where fitted.
    let law = law(0.01);
    let hours = sample(&law, 100, 1);
    let mut random = Pcg64::seed_from_u64(2);
    let known = fit(&hours, &law, Null::Specified, 4_000, &mut random).expect("a fit");
    assert!((known.anderson_darling_critical - 2.492).abs() < 0.2, "{known:?}");
    assert!((known.kolmogorov_smirnov_critical - 0.134).abs() < 0.006, "{known:?}");
    let fitted = fit(&hours, &law, Null::ScaleFitted, 4_000, &mut random).expect("a fit");
    assert!((fitted.anderson_darling_critical - 1.321 / 1.006).abs() < 0.1, "{fitted:?}");
    assert!((fitted.kolmogorov_smirnov_critical - 0.1075).abs() < 0.005, "{fitted:?}");
}

#[test]
fn a_true_law_is_rejected_as_often_as_promised() {
    let law = law(5_000.0);
    for null in [Null::Specified, Null::ScaleFitted] {
        let rejected = (0..200)
            .filter(|&seed| {
                let mut random = Pcg64::seed_from_u64(1_000 + seed);
                let hours = sample(&law, 30, seed);
                fit(&hours, &law, null, 200, &mut random).expect("a fit").anderson_darling_p < 0.05
            })
            .count();
        // 5 % of 200 with three standard errors.
        assert!(rejected <= 20, "{null:?}: {rejected}");
    }
}

#[test]
fn an_exponential_law_is_told_from_a_hypoexponential_one() {
    // Strong acceleration: repair is slow, and short times are rarer than in an exponential law of the same mean.
    let hypoexponential = law(5_000.0);
    let exponential = law(1e-3);
    let mut random = Pcg64::seed_from_u64(3);
    let found =
        fit(&sample(&hypoexponential, 1_000, 4), &exponential, Null::ScaleFitted, 500, &mut random);
    assert!(found.expect("a fit").anderson_darling_p < 0.01);
}

#[test]
fn the_table_of_a_law_is_that_of_its_chain() {
    let law = law(500.0);
    let chain = system(3, 1, Rule::Paper, 10_000.0, 500.0).chain().expect("a chain");
    let times: Vec<f64> = (1..100).map(|step| law.mean() * f64::from(step) / 20.0).collect();
    let exact = chain.transients(&times, AfterFailure::Final).expect("P(t)");
    for (hours, exact) in times.into_iter().zip(exact) {
        assert!((law.unreliability(hours) - exact.failed).abs() < 1e-5, "{hours}");
    }
    for share in (1..100).map(|step| f64::from(step) / 100.0) {
        assert!((law.unreliability(law.quantile(share)) - share).abs() < 1e-12);
    }
}

#[test]
fn what_allows_no_test_is_refused() {
    let law = law(24.0);
    let mut random = Pcg64::seed_from_u64(5);
    let mut code = |hours: &[f64], bootstrap| {
        fit(hours, &law, Null::Specified, bootstrap, &mut random).expect_err("refused").code()
    };
    assert_eq!(code(&[1.0, 2.0], 1_000), "U0716");
    assert_eq!(code(&[1.0; 10], 5), "U0716");
    assert_eq!(code(&[1.0, 2.0, 3.0, 4.0, -5.0], 1_000), "U0701");
}
