//! The solver's packing against every packing, on small cases.

use std::collections::BTreeMap;

use proptest::prelude::*;
use understudy_allocation::packing::{BoxType, Packing, pack};
use understudy_allocation::{Dimension, Load};

/// Capacity, cost, stock, and which items must not be there.
type Kind = ([u64; 2], u64, Option<usize>, Vec<bool>);

/// What items take in two dimensions, and what boxes have.
#[derive(Debug, Clone)]
struct Case {
    takes: Vec<[u64; 2]>,
    types: Vec<Kind>,
    apart: Vec<(usize, usize)>,
}

impl Case {
    fn box_types(&self) -> Vec<BoxType> {
        let dimensions = [Dimension::ProgramMemory, Dimension::Timers];
        let numbered = self.types.iter().enumerate();
        let of_type = numbered.map(|(model, (capacity, cost, stock, barred))| BoxType {
            cost: *cost as f64,
            model,
            stock: *stock,
            loads: self
                .takes
                .iter()
                .zip(barred)
                .map(|(takes, barred)| {
                    let fits = takes.iter().zip(capacity).all(|(takes, usable)| takes <= usable);
                    (fits && !barred).then(|| {
                        let parts = takes.iter().zip(capacity).zip(dimensions);
                        parts
                            .filter(|((takes, _), _)| **takes > 0)
                            .map(|((&takes, &usable), dimension)| {
                                (dimension, Load { takes, usable })
                            })
                            .collect::<BTreeMap<_, _>>()
                    })
                })
                .collect(),
        });
        of_type.collect()
    }

    fn apart(&self, left: usize, right: usize) -> bool {
        self.apart.contains(&(left, right)) || self.apart.contains(&(right, left))
    }

    /// Items that are left over, then the cost: of the best of all packings, each tried.
    fn naive(&self) -> (usize, u64) {
        let mut best = (usize::MAX, u64::MAX);
        self.search(0, &mut Vec::new(), 0, &mut best);
        best
    }

    fn search(
        &self,
        item: usize,
        boxes: &mut Vec<(usize, Vec<usize>)>,
        left: usize,
        best: &mut (usize, u64),
    ) {
        if item == self.takes.len() {
            let cost = boxes.iter().map(|(box_type, _)| self.types[*box_type].1).sum();
            *best = (*best).min((left, cost));
            return;
        }
        self.search(item + 1, boxes, left + 1, best);
        for place in 0..boxes.len() {
            boxes[place].1.push(item);
            if self.allowed(&boxes[place]) {
                self.search(item + 1, boxes, left, best);
            }
            boxes[place].1.pop();
        }
        for box_type in 0..self.types.len() {
            let taken = boxes.iter().filter(|(other, _)| *other == box_type).count();
            let short = self.types[box_type].2.is_some_and(|stock| taken >= stock);
            let new = (box_type, vec![item]);
            if !short && self.allowed(&new) {
                boxes.push(new);
                self.search(item + 1, boxes, left, best);
                boxes.pop();
            }
        }
    }

    fn allowed(&self, (box_type, items): &(usize, Vec<usize>)) -> bool {
        let (capacity, _, _, barred) = &self.types[*box_type];
        let fits = |dimension: usize| {
            let sum: u64 = items.iter().map(|&item| self.takes[item][dimension]).sum();
            sum <= capacity[dimension]
        };
        let pairs = items.iter().enumerate();
        let mut pairs =
            pairs.flat_map(|(at, left)| items[at + 1..].iter().map(move |right| (*left, *right)));
        fits(0)
            && fits(1)
            && items.iter().all(|&item| !barred[item])
            && pairs.all(|(left, right)| !self.apart(left, right))
    }

    fn packed(&self) -> Packing {
        let types = self.box_types();
        pack(self.takes.len(), &types, &|left, right| self.apart(left, right)).expect("a packing")
    }

    fn cost(&self, packing: &Packing) -> (usize, u64) {
        let cost = packing.boxes.iter().map(|packed| self.types[packed.box_type].1).sum();
        (packing.left_over.len(), cost)
    }
}

fn cases() -> impl Strategy<Value = Case> {
    (1_usize..=5, 1_usize..=3).prop_flat_map(|(items, types)| {
        let takes = prop::collection::vec([0_u64..6, 0_u64..3], items);
        let barred = prop::collection::vec(prop::bool::weighted(0.15), items);
        let stock = prop_oneof![3 => Just(None), 1 => (0_usize..3).prop_map(Some)];
        let box_type = ([1_u64..12, 0_u64..6], 1_u64..30, stock, barred);
        let pairs: Vec<(usize, usize)> =
            (0..items).flat_map(|left| (left + 1..items).map(move |right| (left, right))).collect();
        let some = pairs.len();
        let apart = prop::sample::subsequence(pairs, 0..=some);
        (takes, prop::collection::vec(box_type, types), apart)
            .prop_map(|(takes, types, apart)| Case { takes, types, apart })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_packing_is_better(case in cases()) {
        let packing = case.packed();
        prop_assert!(packing.best);
        prop_assert_eq!(case.cost(&packing), case.naive());
        for packed in &packing.boxes {
            prop_assert!(case.allowed(&(packed.box_type, packed.items.clone())));
        }
    }
}

#[test]
fn nothing_to_place_and_nothing_to_place_it_on() {
    assert_eq!(pack(0, &[], &|_, _| false).map(|found| found.boxes.len()), Ok(0));
    let alone = pack(2, &[], &|_, _| false).expect("nothing is placed");
    assert_eq!(alone.left_over, [0, 1]);
}

/// A plant of sixty programs that must all be apart wants no solver; without a stock the cheapest for each is the best.
#[test]
fn items_that_share_with_nobody_take_what_is_cheapest_for_each() {
    let case = Case {
        takes: (0..60).map(|item| [1 + item % 5, 0]).collect(),
        types: (2..6).map(|size| ([size, 0], 10 * size, None, vec![false; 60])).collect(),
        apart: (0..60).flat_map(|left| (left + 1..60).map(move |right| (left, right))).collect(),
    };
    let packing = case.packed();
    assert!(packing.best);
    // Each fifth of them takes 1, 2, 3, 4 and 5; the smallest box holds 2.
    assert_eq!(case.cost(&packing), (0, 12 * (20 + 20 + 30 + 40 + 50)));
}

/// A hundred programs that may all share: too much for the solver. The cheaper boxes are too few for all of them.
#[test]
fn a_hundred_programs_are_packed_one_after_the_other() {
    let case = Case {
        takes: (0..100).map(|item| [1 + item % 4, 1]).collect(),
        types: vec![
            ([20, 50], 10, None, vec![false; 100]),
            ([7, 50], 5, Some(1), vec![false; 100]),
        ],
        apart: vec![(0, 4), (1, 5)],
    };
    let packing = case.packed();
    assert!(!packing.best && packing.left_over.is_empty());
    assert!(packing.boxes.len() < 30, "{}", packing.boxes.len());
}

/// Forty models and a dozen programs that may share: more than the solver gets, and still every rule holds.
#[test]
fn what_is_too_large_is_packed_and_said_to_be_perhaps_not_the_best() {
    let case = Case {
        takes: (0..12).map(|item| [1 + item % 3, 1]).collect(),
        types: (0..40)
            .map(|number| ([4 + number % 5, 2 + number / 8], 10 + number, Some(3), vec![false; 12]))
            .collect(),
        apart: vec![(0, 1), (2, 3)],
    };
    let packing = case.packed();
    assert!(!packing.best);
    assert!(packing.left_over.is_empty(), "{packing:?}");
}
