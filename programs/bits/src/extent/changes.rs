//! Terms whose extents may be other ones since some cells grew: the others are not evaluated again.
//!
//! An operation depends on the extents of its operands. A selection looks deeper: into its condition for facts, and into what it selects for what they
//! say, at most [`LOOK`] operands down. So a selection is evaluated where an extent has changed as near as that, an operation where one of its operands has.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::Search;
use crate::term::{Node, Term, Terms, Variable};

/// Operands below a selection that its extent may depend on. What is selected is looked into 17 deep, and from there a condition 25 deep, with a
/// comparison in it and 9 operands of that.
const LOOK: u8 = 64;
/// Nothing has changed below it.
const FAR: u8 = u8::MAX;

/// Who depends on whom, and what is being evaluated.
pub(super) struct Changes {
    /// The first user of each term, in `users`.
    first: Vec<u32>,
    users: Vec<u32>,
    /// The terms of each cell.
    cells: Vec<Option<Term>>,
    /// For each term the operands down to the nearest whose extent has changed.
    near: Vec<u8>,
    /// Terms that are waiting.
    is_waiting: Vec<bool>,
}

fn operands(node: &Node) -> &[Term] {
    match node {
        Node::Apply(_, operands) => operands,
        Node::Choose(parts) => parts,
        Node::Constant(_) | Node::Variable(_) | Node::Unknown(_) => &[],
    }
}

impl Changes {
    pub(super) fn new(terms: &Terms, cells: usize) -> Self {
        let nodes = || (0..terms.len()).map(|place| terms.node(terms.at(place)));
        let mut first = vec![0; terms.len() + 1];
        let mut of_cells = vec![None; cells];
        for (place, node) in nodes().enumerate() {
            if let Node::Variable(Variable::Cell(cell)) = node {
                of_cells[*cell as usize] = Some(terms.at(place));
            }
            for operand in operands(node) {
                first[Terms::index(*operand) + 1] += 1;
            }
        }
        for place in 0..terms.len() {
            first[place + 1] += first[place];
        }
        let mut users = vec![0; first[terms.len()] as usize];
        let mut next = first.clone();
        for (place, node) in nodes().enumerate() {
            for operand in operands(node) {
                let at = &mut next[Terms::index(*operand)];
                users[*at as usize] = place as u32;
                *at += 1;
            }
        }
        let (near, is_waiting) = (vec![FAR; terms.len()], vec![false; terms.len()]);
        Self { first, users, cells: of_cells, near, is_waiting }
    }
}

impl Search<'_> {
    /// Extents of all terms, where those of some cells have changed since all terms had theirs.
    pub(super) fn evaluate_changed(&mut self, changes: &mut Changes, cells: &[usize]) {
        let system = self.system;
        let terms = &system.terms;
        let mut waiting = BinaryHeap::new();
        let mut touched = Vec::new();
        for term in cells.iter().filter_map(|&cell| changes.cells[cell]) {
            let place = Terms::index(term);
            changes.is_waiting[place] = true;
            waiting.push(Reverse(place));
        }
        // Operands stand before their users, so each term is met once, after all of them.
        while let Some(Reverse(place)) = waiting.pop() {
            let term = terms.at(place);
            let node = terms.node(term);
            let below = operands(node).iter().map(|operand| changes.near[Terms::index(*operand)]);
            let below = below.min();
            let is_due = match (node, below) {
                (Node::Choose(_), Some(below)) if self.follows => below < LOOK,
                (_, Some(below)) => below == 0,
                (_, None) => true,
            };
            let extent = if is_due { self.extent(term) } else { self.terms[place] };
            let near = match extent == self.terms[place] {
                true => below.unwrap_or(FAR).saturating_add(1),
                false => 0,
            };
            self.terms[place] = extent;
            changes.near[place] = near;
            touched.push(place);
            if near < LOOK {
                let users = changes.first[place] as usize..changes.first[place + 1] as usize;
                for &user in &changes.users[users] {
                    if !std::mem::replace(&mut changes.is_waiting[user as usize], true) {
                        waiting.push(Reverse(user as usize));
                    }
                }
            }
        }
        for place in touched {
            changes.near[place] = FAR;
            changes.is_waiting[place] = false;
        }
    }
}
