//! Another order of variables, found by sifting after Rudell: each variable in turn goes through all places, by swapping it with its neighbour, and stays
//! where the diagrams were smallest.
//!
//! Functions keep their diagrams' identity through it, so the holder of one sees only its size change. The library ends the process where a swap finds
//! no free node; so none is begun that could need more than there are.

use std::sync::atomic::{AtomicUsize, Ordering};

use oxidd::bdd::BDDManagerRef;
use oxidd::{HasLevel, LevelNo, Manager, ManagerRef, VarNo};
use oxidd_core::LevelView;
use oxidd_reorder::set_var_order_seq;

/// Times the living nodes: what one reordering may move, and at most, some seconds: nothing ends it earlier.
const MOVES: usize = 40;
const MOST_MOVES: usize = 1 << 24;

/// Variables that one reordering moves, those with the most nodes.
const VARIABLES: usize = 500;

/// Living nodes at which an early change begins.
const EARLY: usize = 10_000;

/// When to look for a better order.
pub(super) struct Need {
    limit: usize,
    /// Whether the order is changed where there is no node left.
    at_bound: bool,
    /// Nodes, dead ones included, at which the living ones are counted.
    count_at: AtomicUsize,
    /// Living nodes at which the order is changed.
    change_at: AtomicUsize,
}

impl Need {
    pub(super) fn new(limit: usize) -> Self {
        // A good order is left alone as long as there is room.
        let first = limit / 4 * 3;
        Self::at(first, limit, true)
    }

    /// Each time that the diagrams have doubled, and not at the bound, where it takes longest and helps least.
    pub(super) fn early(limit: usize) -> Self {
        Self::at(EARLY.min(limit / 4 * 3), limit, false)
    }

    fn at(first: usize, limit: usize, at_bound: bool) -> Self {
        let [count_at, change_at] = [first; 2].map(AtomicUsize::new);
        Self { limit, at_bound, count_at, change_at }
    }

    /// No change below this number of nodes, as far as there is room.
    pub(super) fn expect(&self, nodes: usize) {
        let nodes = nodes.min(self.limit / 4 * 3);
        self.count_at.fetch_max(nodes, Ordering::Relaxed);
        self.change_at.fetch_max(nodes, Ordering::Relaxed);
    }

    /// Nodes that there are in all: swaps need room.
    pub(super) fn room(limit: usize) -> usize {
        limit.saturating_mul(2)
    }

    /// After an operation that went well: changes the order if the diagrams have grown enough. Whether they are within the bound.
    pub(super) fn look(&self, manager: &BDDManagerRef) -> bool {
        let nodes = manager.with_manager_shared(|manager| manager.approx_num_inner_nodes());
        if nodes < self.count_at.load(Ordering::Relaxed) {
            return true;
        }
        let alive = alive(manager);
        let change_at = self.change_at.load(Ordering::Relaxed);
        let alive = if alive < change_at {
            alive
        } else {
            self.change(manager);
            let left = alive_now(manager);
            self.change_at.store(change_at.max(2 * left), Ordering::Relaxed);
            left
        };
        let change_at = self.change_at.load(Ordering::Relaxed);
        self.count_at.store(alive.max(change_at / 2) + change_at / 2, Ordering::Relaxed);
        alive <= self.limit
    }

    /// After an operation that found no free node: whether a new order made room, so that another try is worth while.
    pub(super) fn make_room(&self, manager: &BDDManagerRef) -> bool {
        let before = alive(manager);
        if !self.at_bound {
            return before < self.limit / 8 * 7;
        }
        self.change(manager);
        let left = alive_now(manager);
        self.change_at.store(2 * left, Ordering::Relaxed);
        self.count_at.store(2 * left, Ordering::Relaxed);
        left < before.min(self.limit)
    }

    fn change(&self, manager: &BDDManagerRef) {
        let slack = (self.limit / 8).min(1 << 17);
        let room = Self::room(self.limit) - slack;
        manager.with_manager_exclusive(|manager| {
            manager.reorder(|manager| Sifting::new(manager, room).run());
        });
    }
}

/// Living nodes, after dead ones have been removed.
fn alive(manager: &BDDManagerRef) -> usize {
    manager.with_manager_exclusive(|manager| manager.gc());
    alive_now(manager)
}

fn alive_now(manager: &BDDManagerRef) -> usize {
    manager.with_manager_shared(|manager| manager.num_inner_nodes())
}

struct Sifting<'m, M> {
    manager: &'m mut M,
    /// The variable at each level.
    order: Vec<VarNo>,
    /// Nodes of each level, and of all.
    sizes: Vec<usize>,
    total: usize,
    /// Nodes that there may be.
    room: usize,
    /// Nodes that may still be moved.
    moves: usize,
}

impl<'m, M: Manager> Sifting<'m, M>
where
    M::InnerNode: HasLevel,
{
    fn new(manager: &'m mut M, room: usize) -> Self {
        let levels = 0..manager.num_levels();
        let order = levels.clone().map(|level| manager.level_to_var(level));
        let order = order.collect();
        let sizes: Vec<usize> = levels.map(|level| manager.level(level).len()).collect();
        Self { total: sizes.iter().sum(), manager, order, sizes, room, moves: 0 }
    }

    fn run(mut self) {
        self.moves = (MOVES * self.total).min(MOST_MOVES);
        let mut largest: Vec<(usize, VarNo)> =
            self.sizes.iter().copied().zip(self.order.iter().copied()).collect();
        largest.sort_unstable_by_key(|&(size, variable)| (std::cmp::Reverse(size), variable));
        for (_, variable) in largest.into_iter().take(VARIABLES) {
            if self.moves == 0 {
                break;
            }
            self.sift(variable);
        }
    }

    /// Takes one variable through all places, and to the best.
    fn sift(&mut self, variable: VarNo) {
        let place = self.order.iter().position(|&known| known == variable);
        let start = place.expect("every variable has a level");
        let last = self.order.len() - 1;
        let mut best = (self.total, start);
        let down_first = last - start < start;
        let mut at = start;
        for down in [down_first, !down_first] {
            while at != if down { last } else { 0 } {
                let grown = self.total > best.0 + best.0 / 5;
                if grown || self.moves == 0 || !self.swap(if down { at } else { at - 1 }) {
                    break;
                }
                at = if down { at + 1 } else { at - 1 };
                if self.total < best.0 {
                    best = (self.total, at);
                }
            }
            at = self.back(at, best.1);
        }
    }

    /// Takes a variable back to a place where it has been, as far as there is room for the swaps.
    fn back(&mut self, from: usize, to: usize) -> usize {
        let mut at = from;
        while at < to && self.swap(at) {
            at += 1;
        }
        while at > to && self.swap(at - 1) {
            at -= 1;
        }
        at
    }

    /// Swaps the variable at `upper` with the one below it; false where that could need too many nodes.
    fn swap(&mut self, upper: usize) -> bool {
        let lower = upper + 1;
        let moved = self.sizes[upper];
        // Each node of the upper level leads to at most two new ones.
        if self.total + 2 * moved > self.room {
            return false;
        }
        self.moves = self.moves.saturating_sub(moved + 1);
        set_var_order_seq(self.manager, &[self.order[lower], self.order[upper]]);
        self.order.swap(upper, lower);
        for level in [upper, lower] {
            self.total -= self.sizes[level];
            self.sizes[level] = self.manager.level(level as LevelNo).len();
            self.total += self.sizes[level];
        }
        true
    }
}
