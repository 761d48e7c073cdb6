use proptest::prelude::*;
use understudy_reliability::{AfterFailure, Chain, ChainBuilder, ReliabilityError};

use crate::support::{check, check_within};

#[test]
fn a_repaired_failure_is_not_the_end() {
    let mut builder = ChainBuilder::new();
    let (up, down) = (builder.state("up"), builder.failure("down"));
    builder.transition(up, down, 0.01).transition(down, up, 0.5);
    let chain = builder.build().expect("a chain");
    check(chain.mttf().expect("a mean"), 100.0, "first failure");
    let steady = chain.steady_state().expect("a steady state");
    check(steady[down], 0.01 / 0.51, "unavailability");
    let later = chain.transient(1_000.0, AfterFailure::Repaired).expect("a transient");
    check(later.failed, 0.01 / 0.51, "point unavailability");
    check(chain.reliability(100.0).expect("R"), (-1.0_f64).exp(), "reliability");
}

#[test]
fn what_is_no_chain_is_refused() {
    let mut builder = ChainBuilder::new();
    let (a, b) = (builder.state("a"), builder.state("b"));
    builder.transition(a, b, -1.0).transition(a, a, 1.0).transition(a, 7, 1.0).transition(
        b,
        a,
        f64::NAN,
    );
    let messages: Vec<_> =
        builder.build().expect_err("wrong").iter().map(ToString::to_string).collect();
    assert_eq!(
        messages,
        [
            "U0702: the rate a -> b is -1 per hour; a rate must be positive and finite",
            "U0710: the transition from the state a leads to itself",
            "U0709: there is no state 7; the chain has 2 states, counted from 0",
            "U0702: the rate b -> a is NaN per hour; a rate must be positive and finite",
        ]
    );
    let mut island = ChainBuilder::new();
    let (a, b) = (island.state("a"), island.state("b"));
    island.state("island");
    island.transition(a, b, 1.0).transition(b, a, 1.0);
    assert_eq!(
        island.build().expect_err("an island"),
        [ReliabilityError::Unreachable { state: "island".into() }]
    );
    assert_eq!(ChainBuilder::new().build().expect_err("nothing")[0].code(), "U0709");
    let mut endless = ChainBuilder::new();
    let (a, b) = (endless.state("a"), endless.state("b"));
    endless.transition(a, b, 1.0).transition(b, a, 1.0);
    let endless = endless.build().expect("a chain");
    assert_eq!(endless.mttf(), Err(ReliabilityError::NoFailureState));
    let mut out_of_reach = ChainBuilder::new();
    let (a, b, c) = (out_of_reach.state("a"), out_of_reach.state("b"), out_of_reach.failure("c"));
    out_of_reach.transition(a, b, 1.0).transition(b, a, 1.0).transition(c, a, 1.0);
    assert_eq!(out_of_reach.build().expect_err("c")[0].code(), "U0708");
    let mut trap = ChainBuilder::new();
    let (a, b, c) = (trap.state("a"), trap.state("trap"), trap.failure("c"));
    trap.transition(a, b, 1.0).transition(a, c, 1.0);
    let trap = trap.build().expect("a chain");
    assert_eq!(trap.mttf(), Err(ReliabilityError::NeverFails { state: "trap".into() }));
    assert_eq!(trap.steady_state().expect_err("a trap").code(), "U0711");
}

/// A random chain in which each state leads to the next, so that all are reached and all fail in the end.
fn random_chain(rates: &[f64], states: usize) -> (Chain, Vec<Vec<f64>>) {
    let mut builder = ChainBuilder::new();
    let mut matrix = vec![vec![0.0; states + 1]; states];
    for _ in 0..states {
        builder.state("");
    }
    builder.failure("");
    for (index, &rate) in rates.iter().enumerate() {
        let (from, to) = (index / (states + 1), index % (states + 1));
        if from < states && from != to && (rate > 0.6 || to == from + 1) {
            matrix[from][to] = rate;
            builder.transition(from, to, rate);
        }
    }
    (builder.build().expect("a chain"), matrix)
}

/// Gauss-Jordan with pivots on (D - Q) m = 1: nothing in common with the elimination.
fn naive_mean(matrix: &[Vec<f64>]) -> f64 {
    let states = matrix.len();
    let mut rows: Vec<Vec<f64>> = (0..states)
        .map(|i| {
            let out: f64 = matrix[i].iter().sum();
            let mut row: Vec<f64> =
                (0..states).map(|j| if i == j { out } else { -matrix[i][j] }).collect();
            row.push(1.0);
            row
        })
        .collect();
    for column in 0..states {
        let pivot = (column..states)
            .max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()));
        rows.swap(column, pivot.expect("a row"));
        let row = rows[column].clone();
        for (index, other) in rows.iter_mut().enumerate() {
            if index != column {
                let factor = other[column] / row[column];
                other.iter_mut().zip(&row).for_each(|(value, pivot)| *value -= factor * pivot);
            }
        }
    }
    rows[0][states] / rows[0][0]
}

/// The first row of e^(Qt) by Taylor's series of Qt/2^30 and thirty squarings.
fn naive_exponential(matrix: &[Vec<f64>], hours: f64) -> Vec<f64> {
    let size = matrix.len() + 1;
    let step = hours / 2.0_f64.powi(30);
    let mut power = vec![vec![0.0; size]; size];
    for (i, row) in matrix.iter().enumerate() {
        let out: f64 = row.iter().sum::<f64>() * step;
        for (j, rate) in row.iter().enumerate() {
            power[i][j] = rate * step;
        }
        power[i][i] = -out;
    }
    let half_square =
        |i: usize, j: usize| (0..size).map(|k| power[i][k] * power[k][j]).sum::<f64>() / 2.0;
    power =
        (0..size).map(|i| (0..size).map(|j| power[i][j] + half_square(i, j)).collect()).collect();
    // Powers of (e^(Qh) - I), so that the small entries are not lost beside 1.
    for _ in 0..30 {
        let square = |i: usize, j: usize| (0..size).map(|k| power[i][k] * power[k][j]).sum::<f64>();
        power = (0..size)
            .map(|i| (0..size).map(|j| 2.0 * power[i][j] + square(i, j)).collect())
            .collect();
    }
    (0..size).map(|j| power[0][j] + f64::from(u8::from(j == 0))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn elimination_is_the_linear_system(states in 1_usize..8, rates in prop::collection::vec(0.01..1.0_f64, 72)) {
        let (chain, matrix) = random_chain(&rates, states);
        check_within(chain.mttf().unwrap(), naive_mean(&matrix), 1e-9, "mean");
        let moments = chain.time_to_failure().unwrap();
        check_within(moments.mean_hours, naive_mean(&matrix), 1e-9, "mean");
        prop_assert!(moments.variance_hours_squared > 0.0);
    }

    #[test]
    fn transients_are_the_matrix_exponential(
        states in 1_usize..7,
        rates in prop::collection::vec(0.05..1.0_f64, 56),
        hours in prop_oneof![0.01..50.0_f64, 50.0..20_000.0_f64],
    ) {
        let (chain, matrix) = random_chain(&rates, states);
        let naive = naive_exponential(&matrix, hours);
        let found = chain.transient(hours, AfterFailure::Final).unwrap();
        for (found, naive) in found.probabilities.iter().zip(&naive) {
            prop_assert!((found - naive).abs() < 1e-9, "{found} instead of {naive}");
        }
    }

    #[test]
    fn the_long_run_balances(states in 2_usize..7, rates in prop::collection::vec(0.05..1.0_f64, 56)) {
        let mut builder = ChainBuilder::new();
        for _ in 0..states {
            builder.state("");
        }
        for from in 0..states {
            for to in (0..states).filter(|to| *to != from) {
                let rate = rates[from * states + to];
                if rate > 0.5 || to == (from + 1) % states {
                    builder.transition(from, to, rate);
                }
            }
        }
        let chain = builder.build().unwrap();
        let steady = chain.steady_state().unwrap();
        prop_assert!((steady.iter().sum::<f64>() - 1.0).abs() < 1e-13);
        for state in 0..states {
            let into: f64 = (0..states).map(|from| {
                let rates = chain.successors(from).filter(|(to, _)| *to == state);
                steady[from] * rates.map(|(_, rate)| rate).sum::<f64>()
            }).sum();
            check(into, steady[state] * chain.leaving(state), "flow in is flow out");
        }
    }
}
