//! A packing that takes the items one after the other: each on the first box that holds it, else on a new one.

use std::collections::BTreeMap;

use super::{BoxType, PackedBox};
use crate::fit::{Dimension, Load};

pub(super) fn pack(
    items: usize,
    types: &[BoxType],
    chosen: &[usize],
    apart: &dyn Fn(usize, usize) -> bool,
) -> Vec<PackedBox> {
    let mut by_cost = chosen.to_vec();
    by_cost.sort_by(|&left, &right| types[left].cost.total_cmp(&types[right].cost));
    let mut boxes: Vec<PackedBox> = Vec::new();
    for item in 0..items {
        let holds = |packed: &&mut PackedBox| {
            let beside = packed.items.iter();
            let mut beside = beside.chain([&item]).copied();
            packed.items.iter().all(|&other| !apart(item, other))
                && is_held(&types[packed.box_type], &mut beside)
        };
        if let Some(packed) = boxes.iter_mut().find(holds) {
            packed.items.push(item);
            continue;
        }
        let model = |packed: &PackedBox| types[packed.box_type].model;
        let taken =
            |one: usize| boxes.iter().filter(|packed| model(packed) == types[one].model).count();
        let free = by_cost.iter().copied().find(|&one| {
            types[one].loads[item].is_some()
                && types[one].stock.is_none_or(|stock| taken(one) < stock)
        });
        if let Some(box_type) = free {
            boxes.push(PackedBox { box_type, items: vec![item] });
        }
    }
    boxes
}

/// Whether a box of this type holds these items together.
fn is_held(box_type: &BoxType, items: &mut dyn Iterator<Item = usize>) -> bool {
    let mut sums: BTreeMap<Dimension, (u128, u64)> = BTreeMap::new();
    for item in items {
        let Some(loads) = &box_type.loads[item] else {
            return false;
        };
        for (&dimension, &Load { takes, usable }) in loads {
            sums.entry(dimension).or_insert((0, usable)).0 += u128::from(takes);
        }
    }
    sums.values().all(|(sum, usable)| *sum <= u128::from(*usable))
}
