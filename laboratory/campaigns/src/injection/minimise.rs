//! Making a faultload that violates a property small: fewer faults, then fewer cycles, then simpler members and numbers.
//!
//! Delta debugging (A. Zeller and R. Hildebrandt, *Simplifying and Isolating Failure-Inducing Input*, IEEE Transactions on
//! Software Engineering 28 (2), 2002) over the injections, and then one simplification after another for as long as one of them
//! still violates. Invariant: what is kept has been run and has violated the property; it is never only believed to.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use understudy_cycle::Schedule;
use understudy_simulator::{Action, Disturbance, Fault};
use understudy_wire::Member;

use super::faultload::{Faultload, Injection};
use super::kind::Role;
use super::trial::{FIRST_CYCLE, Symptom};

/// Runs of one minimisation, at most; then what is smallest so far is kept.
const MAXIMUM_TRIALS: u32 = 1_000;

/// Cycles after the first symptom: a remote I/O that has just started and hears nobody counts its deadlines by itself, and the
/// account of a scenario numbers them some cycles later.
const MARGIN_CYCLES: u64 = 3;

/// A run that violates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Violating {
    pub(super) faultload: Faultload,
    pub(super) cycles: u64,
    pub(super) seed: u64,
    pub(super) symptom: Symptom,
}

/// Runs a faultload for so many cycles from a seed.
pub(super) type Try<'a> = dyn FnMut(&Faultload, u64, u64) -> Option<Symptom> + 'a;

/// The smallest violating run that is found from `found`. Cycles are cut to the first symptom, unless the property is judged at the end of the run:
/// then faults keep their ends, because one that lasts violates it by itself.
pub(super) fn minimise(
    found: Violating,
    schedule: &Schedule,
    judges_at_end: bool,
    attempt: &mut Try<'_>,
) -> Violating {
    let mut search = Search { best: found, judges_at_end, trials: 0, attempt };
    search.shorten();
    search.drop_network();
    search.drop_injections();
    while search.simplify(schedule) {}
    search.shorten();
    search.best
}

struct Search<'a, 'b> {
    best: Violating,
    judges_at_end: bool,
    trials: u32,
    attempt: &'a mut Try<'b>,
}

impl Search<'_, '_> {
    /// Takes `faultload` if it violates too. Where a network is disturbed, chance decides: then some more seeds are tried.
    fn takes(&mut self, faultload: Faultload) -> bool {
        let seeds = if faultload.network.is_some() { 4 } else { 1 };
        (0..seeds).any(|more| {
            let seed = self.best.seed + more;
            self.takes_with(faultload.clone(), self.best.cycles, seed)
        })
    }

    fn takes_with(&mut self, faultload: Faultload, cycles: u64, seed: u64) -> bool {
        if self.trials == MAXIMUM_TRIALS {
            return false;
        }
        self.trials += 1;
        let Some(symptom) = (self.attempt)(&faultload, cycles, seed) else {
            return false;
        };
        self.best = Violating { faultload, cycles, seed, symptom };
        true
    }

    /// Ends the run a little behind the first symptom, without what strikes later.
    fn shorten(&mut self) {
        if self.judges_at_end {
            return;
        }
        let cycles = self.best.symptom.cycle + 1 + MARGIN_CYCLES;
        let mut faultload = self.best.faultload.clone();
        faultload.injections.retain(|injection| injection.cycles().start < cycles);
        for injection in &mut faultload.injections {
            injection.steps.retain(|step| step.at_cycle < cycles);
        }
        let (seed, size) = (self.best.seed, self.best.faultload.size());
        if cycles != self.best.cycles || faultload.size() < size {
            self.takes_with(faultload, cycles, seed);
        }
    }

    fn drop_network(&mut self) {
        if self.best.faultload.network.is_some() {
            let faultload = Faultload { network: None, ..self.best.faultload.clone() };
            self.takes(faultload);
        }
    }

    /// ddmin: drops ever smaller parts of the list.
    fn drop_injections(&mut self) {
        let mut parts = 2;
        loop {
            let count = self.best.faultload.injections.len();
            if count == 0 {
                return;
            }
            let size = count.div_ceil(parts);
            let dropped = (0..count).step_by(size).any(|from| {
                let mut faultload = self.best.faultload.clone();
                faultload.injections.drain(from..(from + size).min(count));
                self.takes(faultload)
            });
            match dropped {
                true => parts = 2,
                false if size == 1 => return,
                false => parts = (2 * parts).min(count),
            }
        }
    }

    /// One pass over all simplifications; true where one was taken.
    fn simplify(&mut self, schedule: &Schedule) -> bool {
        let mut simplified = false;
        let mut place = 0;
        // The list of candidates is made anew after each that is taken, and gone on with from there.
        while let Some(candidate) =
            candidates(&self.best.faultload, schedule, self.judges_at_end).into_iter().nth(place)
        {
            if self.trials == MAXIMUM_TRIALS {
                return false;
            }
            if self.takes(candidate) {
                simplified = true;
                self.shorten();
            } else {
                place += 1;
            }
        }
        simplified
    }
}

/// Every faultload that is one step simpler; each comes before those that are simpler by less.
fn candidates(faultload: &Faultload, schedule: &Schedule, keeps_ends: bool) -> Vec<Faultload> {
    let mut list = Vec::new();
    for (place, injection) in faultload.injections.iter().enumerate() {
        let simpler = simpler_injections(injection).into_iter();
        let simpler = simpler.filter(|simpler| !keeps_ends || ends_as(simpler, injection));
        list.extend(simpler.map(|injection| {
            let mut faultload = faultload.clone();
            faultload.injections[place] = injection;
            faultload
        }));
    }
    if let Some(disturbance) = &faultload.network {
        list.extend(
            simpler_networks(disturbance)
                .into_iter()
                .map(|network| Faultload { network: Some(network), ..faultload.clone() }),
        );
    }
    list.extend(simpler_members(faultload, schedule));
    list.retain(|candidate| candidate != faultload && is_possible(candidate));
    list
}

/// Whether the last action on each member and link is the same in both.
fn ends_as(simpler: &Injection, whole: &Injection) -> bool {
    let ends = |injection: &Injection| -> BTreeMap<(Member, Option<Member>), _> {
        let lasts = |action| match action {
            Action::Slow { by } | Action::Delay { by, .. } => !by.is_zero(),
            _ => false,
        };
        let end = |action| (std::mem::discriminant(&action), lasts(action));
        injection.steps.iter().map(|step| (struck(step), end(step.action))).collect()
    };
    let whole = ends(whole);
    ends(simpler).iter().all(|(struck, end)| whole.get(struck) == Some(end))
}

/// The member that a step strikes, and of a link the other one.
fn struck(step: &Fault) -> (Member, Option<Member>) {
    match step.action {
        Action::Cut { to } | Action::Heal { to } | Action::Delay { to, .. } => {
            (step.member, Some(to))
        }
        _ => (step.member, None),
    }
}

/// Nobody is crashed who is not there.
fn is_possible(faultload: &Faultload) -> bool {
    let injections = faultload.injections.iter().enumerate();
    injections.clone().all(|(place, injection)| {
        let others = &faultload.injections[place + 1..];
        !others.iter().any(|other| injection.collides_with(other))
    })
}

fn simpler_injections(injection: &Injection) -> Vec<Injection> {
    let with = |steps: Vec<Fault>| Injection { steps, ..injection.clone() };
    let each = |change: &dyn Fn(Fault) -> Fault| {
        with(injection.steps.iter().copied().map(change).collect())
    };
    let cycles = injection.cycles();
    let mut list = Vec::new();
    // Without its end, or without its last pair: an outage that lasts, a storm with one crash less.
    let count = injection.steps.len();
    if count > 1 {
        list.push(with(injection.steps[..count.div_ceil(2)].to_vec()));
        list.push(with(injection.steps[..count - 1].to_vec()));
    }
    if count > 2 {
        list.push(with(injection.steps[..2].to_vec()));
        list.push(with(injection.steps[..count - 2].to_vec()));
    }
    for earliest in
        [FIRST_CYCLE, cycles.start.midpoint(FIRST_CYCLE), cycles.start.saturating_sub(1)]
    {
        if (FIRST_CYCLE..cycles.start).contains(&earliest) {
            list.push(each(&|step| Fault {
                at_cycle: step.at_cycle - cycles.start + earliest,
                ..step
            }));
        }
    }
    for last in nearer(cycles.start, cycles.end - 1) {
        list.push(each(&|step| Fault { at_cycle: step.at_cycle.min(last), ..step }));
    }
    for digits in [0, 1, 2] {
        let scale = 10_f64.powi(digits);
        list.push(each(&|step| Fault { phase: (step.phase * scale).floor() / scale, ..step }));
    }
    list.push(each(&|step| Fault { action: simpler_action(step.action), ..step }));
    list
}

/// The least of each number, but for those that end something.
fn simpler_action(action: Action) -> Action {
    match action {
        Action::Slow { by } if by.as_millis() > 1 => {
            Action::Slow { by: Duration::from_millis(by.as_millis() as u64 / 2) }
        }
        Action::Delay { to, by } if by.as_millis() > 1 => {
            Action::Delay { to, by: Duration::from_millis(by.as_millis() as u64 / 2) }
        }
        Action::Corrupt { frames } => Action::Corrupt { frames: frames.div_ceil(2) },
        Action::Replay { age } => Action::Replay { age: age.div_ceil(2) },
        Action::FlipState { program, .. } => Action::FlipState { program, bit: 0 },
        Action::FlipSample { frames, .. } => {
            Action::FlipSample { bit: 0, frames: frames.div_ceil(2) }
        }
        Action::FlipWord { frames, .. } => Action::FlipWord { bit: 0, frames: frames.div_ceil(2) },
        other => other,
    }
}

/// Ever smaller numbers from `least` to below `now`: the least, the middle, and one less.
fn nearer(least: u64, now: u64) -> Vec<u64> {
    let mut list = vec![least, least.midpoint(now), now.saturating_sub(1)];
    list.retain(|&number| number >= least && number < now);
    list.dedup();
    list
}

fn simpler_networks(disturbance: &Disturbance) -> Vec<Disturbance> {
    let mut list = Vec::new();
    let network = disturbance.network;
    let mut with = |change: &dyn Fn(&mut Disturbance)| {
        let mut simpler = disturbance.clone();
        change(&mut simpler);
        list.push(simpler);
    };
    with(&|simpler| simpler.network.loss = 0.0);
    with(&|simpler| simpler.network.duplicate = 0.0);
    with(&|simpler| simpler.network.corruption = 0.0);
    with(&|simpler| simpler.network.jitter = Duration::ZERO);
    let rounded = |share: f64| (share * 20.0).ceil() / 20.0;
    with(&|simpler| simpler.network.loss = rounded(network.loss));
    with(&|simpler| simpler.network.duplicate = rounded(network.duplicate));
    with(&|simpler| simpler.network.corruption = rounded(network.corruption));
    let milliseconds = network.jitter.as_micros().div_ceil(1000) as u64;
    with(&|simpler| simpler.network.jitter = Duration::from_millis(milliseconds));
    if let Some(Range { start, end }) = disturbance.cycles.clone() {
        for end in nearer(start + 1, end) {
            with(&|simpler| simpler.cycles = Some(start..end));
        }
        for later in [start.midpoint(end), start + 1] {
            if later < end {
                with(&|simpler| simpler.cycles = Some(later..end));
            }
        }
    }
    list
}

/// The same with the first members of each role in place of later ones.
fn simpler_members(faultload: &Faultload, schedule: &Schedule) -> Vec<Faultload> {
    let mut used: BTreeMap<Member, Member> = BTreeMap::new();
    for step in faultload.steps() {
        used.entry(step.member).or_insert(step.member);
        if let Action::Cut { to } | Action::Heal { to } | Action::Delay { to, .. } = step.action {
            used.entry(to).or_insert(to);
        }
    }
    let roles = Role::ALL.into_iter().map(|role| role.members(schedule));
    let roles: Vec<Vec<Member>> = roles.map(Iterator::collect).collect();
    let mut list = Vec::new();
    for &member in used.keys() {
        let earlier = roles
            .iter()
            .filter_map(|role| Some(&role[..role.iter().position(|other| *other == member)?]));
        for &other in earlier.flatten() {
            // Two that are both used change places.
            let swap = |which: Member| match which {
                which if which == member => other,
                which if which == other => member,
                which => which,
            };
            let mut simpler = faultload.clone();
            for step in simpler.injections.iter_mut().flat_map(|injection| &mut injection.steps) {
                step.member = swap(step.member);
                step.action = match step.action {
                    Action::Cut { to } => Action::Cut { to: swap(to) },
                    Action::Heal { to } => Action::Heal { to: swap(to) },
                    Action::Delay { to, by } => Action::Delay { to: swap(to), by },
                    action => action,
                };
            }
            if rank(&simpler) < rank(faultload) {
                list.push(simpler);
            }
        }
    }
    list
}

/// Who is struck, in the order of the steps; less is simpler.
fn rank(faultload: &Faultload) -> Vec<(Member, Option<Member>)> {
    let steps = faultload.injections.iter().flat_map(|injection| &injection.steps);
    steps.map(struck).collect()
}

#[cfg(test)]
mod tests;
