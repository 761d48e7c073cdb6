//! What one scan may do, said from the net and the supervisors alone.

use std::collections::BTreeSet;

use understudy_ladder::Name;

use super::verdict::HybridDeviation;
use crate::ladder::When;
use crate::petri::{Action, Condition, HybridLadder, Marking, Net, NetTransition};
use crate::{Automaton, State};

/// Net and supervisors between two scans, with what of the last scan still matters.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Joint {
    pub(super) marking: Marking,
    pub(super) states: Box<[State]>,
    /// Transitions that have fired in the last scan.
    pub(super) fired: Box<[bool]>,
    /// For each place that is a counter, how many scans it has stood still, up to 2.
    pub(super) still: Box<[u8]>,
}

/// What is to be seen of a ladder after a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Seen {
    pub(super) fires: Vec<bool>,
    /// For each place the tokens that its bits say; nothing where they say nothing.
    pub(super) tokens: Vec<Option<u32>>,
    pub(super) states: Vec<Vec<bool>>,
    /// For each transition with a delay whether its timer runs.
    pub(super) powers: Vec<Option<bool>>,
    pub(super) actions: Vec<bool>,
}

/// The signals of actions, each with the actions that drive it, by place.
pub(super) fn actions(net: &Net) -> Vec<(Name, Vec<(usize, bool)>)> {
    let mut actions: Vec<(Name, Vec<(usize, bool)>)> = Vec::new();
    for (place, content) in net.places().iter().enumerate() {
        for action in &content.actions {
            let (signal, is_level) = match action {
                Action::Level(signal) => (signal, true),
                Action::Impulse(signal) => (signal, false),
            };
            match actions.iter_mut().find(|(known, _)| known == signal) {
                Some((_, drivers)) => drivers.push((place, is_level)),
                None => actions.push((signal.clone(), vec![(place, is_level)])),
            }
        }
    }
    actions
}

/// The net and its supervisors.
pub(super) struct Reference<'a> {
    pub(super) net: &'a Net,
    pub(super) supervisors: &'a [Automaton],
    inputs: &'a [String],
    pub(super) is_counter: Vec<bool>,
    /// The input that ends each transition's delay.
    over: Vec<Option<usize>>,
    pub(super) actions: Vec<(Name, Vec<(usize, bool)>)>,
}

/// What has happened in a scan so far.
pub(super) struct Now<'s> {
    pub(super) marking: Marking,
    pub(super) states: Box<[State]>,
    /// Of each place the tokens that were there before the scan.
    pub(super) old: Marking,
    pub(super) fired: Vec<usize>,
    pub(super) last: &'s [bool],
    pub(super) image: &'s [bool],
}

impl<'a> Reference<'a> {
    /// `inputs` are those of the freed ladder.
    pub(super) fn new(
        net: &'a Net,
        supervisors: &'a [Automaton],
        ladder: &HybridLadder,
        inputs: &'a [String],
    ) -> Self {
        let over = ladder.timers.iter().map(|timer| {
            let name = format!("{}.over", timer.as_ref()?);
            inputs.iter().position(|input| *input == name)
        });
        Self {
            net,
            supervisors,
            inputs,
            is_counter: ladder.counters.iter().map(Option::is_some).collect(),
            over: over.collect(),
            actions: actions(net),
        }
    }

    pub(super) fn initial(&self) -> Joint {
        Joint {
            marking: self.net.initial(),
            states: self.supervisors.iter().map(|_| State::INITIAL).collect(),
            fired: self.net.transitions().iter().map(|_| false).collect(),
            still: self.net.places().iter().map(|_| 0).collect(),
        }
    }

    /// The inputs while nothing changes: no delay ends.
    pub(super) fn rest(&self, kept: &[bool]) -> Vec<bool> {
        self.kept(kept)
    }

    /// Part of an image kept for the next scan.
    pub(super) fn kept(&self, image: &[bool]) -> Vec<bool> {
        let mut kept = image.to_vec();
        for &over in self.over.iter().flatten() {
            kept[over] = false;
        }
        kept
    }

    pub(super) fn names(&self, chosen: impl IntoIterator<Item = bool>) -> Vec<String> {
        let transitions = self.net.transitions().iter().zip(chosen);
        let chosen = transitions.filter(|(_, chosen)| *chosen);
        chosen.map(|(transition, _)| transition.name.clone()).collect()
    }

    /// Tokens and states as the bits say them.
    pub(super) fn state_names(&self, seen: &Seen) -> Vec<String> {
        let mut names = Vec::new();
        for (place, tokens) in self.net.places().iter().zip(&seen.tokens) {
            match tokens {
                Some(0) => {}
                Some(1) => names.push(place.name.clone()),
                Some(tokens) => names.push(format!("{}={tokens}", place.name)),
                None => names.push(format!("{}=?", place.name)),
            }
        }
        for (supervisor, bits) in self.supervisors.iter().zip(&seen.states) {
            let on = supervisor.states().zip(bits).filter(|(_, on)| **on);
            names.extend(on.map(|(state, _)| {
                format!("{}:{}", supervisor.name(), supervisor.state_name(state))
            }));
        }
        names
    }

    /// Follows what `seen` says has fired, and where it leads.
    pub(super) fn scan(
        &self,
        joint: &Joint,
        last: &[bool],
        image: &[bool],
        seen: &Seen,
    ) -> Result<Joint, HybridDeviation> {
        let mut now = Now {
            marking: joint.marking.clone(),
            states: joint.states.clone(),
            old: joint.marking.clone(),
            fired: Vec::new(),
            last,
            image,
        };
        for (number, transition) in self.net.transitions().iter().enumerate() {
            self.check_delay(joint, &now, number, seen)?;
            if seen.fires[number] {
                self.fire(&mut now, number, seen)?;
            } else if self.must_fire(joint, &now, number, seen) {
                return Err(HybridDeviation::Omitted { transition: transition.name.clone() });
            }
        }
        self.compare(&now, seen)?;
        let moved = |place: usize| {
            let mut fired = now.fired.iter().map(|&number| &self.net.transitions()[number]);
            fired.any(|transition| transition.taken(place) != transition.given(place))
        };
        let still = joint.still.iter().enumerate().map(|(place, &still)| {
            let counts = self.is_counter[place];
            if counts && moved(place) { 0 } else { (still + 1).min(2) }
        });
        Ok(Joint {
            still: still.collect(),
            fired: seen.fires.as_slice().into(),
            marking: now.marking,
            states: now.states,
        })
    }

    /// Whether the condition holds now, and for a transition with a delay whether it is over.
    pub(super) fn condition(&self, now: &Now<'_>, number: usize, seen: &Seen) -> bool {
        let transition = &self.net.transitions()[number];
        match self.over[number] {
            Some(over) => seen.powers[number] == Some(true) && now.image[over],
            None => self.holds(&transition.condition, now),
        }
    }

    pub(super) fn holds(&self, condition: &Condition, now: &Now<'_>) -> bool {
        match condition {
            Condition::Always => true,
            Condition::Signal(name, when) => {
                let place = self.inputs.iter().position(|input| *input == **name);
                let value = |image: &[bool]| place.is_some_and(|place| image[place]);
                let (before, after) = (value(now.last), value(now.image));
                match when {
                    When::High | When::Pulse => after,
                    When::Low => !after,
                    When::Rising => after && !before,
                    When::Falling => before && !after,
                }
            }
            Condition::All(parts) => parts.iter().all(|part| self.holds(part, now)),
            Condition::Any(parts) => parts.iter().any(|part| self.holds(part, now)),
        }
    }

    /// The supervisor that disables a transition in the states that they have now.
    pub(super) fn disabling(
        &self,
        now: &Now<'_>,
        transition: &NetTransition,
    ) -> Option<&Automaton> {
        let label = transition.label?;
        let supervisors = self.supervisors.iter().zip(&now.states);
        let mut disabling = supervisors.filter(|(supervisor, state)| {
            supervisor.alphabet().contains(label) && supervisor.step(**state, label).is_none()
        });
        disabling.next().map(|(supervisor, _)| supervisor)
    }

    fn fire(&self, now: &mut Now<'_>, number: usize, seen: &Seen) -> Result<(), HybridDeviation> {
        let transition = &self.net.transitions()[number];
        let name = transition.name.clone();
        let Some(marking) = self.net.fire(&now.marking, transition) else {
            return Err(HybridDeviation::NotEnabled { transition: name });
        };
        if !self.condition(now, number, seen) {
            return Err(HybridDeviation::WithoutCondition { transition: name });
        }
        if let Some(supervisor) = self.disabling(now, transition) {
            let supervisor = supervisor.name().to_owned();
            let transition = name;
            return Err(match self.net.transitions()[number].label {
                Some(label) if label.is_controllable() => {
                    HybridDeviation::Disabled { transition, supervisor }
                }
                _ => HybridDeviation::Uncontrollable { transition, supervisor },
            });
        }
        for arc in &transition.takes {
            let old = &mut now.old[arc.place];
            let is_new = *old < arc.weight;
            // What it gives back has not left.
            *old = old.saturating_sub(arc.weight.saturating_sub(transition.given(arc.place)));
            if is_new && self.rests(now, arc.place, transition) {
                return Err(HybridDeviation::Passed {
                    transition: name,
                    place: self.net.places()[arc.place].name.clone(),
                });
            }
        }
        if let Some(label) = transition.label {
            for (supervisor, state) in self.supervisors.iter().zip(&mut now.states) {
                if supervisor.alphabet().contains(label) {
                    *state = supervisor.step(*state, label).unwrap_or(*state);
                }
            }
        }
        now.marking = marking;
        now.fired.push(number);
        Ok(())
    }

    /// Whether a token that came to `place` in this scan must not be taken by `taker` in it.
    fn rests(&self, now: &Now<'_>, place: usize, taker: &NetTransition) -> bool {
        let edges = edges(taker);
        let givers = now.fired.iter().map(|&giver| &self.net.transitions()[giver]);
        let mut givers = givers.filter(|giver| giver.given(place) > 0);
        !self.net.places()[place].actions.is_empty()
            || taker.delay.is_some()
            || givers.any(|giver| !self::edges(giver).is_disjoint(&edges))
    }
}

/// The edges that a transition waits for.
fn edges(transition: &NetTransition) -> BTreeSet<(String, bool)> {
    let mut edges = BTreeSet::new();
    transition.condition.visit(&mut |name, when| {
        if when.is_edge() {
            edges.insert((name.to_string(), when == When::Rising));
        }
    });
    edges
}
