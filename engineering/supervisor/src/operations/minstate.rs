//! The fewest states, by refinement of partitions.
//!
//! The algorithm is A. Valmari's, *Fast brief practical DFA minimization* (Information Processing Letters 112, 2012): blocks of states
//! and cords of transitions split each other; O(m log m) for m transitions, also where the transition function is partial.

use crate::automaton::{Automaton, Edge, State};

use super::basic::reachable;

/// `minstate`: the reachable automaton with the fewest states that has the same closed and the same marked language.
pub fn minstate(automaton: &Automaton) -> Automaton {
    let automaton = reachable(automaton);
    let Some(initial) = automaton.initial() else {
        return automaton;
    };
    let (_, edges) = automaton.arrays();
    let sources: Vec<u32> = automaton
        .states()
        .flat_map(|state| automaton.edges(state).iter().map(move |_| state.number()))
        .collect();
    let blocks = blocks(&automaton, edges, &sources);
    // Blocks are numbered by their first states in breadth-first order; that is the order of the states of `automaton`.
    let unnumbered = u32::MAX;
    let mut numbers = vec![unnumbered; blocks.sets()];
    let mut leaders = Vec::new();
    for state in automaton.states() {
        let number = &mut numbers[blocks.set_of(state.index())];
        if *number == unnumbered {
            *number = leaders.len() as u32;
            leaders.push(state);
        }
    }
    debug_assert_eq!(leaders.first(), Some(&initial));
    let mut first = vec![0];
    let mut merged = Vec::new();
    for &leader in &leaders {
        merged.extend(automaton.edges(leader).iter().map(|edge| Edge {
            event: edge.event,
            target: State::new(numbers[blocks.set_of(edge.target.index())]),
        }));
        first.push(merged.len() as u32);
    }
    let marked = leaders.iter().map(|&leader| automaton.is_marked(leader)).collect();
    let name = automaton.name().to_owned();
    let minimal = Automaton::from_parts(name, automaton.alphabet().clone(), marked, first, merged);
    match automaton.state_names() {
        // A merged state has the name of its first state.
        Some(names) => minimal
            .named_states(leaders.iter().map(|leader| names[leader.index()].clone()).collect()),
        None => minimal,
    }
}

/// The coarsest partition of the states that agrees with marking and transitions.
fn blocks(automaton: &Automaton, edges: &[Edge], sources: &[u32]) -> Partition {
    let mut blocks = Partition::new(automaton.state_count());
    for state in automaton.marked() {
        blocks.mark(state.index());
    }
    blocks.split();
    let mut cords = Partition::new(edges.len());
    cords.group_by(|transition| edges[transition].event);
    let incoming = Incoming::new(edges, automaton.state_count());
    let mut next_block = 1;
    let mut next_cord = 0;
    while next_cord < cords.sets() {
        for place in cords.range(next_cord) {
            blocks.mark(sources[cords.element(place)] as usize);
        }
        blocks.split();
        next_cord += 1;
        while next_block < blocks.sets() {
            for place in blocks.range(next_block) {
                for &transition in incoming.of(blocks.element(place)) {
                    cords.mark(transition as usize);
                }
            }
            cords.split();
            next_block += 1;
        }
    }
    blocks
}

/// The transitions that lead to each state.
struct Incoming {
    first: Vec<u32>,
    transitions: Vec<u32>,
}

impl Incoming {
    fn new(edges: &[Edge], states: usize) -> Self {
        let mut first = vec![0; states + 1];
        for edge in edges {
            first[edge.target.index() + 1] += 1;
        }
        for state in 0..states {
            first[state + 1] += first[state];
        }
        let mut next: Vec<u32> = first.clone();
        let mut transitions = vec![0; edges.len()];
        for (number, edge) in edges.iter().enumerate() {
            let place = &mut next[edge.target.index()];
            transitions[*place as usize] = number as u32;
            *place += 1;
        }
        Self { first, transitions }
    }

    fn of(&self, state: usize) -> &[u32] {
        &self.transitions[self.first[state] as usize..self.first[state + 1] as usize]
    }
}

/// A partition that is refined: elements lie grouped by set, the marked ones of a set before the others.
struct Partition {
    elements: Vec<u32>,
    place: Vec<u32>,
    set: Vec<u32>,
    start: Vec<u32>,
    end: Vec<u32>,
    marks: Vec<u32>,
    touched: Vec<u32>,
}

impl Partition {
    fn new(size: usize) -> Self {
        let all: Vec<u32> = (0..size as u32).collect();
        let sets = usize::from(size > 0);
        Self {
            elements: all.clone(),
            place: all,
            set: vec![0; size],
            start: vec![0; sets],
            end: vec![size as u32; sets],
            marks: vec![0; sets],
            touched: Vec::new(),
        }
    }

    /// One set for each key; to be called before anything is marked.
    fn group_by(&mut self, key: impl Fn(usize) -> u32) {
        if self.elements.is_empty() {
            return;
        }
        self.elements.sort_by_key(|&element| key(element as usize));
        self.start.clear();
        self.end.clear();
        let mut last = None;
        for (place, &element) in self.elements.iter().enumerate() {
            let key = key(element as usize);
            if last != Some(key) {
                if last.is_some() {
                    self.end.push(place as u32);
                }
                self.start.push(place as u32);
                last = Some(key);
            }
            self.place[element as usize] = place as u32;
            self.set[element as usize] = self.start.len() as u32 - 1;
        }
        self.end.push(self.elements.len() as u32);
        self.marks = vec![0; self.start.len()];
    }

    fn sets(&self) -> usize {
        self.start.len()
    }

    fn set_of(&self, element: usize) -> usize {
        self.set[element] as usize
    }

    fn range(&self, set: usize) -> std::ops::Range<usize> {
        self.start[set] as usize..self.end[set] as usize
    }

    fn element(&self, place: usize) -> usize {
        self.elements[place] as usize
    }

    fn mark(&mut self, element: usize) {
        let set = self.set[element] as usize;
        let from = self.place[element];
        let to = self.start[set] + self.marks[set];
        if from < to {
            return;
        }
        let other = self.elements[to as usize];
        self.elements.swap(from as usize, to as usize);
        self.place[other as usize] = from;
        self.place[element] = to;
        if self.marks[set] == 0 {
            self.touched.push(set as u32);
        }
        self.marks[set] += 1;
    }

    /// Parts the marked elements of each set from the others; the smaller part becomes the new set, which is what bounds the work.
    fn split(&mut self) {
        for set in std::mem::take(&mut self.touched) {
            let set = set as usize;
            let (start, end) = (self.start[set], self.end[set]);
            let middle = start + self.marks[set];
            self.marks[set] = 0;
            if middle == end {
                continue;
            }
            let new = self.start.len() as u32;
            let (new_start, new_end) = if middle - start <= end - middle {
                self.start[set] = middle;
                (start, middle)
            } else {
                self.end[set] = middle;
                (middle, end)
            };
            self.start.push(new_start);
            self.end.push(new_end);
            self.marks.push(0);
            for place in new_start..new_end {
                self.set[self.elements[place as usize] as usize] = new;
            }
        }
    }
}
