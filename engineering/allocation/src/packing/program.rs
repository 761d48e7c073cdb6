//! The 0/1 integer program of [`super`], given to the solver.

use std::collections::{BTreeMap, BTreeSet};

use good_lp::{
    Constraint, Expression, ProblemVariables, Solution, SolutionStatus, SolverModel, Variable,
    WithInitialSolution, WithTimeLimit, constraint, microlp, variable,
};

use super::{BoxType, PackedBox, usable_items};
use crate::fit::Dimension;

/// Seconds after which the solver is stopped; what it has found until then is taken, and not said to be the best.
const MAXIMUM_SECONDS: f64 = 60.0;

/// A copy of a type and the unknowns of what is on it.
struct Copy {
    box_type: usize,
    taken: Variable,
    on_it: Vec<(usize, Variable)>,
}

/// The packing, and whether it is proved that none is better; nothing where the solver found none. `first` is one to begin with.
pub(super) fn solve(
    items: usize,
    types: &[BoxType],
    chosen: &[usize],
    first: &[PackedBox],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Option<(Vec<PackedBox>, bool)> {
    let mut variables = ProblemVariables::new();
    let mut binary = || variables.add(variable().binary());
    let mut copies = Vec::new();
    for &box_type in chosen {
        let usable = usable_items(items, &types[box_type]);
        let stock = types[box_type].stock.unwrap_or(usable.len());
        for number in 0..stock.min(usable.len()) {
            // The n-th item can always be on one of the first n copies, so the others need not be tried.
            let candidates = usable.iter().skip(number);
            copies.push(Copy {
                box_type,
                taken: binary(),
                on_it: candidates.map(|&item| (item, binary())).collect(),
            });
        }
    }
    let left_over: Vec<Variable> = (0..items).map(|_| binary()).collect();
    let dearest = chosen.iter().map(|&one| types[one].cost);
    let dearest = dearest.fold(0.0, f64::max).max(1e-9);
    // In units of the most expensive controller, an unplaced item costs more than all controllers together.
    let lost = items as f64 + 1.0;
    let mut objective = Expression::from(0.0);
    for copy in &copies {
        objective += types[copy.box_type].cost / dearest * copy.taken;
    }
    for &item in &left_over {
        objective += lost * item;
    }
    let mut constraints = Vec::new();
    for (item, &lost) in left_over.iter().enumerate() {
        let mut sum = Expression::from(lost);
        for copy in &copies {
            for &(_, on_it) in copy.on_it.iter().filter(|(other, _)| *other == item) {
                sum += on_it;
            }
        }
        constraints.push(constraint!(sum == 1.0)); // (1)
    }
    for (place, copy) in copies.iter().enumerate() {
        constraints.extend(exclusions(copy, apart));
        for (usable, parts) in dimensions(&types[copy.box_type], &copy.on_it) {
            let mut sum = Expression::from(0.0);
            for (on_it, takes) in parts {
                sum += takes as f64 / usable as f64 * on_it;
            }
            constraints.push(constraint!(sum <= copy.taken)); // (4)
        }
        if let Some(next) = copies.get(place + 1)
            && next.box_type == copy.box_type
        {
            constraints.push(constraint!(next.taken <= copy.taken)); // (5)
        }
    }
    for of_model in models(&copies, types).into_values() {
        let mut sum = Expression::from(0.0);
        for copy in &of_model {
            sum += copy.taken;
        }
        if let Some(stock) = of_model.first().and_then(|copy| types[copy.box_type].stock) {
            constraints.push(constraint!(sum <= stock as f64)); // (6)
        }
    }
    let model = variables.minimise(objective).using(microlp);
    let mut model = model
        .with_time_limit(MAXIMUM_SECONDS)
        .with_initial_solution(values(&copies, &left_over, first));
    for constraint in constraints {
        model = model.with(constraint);
    }
    let solution = model.solve().ok()?;
    let is_one = |variable: Variable| solution.value(variable) > 0.5;
    let packed = copies.iter().map(|copy| PackedBox {
        box_type: copy.box_type,
        items: copy
            .on_it
            .iter()
            .filter(|(_, on_it)| is_one(*on_it))
            .map(|(item, _)| *item)
            .collect(),
    });
    let boxes = packed.filter(|packed| !packed.items.is_empty()).collect();
    let is_proved = matches!(solution.status(), SolutionStatus::Optimal);
    Some((boxes, is_proved))
}

/// The copies by model.
fn models<'a>(copies: &'a [Copy], types: &[BoxType]) -> BTreeMap<usize, Vec<&'a Copy>> {
    let mut models: BTreeMap<usize, Vec<&Copy>> = BTreeMap::new();
    for copy in copies {
        models.entry(types[copy.box_type].model).or_default().push(copy);
    }
    models
}

/// (2) and (3): of items that are all apart from each other one at most is on a copy, and only on one that is taken. Every pair that must be
/// apart is in one such set, and every item is in some set, if only alone.
fn exclusions(copy: &Copy, apart: &dyn Fn(usize, usize) -> bool) -> Vec<Constraint> {
    let on_it = &copy.on_it;
    let are_apart = |one: usize, other: usize| apart(on_it[one].0, on_it[other].0);
    let mut covered = BTreeSet::new();
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for one in 0..on_it.len() {
        for other in one + 1..on_it.len() {
            if !are_apart(one, other) || covered.contains(&(one, other)) {
                continue;
            }
            let mut set = vec![one, other];
            for next in other + 1..on_it.len() {
                if set.iter().all(|&member| are_apart(member, next)) {
                    set.push(next);
                }
            }
            for (place, &member) in set.iter().enumerate() {
                covered.extend(set[place + 1..].iter().map(|&later| (member, later)));
            }
            sets.push(set);
        }
    }
    let alone = (0..on_it.len()).filter(|one| !sets.iter().any(|set| set.contains(one)));
    let alone: Vec<Vec<usize>> = alone.map(|one| vec![one]).collect();
    sets.extend(alone);
    let constraint = |set: Vec<usize>| {
        let mut sum = Expression::from(0.0);
        for member in set {
            sum += on_it[member].1;
        }
        constraint!(sum <= copy.taken)
    };
    sets.into_iter().map(constraint).collect()
}

/// A packing as values of the unknowns.
fn values(copies: &[Copy], left_over: &[Variable], boxes: &[PackedBox]) -> Vec<(Variable, f64)> {
    let mut waiting: Vec<&PackedBox> = boxes.iter().collect();
    // The first copy of a type has the box with the first item.
    waiting.sort_by_key(|packed| packed.items.first().copied());
    let mut values = Vec::new();
    let mut placed = BTreeSet::new();
    for copy in copies {
        let found = waiting.iter().position(|packed| packed.box_type == copy.box_type);
        let items = found.map(|found| waiting.remove(found).items.clone());
        values.push((copy.taken, if items.is_some() { 1.0 } else { 0.0 }));
        let items = items.unwrap_or_default();
        for &(item, on_it) in &copy.on_it {
            let is_on_it = items.contains(&item);
            values.push((on_it, if is_on_it { 1.0 } else { 0.0 }));
        }
        placed.extend(items);
    }
    for (item, &variable) in left_over.iter().enumerate() {
        let is_lost = !placed.contains(&item);
        values.push((variable, if is_lost { 1.0 } else { 0.0 }));
    }
    values
}

/// For each dimension that the candidates together could overfill: what is usable, and who takes how much.
fn dimensions(box_type: &BoxType, on_it: &[(usize, Variable)]) -> Vec<(u64, Vec<(Variable, u64)>)> {
    let mut found: BTreeMap<Dimension, (u64, Vec<(Variable, u64)>)> = BTreeMap::new();
    for &(item, variable) in on_it {
        for (&dimension, load) in box_type.loads[item].iter().flatten() {
            let entry = found.entry(dimension).or_insert((load.usable, Vec::new()));
            entry.0 = entry.0.min(load.usable);
            entry.1.push((variable, load.takes));
        }
    }
    found
        .into_values()
        .filter(|(usable, parts)| {
            let sum: u128 = parts.iter().map(|(_, takes)| u128::from(*takes)).sum();
            *usable > 0 && sum > u128::from(*usable)
        })
        .collect()
}
