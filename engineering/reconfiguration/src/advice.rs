//! What a person wants to know: for each channel that may fail, what goes on, what stops, and whether it comes back by itself.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::analysis::Outcome;
use crate::controller::Controller;
use crate::mega::Label;
use crate::signals::Event;

/// What a failure of one channel means in one state of S.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Effect {
    /// The states of S, by their numbers, in which it means this.
    pub states: Vec<usize>,
    /// Where the plant may be then, by the numbers of S.
    pub members: Vec<usize>,
    /// What is commanded; none where the ladder goes on as it is.
    pub outputs: Option<String>,
    /// Events that are prevented until the channel is repaired.
    pub stopped: Vec<String>,
    /// Events that may go on.
    pub going: Vec<String>,
    /// Whether the repair is sufficient to continue in every case; otherwise the operator may have to release.
    pub comes_back: bool,
}

/// One channel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ChannelAdvice {
    /// Its input.
    pub channel: String,
    /// Whether its failure ever stops anything.
    pub is_needed: bool,
    /// What its failure means, and where.
    pub effects: Vec<Effect>,
}

impl Outcome {
    /// For each channel of the question.
    pub fn advice(&self) -> Vec<ChannelAdvice> {
        (0..self.question.channels.len()).map(|bit| self.advice_on(bit)).collect()
    }

    fn advice_on(&self, bit: usize) -> ChannelAdvice {
        let mut effects: Vec<Effect> = Vec::new();
        for state in 0..self.controller.states().len() {
            let home = self.mega.find(&[state as u32], 0);
            let Some(after) = home.and_then(|home| self.mega.follow(home, &Label::Break(bit)))
            else {
                continue;
            };
            let effect = self.effect(state, after, bit);
            let same = effects.iter_mut().find(|known| {
                let is_same = known.outputs == effect.outputs
                    && known.stopped == effect.stopped
                    && known.comes_back == effect.comes_back;
                is_same && (effect.outputs.is_none() || known.members == effect.members)
            });
            match same {
                Some(known) => {
                    known.states.extend(effect.states);
                    let going: BTreeSet<String> =
                        known.going.drain(..).chain(effect.going).collect();
                    known.going = going.into_iter().collect();
                }
                None => effects.push(effect),
            }
        }
        ChannelAdvice {
            channel: self.controller.signals.inputs[self.question.channels[bit]].clone(),
            is_needed: effects.iter().any(|effect| effect.outputs.is_some()),
            effects,
        }
    }

    fn effect(&self, state: usize, after: usize, bit: usize) -> Effect {
        let signals = &self.controller.signals;
        let names = |events: &BTreeSet<Event>| {
            events.iter().map(|&event| signals.event_name(event)).collect()
        };
        let found = &self.mega.states[after];
        let repaired = [Some(false), Some(true)]
            .map(|value| self.mega.follow(after, &Label::Repair(bit, value)));
        let comes_back = repaired.into_iter().flatten().all(|place| !self.mega.dangling[place]);
        let own = self
            .controller
            .moves(state)
            .iter()
            .flat_map(|step| step.events.iter().copied())
            .collect();
        Effect {
            states: vec![Controller::number(state)],
            members: found
                .members
                .iter()
                .map(|&member| Controller::number(member as usize))
                .collect(),
            outputs: found.command.as_ref().map(|command| command.outputs.to_string()),
            stopped: found
                .command
                .as_ref()
                .map_or_else(Vec::new, |command| names(&command.stopped)),
            going: found
                .command
                .as_ref()
                .map_or_else(|| names(&own), |command| names(&command.going)),
            comes_back,
        }
    }

    /// The fewest channels that have to work for full control: a failure of all the others together stops nothing, as far as so
    /// many at once were asked about.
    pub fn minimum_channels(&self) -> Vec<String> {
        let commands = self.mega.states.iter().filter(|state| state.command.is_some());
        let mut harmful: Vec<u64> =
            commands.map(|state| state.failed).filter(|&failed| failed != 0).collect();
        harmful.sort_unstable_by_key(|failed| (failed.count_ones(), *failed));
        harmful.dedup();
        let mut needed = 0_u64;
        for failed in harmful {
            if failed & needed == 0 {
                // One of them must work; a single channel leaves no choice.
                needed |= 1 << failed.trailing_zeros();
            }
        }
        let channels = self.question.channels.iter().enumerate();
        channels
            .filter(|(bit, _)| needed >> bit & 1 == 1)
            .map(|(_, &input)| self.controller.signals.inputs[input].clone())
            .collect()
    }
}
