//! The fixture and what the tests share.

use serde_json::Value;
use understudy_reliability::{BoxKind, Hours, Probability, Rule, System};

/// Twelve digits.
pub(crate) const PRECISION: f64 = 1e-12;

pub(crate) fn fixture() -> Value {
    let text = include_str!("../fixtures/high-precision.json");
    serde_json::from_str(text).expect("the fixture is JSON")
}

pub(crate) fn rows<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().expect("an array")
}

pub(crate) fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().expect("a number")
}

pub(crate) fn whole(value: &Value, key: &str) -> u32 {
    u32::try_from(value[key].as_u64().expect("a count")).expect("a small count")
}

pub(crate) fn check(found: f64, expected: f64, what: &str) {
    check_within(found, expected, PRECISION, what);
}

pub(crate) fn check_within(found: f64, expected: f64, precision: f64, what: &str) {
    let error = if found == expected { 0.0 } else { (found - expected).abs() / expected.abs() };
    assert!(error <= precision, "{what}: {found:e} instead of {expected:e}, wrong by {error:e}");
}

pub(crate) fn hours(value: f64) -> Hours {
    Hours::new("a time", value).expect("a time")
}

pub(crate) fn kind(name: &str, count: u32, mtbf: f64, mttr: f64) -> BoxKind {
    BoxKind { name: name.into(), count, mtbf: hours(mtbf), mttr: hours(mttr) }
}

/// Alike boxes, a crew each, and nothing else that fails.
pub(crate) fn system(controllers: u32, spares: u32, rule: Rule, mtbf: f64, mttr: f64) -> System {
    System {
        controllers: vec![kind("controllers", controllers, mtbf, mttr)],
        understudies: kind("understudies", spares, mtbf, mttr),
        groups: 1,
        rule,
        crews: None,
        coverage: Probability::ONE,
        detection: None,
        common_cause: None,
        shared: Vec::new(),
    }
}
