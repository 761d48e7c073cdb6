//! R(t) and 1 - R(t) where one of them is next to nothing: against matrix exponentials of 800 digits (`tests/fixtures/survival.py`).

use serde_json::Value;
use understudy_reliability::{
    AfterFailure, Chain, ChainBuilder, MINIMUM_PROBABILITY, Options, Rule, calculate, read_chain,
};

use crate::support::{check, check_within, hours, number, rows, system, whole};

fn fixture() -> Value {
    let text = include_str!("../fixtures/survival.json");
    serde_json::from_str(text).expect("the fixture is JSON")
}

/// Twelve digits, or nothing where there is nothing to state.
fn check_stated(found: Option<f64>, expected: &Value, what: &str) {
    match (found, expected.as_f64()) {
        (Some(found), Some(expected)) => check(found, expected, what),
        (found, expected) => assert_eq!(found, expected, "{what}"),
    }
}

fn options(row: &Value) -> Options {
    Options {
        spares: whole(row, "spares"),
        coverage: number(row, "coverage"),
        ..Options::new(
            whole(row, "controllers"),
            hours(number(row, "mtbf")),
            hours(number(row, "mttr")),
        )
    }
}

#[test]
fn every_model_has_twelve_digits_at_both_ends() {
    for row in rows(&fixture(), "systems") {
        for place in 0..rows(row, "cluster").len() {
            let expected = |model: &str, key: &str| row[model][place][key].clone();
            let time = number(&row["cluster"][place], "hours");
            let asked = Options { mission: Some(hours(time)), ..options(row) };
            let found = calculate(&asked).expect("an answer");
            let at = found.mission.expect("a mission");
            for (model, works, failed) in [
                ("cluster", at.reliability_cluster, at.unreliability_cluster),
                ("paper", at.reliability_paper, at.unreliability_paper),
                ("duplex", at.reliability_duplex, at.unreliability_duplex),
                ("tmr", at.reliability_tmr, at.unreliability_tmr),
                ("simplex", at.reliability_simplex, at.unreliability_simplex),
            ] {
                let what = format!("{model} of {asked:?}");
                check_stated(works, &expected(model, "works"), &format!("R, {what}"));
                check_stated(failed, &expected(model, "failed"), &format!("F, {what}"));
            }
        }
    }
}

#[test]
fn a_chain_from_a_file_has_them_too() {
    let text = "state both\nstate one\nstate none failure\n\
                both -> one : 2 / 10000h\none -> both : 1 / 24h\none -> none : 1 / 10000h\n";
    let chain = read_chain("pair.chain", text).chain.expect("a chain");
    // mpmath, 60 digits: s = 3/10000 + 1/24, d = sqrt(s*s - 8/10000**2), a = (s + d)/2, b = (s - d)/2,
    // R = (a*exp(-b*t) - b*exp(-a*t))/(a - b)
    for (time, works, failed) in
        [(1e-6, 1.0, 9.999_999_860_111_113e-21), (1e8, 2.007_492_796_641_722_5e-21, 1.0)]
    {
        let at = chain.transient(time, AfterFailure::Final).expect("P(t)");
        check(at.working, works, "R");
        check(at.failed, failed, "F");
    }
    let gone = chain.reliability(1.5e9).expect_err("below 1e-300");
    assert_eq!(gone.code(), "U0715");
    assert!(gone.to_string().contains("below 1e-300"), "{gone}");
}

/// Four hundred states in a row, each left once an hour on average.
fn stages(repeat: usize) -> Chain {
    let mut builder = ChainBuilder::new();
    for _ in 0..repeat {
        builder.state("");
    }
    builder.failure("failed");
    for place in 0..repeat {
        builder.transition(place, place + 1, 1.0);
    }
    builder.build().expect("a chain")
}

#[test]
fn a_chain_too_large_to_be_squared_has_them_too() {
    let chain = stages(400);
    let fixture = fixture();
    let expected = rows(&fixture, "stages");
    let times: Vec<f64> = expected.iter().map(|row| number(row, "hours")).collect();
    let found = chain.transients(&times, AfterFailure::Final).expect("P(t)");
    for (found, row) in found.iter().zip(expected) {
        let stated = |value: f64| (value >= MINIMUM_PROBABILITY).then_some(value);
        check_stated(stated(found.working), &row["works"], &format!("R, {row}"));
        check_stated(stated(found.failed), &row["failed"], &format!("F, {row}"));
    }
}

/// Pairs that are independent, one by one and as one chain of all of them, by uniformisation.
#[test]
fn the_product_of_single_controllers_is_their_chain() {
    let pairs = system(400, 1, Rule::AsBuilt, 1e4, 2e3);
    let chain = pairs.copies_chain(2).expect("a chain");
    for time in [1e-3, 3_000.0, 10_000.0] {
        let alone = pairs.copies_survival(2, time).expect("R");
        let found = chain.transient(time, AfterFailure::Final).expect("P(t)");
        check(found.working, alone.working, "R");
        check(found.failed, alone.failed, "F");
        let mut busy = pairs.clone();
        busy.crews = Some(400);
        assert_eq!(busy.copies_survival(2, time).expect("R"), alone);
    }
}

/// A fast and a slow repair, over a time of 10^19 steps: the state at the end is known by hand.
#[test]
fn many_steps_do_not_add_up_to_a_loss() {
    let mut builder = ChainBuilder::new();
    let (a, b, c) = (builder.state("a"), builder.state("b"), builder.state("c"));
    let lost = builder.failure("lost");
    builder
        .transition(a, b, 1e-9)
        .transition(b, a, 3e-9)
        .transition(a, c, 1e-3)
        .transition(c, a, 1e7)
        .transition(a, lost, 1e-30);
    let chain = builder.build().expect("a chain");
    let at = chain.transient(1e12, AfterFailure::Final).expect("P(t)");
    check(at.probabilities[b], 0.25 / (1.0 + 0.75e-10), "b");
    check(at.probabilities[c], 0.75e-10 / (1.0 + 0.75e-10), "c");
    check_within(at.failed, 1e-30 * (7.5e11 + 6.25e7), 1e-9, "lost");
}
