//! From scans to states: Algorithm 1's choice that equal vectors are one state, and what is hidden where they are not.
//!
//! Scans with equal inputs and outputs are merged. Where a merged state, on the same new inputs, goes on to different
//! outputs, something hidden tells the scans apart; then they are told apart by that (`hidden`), as coarsely as serves.

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::controller::{Controller, State};
use crate::signals::{Bits, Signals};

/// One scan, or many equal ones.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Seen {
    pub(crate) inputs: Bits,
    pub(crate) outputs: Bits,
}

/// What tells scans of one vector apart, from the coarsest to the finest.
pub(crate) type Hidden = Vec<u64>;

/// Merges `nodes`, of which the first is the first scan; `edges` go from a scan to the next. `hidden` has, for each node,
/// equally many keys. `memory` are the bits of [`State::memory`], one per node, or none. Answers with the state of each node too.
pub(crate) fn quotient(
    signals: Signals,
    memory_names: Vec<String>,
    nodes: &[Seen],
    hidden: &[Hidden],
    memory: &[Bits],
    edges: &[(u32, u32)],
) -> (Controller, Vec<usize>) {
    let mut vectors: FxHashMap<&Seen, usize> = FxHashMap::default();
    let vector_of: Vec<usize> = nodes
        .iter()
        .map(|node| {
            let next = vectors.len();
            *vectors.entry(node).or_insert(next)
        })
        .collect();
    let depth = hidden.first().map_or(0, Vec::len);
    let mut finesse = vec![0_usize; vectors.len()];
    let blocks = loop {
        let blocks = blocks(&vector_of, hidden, &finesse);
        let mut grew = false;
        let split: BTreeSet<usize> =
            conflicts(nodes, edges, &blocks).into_iter().map(|node| vector_of[node]).collect();
        for vector in split {
            if finesse[vector] < depth {
                finesse[vector] += 1;
                grew = true;
            }
        }
        if !grew {
            break blocks;
        }
    };
    let count = blocks.iter().copied().max().map_or(0, |last| last + 1);
    let mut states: Vec<Option<State>> = vec![None; count];
    let mut kept: Vec<FxHashSet<&Bits>> = vec![FxHashSet::default(); count];
    let mut siblings: BTreeMap<usize, u32> = BTreeMap::new();
    for (node, &block) in blocks.iter().enumerate() {
        let state = states[block].get_or_insert_with(|| {
            let sibling = siblings.entry(vector_of[node]).or_insert(0);
            *sibling += 1;
            State {
                inputs: nodes[node].inputs.clone(),
                outputs: nodes[node].outputs.clone(),
                memory: Vec::new(),
                sibling: *sibling - 1,
            }
        });
        if let Some(bits) = memory.get(node)
            && kept[block].insert(bits)
        {
            state.memory.push(bits.clone());
        }
    }
    let states: Vec<State> = states.into_iter().flatten().collect();
    let pairs: FxHashSet<(usize, usize)> =
        edges.iter().map(|&(from, to)| (blocks[from as usize], blocks[to as usize])).collect();
    let controller = Controller::new(signals, memory_names, states, pairs);
    (controller, blocks)
}

/// Numbers the blocks in the order in which their first nodes come.
fn blocks(vector_of: &[usize], hidden: &[Hidden], finesse: &[usize]) -> Vec<usize> {
    let mut numbers: FxHashMap<(usize, &[u64]), usize> = FxHashMap::default();
    vector_of
        .iter()
        .enumerate()
        .map(|(node, &vector)| {
            let key: &[u64] = hidden.get(node).map_or(&[], |hidden| &hidden[..finesse[vector]]);
            let next = numbers.len();
            *numbers.entry((vector, key)).or_insert(next)
        })
        .collect()
}

/// The scans of states that, on the same new inputs, go on to different ones.
fn conflicts(nodes: &[Seen], edges: &[(u32, u32)], blocks: &[usize]) -> Vec<usize> {
    let mut first: FxHashMap<(usize, &Bits), usize> = FxHashMap::default();
    let mut found = Vec::new();
    for &(from, to) in edges {
        let (from, to) = (from as usize, to as usize);
        if blocks[from] == blocks[to] {
            continue;
        }
        let known = *first.entry((blocks[from], &nodes[to].inputs)).or_insert(to);
        if blocks[known] != blocks[to] {
            found.push(from);
        }
    }
    found
}
