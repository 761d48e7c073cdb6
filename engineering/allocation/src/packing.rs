//! Placement of all items on controllers at minimum cost: a 0/1 integer program.
//!
//! ```text
//! min  Σ c_t y_tk + B Σ v_i            k-th copy of type t is taken; item i is left over, which costs more than all boxes
//! (1)  Σ_tk x_itk + v_i = 1            every item is on one box, or left over
//! (2)  x_itk <= y_tk                   and that box is taken
//! (3)  x_itk + x_jtk + .. <= y_tk      of items that must not share with each other there is one at most
//! (4)  Σ_i d_itm x_itk <= D_tm y_tk    every dimension m of a box holds what is on it
//! (5)  y_t,k+1 <= y_tk                 copies are alike
//! (6)  Σ y_tk <= stock                 over the types t of one model
//! ```
//!
//! Items that share with nobody, on types of which there are as many as wanted, are not part of it: each takes what is cheapest for it. What
//! the solver answers is checked against the rules before it is used, so nothing rests on its arithmetic; where it is stopped, or the program
//! would be too large for it, there is still the packing that takes the items one after the other.

mod greedy;
mod program;

use std::collections::BTreeMap;

use crate::fit::{Dimension, Load};

/// More unknowns are not given to the solver; types that are worse by preference are left out then.
const MAXIMUM_UNKNOWNS: usize = 1500;

/// A kind of box.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxType {
    /// Cost of one in any unit; not negative.
    pub cost: f64,
    /// Number of its model; types of one model draw on one stock.
    pub model: usize,
    /// Available number of the model; unlimited if none.
    pub stock: Option<usize>,
    /// Amounts that each item takes of such a box; none where the item cannot be placed.
    pub loads: Vec<Option<BTreeMap<Dimension, Load>>>,
}

/// A box that is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedBox {
    /// Number of the type.
    pub box_type: usize,
    /// Numbers of the items on it, ascending.
    pub items: Vec<usize>,
}

/// A packing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Packing {
    /// The boxes that are used.
    pub boxes: Vec<PackedBox>,
    /// Items that are on no box.
    pub left_over: Vec<usize>,
    /// False where it is not proved that none is better.
    pub best: bool,
}

/// The solver's answer breaks the rules.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("U1140: no packing was found: {0}")]
pub struct PackingError(String);

/// The cheapest packing of `items` items; `apart(i, j)` says whether i and j must not share a box.
///
/// # Errors
/// The solver answered what breaks the rules.
pub fn pack(
    items: usize,
    types: &[BoxType],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Result<Packing, PackingError> {
    let (mut boxes, rest) = settled(items, types, apart);
    // The rest among itself, with numbers of its own.
    let rest_types: Vec<BoxType> = types
        .iter()
        .map(|one| BoxType {
            loads: rest.iter().map(|&item| one.loads[item].clone()).collect(),
            ..one.clone()
        })
        .collect();
    let rest_apart = |left: usize, right: usize| apart(rest[left], rest[right]);
    let (packed, best) = pack_rest(rest.len(), &rest_types, &rest_apart);
    boxes.extend(packed.into_iter().map(|packed| PackedBox {
        box_type: packed.box_type,
        items: packed.items.into_iter().map(|item| rest[item]).collect(),
    }));
    check(items, types, &boxes, apart)?;
    let placed = |item: &usize| boxes.iter().any(|packed| packed.items.contains(item));
    Ok(Packing { left_over: (0..items).filter(|item| !placed(item)).collect(), boxes, best })
}

/// Controllers for the items that share none and need no limited stock, and all other items.
fn settled(
    items: usize,
    types: &[BoxType],
    apart: &dyn Fn(usize, usize) -> bool,
) -> (Vec<PackedBox>, Vec<usize>) {
    let (mut boxes, mut rest) = (Vec::new(), Vec::new());
    for item in 0..items {
        let usable = (0..types.len()).filter(|&one| types[one].loads[item].is_some());
        let usable: Vec<usize> = usable.collect();
        let alone = (0..items).all(|other| other == item || apart(item, other));
        let scarce = usable.iter().any(|&one| types[one].stock.is_some());
        let cheapest =
            usable.iter().min_by(|&&left, &&right| types[left].cost.total_cmp(&types[right].cost));
        match cheapest {
            Some(&box_type) if alone && !scarce => {
                boxes.push(PackedBox { box_type, items: vec![item] })
            }
            _ => rest.push(item),
        }
    }
    (boxes, rest)
}

/// The packing of items that may share, and whether it is proved that none is better.
fn pack_rest(
    items: usize,
    types: &[BoxType],
    apart: &dyn Fn(usize, usize) -> bool,
) -> (Vec<PackedBox>, bool) {
    let useful = undominated(items, types, apart);
    let (chosen, all) = within_bound(items, types, &useful);
    if chosen.is_empty() {
        return (Vec::new(), true);
    }
    // Of all types: where one that was left out for its cost is the only one of which there are enough, it is here.
    let simple = greedy::pack(items, types, &useful, apart);
    if unknowns(items, types, &chosen) > MAXIMUM_UNKNOWNS {
        return (simple, false);
    }
    let first = if all { simple.clone() } else { greedy::pack(items, types, &chosen, apart) };
    match program::solve(items, types, &chosen, &first, apart) {
        Some((boxes, proved)) if !is_better(items, types, &simple, &boxes) => {
            (boxes, proved && all)
        }
        _ => (simple, false),
    }
}

/// Whether fewer items remain unplaced, or the same number at lower cost.
fn is_better(items: usize, types: &[BoxType], one: &[PackedBox], other: &[PackedBox]) -> bool {
    let measure = |boxes: &[PackedBox]| {
        let placed: usize = boxes.iter().map(|packed| packed.items.len()).sum();
        let costs = boxes.iter().map(|packed| types[packed.box_type].cost);
        (items.saturating_sub(placed), costs.sum::<f64>())
    };
    let (one, other) = (measure(one), measure(other));
    // What the solver rounds is no difference.
    one.0 < other.0 || one.0 == other.0 && one.1 < other.1 * (1.0 - 1e-9)
}

fn usable_items(items: usize, box_type: &BoxType) -> Vec<usize> {
    (0..items).filter(|&item| box_type.loads[item].is_some()).collect()
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
        let alone = usable
            .iter()
            .all(|&item| usable.iter().all(|&other| item == other || apart(item, other)));
        let cheaper = left.cost < right.cost || left.cost == right.cost && better < worse;
        cheaper
            && left.stock.is_none()
            && usable.iter().all(|&item| match (&left.loads[item], &right.loads[item]) {
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
            usable.find(|&&found| types[found].loads[item].is_some()).copied()
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    for &one in &by_cost {
        if chosen.contains(&one) {
            continue;
        }
        chosen.push(one);
        if unknowns(items, types, &chosen) > MAXIMUM_UNKNOWNS {
            chosen.pop();
            chosen.sort_unstable();
            return (chosen, false);
        }
    }
    chosen.sort_unstable();
    (chosen, true)
}

/// How many unknowns the program of these types has.
fn unknowns(items: usize, types: &[BoxType], chosen: &[usize]) -> usize {
    let of_type = |&one: &usize| {
        let usable = usable_items(items, &types[one]).len();
        let copies = types[one].stock.unwrap_or(usable).min(usable);
        copies * (usable + 1)
    };
    chosen.iter().map(of_type).sum()
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
    let mut taken: BTreeMap<usize, usize> = BTreeMap::new();
    for packed in boxes {
        let box_type = &types[packed.box_type];
        *taken.entry(box_type.model).or_default() += 1;
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
            if packed.items[index + 1..].iter().any(|&other| apart(item, other)) {
                return broken("puts on one box what must be apart");
            }
        }
        if sums.values().any(|(sum, usable)| *sum > u128::from(*usable)) {
            return broken("overfills a box");
        }
    }
    if places.iter().any(|&count| count > 1) {
        return broken("places an item twice");
    }
    let short = |one: &BoxType| {
        let count = taken.get(&one.model).copied().unwrap_or(0);
        one.stock.is_some_and(|stock| count > stock)
    };
    if types.iter().any(short) {
        return broken("takes more boxes than there are");
    }
    Ok(())
}
