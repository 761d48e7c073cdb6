//! Supervisor reduction, after R. Su and W. M. Wonham, *Supervisor reduction for discrete-event systems* (2004).
//!
//! Two states of a supervisor may become one when neither enables what the other disables, when they agree on marking wherever the
//! plant leaves it to them, and when the same holds for all that follows. Finding the fewest states is NP-hard; merging greedily
//! is not, and what comes out depends on the order in which pairs are tried. A few orders are tried and the smallest result is kept.

use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Bounds, Joint, Product, TooLarge};

/// How far a reduction is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reducing {
    /// The order in which pairs are tried now, from 1.
    pub order: usize,
    /// How many orders there are.
    pub orders: usize,
    /// States of which every pair was tried in this order.
    pub tried: usize,
    /// States of the supervisor.
    pub states: usize,
    /// States that are left so far.
    pub left: usize,
}

/// A reduced supervisor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reduction {
    /// With the same effect on the plant, also where the reduction was stopped.
    pub supervisor: Automaton,
    /// Whether all pairs of states were tried; otherwise it was stopped before, and fewer states may do.
    pub is_complete: bool,
}

/// `supreduce`: a supervisor with no more states than `supervisor` and the same effect on `plant`; usually with far fewer, for it forgets
/// what the plant knows by itself. Its states have no names.
///
/// # Errors
/// The product of the two passes the bounds.
pub fn supreduce(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<Automaton, TooLarge> {
    supreduce_while(plant, supervisor, bounds, &mut |_| true).map(|made| made.supervisor)
}

/// As [`supreduce`], for as long as `go_on` says so, which is asked many times a second; the smallest result until then is kept.
///
/// # Errors
/// The product of the two passes the bounds.
pub fn supreduce_while(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    go_on: &mut dyn FnMut(Reducing) -> bool,
) -> Result<Reduction, TooLarge> {
    let mut best = Reduction {
        supervisor: supervisor.clone(),
        is_complete: true,
    };
    if supervisor.is_empty() {
        return Ok(best);
    }
    let demands = Demands::new(plant, supervisor, bounds)?;
    let orders = [ascending(supervisor), depth_first(supervisor)];
    for (number, order) in orders.iter().enumerate() {
        let mut cells = Cells::new(supervisor, &demands);
        let mut go_on = |tried, left| {
            go_on(Reducing {
                order: number + 1,
                orders: orders.len(),
                tried,
                states: supervisor.state_count(),
                left,
            })
        };
        best.is_complete = cells.merge_greedily(order, &mut go_on);
        let reduced = cells.reduced(supervisor);
        let size = |automaton: &Automaton| (automaton.state_count(), automaton.transition_count());
        if number == 0 || size(&reduced) < size(&best.supervisor) {
            best.supervisor = reduced;
        }
        if !best.is_complete {
            break;
        }
    }
    Ok(best)
}

fn ascending(supervisor: &Automaton) -> Vec<State> {
    supervisor.states().collect()
}

fn depth_first(supervisor: &Automaton) -> Vec<State> {
    let mut seen = vec![false; supervisor.state_count()];
    let mut order = Vec::with_capacity(seen.len());
    let mut pending: Vec<State> = supervisor.initial().into_iter().collect();
    while let Some(state) = pending.pop() {
        if std::mem::replace(&mut seen[state.index()], true) {
            continue;
        }
        order.push(state);
        pending.extend(supervisor.edges(state).iter().rev().map(|edge| edge.target));
    }
    order.extend(supervisor.states().filter(|state| !seen[state.index()]));
    order
}

/// What each state of a supervisor asks for, as bit sets over its alphabet and one bit more for marking: E(x) and D(x) of the
/// paper. A state that marks where the plant does enables the marking; one that does not where the plant does disables it.
struct Demands {
    words: usize,
    enabled: Vec<u64>,
    disabled: Vec<u64>,
}

impl Demands {
    fn new(plant: &Automaton, supervisor: &Automaton, bounds: Bounds) -> Result<Self, TooLarge> {
        let product = Product::explore(&[plant, supervisor], &[], Joint::Meet, bounds)?;
        let alphabet = supervisor.alphabet();
        let marking = alphabet.len();
        let words = (marking + 1).div_ceil(64);
        let mut demands = Self {
            words,
            enabled: vec![0; supervisor.state_count() * words],
            disabled: vec![0; supervisor.state_count() * words],
        };
        for number in 0..product.state_count() {
            let of_plant = product.component_state(number, 0);
            let state = product.component_state(number, 1);
            for edge in plant.edges(of_plant) {
                if let Some(event) = alphabet.place(plant.label(*edge)) {
                    let allowed = supervisor.successor(state, event).is_some();
                    demands.set(state, event as usize, allowed);
                }
            }
            if plant.is_marked(of_plant) {
                demands.set(state, marking, supervisor.is_marked(state));
            }
        }
        for state in supervisor.states() {
            for edge in supervisor.edges(state) {
                demands.set(state, edge.event as usize, true);
            }
        }
        Ok(demands)
    }

    fn set(&mut self, state: State, bit: usize, enabled: bool) {
        let sets = if enabled {
            &mut self.enabled
        } else {
            &mut self.disabled
        };
        sets[state.index() * self.words + bit / 64] |= 1 << (bit % 64);
    }
}

const NONE: u32 = u32::MAX;

/// Whether to go on: asked each time that the patience is used up.
fn spend(patience: &mut u32, go_on: &mut dyn FnMut() -> bool) -> bool {
    *patience -= 1;
    if *patience > 0 {
        return true;
    }
    *patience = PATIENCE;
    go_on()
}

/// A partition of the states into cells whose members agree, with what a cell asks for and where its events lead. A step that
/// turns out wrong is taken back.
struct Cells {
    words: usize,
    events: usize,
    parent: Vec<u32>,
    /// Bigger states come later in the order that is tried; the root of a cell is its first.
    enabled: Vec<u64>,
    disabled: Vec<u64>,
    /// Target for each state and event, or [`NONE`].
    targets: Vec<u32>,
    /// What a tentative merge changed.
    undo: Vec<Change>,
    pending: Vec<(u32, u32)>,
    /// Cells that are left.
    left: usize,
    /// Until it is asked again whether to go on.
    patience: u32,
}

/// Number of pairs of states between two checks whether to continue: some milliseconds.
const PATIENCE: u32 = 1 << 16;

enum Change {
    Parent(u32, u32),
    Enabled(usize, u64),
    Disabled(usize, u64),
    Target(usize),
}

impl Cells {
    fn new(supervisor: &Automaton, demands: &Demands) -> Self {
        let events = supervisor.alphabet().len();
        let mut targets = vec![NONE; supervisor.state_count() * events];
        for state in supervisor.states() {
            for edge in supervisor.edges(state) {
                targets[state.index() * events + edge.event as usize] = edge.target.number();
            }
        }
        Self {
            words: demands.words,
            events,
            parent: (0..supervisor.state_count() as u32).collect(),
            enabled: demands.enabled.clone(),
            disabled: demands.disabled.clone(),
            targets,
            undo: Vec::new(),
            pending: Vec::new(),
            left: supervisor.state_count(),
            patience: PATIENCE,
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

    /// Tries every pair of cells in an order; false where it was stopped before. `go_on` is told how many states were tried with all
    /// others, and how many cells are left.
    fn merge_greedily(
        &mut self,
        order: &[State],
        go_on: &mut dyn FnMut(usize, usize) -> bool,
    ) -> bool {
        for (place, &state) in order.iter().enumerate() {
            if !self.is_root(state) {
                continue;
            }
            for &other in &order[place + 1..] {
                if !self.is_root(other) {
                    continue;
                }
                let mut asked = || go_on(place, self.left);
                if !spend(&mut self.patience, &mut asked) {
                    return false;
                }
                let root = self.find(state.number());
                self.undo.clear();
                if self.agree(root, other.number())
                    && !self.try_merge(root, other.number(), place, go_on)
                {
                    return false;
                }
            }
        }
        true
    }

    /// Whether neither of two cells enables what the other disables.
    fn agree(&self, left: u32, right: u32) -> bool {
        let (left, right) = (left as usize * self.words, right as usize * self.words);
        (0..self.words).all(|word| {
            let clash = self.enabled[left + word] & self.disabled[right + word]
                | self.disabled[left + word] & self.enabled[right + word];
            clash == 0
        })
    }

    /// Merges two cells and all that must then be merged, the nearest first; or takes everything back. False where it was stopped, with
    /// everything taken back.
    fn try_merge(
        &mut self,
        left: u32,
        right: u32,
        tried: usize,
        go_on: &mut dyn FnMut(usize, usize) -> bool,
    ) -> bool {
        let before = self.left;
        self.pending.clear();
        self.pending.push((left, right));
        let mut next = 0;
        while let Some(&(left, right)) = self.pending.get(next) {
            next += 1;
            let goes_on = spend(&mut self.patience, &mut || go_on(tried, before));
            let (left, right) = (self.find(left), self.find(right));
            if left == right {
                continue;
            }
            if !goes_on || !self.agree(left, right) || !self.join(left, right) {
                self.take_back();
                self.left = before;
                return goes_on;
            }
            self.left -= 1;
        }
        self.undo.clear();
        true
    }

    /// Makes two cells one, and notes what must then be merged; false where some of that cannot.
    fn join(&mut self, left: u32, right: u32) -> bool {
        let (kept, joined) = (left.min(right), left.max(right));
        self.parent[joined as usize] = kept;
        self.undo.push(Change::Parent(joined, joined));
        for word in 0..self.words {
            let (to, from) = (
                kept as usize * self.words + word,
                joined as usize * self.words + word,
            );
            let (enabled, disabled) = (self.enabled[to], self.disabled[to]);
            if self.enabled[from] & !enabled != 0 {
                self.undo.push(Change::Enabled(to, enabled));
                self.enabled[to] |= self.enabled[from];
            }
            if self.disabled[from] & !disabled != 0 {
                self.undo.push(Change::Disabled(to, disabled));
                self.disabled[to] |= self.disabled[from];
            }
        }
        for event in 0..self.events {
            let other = self.targets[joined as usize * self.events + event];
            if other == NONE {
                continue;
            }
            let place = kept as usize * self.events + event;
            if self.targets[place] == NONE {
                self.targets[place] = other;
                self.undo.push(Change::Target(place));
            } else {
                let (one, other) = (self.find(self.targets[place]), self.find(other));
                if one != other {
                    // Most attempts fail, and soon: before anything else is changed for them.
                    if !self.agree(one, other) {
                        return false;
                    }
                    self.pending.push((one, other));
                }
            }
        }
        true
    }

    fn take_back(&mut self) {
        while let Some(change) = self.undo.pop() {
            match change {
                Change::Parent(state, parent) => self.parent[state as usize] = parent,
                Change::Enabled(place, set) => self.enabled[place] = set,
                Change::Disabled(place, set) => self.disabled[place] = set,
                Change::Target(place) => self.targets[place] = NONE,
            }
        }
    }

    fn reduced(&self, supervisor: &Automaton) -> Automaton {
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
                    edges.push(Edge {
                        event: event as u32,
                        target,
                    });
                }
            }
            first.push(edges.len() as u32);
        }
        let alphabet = supervisor.alphabet().clone();
        // A cell represents many states; the name of one would mislead.
        Automaton::from_parts("SIMSUP".to_owned(), alphabet, marked, first, edges)
    }
}
