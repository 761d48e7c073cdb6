//! Spares that several groups share.
//!
//! A plant has G groups of N controllers and one understudy each, and P spares. A group with a failed station takes a free
//! spare; that wakes within a mean time, as one more understudy, and is free again when the group is complete. The plant
//! fails with the first group that fails: every understudy that is awake has failed, and a controller too.
//!
//! Groups are alike, so a state is how many of them are in each condition:
//!
//! | condition | controllers | understudy | next failure that fails the group |
//! |---|---|---|---|
//! | `One` | one failed | works | the understudy |
//! | `More` | two failed | works | the understudy |
//! | `Understudy` | all work | failed | a controller |
//! | `Both` | one failed | failed | the spare, which is awake |
//!
//! A third controller that fails is not counted, which is too good by the order of (N MTTR / MTBF)². A spare that does not
//! wake is found failed then, and repaired. Groups in need beyond [`bound`] are a failure of the plant.

use std::collections::HashMap;

use serde::Serialize;

use crate::chain::{Chain, ChainBuilder};
use crate::error::ReliabilityError;
use crate::quantity::{Hours, Probability};

/// Spares of a plant, at most.
pub const MAXIMUM_SHARED_SPARES: u32 = 4;

/// Groups of a plant, at most.
pub const MAXIMUM_SHARED_GROUPS: u32 = 1000;

/// A plant whose groups share spares.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedSpares {
    /// Groups that the spares serve, G.
    pub groups: u32,
    /// Groups that are too large for the capacity of the spares.
    pub too_large: u32,
    /// Controllers of each group, N.
    pub controllers: u32,
    /// Spares, P.
    pub spares: u32,
    /// Mean time between failures of each station and spare.
    pub mtbf: Hours,
    /// Mean time to repair.
    pub mttr: Hours,
    /// Mean time from the failure to the first turn of the spare.
    pub wake: Hours,
    /// Probability that a spare wakes.
    pub coverage: Probability,
}

/// Condition of a group with a failed station.
const ONE: usize = 0;
const MORE: usize = 1;
const UNDERSTUDY: usize = 2;
const BOTH: usize = 3;

/// Groups in need, by their condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
struct Plant {
    /// Without a spare.
    alone: [u16; 3],
    /// Whose spare wakes.
    waking: [u16; 3],
    /// Whose spare is awake.
    awake: [u16; 4],
    /// Failed spares.
    failed: u16,
}

impl Plant {
    fn in_need(&self) -> u32 {
        let all = self.alone.iter().chain(&self.waking).chain(&self.awake);
        all.map(|count| u32::from(*count)).sum()
    }

    fn taken(&self) -> u32 {
        let all = self.waking.iter().chain(&self.awake).chain([&self.failed]);
        all.map(|count| u32::from(*count)).sum()
    }
}

/// A step out of a state: its rate, and the state after it; none where the plant fails.
type Step = (f64, Option<Plant>);

/// The groups of a state whose spare is in one condition.
type Part = fn(&mut Plant) -> &mut [u16];

impl SharedSpares {
    /// Mean time to the first failure of a group, in hours.
    ///
    /// # Errors
    /// Numbers out of their bounds, and a precision that is not reached.
    pub fn mttf(&self) -> Result<f64, Vec<ReliabilityError>> {
        if self.spares == 0 && self.too_large > 0 {
            // Without spares all groups are alike.
            let groups = self.groups + self.too_large;
            return Self { groups, too_large: 0, ..self.clone() }.mttf();
        }
        let served = self.chain()?.mttf().map_err(|error| vec![error])?;
        if self.too_large == 0 {
            return Ok(served);
        }
        // Both parts fail rarely, so the times to failure are exponential.
        let without = Self { groups: self.too_large, too_large: 0, spares: 0, ..self.clone() };
        Ok(1.0 / (1.0 / served + 1.0 / without.mttf()?))
    }

    /// The chain of the groups that the spares serve.
    ///
    /// # Errors
    /// Numbers out of their bounds.
    pub fn chain(&self) -> Result<Chain, Vec<ReliabilityError>> {
        self.check()?;
        let mut chain = ChainBuilder::new();
        let mut places = HashMap::from([(Plant::default(), chain.state("complete"))]);
        let failure = chain.failure("failed");
        let mut open = vec![Plant::default()];
        while let Some(plant) = open.pop() {
            let from = places[&plant];
            for (rate, after) in self.steps(&plant) {
                let Some(after) = after.filter(|it| it.in_need() <= self.bound()) else {
                    chain.transition(from, failure, rate);
                    continue;
                };
                for (share, after) in self.assigned(after) {
                    let to = *places.entry(after).or_insert_with(|| {
                        open.push(after);
                        chain.state("")
                    });
                    if to != from {
                        chain.transition(from, to, rate * share);
                    }
                }
            }
        }
        chain.build()
    }

    fn check(&self) -> Result<(), Vec<ReliabilityError>> {
        let counts = [
            ("the number of groups", self.groups, 1, MAXIMUM_SHARED_GROUPS),
            ("the number of groups beyond the capacity", self.too_large, 0, MAXIMUM_SHARED_GROUPS),
            ("the number of controllers", self.controllers, 1, 64),
            ("the number of shared spares", self.spares, 0, MAXIMUM_SHARED_SPARES),
        ];
        let wrong =
            counts.into_iter().filter(|(_, count, least, most)| !(least..=most).contains(&count));
        let errors: Vec<ReliabilityError> = wrong
            .map(|(what, count, minimum, maximum)| ReliabilityError::Count {
                what: what.into(),
                count: u64::from(count),
                minimum: u64::from(minimum),
                maximum: u64::from(maximum),
            })
            .collect();
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    /// Groups in need at once that are told apart: more are rarer than 1e-9.
    fn bound(&self) -> u32 {
        let stations = f64::from(self.groups) * f64::from(self.controllers + 1);
        let mean = stations * self.mttr.get() / self.mtbf.get();
        self.groups.min((mean + 6.0 * mean.sqrt() + 6.0) as u32)
    }

    /// Every failure, repair and wake-up of a state.
    fn steps(&self, plant: &Plant) -> Vec<Step> {
        let (fails, repaired) = (self.mtbf.rate(), self.mttr.rate());
        let all = f64::from(self.controllers);
        let mut steps: Vec<Step> = Vec::new();
        let mut step = |count: u32, rate: f64, change: &dyn Fn(&mut Plant) -> bool| {
            if count > 0 && rate > 0.0 {
                let mut after = *plant;
                let lives = change(&mut after);
                steps.push((f64::from(count) * rate, lives.then_some(after)));
            }
        };
        let complete = self.groups - plant.in_need();
        step(complete, all * fails, &|it| add(&mut it.alone[ONE]));
        step(complete, fails, &|it| add(&mut it.alone[UNDERSTUDY]));
        let idle = self.spares.saturating_sub(plant.taken());
        step(idle, fails, &|it| add(&mut it.failed));
        step(plant.failed.into(), repaired, &|it| remove(&mut it.failed));
        let parts: [(Part, &[u16]); 3] = [
            (|it| &mut it.alone, &plant.alone),
            (|it| &mut it.waking, &plant.waking),
            (|it| &mut it.awake, &plant.awake),
        ];
        for (part, (of, counts)) in parts.into_iter().enumerate() {
            let is_awake = part == 2;
            let both = |it: &mut Plant, from: usize| is_awake && turn(of(it), from, BOTH);
            let ends = |it: &mut Plant, from: usize| remove(&mut of(it)[from]);
            let [one, more, understudy] = [ONE, MORE, UNDERSTUDY].map(|it| u32::from(counts[it]));
            step(one, (all - 1.0) * fails, &|it| turn(of(it), ONE, MORE));
            step(one, fails, &|it| both(it, ONE));
            step(one, repaired, &|it| ends(it, ONE));
            step(more, fails, &|it| both(it, MORE));
            step(more, 2.0 * repaired, &|it| turn(of(it), MORE, ONE));
            step(understudy, all * fails, &|it| both(it, UNDERSTUDY));
            step(understudy, repaired, &|it| ends(it, UNDERSTUDY));
            if part == 0 {
                continue;
            }
            for condition in [ONE, MORE, UNDERSTUDY] {
                let lost = |it: &mut Plant| {
                    remove(&mut of(it)[condition])
                        && add(&mut it.alone[condition])
                        && add(&mut it.failed)
                };
                let count = u32::from(counts[condition]);
                step(count, fails, &lost);
                if !is_awake {
                    let (wakes, does) = (self.wake.rate(), self.coverage.get());
                    step(count, wakes * (1.0 - does), &lost);
                    step(count, wakes * does, &|it| {
                        remove(&mut it.waking[condition]) && add(&mut it.awake[condition])
                    });
                }
            }
        }
        let both = u32::from(plant.awake[BOTH]);
        step(both, fails, &|_| false);
        step(both, repaired, &|it| turn(&mut it.awake, BOTH, UNDERSTUDY));
        step(both, repaired, &|it| turn(&mut it.awake, BOTH, ONE));
        steps
    }

    /// Free spares go to groups in need, each of which is as likely as the others to be the first in the plant file.
    fn assigned(&self, plant: Plant) -> Vec<(f64, Plant)> {
        let waiting: u32 = plant.alone.iter().map(|count| u32::from(*count)).sum();
        if waiting == 0 || plant.taken() >= self.spares {
            return vec![(1.0, plant)];
        }
        let conditions = (0..3).filter(|it| plant.alone[*it] > 0);
        let given = conditions.flat_map(|condition| {
            let mut after = plant;
            remove(&mut after.alone[condition]);
            add(&mut after.waking[condition]);
            let share = f64::from(plant.alone[condition]) / f64::from(waiting);
            self.assigned(after).into_iter().map(move |(rest, state)| (share * rest, state))
        });
        given.collect()
    }
}

fn add(count: &mut u16) -> bool {
    *count += 1;
    true
}

fn remove(count: &mut u16) -> bool {
    *count -= 1;
    true
}

fn turn(counts: &mut [u16], from: usize, to: usize) -> bool {
    remove(&mut counts[from]) && add(&mut counts[to])
}

#[cfg(test)]
mod tests;
