//! A partition of the states of a supervisor into cells, made coarser pair by pair.
//!
//! A merge that is refused once is always refused: cells only grow, and a larger cell asks for more. So a cell that was tried with all
//! others is *closed*: no later merge can change it. Most attempts end at a closed cell, in their first step.

use understudy_logic::ones;

use super::demands::Demands;
use super::sieve::Sieve;
use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Bounds, TooLarge};

const NONE: u32 = u32::MAX;

/// Pairs of cells between two checks whether to continue: about a millisecond.
const BETWEEN_CHECKS: u64 = 1 << 12;

/// What an order may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// An order that leaves more cells is of no use.
    pub(super) cells: usize,
    /// Pairs of cells to look at.
    pub(super) steps: u64,
}

/// How the attempts in one order ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// Every pair of cells was tried.
    Complete,
    /// A limit was reached.
    Useless,
    /// The caller stopped it.
    Stopped,
}

/// Cells whose members agree, with what a cell asks for and where its events lead. A step that turns out wrong is taken back.
pub(super) struct Cells {
    /// Words of [`Self::demands`] of a cell.
    words: usize,
    events: usize,
    /// The root of a cell is its smallest state.
    parent: Vec<u32>,
    /// The next state of the same cell, in a ring.
    next: Vec<u32>,
    /// What a cell enables, then what it disables.
    demands: Vec<u64>,
    /// The events with a target, as bit sets.
    defined: Vec<u64>,
    /// Target for each state and event, or [`NONE`].
    targets: Vec<u32>,
    /// Cells that can no longer change.
    closed: Vec<bool>,
    /// For each root the state with which a merge was refused last.
    refused_with: Vec<u32>,
    /// The state that is tried with all others now.
    current: u32,
    /// What a tentative merge changed.
    undo: Vec<Change>,
    pending: Vec<(u32, u32)>,
    /// Cells that are left.
    left: usize,
    /// Pairs of cells that were looked at.
    steps: u64,
}

enum Change {
    Parent(u32, u32),
    /// The rings of two cells became one, or the other way round.
    Rings(u32, u32),
    Demand(usize, u64),
    Defined(usize, u64),
    Target(usize),
    Refused(u32, u32),
}

/// What came of an attempt to merge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Attempt {
    Merged,
    Refused,
    /// Stopped before its end, with everything taken back.
    Stopped,
}

impl Cells {
    /// Whether the targets of all states and events fit.
    pub(super) fn check_fits(supervisor: &Automaton, bounds: Bounds) -> Result<(), TooLarge> {
        let (states, events) = (supervisor.state_count(), supervisor.alphabet().len());
        if states.saturating_mul(events).saturating_mul(size_of::<u32>()) <= bounds.memory_bytes {
            return Ok(());
        }
        Err(TooLarge::Memory {
            states,
            transitions: supervisor.transition_count(),
            memory_bytes: bounds.memory_bytes,
        })
    }

    pub(super) fn new(supervisor: &Automaton, demands: &Demands) -> Self {
        let events = supervisor.alphabet().len();
        let states = supervisor.state_count();
        let sets = events.div_ceil(64);
        let mut targets = vec![NONE; states * events];
        let mut defined = vec![0; states * sets];
        for state in supervisor.states() {
            for edge in supervisor.edges(state) {
                let event = edge.event as usize;
                targets[state.index() * events + event] = edge.target.number();
                defined[state.index() * sets + event / 64] |= 1 << (event % 64);
            }
        }
        Self {
            words: demands.words,
            events,
            parent: (0..states as u32).collect(),
            next: (0..states as u32).collect(),
            demands: demands.sets.clone(),
            defined,
            targets,
            closed: vec![false; states],
            refused_with: vec![NONE; states],
            current: NONE,
            undo: Vec::new(),
            pending: Vec::new(),
            left: states,
            steps: 0,
        }
    }

    fn root(&self, mut state: u32) -> u32 {
        while self.parent[state as usize] != state {
            state = self.parent[state as usize];
        }
        state
    }

    /// As [`Self::root`], and makes the way there shorter for the next time.
    fn find(&mut self, state: u32) -> u32 {
        let root = self.root(state);
        let mut at = state;
        while self.parent[at as usize] != root && at != root {
            let next = std::mem::replace(&mut self.parent[at as usize], root);
            self.undo.push(Change::Parent(at, next));
            at = next;
        }
        root
    }

    fn is_root(&self, state: State) -> bool {
        self.parent[state.index()] == state.number()
    }

    fn is_open(&self, state: State) -> bool {
        self.is_root(state) && !self.closed[state.index()]
    }

    pub(super) fn is_closed(&self, root: u32) -> bool {
        self.closed[root as usize]
    }

    /// The states of a cell.
    pub(super) fn members(&self, root: u32) -> impl Iterator<Item = u32> {
        let next = move |state: &u32| {
            let next = self.next[*state as usize];
            (next != root).then_some(next)
        };
        std::iter::successors(Some(root), next)
    }

    /// What a cell enables and what it disables.
    pub(super) fn demands_of(&self, root: u32) -> (&[u64], &[u64]) {
        self.demands[root as usize * self.words..][..self.words].split_at(self.words / 2)
    }

    /// The events of a cell that have a target, with the cell of the target.
    pub(super) fn targets_of(&self, root: u32) -> impl Iterator<Item = (usize, u32)> {
        let targets = &self.targets[root as usize * self.events..][..self.events];
        let targets = targets.iter().enumerate();
        targets
            .filter(|(_, target)| **target != NONE)
            .map(|(event, target)| (event, self.root(*target)))
    }

    /// Tries every pair of cells in the order of the sieve. `go_on` is told how many states were tried with all others, and how many cells
    /// are left.
    pub(super) fn merge_greedily(
        &mut self,
        sieve: &mut Sieve,
        limits: Limits,
        go_on: &mut dyn FnMut(usize, usize) -> bool,
    ) -> End {
        let mut closed = 0;
        for place in 0..self.parent.len() {
            let state = sieve.state(place);
            if !self.is_open(state) {
                continue;
            }
            // Closed cells stay, and this one is still open.
            if closed == limits.cells || self.steps > limits.steps {
                return End::Useless;
            }
            closed += 1;
            self.current = state.number();
            sieve.sift(self, state.number());
            for word in 0..sieve.words() {
                if !self.spend(self.left, &mut |left| go_on(place, left)) {
                    return End::Stopped;
                }
                for bit in ones(sieve.left(word)) {
                    let other = sieve.state(64 * word + bit);
                    // A cell before this one that is still open has a root behind it.
                    if other == state {
                        continue;
                    }
                    if !self.is_open(other) {
                        sieve.forget(64 * word + bit);
                        continue;
                    }
                    let root = self.find(state.number());
                    self.undo.clear();
                    if !self.spend(self.left, &mut |left| go_on(place, left)) {
                        return End::Stopped;
                    }
                    if !self.first_step_agrees(root, other.number()) {
                        self.refused_with[other.index()] = self.current;
                        continue;
                    }
                    match self.attempt(root, other.number(), &mut |left| go_on(place, left)) {
                        Attempt::Merged => {}
                        Attempt::Refused => self.refused_with[other.index()] = self.current,
                        Attempt::Stopped => return End::Stopped,
                    }
                }
            }
            let root = self.root(state.number());
            self.closed[root as usize] = true;
            sieve.close(self, root);
        }
        End::Complete
    }

    /// Whether neither of two cells enables what the other disables.
    fn agree(&self, left: u32, right: u32) -> bool {
        let left = &self.demands[left as usize * self.words..][..self.words];
        let right = &self.demands[right as usize * self.words..][..self.words];
        let half = self.words / 2;
        (0..half).all(|word| left[word] & right[half + word] | left[half + word] & right[word] == 0)
    }

    /// Whether nothing known speaks against a merge of two cells.
    fn may_merge(&self, left: u32, right: u32) -> bool {
        let refused = |one: u32, other: u32| {
            self.refused_with[one as usize] == self.current && other == self.current_root()
        };
        !self.closed[left as usize]
            && !self.closed[right as usize]
            && self.agree(left, right)
            && !refused(left, right)
            && !refused(right, left)
    }

    /// Whether nothing known speaks against a merge of two cells and of the targets of their events: most attempts fail so soon, and
    /// nothing was changed for them.
    fn first_step_agrees(&self, left: u32, right: u32) -> bool {
        let sets = self.events.div_ceil(64);
        let row = |cell: u32| cell as usize * self.events;
        self.may_merge(left, right)
            && (0..sets).all(|set| {
                let set_of = |cell: u32| self.defined[cell as usize * sets + set];
                ones(set_of(left) & set_of(right)).all(|bit| {
                    let event = set * 64 + bit;
                    let one = self.root(self.targets[row(left) + event]);
                    let other = self.root(self.targets[row(right) + event]);
                    one == other || self.may_merge(one, other)
                })
            })
    }

    fn current_root(&self) -> u32 {
        self.root(self.current)
    }

    /// Merges two cells and all that must then be merged, the nearest first; or takes everything back.
    fn attempt(&mut self, left: u32, right: u32, go_on: &mut dyn FnMut(usize) -> bool) -> Attempt {
        let before = self.left;
        self.pending.clear();
        self.pending.push((left, right));
        let mut next = 0;
        while let Some(&(left, right)) = self.pending.get(next) {
            next += 1;
            let goes_on = self.spend(before, go_on);
            let (left, right) = (self.find(left), self.find(right));
            if left == right {
                continue;
            }
            if !goes_on || !self.may_merge(left, right) || !self.join(left, right) {
                self.take_back();
                self.left = before;
                return if goes_on { Attempt::Refused } else { Attempt::Stopped };
            }
            self.left -= 1;
        }
        self.undo.clear();
        Attempt::Merged
    }

    /// Counts a step; whether to go on, which is asked now and then.
    fn spend(&mut self, left: usize, go_on: &mut dyn FnMut(usize) -> bool) -> bool {
        self.steps += 1;
        !self.steps.is_multiple_of(BETWEEN_CHECKS) || go_on(left)
    }

    /// Pairs of cells that were looked at.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// Makes two cells one, and notes what must then be merged; false where some of that cannot.
    fn join(&mut self, left: u32, right: u32) -> bool {
        let (kept, joined) = (left.min(right), left.max(right));
        self.parent[joined as usize] = kept;
        self.undo.push(Change::Parent(joined, joined));
        self.next.swap(kept as usize, joined as usize);
        self.undo.push(Change::Rings(kept, joined));
        if self.refused_with[joined as usize] == self.current {
            let before = std::mem::replace(&mut self.refused_with[kept as usize], self.current);
            self.undo.push(Change::Refused(kept, before));
        }
        for word in 0..self.words {
            let from = self.demands[joined as usize * self.words + word];
            let place = kept as usize * self.words + word;
            let to = self.demands[place];
            if from & !to != 0 {
                self.undo.push(Change::Demand(place, to));
                self.demands[place] = to | from;
            }
        }
        let sets = self.events.div_ceil(64);
        (0..sets).all(|set| self.join_targets(kept, joined, set))
    }

    /// Joins the targets of 64 events.
    fn join_targets(&mut self, kept: u32, joined: u32, set: usize) -> bool {
        let sets = self.events.div_ceil(64);
        let place = kept as usize * sets + set;
        let (to, from) = (self.defined[place], self.defined[joined as usize * sets + set]);
        let row = |cell: u32| cell as usize * self.events + set * 64;
        let (kept, joined) = (row(kept), row(joined));
        for bit in ones(from & to) {
            let one = self.find(self.targets[kept + bit]);
            let other = self.find(self.targets[joined + bit]);
            if one != other {
                // Most attempts fail, and soon: before anything else is changed for them.
                if !self.may_merge(one, other) {
                    return false;
                }
                self.pending.push((one, other));
            }
        }
        if from & !to != 0 {
            self.undo.push(Change::Defined(place, to));
            self.defined[place] = to | from;
        }
        for bit in ones(from & !to) {
            self.targets[kept + bit] = self.targets[joined + bit];
            self.undo.push(Change::Target(kept + bit));
        }
        true
    }

    fn take_back(&mut self) {
        while let Some(change) = self.undo.pop() {
            match change {
                Change::Parent(state, parent) => self.parent[state as usize] = parent,
                Change::Rings(kept, joined) => self.next.swap(kept as usize, joined as usize),
                Change::Demand(place, set) => self.demands[place] = set,
                Change::Defined(place, set) => self.defined[place] = set,
                Change::Target(place) => self.targets[place] = NONE,
                Change::Refused(state, with) => self.refused_with[state as usize] = with,
            }
        }
    }

    pub(super) fn reduced(&self, supervisor: &Automaton) -> Automaton {
        let mut numbers = vec![NONE; supervisor.state_count()];
        let mut roots = Vec::new();
        // The initial state is 0, so its cell has the root 0.
        for state in supervisor.states() {
            if self.is_root(state) {
                numbers[state.index()] = roots.len() as u32;
                roots.push(state);
            }
        }
        let mut marked = vec![false; roots.len()];
        for state in supervisor.marked() {
            marked[numbers[self.root(state.number()) as usize] as usize] = true;
        }
        let mut first = vec![0];
        let mut edges = Vec::new();
        for root in &roots {
            for event in 0..self.events {
                let target = self.targets[root.index() * self.events + event];
                if target != NONE {
                    let target = State::new(numbers[self.root(target) as usize]);
                    edges.push(Edge { event: event as u32, target });
                }
            }
            first.push(edges.len() as u32);
        }
        let alphabet = supervisor.alphabet().clone();
        // A cell represents many states; the name of one would mislead.
        Automaton::from_parts("SIMSUP".to_owned(), alphabet, marked, first, edges)
    }
}
