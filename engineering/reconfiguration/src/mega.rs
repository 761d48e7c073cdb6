//! The mega-controller Θ: what may be true while channels fail and come back, sections 2 and 5.
//!
//! A state is a set of states of S in which the plant may be, with the channels that are failed. It is built on the fly from
//! x0 with all channels working. Steps 4 and 5 of section 2 are read with their conditions put right: a channel breaks while it
//! works, and is repaired while it is broken.
//!
//! [`Analysis::Section2`] is the paper's construction to the letter. The other two are what a scan can do besides: it keeps
//! unseen events from happening where outputs can ([`crate::settle`]), reads a repaired channel's value (*disaggregation*), and
//! sees all inputs of a scan at once. They differ in how much may have happened unseen before a failure is known.

mod entry;
mod trim;

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::FxHashMap;

use self::entry::{Entry, overlaps};
pub use self::trim::{Reached, Trimming};
use crate::command::Objective;
use crate::controller::{Controller, Move, reach};
use crate::relation::{Feedback, Relation, joint_feedback};
use crate::settle::{Command, Ground, NoCommand};
use crate::signals::{Bits, Event};

/// How the observation is analysed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Analysis {
    /// As section 2 has it: every string of unseen events may happen.
    Section2,
    /// A failure is known before the channel misses an event.
    Prompt,
    /// A channel may have missed one event before its failure is known.
    #[default]
    Late,
}

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The inputs that may fail, at most 64.
    pub channels: Vec<usize>,
    /// How many of them at once.
    pub simultaneous: usize,
    /// How.
    pub analysis: Analysis,
    /// Which of several safe commands.
    pub objective: Objective,
    /// Maximum number of states.
    pub maximum_states: usize,
}

/// y.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MegaState {
    /// X̄, ascending.
    pub members: Vec<u32>,
    /// Bit k: channel k of the question is failed.
    pub failed: u64,
    /// What module 2 commands; none where the ladder's own outputs are right.
    pub command: Option<Command>,
}

impl MegaState {
    /// Unseen events that would lead out of its members, each with its member: its command prevents them.
    pub(crate) fn blocked(
        &self,
        ground: &Ground<'_>,
        question: &Question,
    ) -> BTreeSet<(u32, Event)> {
        let unseen = |step: &Move| {
            let mut events = step.events.iter();
            !step.events.is_empty() && events.all(|&event| is_unseen(question, self.failed, event))
        };
        ground.blocked(&self.members.iter().copied().collect(), &unseen)
    }
}

/// What leads from one state of Θ to another.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Label {
    /// Changes that the working channels show in one scan; none is ω.
    Seen(Vec<Event>),
    /// b: this channel of the question fails.
    Break(usize),
    /// r: it is repaired, and shows this value where the analysis reads it.
    Repair(usize, Option<bool>),
}

/// Θ with its commands.
#[derive(Debug, Clone)]
pub struct MegaController {
    /// Y; state 0 is y0.
    pub states: Vec<MegaState>,
    /// g, for each state.
    pub edges: Vec<Vec<(Label, usize)>>,
    /// The states from which nothing leads back to a marked state with all channels working, step 7.
    pub dangling: Vec<bool>,
    /// How many different integer programs were solved.
    pub programs: usize,
    places: FxHashMap<(Vec<u32>, u64), usize>,
    seeds: FxHashMap<(Vec<u32>, u64), Option<usize>>,
    entries: BTreeMap<Entry, usize>,
}

/// Why Θ could not be built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unbuilt {
    /// More states than the limit.
    TooLarge(usize),
    /// States without a safe command, all that were found.
    NoCommand(Vec<NoCommand>),
}

/// States without a command that are told; the rest is only looked for.
const MAXIMUM_TOLD: usize = 20;

impl MegaController {
    /// Builds Θ.
    ///
    /// # Errors
    /// It grows past the limit, or there are states for which no command is safe.
    pub fn build(
        controller: &Controller,
        relation: &Relation,
        question: &Question,
    ) -> Result<Self, Unbuilt> {
        let ground = Ground::new(controller, relation, &question.objective);
        let mut builder = Builder {
            ground,
            question,
            states: Vec::new(),
            edges: Vec::new(),
            places: FxHashMap::default(),
            seeds: FxHashMap::default(),
            entries: BTreeMap::new(),
            without: Vec::new(),
        };
        builder.place(vec![0], 0);
        let overlaps = overlaps(controller, question);
        let mut next = 0;
        loop {
            while next < builder.states.len() && builder.without.len() < MAXIMUM_TOLD {
                builder.expand(next);
                if builder.states.len() > question.maximum_states {
                    return Err(Unbuilt::TooLarge(question.maximum_states));
                }
                next += 1;
            }
            let is_literal = question.analysis == Analysis::Section2;
            if is_literal || builder.without.len() >= MAXIMUM_TOLD || !builder.enter(&overlaps) {
                break;
            }
        }
        if !builder.without.is_empty() {
            return Err(Unbuilt::NoCommand(builder.without));
        }
        let mut mega = Self {
            dangling: Vec::new(),
            programs: builder.ground.program_count(),
            states: builder.states,
            edges: builder.edges,
            places: builder.places,
            seeds: builder.seeds,
            entries: builder.entries,
        };
        mega.dangling = mega.without_return(controller, relation, question);
        Ok(mega)
    }

    /// The states from which nothing that can happen leads back to a marked state with all channels working.
    fn without_return(
        &self,
        controller: &Controller,
        relation: &Relation,
        question: &Question,
    ) -> Vec<bool> {
        let marked = controller.marked();
        let mut backward = vec![Vec::new(); self.states.len()];
        for (source, edges) in self.edges.iter().enumerate() {
            for (label, target) in edges {
                let is_way = match label {
                    // Only a second failure of the same channel would decide this.
                    Label::Break(_) => question.analysis == Analysis::Section2,
                    _ => self.lets(controller, relation, question, source, label),
                };
                if is_way {
                    backward[*target].push(source);
                }
            }
        }
        let home = self.states.iter().enumerate().filter(|(_, state)| {
            state.failed == 0 && state.members.len() == 1 && marked[state.members[0] as usize]
        });
        let alive = reach(&backward, home.map(|(place, _)| place));
        alive.iter().map(|alive| !alive).collect()
    }

    /// Whether the outputs in force in a state let its plant do what `label` says. What they prevent is followed all the same,
    /// should it be seen.
    fn lets(
        &self,
        controller: &Controller,
        relation: &Relation,
        question: &Question,
        place: usize,
        label: &Label,
    ) -> bool {
        let state = &self.states[place];
        let (Label::Seen(events), Some(command)) = (label, &state.command) else {
            return true;
        };
        happenings(controller, question, state, events).any(|(member, step)| {
            let is_let = |&event: &Event| relation.allows(member, event, &command.outputs);
            step.events.iter().all(is_let)
        })
    }

    /// Outputs that are safe wherever the plant may be.
    ///
    /// # Errors
    /// There are none.
    pub fn outputs_for_any(
        controller: &Controller,
        relation: &Relation,
        question: &Question,
    ) -> Result<Bits, NoCommand> {
        let mut ground = Ground::new(controller, relation, &question.objective);
        let all: Vec<u32> = (0..controller.states().len() as u32).collect();
        let blocked = BTreeSet::new();
        let only_prevented = ground.prevented(&all, &blocked);
        ground.answer(&all, only_prevented)
    }

    /// The state of these members and failed channels.
    pub fn find(&self, members: &[u32], failed: u64) -> Option<usize> {
        self.places.get(&(members.to_vec(), failed)).copied()
    }

    /// The state that was come to from `seed`, before it was settled.
    pub fn settled(&self, seed: &[u32], failed: u64) -> Option<usize> {
        self.seeds.get(&(seed.to_vec(), failed)).copied().flatten()
    }

    /// Where `label` leads from `state`.
    pub fn follow(&self, state: usize, label: &Label) -> Option<usize> {
        let edges = self.edges[state].iter();
        edges.clone().find(|(known, _)| known == label).map(|(_, target)| *target)
    }

    /// Φ̃(y, e) for an event of Σ, step 2.
    pub fn feedback(
        &self,
        controller: &Controller,
        relation: &Relation,
        state: usize,
        event: Event,
    ) -> Feedback {
        let members = self.states[state].members.iter();
        joint_feedback(
            members.map(|&member| {
                crate::relation::feedback(controller, relation, member as usize, event)
            }),
        )
    }
}

/// The channels of `failed` as places among the inputs.
pub fn failed_channels(channels: &[usize], failed: u64) -> impl Iterator<Item = usize> + '_ {
    let places = channels.iter().enumerate();
    places.filter(move |(bit, _)| failed >> bit & 1 == 1).map(|(_, &input)| input)
}

/// Whether the channel of `event` is failed.
fn is_unseen(question: &Question, failed: u64, event: Event) -> bool {
    event.channel().is_some_and(|input| {
        let bit = question.channels.iter().position(|&known| known == input);
        bit.is_some_and(|bit| failed >> bit & 1 == 1)
    })
}

/// The moves of the members of a state that its working channels show as `events`, each with its member.
fn happenings<'a>(
    controller: &'a Controller,
    question: &'a Question,
    state: &'a MegaState,
    events: &'a [Event],
) -> impl Iterator<Item = (usize, &'a Move)> {
    let members = state.members.iter().map(|&member| member as usize);
    let moves =
        members.flat_map(|member| controller.moves(member).iter().map(move |step| (member, step)));
    moves.filter(move |(_, step)| {
        let seen = step.events.iter().filter(|&&event| !is_unseen(question, state.failed, event));
        match question.analysis {
            Analysis::Section2 => events.iter().all(|event| seen.clone().any(|it| it == event)),
            Analysis::Prompt | Analysis::Late => seen.eq(events),
        }
    })
}

struct Builder<'a> {
    ground: Ground<'a>,
    question: &'a Question,
    states: Vec<MegaState>,
    edges: Vec<Vec<(Label, usize)>>,
    places: FxHashMap<(Vec<u32>, u64), usize>,
    seeds: FxHashMap<(Vec<u32>, u64), Option<usize>>,
    entries: BTreeMap<Entry, usize>,
    without: Vec<NoCommand>,
}

impl Builder<'_> {
    fn is_unseen(&self, failed: u64, event: Event) -> bool {
        is_unseen(self.question, failed, event)
    }

    /// Settles `seed` and numbers the state; nothing where no command is safe.
    fn place(&mut self, mut seed: Vec<u32>, failed: u64) -> Option<usize> {
        seed.sort_unstable();
        seed.dedup();
        let key = (seed, failed);
        if let Some(&known) = self.seeds.get(&key) {
            return known;
        }
        let place = self.settle(key.0.clone(), failed);
        self.seeds.insert(key, place);
        place
    }

    fn settle(&mut self, seed: Vec<u32>, failed: u64) -> Option<usize> {
        let channels: Vec<usize> = failed_channels(&self.question.channels, failed).collect();
        let unseen = |event: &Event| event.channel().is_some_and(|input| channels.contains(&input));
        let settled = match self.question.analysis {
            Analysis::Section2 => {
                let any = |step: &Move| step.events.iter().any(unseen);
                let members = self.ground.closure(seed, |_, step| any(step));
                let members: Vec<u32> = members.into_iter().collect();
                if members.len() == 1 {
                    Ok((members, None))
                } else {
                    let command = self.ground.command(&members, &Default::default(), failed);
                    command.map(|command| (members, Some(command)))
                }
            }
            Analysis::Prompt | Analysis::Late => {
                let all = |step: &Move| !step.events.is_empty() && step.events.iter().all(unseen);
                self.ground.settle(seed, failed, &all)
            }
        };
        let (members, command) = match settled {
            Ok(settled) => settled,
            Err(none) => {
                if !self.without.contains(&none) {
                    self.without.push(none);
                }
                return None;
            }
        };
        let key = (members, failed);
        if let Some(&place) = self.places.get(&key) {
            return Some(place);
        }
        let place = self.states.len();
        self.states.push(MegaState { members: key.0.clone(), failed, command });
        self.edges.push(Vec::new());
        self.places.insert(key, place);
        Some(place)
    }

    fn expand(&mut self, place: usize) {
        let mut successors: Vec<(Label, Vec<u32>, u64)> = self.seen(place);
        let MegaState { members, failed, .. } = self.states[place].clone();
        for bit in 0..self.question.channels.len() {
            if failed >> bit & 1 == 1 {
                self.repair(&members, failed, bit, &mut successors);
            } else if (failed.count_ones() as usize) < self.question.simultaneous {
                let after = failed | 1 << bit;
                let seed = self.after_break(&members, after, bit);
                successors.push((Label::Break(bit), seed, after));
            }
        }
        for (label, seed, failed) in successors {
            if let Some(target) = self.place(seed, failed) {
                self.edges[place].push((label, target));
            }
        }
    }

    /// Step 3.
    fn seen(&self, place: usize) -> Vec<(Label, Vec<u32>, u64)> {
        let MegaState { members, failed, command } = &self.states[place];
        let mut successors: Vec<(Label, Vec<u32>, u64)> = Vec::new();
        let mut add = |label: Label, target: usize| {
            let target = target as u32;
            match successors.iter_mut().find(|(known, _, _)| *known == label) {
                Some((_, seed, _)) => seed.push(target),
                None => successors.push((label, vec![target], *failed)),
            }
        };
        for &member in members {
            for step in self.ground.controller.moves(member as usize) {
                let mut events = step.events.clone();
                events.retain(|&event| !self.is_unseen(*failed, event));
                if events.is_empty() {
                    // In a combined state the program does not go on by itself: its outputs are not in force.
                    let goes_on = self.question.analysis == Analysis::Section2 || command.is_none();
                    if step.events.is_empty() && goes_on {
                        add(Label::Seen(events), step.target);
                    }
                } else if self.question.analysis == Analysis::Section2 {
                    for event in events {
                        add(Label::Seen(vec![event]), step.target);
                    }
                } else {
                    add(Label::Seen(events), step.target);
                }
            }
        }
        successors.sort();
        successors
    }

    /// Step 4: what may be true once the channel is known to be failed.
    fn after_break(&self, members: &[u32], failed: u64, bit: usize) -> Vec<u32> {
        let mut seed = members.to_vec();
        if self.question.analysis == Analysis::Late {
            let channel = self.question.channels[bit];
            // The event may have been missed in the scan in which the ladder made a move of its own.
            let controller = self.ground.controller;
            let before = controller.before_omega(members.iter().map(|&member| member as usize));
            for member in before {
                for step in controller.moves(member) {
                    let missed = |event: &Event| event.channel() == Some(channel);
                    let unseen = |event: &Event| self.is_unseen(failed, *event);
                    if step.events.iter().any(missed) && step.events.iter().all(unseen) {
                        seed.push(step.target as u32);
                    }
                }
            }
        }
        seed
    }

    /// Step 5.
    fn repair(
        &self,
        members: &[u32],
        failed: u64,
        bit: usize,
        successors: &mut Vec<(Label, Vec<u32>, u64)>,
    ) {
        let after = failed & !(1 << bit);
        if self.question.analysis == Analysis::Section2 {
            successors.push((Label::Repair(bit, None), members.to_vec(), after));
            return;
        }
        let channel = self.question.channels[bit];
        for value in [false, true] {
            let shows = |&&member: &&u32| {
                self.ground.controller.states()[member as usize].inputs.0[channel] == value
            };
            let seed: Vec<u32> = members.iter().filter(shows).copied().collect();
            if !seed.is_empty() {
                successors.push((Label::Repair(bit, Some(value)), seed, after));
            }
        }
    }
}
