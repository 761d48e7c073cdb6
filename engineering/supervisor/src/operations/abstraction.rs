use std::collections::{HashMap, VecDeque};

use super::basic::trim;
use super::project::Subsets;
use crate::alphabet::Label;
use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Bounds, TooLarge};

/// What makes a natural projection a sound abstraction: where the events in `hidden` are not seen. All three are about the trim part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Abstraction {
    /// States that are not reachable or block: the properties are not about them.
    pub trimmed: usize,
    /// Why the projection has not the observer property (Wong and Wonham, 1996): what its observer can still do, the automaton can do in
    /// each of its states, after hidden events.
    pub observer: Option<Unobserved>,
    /// Why it is not locally control consistent (Schmidt and Breindl, 2011): a visible uncontrollable event that hidden events lead to is
    /// also led to by uncontrollable ones alone.
    pub local_control: Option<Uncontrolled>,
    /// Why it is not output control consistent (Zhong and Wonham, 1990): no hidden controllable event comes between a visible event and
    /// the next one if that is uncontrollable.
    pub output_control: Option<Uncontrolled>,
}

/// Where an automaton cannot do what its observer can.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unobserved {
    /// A shortest sequence of events to a state.
    pub word: Vec<Label>,
    /// The state of the trim part, by its name.
    pub state: String,
    /// The visible event that the observer has there; none where it is marked.
    pub event: Option<Label>,
}

/// Where a hidden controllable event decides about an uncontrollable one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Uncontrolled {
    /// A shortest sequence of events to a state.
    pub word: Vec<Label>,
    /// The state of the trim part, by its name.
    pub state: String,
    /// The visible uncontrollable event.
    pub event: Label,
}

/// The properties of the natural projection that hides the events in `hidden`.
///
/// # Errors
/// As of [`project`](super::project).
pub fn abstraction(
    automaton: &Automaton,
    hidden: &[Label],
    bounds: Bounds,
) -> Result<Abstraction, TooLarge> {
    let whole = trim(automaton);
    let trimmed = automaton.state_count() - whole.state_count();
    let view = View::of(&whole, hidden);
    let subsets = Subsets::of(&whole, hidden, bounds)?;
    let paths = Paths::of(&whole, |_, _| 0);
    let (local_control, output_control) = view.control(&paths);
    Ok(Abstraction { trimmed, observer: view.unobserved(&subsets), local_control, output_control })
}

/// A trim automaton with what of it is hidden.
struct View<'a> {
    automaton: &'a Automaton,
    is_hidden: Vec<bool>,
}

impl<'a> View<'a> {
    fn of(automaton: &'a Automaton, hidden: &[Label]) -> Self {
        let is_hidden = automaton.alphabet().labels().map(|label| hidden.contains(&label));
        Self { is_hidden: is_hidden.collect(), automaton }
    }

    fn label(&self, event: usize) -> Label {
        self.automaton.alphabet().event(event as u32).label
    }

    fn is_controllable(&self, event: usize) -> bool {
        self.label(event).is_controllable()
    }

    /// From which states a state of `goals` is reached by transitions that `passes` lets through.
    fn leading(&self, goals: &[bool], passes: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut before: Vec<Vec<State>> = vec![Vec::new(); goals.len()];
        for state in self.automaton.states() {
            for edge in
                self.automaton.edges(state).iter().filter(|edge| passes(edge.event as usize))
            {
                before[edge.target.index()].push(state);
            }
        }
        let mut leading = goals.to_vec();
        let states = self.automaton.states();
        let mut pending: Vec<State> = states.filter(|state| goals[state.index()]).collect();
        while let Some(state) = pending.pop() {
            for &source in &before[state.index()] {
                if !std::mem::replace(&mut leading[source.index()], true) {
                    pending.push(source);
                }
            }
        }
        leading
    }

    /// The states that have a transition of an event.
    fn having(&self, event: usize) -> Vec<bool> {
        let states = self.automaton.states();
        states.map(|state| self.automaton.successor(state, event as u32).is_some()).collect()
    }

    /// The first state of an observer's state that cannot do what that can.
    fn unobserved(&self, subsets: &Subsets) -> Option<Unobserved> {
        let observer = &subsets.automaton;
        let visible = (0..self.is_hidden.len()).filter(|&event| !self.is_hidden[event]);
        let can: HashMap<Label, Vec<bool>> = visible
            .map(|event| {
                let leading = self.leading(&self.having(event), |other| self.is_hidden[other]);
                (self.label(event), leading)
            })
            .collect();
        let marked: Vec<bool> =
            self.automaton.states().map(|state| self.automaton.is_marked(state)).collect();
        let ends = self.leading(&marked, |event| self.is_hidden[event]);
        // Pairs of the observer's state and one of its states.
        let follow = |set: u32, edge: &Edge| match self.is_hidden[edge.event as usize] {
            true => set,
            false => {
                let next = observer.step(State::new(set), self.automaton.label(*edge));
                next.map_or(set, State::number)
            }
        };
        let paths = Paths::of(self.automaton, follow);
        paths.order.iter().find_map(|&(state, set)| {
            let of_set = State::new(set);
            let mut enabled = observer.edges(of_set).iter().map(|edge| observer.label(*edge));
            let lost = enabled.find(|label| !can[label][state.index()]);
            let is_wrong = lost.is_some() || (observer.is_marked(of_set) && !ends[state.index()]);
            is_wrong.then(|| Unobserved {
                word: paths.word((state, set)),
                state: self.automaton.state_name(state).into_owned(),
                event: lost,
            })
        })
    }

    /// Where local and output control consistency fail.
    fn control(&self, paths: &Paths) -> (Option<Uncontrolled>, Option<Uncontrolled>) {
        let (mut local, mut output) = (None, None);
        let at = |state: State, event: usize| Uncontrolled {
            word: paths.word((state, 0)),
            state: self.automaton.state_name(state).into_owned(),
            event: self.label(event),
        };
        for event in 0..self.is_hidden.len() {
            if self.is_hidden[event] || self.is_controllable(event) {
                continue;
            }
            let having = self.having(event);
            let hidden = self.leading(&having, |other| self.is_hidden[other]);
            let forced = self
                .leading(&having, |other| self.is_hidden[other] && !self.is_controllable(other));
            for &(state, _) in &paths.order {
                if hidden[state.index()] && !forced[state.index()] {
                    local.get_or_insert_with(|| at(state, event));
                }
                let decides = self.automaton.edges(state).iter().any(|edge| {
                    let other = edge.event as usize;
                    self.is_hidden[other]
                        && self.is_controllable(other)
                        && hidden[edge.target.index()]
                });
                if decides {
                    output.get_or_insert_with(|| at(state, event));
                }
            }
        }
        (local, output)
    }
}

/// Shortest sequences of events to the reachable states, each with a number that the events on the way make.
struct Paths {
    order: Vec<(State, u32)>,
    before: HashMap<(State, u32), ((State, u32), Label)>,
}

impl Paths {
    fn of(automaton: &Automaton, follow: impl Fn(u32, &Edge) -> u32) -> Self {
        let mut paths = Self { order: Vec::new(), before: HashMap::new() };
        let Some(initial) = automaton.initial() else { return paths };
        let first = (initial, 0);
        let mut pending = VecDeque::from([first]);
        while let Some(at) = pending.pop_front() {
            paths.order.push(at);
            for edge in automaton.edges(at.0) {
                let next = (edge.target, follow(at.1, edge));
                if next != first && !paths.before.contains_key(&next) {
                    paths.before.insert(next, (at, automaton.label(*edge)));
                    pending.push_back(next);
                }
            }
        }
        paths
    }

    fn word(&self, mut at: (State, u32)) -> Vec<Label> {
        let mut word = Vec::new();
        while let Some(&(before, label)) = self.before.get(&at) {
            word.push(label);
            at = before;
        }
        word.reverse();
        word
    }
}
