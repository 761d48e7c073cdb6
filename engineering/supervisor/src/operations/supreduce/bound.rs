//! How few states a supervisor with the same effect has at least.
//!
//! After two words that a supervisor's effect tells apart it is in two states: where the plant can do an event after both and only one
//! of them may go on with it, where only one of them is marked, or where one continuation leads to such a difference. So words of which
//! any two are told apart need as many states. Each state of the product of plant and supervisor stands for its words.

use std::collections::{BTreeMap, BTreeSet};

use super::Bounds;
use crate::alphabet::Label;
use crate::automaton::Automaton;
use crate::explicit::{Joint, Product, TooLarge};

/// States of the product that are compared pair by pair; of a larger product only the first different ones, without what follows them.
const MOST: usize = 1_000;

/// The number of states from each of which a set of states that are told apart in pairs is grown.
const SEEDS: usize = 64;

/// What a supervisor asks for after the words of one state of the product.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Demand {
    allowed: BTreeSet<Label>,
    /// What the plant can do and the supervisor forbids.
    forbidden: BTreeSet<Label>,
    /// Whether the supervisor marks; nothing where the plant does not.
    marks: Option<bool>,
}

impl Demand {
    fn clashes(&self, other: &Self) -> bool {
        !self.allowed.is_disjoint(&other.forbidden)
            || !other.allowed.is_disjoint(&self.forbidden)
            || self.marks.zip(other.marks).is_some_and(|(one, other)| one != other)
    }
}

/// A number of states that every supervisor with the effect of `supervisor` on `plant` has at least: the size of a set of words of which
/// any two are told apart, which is found greedily.
///
/// # Errors
/// The product of the two passes the bounds.
pub fn fewest_states(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<usize, TooLarge> {
    if plant.is_empty() || supervisor.is_empty() {
        return Ok(0);
    }
    let product = Product::explore(&[plant, supervisor], &[], Joint::Meet, bounds)?;
    let count = product.state_count();
    let parts: Vec<_> = (0..count)
        .map(|state| (product.component_state(state, 0), product.component_state(state, 1)))
        .collect();
    let product = product.into_automaton(String::new());
    let demand = |state: usize| {
        let (at, of) = parts[state];
        let possible = plant.edges(at).iter().map(|&edge| plant.label(edge));
        let (allowed, forbidden) =
            possible.partition(|&label| supervisor.step(of, label).is_some());
        let marks = plant.is_marked(at).then(|| supervisor.is_marked(of));
        Demand { allowed, forbidden, marks }
    };
    if count > MOST {
        let mut distinct = BTreeSet::new();
        let mut states = 0..count;
        while distinct.len() < MOST
            && let Some(state) = states.next()
        {
            distinct.insert(demand(state));
        }
        let demands: Vec<Demand> = distinct.into_iter().collect();
        return Ok(largest_set(&apart(&demands)));
    }
    let demands: Vec<Demand> = (0..count).map(demand).collect();
    let mut apart = apart(&demands);
    spread(&mut apart, &product);
    Ok(largest_set(&apart))
}

/// Which of `demands` clash.
fn apart(demands: &[Demand]) -> Vec<Vec<bool>> {
    let row = |one: &Demand| demands.iter().map(|other| one.clashes(other)).collect();
    demands.iter().map(row).collect()
}

/// Tells apart also what one event leads to states that are.
fn spread(apart: &mut [Vec<bool>], product: &Automaton) {
    let mut before: Vec<BTreeMap<Label, Vec<usize>>> = vec![BTreeMap::new(); apart.len()];
    for step in product.transitions() {
        let sources = before[step.target.index()].entry(step.label).or_default();
        sources.push(step.source.index());
    }
    let count = apart.len();
    let pairs = (0..count).flat_map(|one| (one + 1..count).map(move |other| (one, other)));
    let mut pending: Vec<(usize, usize)> =
        pairs.filter(|&(one, other)| apart[one][other]).collect();
    while let Some((one, other)) = pending.pop() {
        for (label, sources) in &before[one] {
            for &left in sources {
                for &right in before[other].get(label).into_iter().flatten() {
                    if !apart[left][right] {
                        apart[left][right] = true;
                        apart[right][left] = true;
                        pending.push((left, right));
                    }
                }
            }
        }
    }
}

/// The size of a large set of which any two are apart.
fn largest_set(apart: &[Vec<bool>]) -> usize {
    let degree = |state: &usize| apart[*state].iter().filter(|&&is_apart| is_apart).count();
    let mut order: Vec<usize> = (0..apart.len()).collect();
    order.sort_by_cached_key(|state| std::cmp::Reverse(degree(state)));
    let size_from = |&seed: &usize| {
        let mut set = vec![seed];
        for &state in &order {
            if set.iter().all(|&member| apart[member][state]) {
                set.push(state);
            }
        }
        set.len()
    };
    order.iter().take(SEEDS).map(size_from).max().unwrap_or(0)
}
