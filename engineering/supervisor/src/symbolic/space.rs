//! Sets of product states as diagrams: one block of bits a level.

use std::collections::HashMap;

use understudy_logic::Variable;
use understudy_logic::bdd::{BddError, Diagram, Diagrams};

/// Where a level's state lies among the bits.
#[derive(Debug, Clone, Copy)]
struct Block {
    first: usize,
    bits: usize,
    states: usize,
}

/// The space of all tuples, a state for each level.
pub(super) struct Space {
    diagrams: Diagrams,
    blocks: Vec<Block>,
    variables: Vec<Diagram>,
}

impl Space {
    /// `sizes[k]` states on level k; no level has none.
    pub(super) fn new(sizes: &[usize], nodes: usize) -> Result<Self, BddError> {
        let mut bits = 0;
        let blocks = sizes.iter().map(|&states| {
            let width = (usize::BITS - (states - 1).leading_zeros()) as usize;
            let block = Block { first: bits, bits: width, states };
            bits += width;
            block
        });
        let blocks: Vec<Block> = blocks.collect();
        let diagrams = Diagrams::new((0..bits as u32).map(Variable::Register), nodes);
        let variables = (0..bits as u32).map(|bit| diagrams.variable(Variable::Register(bit)));
        let variables = variables.collect::<Result<_, _>>()?;
        Ok(Self { diagrams, blocks, variables })
    }

    pub(super) fn levels(&self) -> usize {
        self.blocks.len()
    }

    pub(super) fn nothing(&self) -> Diagram {
        self.diagrams.constant(false)
    }

    /// Every assignment, those that are no tuple included.
    pub(super) fn everything(&self) -> Diagram {
        self.diagrams.constant(true)
    }

    pub(super) fn or(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        self.diagrams.or(left, right)
    }

    pub(super) fn and(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        self.diagrams.and(left, right)
    }

    pub(super) fn without(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        self.and(left, &self.diagrams.not(right)?)
    }

    /// What is left of `set` under each state of `level`; `set` must not depend on levels above.
    pub(super) fn split(&self, set: &Diagram, level: usize) -> Vec<Diagram> {
        let block = self.blocks[level];
        let top = self.diagrams.top(set).unwrap_or(usize::MAX);
        if top >= block.first + block.bits {
            return vec![set.clone(); block.states];
        }
        let mut halves = vec![set.clone()];
        for bit in block.first..block.first + block.bits {
            let mut next = Vec::with_capacity(halves.len() * 2);
            for half in halves {
                let (zero, one) = self.diagrams.cofactors(&half, bit);
                next.extend([zero, one]);
            }
            halves = next;
        }
        halves.truncate(block.states);
        halves
    }

    /// The set that leaves `parts[q]` under each state q of `level`; the inverse of [`Self::split`].
    pub(super) fn join(&self, mut parts: Vec<Diagram>, level: usize) -> Result<Diagram, BddError> {
        let block = self.blocks[level];
        parts.resize(1 << block.bits, self.nothing());
        for bit in (block.first..block.first + block.bits).rev() {
            let halves = parts.chunks_exact(2).map(|pair| {
                if pair[0] == pair[1] {
                    Ok(pair[0].clone())
                } else {
                    self.diagrams.choose(&self.variables[bit], &pair[1], &pair[0])
                }
            });
            parts = halves.collect::<Result<_, _>>()?;
        }
        Ok(parts.swap_remove(0))
    }

    /// All tuples whose state on `level` is one that `contains`.
    pub(super) fn where_local(
        &self,
        level: usize,
        contains: impl Fn(u32) -> bool,
    ) -> Result<Diagram, BddError> {
        let (all, nothing) = (self.everything(), self.nothing());
        let states = 0..self.blocks[level].states as u32;
        let pick = |state| {
            if contains(state) { all.clone() } else { nothing.clone() }
        };
        self.join(states.map(pick).collect(), level)
    }

    /// Every assignment that is a tuple.
    pub(super) fn tuples(&self) -> Result<Diagram, BddError> {
        (0..self.levels()).try_fold(self.everything(), |all, level| {
            self.and(&all, &self.where_local(level, |_| true)?)
        })
    }

    /// How many tuples are in `set`; `None` past 2^128.
    pub(super) fn count(&self, set: &Diagram) -> Option<u128> {
        self.count_below(0, set, &mut HashMap::new())
    }

    fn count_below(
        &self,
        level: usize,
        set: &Diagram,
        known: &mut HashMap<(usize, Diagram), Option<u128>>,
    ) -> Option<u128> {
        if set.is_constant(false) {
            return Some(0);
        }
        if level == self.levels() {
            return Some(1);
        }
        let key = (level, set.clone());
        if let Some(&count) = known.get(&key) {
            return count;
        }
        let parts = self.split(set, level);
        let mut counts = parts.iter().map(|part| self.count_below(level + 1, part, known));
        let count = counts.try_fold(0_u128, |sum, count| sum.checked_add(count?));
        known.insert(key, count);
        count
    }

    /// Whether the tuple of `state(level)` is in `set`.
    pub(super) fn contains(&self, set: &Diagram, state: impl Fn(usize) -> u32) -> bool {
        let mut rest = set.clone();
        for (level, block) in self.blocks.iter().enumerate() {
            let state = state(level) as usize;
            for bit in 0..block.bits {
                let (zero, one) = self.diagrams.cofactors(&rest, block.first + bit);
                let is_one = state >> (block.bits - 1 - bit) & 1 == 1;
                rest = if is_one { one } else { zero };
            }
        }
        rest.is_constant(true)
    }
}
