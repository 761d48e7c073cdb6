//! Conditions on the closed loop, each with what breaks it.

use std::collections::BTreeMap;

use super::closed_loop::{ClosedLoop, in_states};
use super::{Finding, FindingKind, FindingSeverity};
use crate::{Label, State};

impl ClosedLoop {
    pub(super) fn blocking(&self) -> Option<Finding> {
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
    pub(super) fn choices(&self) -> Vec<Finding> {
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
                "{} {} and {} are both enabled, and which of them comes first makes a difference; in automatic mode it is the one whose rung comes first",
                in_states(&states),
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

    /// States in which a command is enabled after any number of commands, or that such states lead to by commands: what is left when
    /// states without a command that leads to them are removed one after the other.
    fn endless_commands(&self) -> Vec<State> {
        let mut arriving = vec![0_usize; self.automaton.state_count()];
        let targets = |state| self.edges(state, true).map(|(_, target)| target.index());
        for target in self.automaton.states().flat_map(targets) {
            arriving[target] += 1;
        }
        let states = self.automaton.states();
        let mut pending: Vec<State> = states.filter(|state| arriving[state.index()] == 0).collect();
        while let Some(state) = pending.pop() {
            for (_, target) in self.edges(state, true) {
                arriving[target.index()] -= 1;
                if arriving[target.index()] == 0 {
                    pending.push(target);
                }
            }
        }
        let states = self.automaton.states();
        states.filter(|state| arriving[state.index()] > 0).collect()
    }

    pub(super) fn response(&self) -> Option<Finding> {
        let states = self.endless_commands();
        let first = *states.first()?;
        let events: Vec<Label> = self.edges(first, true).map(|(label, _)| label).collect();
        let message = format!(
            "commands can follow each other without end, as from state {first}; in automatic mode the PLC generates them for ever"
        );
        Some(self.finding(FindingKind::Response, FindingSeverity::Warning, message, states, events))
    }

    /// A controlled run generates commands wherever it can; it has come to rest where it cannot.
    pub(super) fn blocking_under_control(&self) -> Option<Finding> {
        let rests = |state: State| self.edges(state, true).next().is_none();
        let goals = self.automaton.marked().filter(|&state| rests(state));
        let reaching =
            self.reaching(goals, |source, label| label.is_controllable() || rests(source));
        let states = self.unreached(&reaching);
        let first = *states.first()?;
        let message = format!(
            "a PLC that generates every command at once never comes to rest in a marked state from {} of {} states on, such as {first}",
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

    /// Pairs of events of which the order makes a difference; `queue` is the order in which events have their turn, if they wait.
    pub(super) fn simultaneity(&self, queue: &[Label]) -> Vec<Finding> {
        let mut pairs: BTreeMap<(Label, Label, String), Vec<State>> = BTreeMap::new();
        for state in self.automaton.states() {
            let enabled: Vec<_> = self.edges(state, false).collect();
            for (index, &(first, after_first)) in enabled.iter().enumerate() {
                for &(second, after_second) in &enabled[index + 1..] {
                    let one = self.automaton.step(after_first, second);
                    let other = self.automaton.step(after_second, first);
                    let place = |label| queue.iter().position(|&queued| queued == label);
                    let turns = place(first).zip(place(second));
                    let is_second_next = turns.is_some_and(|(one, other)| other < one);
                    let (next, later) =
                        if is_second_next { (second, first) } else { (first, second) };
                    let (next, later) = (self.name(next), self.name(later));
                    let has_both = if is_second_next { other.is_some() } else { one.is_some() };
                    let reason = match (one, other, turns) {
                        (Some(one), Some(other), _) if one == other => continue,
                        (Some(_), Some(_), None) => {
                            "lead to different states by their order, which one scan cannot see"
                                .to_owned()
                        }
                        (None, None, None) => {
                            "forbid each other; where both come in one scan, one of them is lost"
                                .to_owned()
                        }
                        (_, _, None) => {
                            "can occur together in one order only; that one is taken".to_owned()
                        }
                        (Some(_), Some(_), Some(_)) => format!(
                            "lead to different states by their order, which one scan cannot see; {next} has its turn first"
                        ),
                        (_, _, Some(_)) if has_both => {
                            format!(
                                "can occur together in one order only; {next} has its turn first"
                            )
                        }
                        (_, _, Some(_)) => format!(
                            "cannot both occur after {next}, which has its turn first; {later} is then ignored"
                        ),
                    };
                    pairs.entry((first, second, reason)).or_default().push(state);
                }
            }
        }
        let findings = pairs.into_iter().map(|((first, second, reason), states)| {
            let message = format!(
                "{} {} and {} {reason}",
                in_states(&states),
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
