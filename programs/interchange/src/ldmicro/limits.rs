//! How far a counter is of interest.

use std::collections::HashMap;

use super::parse::{Counter, Element, Kind};

/// How far a counter can be told from one that goes on: past the numbers that it is compared with, nothing sees its value.
///
/// None where more is done with it than to count one way, to compare it, and to set it to numbers.
pub(super) fn limits(rungs: &[Vec<Element>]) -> HashMap<String, Option<(i64, i64)>> {
    let mut limits = HashMap::new();
    let mut directions: HashMap<String, Counter> = HashMap::new();
    rungs.iter().for_each(|rung| find_limits(rung, &mut limits, &mut directions));
    limits
}

fn find_limits(
    series: &[Element],
    limits: &mut HashMap<String, Option<(i64, i64)>>,
    directions: &mut HashMap<String, Counter>,
) {
    for element in series {
        match &element.kind {
            Kind::Counter(direction, name, value) => {
                let first = *directions.entry(name.clone()).or_insert(*direction);
                see(limits, name, (first == *direction).then_some(*value));
            }
            Kind::Move(name, value) => {
                see(limits, name, value.parse().ok());
                see(limits, value, None);
            }
            Kind::Compare(_, left, right) => {
                see(limits, left, right.parse().ok());
                see(limits, right, left.parse().ok());
            }
            Kind::Calculate(_, to, left, right) => {
                [to, left, right].into_iter().for_each(|name| see(limits, name, None))
            }
            Kind::Retentive(name, _) => see(limits, name, None),
            Kind::Parallel(branches) => {
                for branch in branches {
                    find_limits(branch, limits, directions);
                }
            }
            _ => {}
        }
    }
}

/// Notes that the name is compared with or set to a number, or used in another way.
fn see(limits: &mut HashMap<String, Option<(i64, i64)>>, name: &str, value: Option<i64>) {
    let known = limits.entry(name.to_owned()).or_insert(Some((0, 0)));
    *known = match (*known, value) {
        (Some((low, high)), Some(value)) => Some((low.min(value), high.max(value))),
        _ => None,
    };
}
