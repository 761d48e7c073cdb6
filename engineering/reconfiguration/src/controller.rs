//! The automaton S of a ladder with its feedback Φ' on outputs, section 3.
//!
//! A state is what a scan shows: the inputs, the outputs, and where these do not tell the future, what is hidden. A move
//! leads to the state of a later scan; its events are the inputs that differ, and where none does it is ω. Several inputs
//! may change in one scan: then the move stands under each of their events, as in Algorithm 1.

use std::collections::{BTreeSet, VecDeque};
use std::fmt::Write as _;

use crate::signals::{Bits, Event, Signals};

/// x.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// V^I.
    pub inputs: Bits,
    /// V^O, which is Φ'(x, ·).
    pub outputs: Bits,
    /// What the memory bits of the ladder were when it was in this state, each once; none where a record does not tell.
    pub memory: Vec<Bits>,
    /// 0, and counted where several states have one vector.
    pub sibling: u32,
}

/// A move to another state.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Move {
    /// Where it leads.
    pub target: usize,
    /// The inputs that change; none is ω.
    pub events: Vec<Event>,
}

impl Move {
    /// Whether it belongs to `event`.
    pub fn is(&self, event: Event) -> bool {
        match event {
            Event::Omega => self.events.is_empty(),
            _ => self.events.contains(&event),
        }
    }
}

/// S with Φ'. State 0 is x0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Controller {
    /// I and O.
    pub signals: Signals,
    /// Names of the bits of [`State::memory`].
    pub memory: Vec<String>,
    states: Vec<State>,
    moves: Vec<Vec<Move>>,
    /// Of each state, from where ω leads to it.
    omega_before: Vec<Vec<usize>>,
}

impl Controller {
    /// `pairs` are moves by the places of their states; one that leads to itself is none.
    pub fn new(
        signals: Signals,
        memory: Vec<String>,
        states: Vec<State>,
        pairs: impl IntoIterator<Item = (usize, usize)>,
    ) -> Self {
        let mut moves: Vec<BTreeSet<Move>> = vec![BTreeSet::new(); states.len()];
        for (source, target) in pairs {
            if source != target {
                let events = Signals::changes(&states[source].inputs, &states[target].inputs);
                moves[source].insert(Move { target, events });
            }
        }
        let mut omega_before = vec![Vec::new(); states.len()];
        for (source, moves) in moves.iter().enumerate() {
            for step in moves.iter().filter(|step| step.events.is_empty()) {
                omega_before[step.target].push(source);
            }
        }
        let moves = moves.into_iter().map(|set| set.into_iter().collect());
        Self { signals, memory, moves: moves.collect(), states, omega_before }
    }

    /// X.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// What may come after `state`.
    pub fn moves(&self, state: usize) -> &[Move] {
        &self.moves[state]
    }

    /// All moves, over all states.
    pub fn move_count(&self) -> usize {
        self.moves.iter().map(Vec::len).sum()
    }

    /// Whether f(`state`, `event`) is defined.
    pub fn is_defined(&self, state: usize, event: Event) -> bool {
        self.moves[state].iter().any(|step| step.is(event))
    }

    /// The vector as the paper writes it: `01000_0100`, with a number behind it where several states have it.
    pub fn state_name(&self, state: usize) -> String {
        let found = &self.states[state];
        let mut name = format!("{}_{}", found.inputs, found.outputs);
        if found.sibling > 0 {
            let _ = write!(name, "'{}", found.sibling);
        }
        name
    }

    /// The number that the tables give it, counted from 1.
    pub fn number(state: usize) -> usize {
        state + 1
    }

    /// X_m: x0 where every state can come back to it, and otherwise the states of the cycles that nothing leaves.
    pub fn marked(&self) -> Vec<bool> {
        let backward = self.backward();
        let home = reach(&backward, [0]);
        if home.iter().all(|&reached| reached) {
            let mut marked = vec![false; self.states.len()];
            marked[0] = true;
            return marked;
        }
        // A state lies in a cycle that nothing leaves when all that it reaches can reach it.
        let forward: Vec<Vec<usize>> =
            self.moves.iter().map(|moves| moves.iter().map(|step| step.target).collect()).collect();
        let mut marked = vec![None; self.states.len()];
        for state in 0..self.states.len() {
            if marked[state].is_some() {
                continue;
            }
            let after = reach(&forward, [state]);
            let before = reach(&backward, [state]);
            let is_final = after.iter().zip(&before).all(|(after, before)| !after || *before);
            for (place, mark) in marked.iter_mut().enumerate() {
                if after[place] && before[place] {
                    *mark = Some(is_final);
                }
            }
        }
        marked.into_iter().map(|mark| mark == Some(true)).collect()
    }

    /// `states`, and all from which ω alone leads to them.
    pub(crate) fn before_omega(&self, states: impl IntoIterator<Item = usize>) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut stack: Vec<usize> = states.into_iter().collect();
        while let Some(state) = stack.pop() {
            if found.insert(state) {
                stack.extend(&self.omega_before[state]);
            }
        }
        found
    }

    /// The states from which nothing follows.
    pub fn deadlocks(&self) -> Vec<usize> {
        (0..self.states.len()).filter(|&state| self.moves[state].is_empty()).collect()
    }

    /// The events of a shortest way from x0 to `state`.
    pub fn way_to(&self, state: usize) -> Vec<Vec<Event>> {
        let mut from: Vec<Option<(usize, usize)>> = vec![None; self.states.len()];
        let mut queue = VecDeque::from([0]);
        while let Some(at) = queue.pop_front() {
            for (place, step) in self.moves[at].iter().enumerate() {
                if step.target != 0 && from[step.target].is_none() {
                    from[step.target] = Some((at, place));
                    queue.push_back(step.target);
                }
            }
        }
        let mut way = Vec::new();
        let mut at = state;
        while let Some((before, place)) = from[at] {
            way.push(self.moves[before][place].events.clone());
            at = before;
        }
        way.reverse();
        way
    }

    fn backward(&self) -> Vec<Vec<usize>> {
        let mut backward = vec![Vec::new(); self.states.len()];
        for (source, moves) in self.moves.iter().enumerate() {
            for step in moves {
                backward[step.target].push(source);
            }
        }
        backward
    }
}

/// What `edges` reach from `roots`, these included.
pub(crate) fn reach(edges: &[Vec<usize>], roots: impl IntoIterator<Item = usize>) -> Vec<bool> {
    let mut reached = vec![false; edges.len()];
    let mut stack: Vec<usize> = roots.into_iter().collect();
    while let Some(at) = stack.pop() {
        if !std::mem::replace(&mut reached[at], true) {
            stack.extend(&edges[at]);
        }
    }
    reached
}
