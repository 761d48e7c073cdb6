//! How long ladder and plant stay in a state of S, and how long an input keeps a value: in scans, over all that was explored.

use std::collections::VecDeque;

/// What an exploration knows of times.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Timing {
    /// Longest stay in each state of S, in scans; none if unlimited.
    pub longest_stay: Vec<Option<u32>>,
    /// Of each input, the scans between two of its changes that are nearest to each other; none where it changes once at most.
    pub shortest_pulse: Vec<Option<u32>>,
}

/// `state_of` and `shown` are those of each node, `edges` lead from a scan to the next.
pub(crate) fn timing(
    states: usize,
    state_of: &[usize],
    inputs: usize,
    shown: &dyn Fn(usize, usize) -> bool,
    edges: &[(u32, u32)],
) -> Timing {
    Timing {
        longest_stay: longest_stay(states, state_of, edges),
        shortest_pulse: (0..inputs)
            .map(|input| shortest_pulse(state_of.len(), &|node| shown(node, input), edges))
            .collect(),
    }
}

/// The longest ways inside of each state; a node that lies on a cycle, or behind one, has none.
fn longest_stay(states: usize, state_of: &[usize], edges: &[(u32, u32)]) -> Vec<Option<u32>> {
    let mut next = vec![Vec::new(); state_of.len()];
    let mut before = vec![0_u32; state_of.len()];
    for &(from, to) in edges {
        if state_of[from as usize] == state_of[to as usize] {
            next[from as usize].push(to as usize);
            before[to as usize] += 1;
        }
    }
    let mut stay = vec![1_u32; state_of.len()];
    let mut done = vec![false; state_of.len()];
    let mut ready: Vec<usize> = (0..state_of.len()).filter(|&node| before[node] == 0).collect();
    while let Some(node) = ready.pop() {
        done[node] = true;
        for &target in &next[node] {
            stay[target] = stay[target].max(stay[node] + 1);
            before[target] -= 1;
            if before[target] == 0 {
                ready.push(target);
            }
        }
    }
    let mut longest = vec![Some(0); states];
    for (node, &state) in state_of.iter().enumerate() {
        longest[state] = match longest[state] {
            Some(known) if done[node] => Some(stay[node].max(known)),
            _ => None,
        };
    }
    longest
}

/// From every change forward to the next one.
fn shortest_pulse(
    nodes: usize,
    value: &dyn Fn(usize) -> bool,
    edges: &[(u32, u32)],
) -> Option<u32> {
    let mut backward = vec![Vec::new(); nodes];
    let mut scans: Vec<Option<u32>> = vec![None; nodes];
    let mut queue = VecDeque::new();
    let mut changed = Vec::new();
    for &(from, to) in edges {
        let (from, to) = (from as usize, to as usize);
        backward[to].push(from);
        if value(from) != value(to) {
            changed.push(to);
            if scans[from].is_none() {
                scans[from] = Some(1);
                queue.push_back(from);
            }
        }
    }
    while let Some(node) = queue.pop_front() {
        let after = scans[node].map(|scans| scans + 1);
        for &source in &backward[node] {
            if scans[source].is_none() {
                scans[source] = after;
                queue.push_back(source);
            }
        }
    }
    changed.into_iter().filter_map(|node| scans[node]).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cycle of 3 scans in state 0, 2 in state 1, of which the second may last; the input is 1 in state 1.
    #[test]
    fn stays_and_pulses_are_counted_in_scans() {
        let edges = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)];
        let state_of = [0, 0, 0, 1, 1];
        let shown = |node: usize, _| node >= 3;
        let found = timing(2, &state_of, 1, &shown, &edges);
        assert_eq!(found.longest_stay, [Some(3), Some(2)]);
        assert_eq!(found.shortest_pulse, [Some(2)]);
        let lasting: Vec<(u32, u32)> = edges.into_iter().chain([(4, 4)]).collect();
        let found = timing(2, &state_of, 1, &shown, &lasting);
        assert_eq!(found.longest_stay, [Some(3), None]);
        assert_eq!(found.shortest_pulse, [Some(2)]);
    }
}
