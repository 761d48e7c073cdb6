//! Which boxes to take so that all items are placed and the boxes cost least: a 0/1 integer program.
//!
//! ```text
//! min  Σ c_t y_tk + B Σ v_i            k-th copy of type t is taken; item i is left over, which costs more than all boxes
//! (1)  Σ_tk x_itk + v_i = 1            every item is on one box, or left over
//! (2)  x_itk <= y_tk                   and that box is taken
//! (3)  x_itk + x_jtk <= y_tk           items that must not share do not
//! (4)  Σ_i d_itm x_itk <= D_tm y_tk    every dimension m of a box holds what is on it
//! (5)  y_t,k+1 <= y_tk                 copies are alike
//! ```
//!
//! What the solver answers is checked against the rules before it is used, so nothing rests on its arithmetic.

use std::collections::BTreeMap;

use good_lp::{
    Expression, ProblemVariables, Solution, SolverModel, Variable, constraint, microlp, variable,
};

use crate::fit::{Dimension, Load};

/// More unknowns are not given to the solver; types that are worse by preference are left out then.
const MAXIMUM_UNKNOWNS: usize = 1500;

/// A kind of box.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxType {
    /// What one costs, in any unit; not negative.
    pub cost: f64,
    /// How many there are; as many as wanted where nothing is said.
    pub stock: Option<usize>,
    /// For each item what it takes of such a box; nothing where it cannot be there.
    pub loads: Vec<Option<BTreeMap<Dimension, Load>>>,
}

/// A box that is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedBox {
    /// Of which type, by number.
    pub box_type: usize,
    /// What is on it, by number, ascending.
    pub items: Vec<usize>,
}

/// A packing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Packing {
    /// Those that are taken.
    pub boxes: Vec<PackedBox>,
    /// Items that are on no box.
    pub left_over: Vec<usize>,
    /// False where types were left out because the program would have been too large: there may be a better packing.
    pub best: bool,
}

/// The solver failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("U1140: no packing was found: {0}")]
pub struct PackingError(String);

/// The cheapest packing of `items` items; `apart(i, j)` says whether i and j must not share a box.
///
/// # Errors
/// The solver failed, or answered what breaks the rules.
pub fn pack(
    items: usize,
    types: &[BoxType],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Result<Packing, PackingError> {
    let useful = undominated(items, types, apart);
    let (chosen, best) = within_bound(items, types, &useful);
    if chosen.is_empty() {
        return Ok(Packing {
            boxes: Vec::new(),
            left_over: (0..items).collect(),
            best: true,
        });
    }
    let boxes = solve(items, types, &chosen, apart)?;
    check(items, types, &boxes, apart)?;
    let placed = |item: &usize| boxes.iter().any(|packed| packed.items.contains(item));
    Ok(Packing {
        left_over: (0..items).filter(|item| !placed(item)).collect(),
        boxes,
        best,
    })
}

fn usable_items(items: usize, box_type: &BoxType) -> Vec<usize> {
    (0..items)
        .filter(|&item| box_type.loads[item].is_some())
        .collect()
}

/// Types that are not worse than another in every respect.
fn undominated(
    items: usize,
    types: &[BoxType],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Vec<usize> {
    let beats = |better: usize, worse: usize| {
        let (left, right) = (&types[better], &types[worse]);
        let usable = usable_items(items, right);
        let alone = usable.iter().all(|&item| {
            usable
                .iter()
                .all(|&other| item == other || apart(item, other))
        });
        let cheaper = left.cost < right.cost || left.cost == right.cost && better < worse;
        cheaper
            && left.stock.is_none()
            && usable
                .iter()
                .all(|&item| match (&left.loads[item], &right.loads[item]) {
                    (Some(_), Some(_)) if alone => true,
                    (Some(left), Some(right)) => left.iter().all(|(dimension, load)| {
                        let other = right.get(dimension).copied();
                        other.is_some_and(|other| takes_no_more(*load, other)) || load.takes == 0
                    }),
                    _ => false,
                })
    };
    let all = 0..types.len();
    all.clone()
        .filter(|&one| !usable_items(items, &types[one]).is_empty())
        .filter(|&one| !all.clone().any(|other| other != one && beats(other, one)))
        .collect()
}

/// Whether the part that the first takes is no larger than that of the second.
fn takes_no_more(first: Load, second: Load) -> bool {
    let left = u128::from(first.takes) * u128::from(second.usable);
    left <= u128::from(second.takes) * u128::from(first.usable)
}

/// The cheapest types that the solver gets, ascending, and whether these are all.
fn within_bound(items: usize, types: &[BoxType], useful: &[usize]) -> (Vec<usize>, bool) {
    let mut by_cost = useful.to_vec();
    by_cost.sort_by(|&left, &right| types[left].cost.total_cmp(&types[right].cost));
    let mut chosen: Vec<usize> = (0..items)
        .filter_map(|item| {
            let mut usable = by_cost.iter();
            usable
                .find(|&&found| types[found].loads[item].is_some())
                .copied()
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    let unknowns = |chosen: &[usize]| -> usize {
        let of_type = |&one: &usize| {
            let usable = usable_items(items, &types[one]).len();
            let copies = types[one].stock.unwrap_or(usable).min(usable);
            copies * (usable + 1)
        };
        chosen.iter().map(of_type).sum()
    };
    for &one in &by_cost {
        if chosen.contains(&one) {
            continue;
        }
        chosen.push(one);
        if unknowns(&chosen) > MAXIMUM_UNKNOWNS {
            chosen.pop();
            chosen.sort_unstable();
            return (chosen, false);
        }
    }
    chosen.sort_unstable();
    (chosen, true)
}

/// A copy of a type and the unknowns of what is on it.
struct Copy {
    box_type: usize,
    taken: Variable,
    on_it: Vec<(usize, Variable)>,
}

fn solve(
    items: usize,
    types: &[BoxType],
    chosen: &[usize],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Result<Vec<PackedBox>, PackingError> {
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
    // In units of the dearest box a left-over item costs more than all boxes together.
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
        for (index, &(item, on_it)) in copy.on_it.iter().enumerate() {
            constraints.push(constraint!(on_it <= copy.taken)); // (2)
            for &(other, beside) in &copy.on_it[index + 1..] {
                if apart(item, other) {
                    constraints.push(constraint!(on_it + beside <= copy.taken)); // (3)
                }
            }
        }
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
    let mut model = variables.minimise(objective).using(microlp);
    for constraint in constraints {
        model = model.with(constraint);
    }
    let solution = model
        .solve()
        .map_err(|error| PackingError(error.to_string()))?;
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
    Ok(packed.filter(|packed| !packed.items.is_empty()).collect())
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

/// The rules, without the solver.
fn check(
    items: usize,
    types: &[BoxType],
    boxes: &[PackedBox],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Result<(), PackingError> {
    let broken = |what: &str| Err(PackingError(format!("the solver's answer {what}")));
    let mut places = vec![0_usize; items];
    let mut taken = vec![0_usize; types.len()];
    for packed in boxes {
        let box_type = &types[packed.box_type];
        taken[packed.box_type] += 1;
        let mut sums: BTreeMap<Dimension, (u128, u64)> = BTreeMap::new();
        for (index, &item) in packed.items.iter().enumerate() {
            places[item] += 1;
            let Some(loads) = &box_type.loads[item] else {
                return broken("puts an item on a box that does not fit");
            };
            for (&dimension, load) in loads {
                let sum = sums.entry(dimension).or_insert((0, load.usable));
                sum.0 += u128::from(load.takes);
            }
            if packed.items[index + 1..]
                .iter()
                .any(|&other| apart(item, other))
            {
                return broken("puts on one box what must be apart");
            }
        }
        if sums
            .values()
            .any(|(sum, usable)| *sum > u128::from(*usable))
        {
            return broken("overfills a box");
        }
    }
    if places.iter().any(|&count| count > 1) {
        return broken("places an item twice");
    }
    let short =
        |(box_type, &count): (&BoxType, &usize)| box_type.stock.is_some_and(|stock| count > stock);
    if types.iter().zip(&taken).any(short) {
        return broken("takes more boxes than there are");
    }
    Ok(())
}
