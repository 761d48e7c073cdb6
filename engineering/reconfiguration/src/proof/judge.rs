//! Conditions after every scan.

use super::{Prover, World};
use crate::controller::{Controller, Move};
use crate::signals::{Bits, Event};

impl Prover<'_> {
    /// Whether world and ladder are still in the model; what is broken.
    pub(super) fn judge(
        &self,
        world: &mut World,
        latched: &[usize],
        at: &[u32],
        lost: bool,
    ) -> Result<bool, String> {
        let claim = self.claim;
        let number = |state: u32| Controller::number(state as usize);
        if latched.len() + usize::from(lost) > 1 {
            return Err("two states of the mega-controller are latched at once".into());
        }
        if lost {
            return self.keeps_back(&[world.state], 0, &world.outputs).map(|()| false);
        }
        let (members, failed) = match latched {
            [] if at.is_empty() && world.failed == 0 => return Ok(false),
            [] => (at.to_vec(), world.failed),
            [one, ..] => (self.latches[*one].1.clone(), self.latches[*one].2),
        };
        if failed != world.failed {
            return Err(format!(
                "the mega-controller takes {failed:b} for failed, and {:b} are",
                world.failed
            ));
        }
        if !members.contains(&world.state) {
            let own = self.own_moves(world.state);
            match own.iter().find(|state| members.contains(state)) {
                Some(&state) if world.is_single || members.len() == 1 => world.state = state,
                _ if world.alone.is_some() => return Ok(false),
                _ => {
                    let sets: Vec<String> =
                        members.iter().map(|&state| number(state).to_string()).collect();
                    return Err(format!(
                        "the plant is in state {}, and the mega-controller thinks of {}",
                        number(world.state),
                        sets.join(" ")
                    ));
                }
            }
        }
        world.is_single = members.len() == 1;
        let is_adjusted = members.len() > 1 || self.must_prevent(&members, failed);
        let state = &claim.controller.states()[world.state as usize];
        if !is_adjusted && world.outputs != state.outputs {
            return Err(format!(
                "in state {} the outputs are {} in place of {}",
                number(world.state),
                world.outputs,
                state.outputs
            ));
        }
        if is_adjusted {
            self.keeps_back(&members, failed, &world.outputs)?;
        }
        Ok(true)
    }

    /// Where ω alone leads.
    fn own_moves(&self, state: u32) -> Vec<u32> {
        let mut found = vec![state];
        let mut next = 0;
        while next < found.len() {
            for step in self.claim.controller.moves(found[next] as usize) {
                let target = step.target as u32;
                if step.events.is_empty() && !found.contains(&target) {
                    found.push(target);
                }
            }
            next += 1;
        }
        found
    }

    /// Whether an unseen move leaves `members`.
    fn must_prevent(&self, members: &[u32], failed: u64) -> bool {
        members.iter().any(|&state| {
            self.unseen(state, failed).any(|step| !members.contains(&(step.target as u32)))
        })
    }

    fn unseen(&self, state: u32, failed: u64) -> impl Iterator<Item = &Move> {
        let claim = self.claim;
        let is_unseen = move |event: &Event| {
            event.channel().is_some_and(|input| {
                let bit = claim.channels.iter().position(|&known| known == input);
                bit.is_some_and(|bit| failed >> bit & 1 == 1)
            })
        };
        let moves = claim.controller.moves(state as usize).iter();
        moves.filter(move |step| !step.events.is_empty() && step.events.iter().all(is_unseen))
    }

    /// 4.
    fn keeps_back(&self, members: &[u32], failed: u64, outputs: &Bits) -> Result<(), String> {
        let claim = self.claim;
        let (controller, relation) = (claim.controller, claim.relation);
        let is_possible = |state: u32, event: Event| {
            controller.moves(state as usize).iter().any(|step| step.events.contains(&event))
        };
        let own = |state: u32| &controller.states()[state as usize].outputs;
        let forbids = |state: u32, event: Event| {
            !is_possible(state, event) && !relation.allows(state as usize, event, own(state))
        };
        for &state in members {
            for event in controller.signals.events() {
                let concerns = is_possible(state, event) || forbids(state, event);
                let is_let = relation.allows(state as usize, event, outputs);
                let by = members.iter().find(|&&other| forbids(other, event));
                let rows = !relation.rows(state as usize, event).is_empty();
                if rows
                    && concerns
                    && is_let
                    && let Some(&by) = by
                {
                    return Err(format!(
                        "the outputs {outputs} let {} happen in state {}, and state {} forbids it",
                        controller.signals.event_name(event),
                        Controller::number(state as usize),
                        Controller::number(by as usize),
                    ));
                }
            }
            for step in self.unseen(state, failed) {
                let is_let = |&event: &Event| relation.allows(state as usize, event, outputs);
                if !members.contains(&(step.target as u32)) && step.events.iter().all(is_let) {
                    return Err(format!(
                        "the outputs {outputs} let {} happen unseen in state {}",
                        controller.signals.event_names(&step.events),
                        Controller::number(state as usize),
                    ));
                }
            }
        }
        Ok(())
    }
}
