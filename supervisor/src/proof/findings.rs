//! What can be said before a ladder is generated: where a PLC that scans could not follow the supervisor.
//!
//! The conditions are those of Ramadge and Wonham (controllability, nonblocking), of Dietrich, Malik, Wonham and Brandin,
//! "Implementation considerations in supervisory control" (confluence, bounded response, nonblocking under control), and of
//! Fabian and Hellgren (avalanche, simultaneous events). All are decided on the closed loop: the automata in step.

use std::collections::{BTreeMap, HashMap, VecDeque};

use super::verdict::ProofError;
use crate::ladder::{Modules, avalanche_events};
use crate::{Automaton, Label, State, Transition};

/// What a finding is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FindingKind {
    /// A supervisor forbids an uncontrollable event that its plant can generate.
    Controllability,
    /// A state from which no marked state can be reached.
    Blocking,
    /// Two commands of which the one that is generated first makes a difference.
    Choice,
    /// Commands without end.
    Response,
    /// A state from which a PLC that generates every command at once does not come to rest in a marked state.
    BlockingUnderControl,
    /// An event on successive transitions.
    Avalanche,
    /// Two events whose order, which one scan cannot see, makes a difference.
    Simultaneity,
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FindingSeverity {
    /// The ladder keeps the specification, and may do other than was meant.
    Warning,
    /// No ladder can keep it.
    Error,
}

/// Something to know before a ladder is generated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What about.
    pub kind: FindingKind,
    /// How bad.
    pub severity: FindingSeverity,
    /// One sentence with the reason.
    pub message: String,
    /// States of the closed loop concerned; of many the first.
    pub states: Vec<State>,
    /// Events concerned.
    pub events: Vec<Label>,
    /// The shortest run to the first state.
    pub run: Vec<Label>,
}

impl Finding {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self.kind {
            FindingKind::Controllability => "U0881",
            FindingKind::Blocking => "U0882",
            FindingKind::Choice => "U0883",
            FindingKind::Response => "U0884",
            FindingKind::BlockingUnderControl => "U0885",
            FindingKind::Avalanche => "U0886",
            FindingKind::Simultaneity => "U0887",
        }
    }
}

/// The closed loop past which nothing is looked for.
pub(super) const MAXIMUM_CLOSED_LOOP: usize = 2_000_000;

/// All findings about `modules`, by kind.
///
/// # Errors
/// More than 2,000,000 states together.
pub fn findings(modules: &Modules) -> Result<Vec<Finding>, ProofError> {
    let closed = ClosedLoop::of(modules)?;
    let mut found = closed.controllability.clone();
    found.extend(closed.blocking());
    found.extend(closed.choices());
    found.extend(closed.response());
    found.extend(closed.blocking_under_control());
    found.extend(avalanche(modules));
    found.extend(closed.simultaneity());
    Ok(found)
}

/// The automata in step.
struct ClosedLoop {
    automaton: Automaton,
    /// Whence each state was first reached.
    parents: Vec<Option<(State, Label)>>,
    controllability: Vec<Finding>,
}

impl ClosedLoop {
    fn of(modules: &Modules) -> Result<Self, ProofError> {
        let automata: Vec<&Automaton> = modules.all().collect();
        let alphabet = modules.alphabet();
        let mut closed = Self {
            automaton: Automaton::empty("closed loop", alphabet.clone()),
            parents: Vec::new(),
            controllability: Vec::new(),
        };
        if automata.iter().any(|automaton| automaton.is_empty()) {
            return Ok(closed);
        }
        let initial: Box<[State]> = automata.iter().map(|_| State::INITIAL).collect();
        let mut numbers = HashMap::from([(initial.clone(), State::INITIAL)]);
        let mut states = vec![initial];
        let mut transitions = Vec::new();
        closed.parents.push(None);
        let mut forbidden: BTreeMap<Label, (usize, State)> = BTreeMap::new();
        let mut index = 0;
        while index < states.len() {
            let source = State::new(index as u32);
            for label in alphabet.labels() {
                let mut next = states[index].clone();
                let mut refusing = Vec::new();
                for (place, automaton) in automata.iter().enumerate() {
                    if !automaton.alphabet().contains(label) {
                        continue;
                    }
                    match automaton.step(next[place], label) {
                        Some(target) => next[place] = target,
                        None => refusing.push(place),
                    }
                }
                if let Some(&first) = refusing.first() {
                    let plants = modules.supervisors.len()..;
                    let known = modules
                        .plants
                        .iter()
                        .any(|plant| plant.alphabet().contains(label));
                    if !label.is_controllable()
                        && known
                        && !refusing.iter().any(|place| plants.contains(place))
                    {
                        forbidden.entry(label).or_insert((first, source));
                    }
                    continue;
                }
                let target = *numbers.entry(next.clone()).or_insert_with(|| {
                    states.push(next);
                    closed.parents.push(Some((source, label)));
                    State::new(states.len() as u32 - 1)
                });
                transitions.push(Transition {
                    source,
                    label,
                    target,
                });
            }
            if states.len() > MAXIMUM_CLOSED_LOOP {
                return Err(ProofError::TooLarge {
                    limit: MAXIMUM_CLOSED_LOOP,
                });
            }
            index += 1;
        }
        let marked = states.iter().map(|state| {
            let mut pairs = automata.iter().zip(state);
            pairs.all(|(automaton, &state)| automaton.is_marked(state))
        });
        let events = alphabet.events().iter().cloned();
        // The product of deterministic automata is one.
        if let Ok(automaton) = Automaton::new("closed loop", events, marked.collect(), transitions)
        {
            closed.automaton = automaton;
        }
        for (label, (supervisor, state)) in forbidden {
            let message = format!(
                "`{}` forbids {} where the plant can generate it, and no PLC can prevent that",
                automata[supervisor].name(),
                alphabet.name(label)
            );
            let finding = closed.finding(
                FindingKind::Controllability,
                FindingSeverity::Error,
                message,
                vec![state],
                vec![label],
            );
            closed.controllability.push(finding);
        }
        Ok(closed)
    }

    fn finding(
        &self,
        kind: FindingKind,
        severity: FindingSeverity,
        message: String,
        states: Vec<State>,
        events: Vec<Label>,
    ) -> Finding {
        let mut run = Vec::new();
        let mut at = states.first().copied();
        while let Some((parent, label)) = at.and_then(|state| self.parents[state.index()]) {
            run.push(label);
            at = Some(parent);
        }
        run.reverse();
        Finding {
            kind,
            severity,
            message,
            states,
            events,
            run,
        }
    }

    fn name(&self, label: Label) -> String {
        self.automaton.alphabet().name(label)
    }

    fn edges(&self, state: State, controllable: bool) -> impl Iterator<Item = (Label, State)> + '_ {
        let edges = self.automaton.edges(state).iter();
        edges
            .map(|edge| (self.automaton.label(*edge), edge.target))
            .filter(move |(label, _)| label.is_controllable() == controllable)
    }

    /// The states from which `goals` can be reached along the transitions that `is_allowed` admits.
    fn reaching(
        &self,
        goals: impl Iterator<Item = State>,
        is_allowed: impl Fn(State, Label) -> bool,
    ) -> Vec<bool> {
        let mut sources: Vec<Vec<State>> = vec![Vec::new(); self.automaton.state_count()];
        for transition in self.automaton.transitions() {
            if is_allowed(transition.source, transition.label) {
                sources[transition.target.index()].push(transition.source);
            }
        }
        let mut reaching = vec![false; self.automaton.state_count()];
        let mut pending: VecDeque<State> = goals.collect();
        for state in &pending {
            reaching[state.index()] = true;
        }
        while let Some(state) = pending.pop_front() {
            for &source in &sources[state.index()] {
                if !std::mem::replace(&mut reaching[source.index()], true) {
                    pending.push_back(source);
                }
            }
        }
        reaching
    }

    fn unreached(&self, reaching: &[bool]) -> Vec<State> {
        let states = self.automaton.states();
        states.filter(|state| !reaching[state.index()]).collect()
    }

    fn blocking(&self) -> Option<Finding> {
        let reaching = self.reaching(self.automaton.marked(), |_, _| true);
        let states = self.unreached(&reaching);
        let first = *states.first()?;
        let message = format!(
            "from {} of {} states no marked state can be reached; state {first} is one",
            states.len(),
            self.automaton.state_count()
        );
        Some(self.finding(
            FindingKind::Blocking,
            FindingSeverity::Error,
            message,
            states,
            Vec::new(),
        ))
    }

    /// Confluence: of two commands that are enabled together the order makes no difference.
    fn choices(&self) -> Vec<Finding> {
        let mut pairs: BTreeMap<(Label, Label), Vec<State>> = BTreeMap::new();
        for state in self.automaton.states() {
            let enabled: Vec<_> = self.edges(state, true).collect();
            for (index, &(first, after_first)) in enabled.iter().enumerate() {
                for &(second, after_second) in &enabled[index + 1..] {
                    let one = self.automaton.step(after_first, second);
                    let other = self.automaton.step(after_second, first);
                    if one.is_none() || one != other {
                        pairs.entry((first, second)).or_default().push(state);
                    }
                }
            }
        }
        let findings = pairs.into_iter().map(|((first, second), states)| {
            let message = format!(
                "in {} states, {} the first, {} and {} are both enabled, and which of them comes first makes a difference; in automatic mode it is the one whose rung comes first",
                states.len(),
                states[0],
                self.name(first),
                self.name(second)
            );
            self.finding(
                FindingKind::Choice,
                FindingSeverity::Warning,
                message,
                states,
                vec![first, second],
            )
        });
        findings.collect()
    }

    /// The longest run of commands alone, and of events alone; `None` where there is no longest.
    fn longest(&self, controllable: bool) -> Result<usize, Vec<State>> {
        let count = self.automaton.state_count();
        let mut arriving = vec![0_usize; count];
        for state in self.automaton.states() {
            for (_, target) in self.edges(state, controllable) {
                arriving[target.index()] += 1;
            }
        }
        let mut pending: Vec<State> = self
            .automaton
            .states()
            .filter(|state| arriving[state.index()] == 0)
            .collect();
        let mut length = vec![0_usize; count];
        let mut ordered = 0;
        while let Some(state) = pending.pop() {
            ordered += 1;
            let longer = length[state.index()] + 1;
            for (_, target) in self.edges(state, controllable) {
                let longest = &mut length[target.index()];
                *longest = (*longest).max(longer);
                arriving[target.index()] -= 1;
                if arriving[target.index()] == 0 {
                    pending.push(target);
                }
            }
        }
        if ordered == count {
            return Ok(length.into_iter().max().unwrap_or(0));
        }
        let states = self.automaton.states();
        Err(states.filter(|state| arriving[state.index()] > 0).collect())
    }

    fn response(&self) -> Option<Finding> {
        let states = self.longest(true).err()?;
        let first = *states.first()?;
        let events: Vec<Label> = self.edges(first, true).map(|(label, _)| label).collect();
        let message = format!(
            "commands can follow each other without end, as from state {first}; in automatic mode the PLC generates them for ever"
        );
        Some(self.finding(
            FindingKind::Response,
            FindingSeverity::Warning,
            message,
            states,
            events,
        ))
    }

    /// A controlled run generates commands wherever it can; it has come to rest where it cannot.
    fn blocking_under_control(&self) -> Option<Finding> {
        let rests = |state: State| self.edges(state, true).next().is_none();
        let goals = self.automaton.marked().filter(|&state| rests(state));
        let reaching = self.reaching(goals, |source, label| {
            label.is_controllable() || rests(source)
        });
        let states = self.unreached(&reaching);
        let first = *states.first()?;
        let message = format!(
            "a PLC that generates every command at once never rests in a marked state after {} of {} states, {first} the first",
            states.len(),
            self.automaton.state_count()
        );
        Some(self.finding(
            FindingKind::BlockingUnderControl,
            FindingSeverity::Warning,
            message,
            states,
            Vec::new(),
        ))
    }

    fn simultaneity(&self) -> Vec<Finding> {
        let mut pairs: BTreeMap<(Label, Label, &str), Vec<State>> = BTreeMap::new();
        for state in self.automaton.states() {
            let enabled: Vec<_> = self.edges(state, false).collect();
            for (index, &(first, after_first)) in enabled.iter().enumerate() {
                for &(second, after_second) in &enabled[index + 1..] {
                    let one = self.automaton.step(after_first, second);
                    let other = self.automaton.step(after_second, first);
                    let reason = match (one, other) {
                        (Some(one), Some(other)) if one == other => continue,
                        (Some(_), Some(_)) => {
                            "lead to different states by their order, which one scan cannot see"
                        }
                        (None, None) => {
                            "forbid each other; where both come in one scan, one of them is lost"
                        }
                        _ => "can occur together in one order only; that one is taken",
                    };
                    pairs
                        .entry((first, second, reason))
                        .or_default()
                        .push(state);
                }
            }
        }
        let findings = pairs.into_iter().map(|((first, second, reason), states)| {
            let message = format!(
                "in {} states, {} the first, {} and {} {reason}",
                states.len(),
                states[0],
                self.name(first),
                self.name(second)
            );
            self.finding(
                FindingKind::Simultaneity,
                FindingSeverity::Warning,
                message,
                states,
                vec![first, second],
            )
        });
        findings.collect()
    }
}

fn avalanche(modules: &Modules) -> Vec<Finding> {
    let findings = modules.all().filter_map(|automaton| {
        let events = avalanche_events(automaton);
        if events.is_empty() {
            return None;
        }
        let names: Vec<String> =
            events.iter().map(|&label| automaton.alphabet().name(label)).collect();
        Some(Finding {
            kind: FindingKind::Avalanche,
            severity: FindingSeverity::Warning,
            message: format!(
                "in `{}` {} stand on successive transitions; their bits are reset by the rungs that use them",
                automaton.name(),
                names.join(", ")
            ),
            states: Vec::new(),
            events,
            run: Vec::new(),
        })
    });
    findings.collect()
}

/// The longest run of uncontrollable events and the longest run of commands in the closed loop; `None` where there is no
/// longest, so that a response is not bounded.
///
/// # Errors
/// More than 2,000,000 states together.
pub fn bounded_response(modules: &Modules) -> Result<(Option<usize>, Option<usize>), ProofError> {
    let closed = ClosedLoop::of(modules)?;
    Ok((closed.longest(false).ok(), closed.longest(true).ok()))
}
