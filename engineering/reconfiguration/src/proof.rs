//! The combined ladder held to S and Λ, by code that shares nothing with what generated it.
//!
//! A world in one state of S runs beside the ladder's circuit. Between two scans at most one move of S happens, and only if
//! the outputs that were in force let it; at most one channel fails or is repaired. A failed channel shows the value
//! that it had. Every order of all this is tried. After every scan:
//!
//! 1. as long as no channel has ever failed, the outputs are those of the ladder alone, on the same inputs;
//! 2. at most one state of Θ is latched, and the states that it stands for contain the one in which the world is;
//! 3. where it stands for one state with nothing unseen to prevent, the outputs are those of that state;
//! 4. otherwise no event can happen that some state of the set must not let happen, and none unseen that leaves the set.
//!
//! ω is the ladder's own move: the world follows it where the bits say that the ladder has made it. What the world does so
//! slowly or so fast that the ladder's timers leave S is outside of the model, and is counted.

mod judge;

use std::time::Duration;

use rustc_hash::FxHashMap;
use understudy_ladder::{LowerError, Name, Program};
use understudy_logic::{LANES, Lanes, Run, Scan, Scratch, bit, pack, unpack};

use crate::controller::Controller;
use crate::module_two::Correspondence;
use crate::relation::Relation;
use crate::signals::{Bits, Event};

/// What is proved.
pub struct Claim<'a> {
    /// S and Φ'.
    pub controller: &'a Controller,
    /// Λ.
    pub relation: &'a Relation,
    /// Module 1.
    pub alone: &'a Program,
    /// Module 1 and 2.
    pub combined: &'a Program,
    /// Which bit means what.
    pub correspondence: &'a Correspondence,
    /// Meaning of each latched bit of the correspondence: states of S, and failed channels as bits.
    pub sets: &'a dyn Fn(usize) -> (Vec<u32>, u64),
    /// The inputs that may fail.
    pub channels: &'a [usize],
    /// How many of them at once.
    pub simultaneous: usize,
    /// Whether a channel may miss one event before its failure is known.
    pub late: bool,
    /// From one scan to the next.
    pub period: Duration,
    /// Maximum number of states of the proof.
    pub maximum_states: usize,
}

/// It holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Proof {
    /// States of world and ladder together.
    pub states: usize,
    /// Scans.
    pub scans: u64,
    /// Scans after which the ladder or the world was outside of the model.
    pub outside: u64,
    /// Latched states of Θ that were come to.
    pub latched: usize,
}

/// It does not hold, or could not be decided.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotProved {
    /// A scan breaks one of the four.
    #[error("U1241: the combined ladder is refuted: {what}\n{}", trace.join("\n"))]
    Refuted {
        /// Which, and by what.
        what: String,
        /// Each scan up to there.
        trace: Vec<String>,
    },
    /// More states than the limit.
    #[error(
        "U1242: the proof needs more than {0} states; ask about fewer channels, or lengthen the period"
    )]
    TooLarge(usize),
    /// The ladder is invalid.
    #[error("{code}: {0}", code = .0.code_or("U1243"))]
    NoCircuit(#[from] LowerError),
    /// A bit of the correspondence is not in the ladder.
    #[error("U1244: the combined ladder has no bit `{0}`")]
    NoBit(String),
}

impl NotProved {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Refuted { .. } => "U1241",
            Self::TooLarge(_) => "U1242",
            Self::NoCircuit(error) => error.code_or("U1243"),
            Self::NoBit(_) => "U1244",
        }
    }
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct World {
    /// Of the combined ladder.
    registers: Box<[u64]>,
    /// Of the ladder alone, while no channel has failed.
    alone: Option<Box<[u64]>>,
    state: u32,
    failed: u64,
    /// What the ladder sees.
    shown: Box<[bool]>,
    outputs: Bits,
    /// Whether one state was thought of, so that the ladder could make moves of its own.
    is_single: bool,
}

/// What may happen before a scan: where the world was, where it is then, and which channels are failed.
#[derive(Clone, Copy)]
struct Happening {
    /// [`ORIGIN`] before the first scan.
    parent: u32,
    state: u32,
    failed: u64,
}

/// The parent of the first scan.
const ORIGIN: u32 = u32::MAX;

struct Prover<'a> {
    claim: &'a Claim<'a>,
    combined: Lanes,
    alone: Scan,
    /// Bits of the circuit: outputs that were added to see them.
    lost: usize,
    latches: Vec<(usize, Vec<u32>, u64)>,
    at: Vec<(usize, u32)>,
    width: usize,
    scratch: Scratch,
    known: FxHashMap<World, u32>,
    nodes: Vec<(World, u32)>,
    /// Before the first scan.
    origin: World,
    proof: Proof,
    used: Vec<bool>,
}

/// Proves `claim`.
///
/// # Errors
/// It is refuted, too large, or the ladder is invalid.
pub fn prove(claim: &Claim<'_>) -> Result<Proof, NotProved> {
    let correspondence = claim.correspondence;
    let mut watched = claim.combined.clone();
    let width = watched.outputs.len();
    // The bits to look at become outputs.
    let mut bits: Vec<Name> = vec![correspondence.lost.clone()];
    bits.extend(correspondence.latches.iter().map(|(name, _)| name.clone()));
    bits.extend(correspondence.at.iter().map(|(name, _)| name.clone()));
    for bit in &bits {
        let place = watched.memory.iter().position(|signal| signal.name == *bit);
        let place = place.ok_or_else(|| NotProved::NoBit(bit.to_string()))?;
        let signal = watched.memory.remove(place);
        watched.outputs.push(signal);
    }
    let circuit = watched.lower(claim.period)?;
    let expected = claim.controller.signals.inputs.iter();
    if let Some(missing) = expected
        .map(String::as_str)
        .chain(correspondence.failed.iter().map(Name::as_str))
        .zip(circuit.inputs())
        .find(|(wanted, found)| wanted != found)
    {
        return Err(NotProved::NoBit(missing.0.to_owned()));
    }
    let alone = claim.alone.lower(claim.period)?;
    let latches = correspondence.latches.iter().enumerate();
    let latches: Vec<_> = latches
        .map(|(number, (_, place))| {
            let (members, failed) = (claim.sets)(*place);
            (width + 1 + number, members, failed)
        })
        .collect();
    let first_at = width + 1 + latches.len();
    let at = correspondence.at.iter().enumerate();
    let at = at.map(|(number, (_, state))| (first_at + number, *state as u32));
    let mut prover = Prover {
        claim,
        origin: World {
            registers: Scan::new(&circuit).initial().into(),
            alone: Some(Scan::new(&alone).initial().into()),
            state: 0,
            failed: 0,
            shown: claim.controller.states()[0].inputs.0.clone().into(),
            outputs: Bits(vec![false; width]),
            is_single: true,
        },
        combined: Lanes::new(Scan::new(&circuit)),
        alone: Scan::new(&alone),
        lost: width,
        at: at.collect(),
        used: vec![false; latches.len()],
        latches,
        width,
        scratch: Scratch::default(),
        known: FxHashMap::default(),
        nodes: Vec::new(),
        proof: Proof::default(),
    };
    prover.run()
}

impl Prover<'_> {
    fn run(&mut self) -> Result<Proof, NotProved> {
        // Before the first scan nothing has happened.
        let mut pending = vec![Happening { parent: ORIGIN, state: 0, failed: 0 }];
        let mut next = 0;
        while !pending.is_empty() {
            let batch = pending.len().min(LANES);
            self.scan(&pending[..batch])?;
            pending.drain(..batch);
            if self.nodes.len() > self.claim.maximum_states {
                return Err(NotProved::TooLarge(self.claim.maximum_states));
            }
            while pending.len() < LANES && next < self.nodes.len() {
                self.happenings(next as u32, &mut pending);
                next += 1;
            }
        }
        self.proof.states = self.nodes.len();
        self.proof.latched = self.used.iter().filter(|used| **used).count();
        Ok(self.proof)
    }

    fn world(&self, place: u32) -> &World {
        match self.nodes.get(place as usize) {
            Some((world, _)) => world,
            None => &self.origin,
        }
    }

    /// What may happen before the scan that follows a node.
    fn happenings(&self, parent: u32, found: &mut Vec<Happening>) {
        let (claim, world) = (self.claim, self.world(parent));
        let happening = |state, failed| Happening { parent, state, failed };
        let mut statuses = vec![world.failed];
        for bit in 0..claim.channels.len() {
            let other = world.failed ^ (1 << bit);
            if (other.count_ones() as usize) <= claim.simultaneous {
                statuses.push(other);
            }
        }
        for failed in statuses {
            found.push(happening(world.state, failed));
            let newly = failed & !world.failed;
            for step in claim.controller.moves(world.state as usize) {
                let is_missed = |event: &Event| {
                    event.channel().is_some_and(|input| {
                        let bit = claim.channels.iter().position(|&known| known == input);
                        bit.is_some_and(|bit| newly >> bit & 1 == 1)
                    })
                };
                if step.events.is_empty() || !claim.late && step.events.iter().any(is_missed) {
                    continue;
                }
                let state = world.state as usize;
                let is_let = |&event: &Event| claim.relation.allows(state, event, &world.outputs);
                if step.events.iter().all(is_let) {
                    found.push(happening(step.target as u32, failed));
                }
            }
        }
    }

    /// What the ladder sees: a failed channel keeps the value that it had.
    fn shown(&self, happening: Happening) -> Box<[bool]> {
        let claim = self.claim;
        let actual = &claim.controller.states()[happening.state as usize].inputs.0;
        let mut shown = self.world(happening.parent).shown.clone();
        for (input, shown) in shown.iter_mut().enumerate() {
            let bit = claim.channels.iter().position(|&known| known == input);
            if bit.is_none_or(|bit| happening.failed >> bit & 1 == 0) {
                *shown = actual[input];
            }
        }
        shown
    }

    /// The scans that follow, at most [`LANES`] of them.
    fn scan(&mut self, happenings: &[Happening]) -> Result<(), NotProved> {
        let mut shown = Vec::with_capacity(happenings.len());
        let mut runs = Vec::with_capacity(happenings.len());
        for &happening in happenings {
            let seen = self.shown(happening);
            let bits = 0..self.claim.channels.len();
            let statuses = bits.map(|bit| happening.failed >> bit & 1 == 1);
            runs.push(Run {
                state: self.world(happening.parent).registers.to_vec(),
                signals: pack(seen.iter().copied().chain(statuses)),
            });
            shown.push(seen);
        }
        self.combined.step(&mut runs);
        for ((&happening, shown), run) in happenings.iter().zip(shown).zip(runs) {
            self.follow(happening, shown, run)?;
        }
        Ok(())
    }

    /// One scan: the conditions after it, and the resulting state.
    fn follow(
        &mut self,
        happening: Happening,
        shown: Box<[bool]>,
        run: Run,
    ) -> Result<(), NotProved> {
        self.proof.scans += 1;
        let Happening { parent, state, failed } = happening;
        let seen = run.signals;
        let registers: Box<[u64]> = run.state.into();
        let before = self.world(parent);
        let (was_single, was_alone) = (before.is_single, before.alone.clone());
        let is_on = |place: usize| bit(&seen, place);
        let outputs = Bits(unpack(&seen, self.width));
        let mut world =
            World { registers, alone: None, state, failed, shown, outputs, is_single: was_single };
        if failed == 0
            && let Some(mut registers) = was_alone
        {
            let mut own = vec![0; self.alone.output_count().div_ceil(64)];
            let inputs = pack(world.shown.iter().copied());
            self.alone.step(&mut self.scratch, &mut registers, &inputs, &mut own);
            let own = Bits(unpack(&own, self.width));
            if own != world.outputs {
                let what = format!(
                    "with no channel failed the outputs are {} in place of {own}",
                    world.outputs
                );
                return Err(self.refuted(parent, &world, what));
            }
            world.alone = Some(registers);
        }
        let latched: Vec<usize> =
            (0..self.latches.len()).filter(|&number| is_on(self.latches[number].0)).collect();
        let at: Vec<u32> =
            self.at.iter().filter(|(place, _)| is_on(*place)).map(|(_, state)| *state).collect();
        let lost = is_on(self.lost);
        let inside = match self.judge(&mut world, &latched, &at, lost) {
            Ok(inside) => inside,
            Err(what) => return Err(self.refuted(parent, &world, what)),
        };
        for number in latched {
            self.used[number] = true;
        }
        if !inside {
            self.proof.outside += 1;
            return Ok(());
        }
        if !self.known.contains_key(&world) {
            self.known.insert(world.clone(), self.nodes.len() as u32);
            self.nodes.push((world, parent));
        }
        Ok(())
    }

    fn refuted(&self, parent: u32, world: &World, what: String) -> NotProved {
        let signals = &self.claim.controller.signals;
        let line = |world: &World| {
            let failed: Vec<&str> = (0..self.claim.channels.len())
                .filter(|bit| world.failed >> bit & 1 == 1)
                .map(|bit| signals.inputs[self.claim.channels[bit]].as_str())
                .collect();
            format!(
                "  state {:>4}  inputs {}  outputs {}  failed {}",
                Controller::number(world.state as usize),
                Bits(world.shown.to_vec()),
                world.outputs,
                if failed.is_empty() { "-".to_owned() } else { failed.join(" ") }
            )
        };
        let mut trace = vec![line(world)];
        let mut at = parent;
        while at != u32::MAX && trace.len() < 60 {
            let (world, before) = &self.nodes[at as usize];
            trace.push(line(world));
            at = *before;
        }
        trace.reverse();
        NotProved::Refuted { what, trace }
    }
}
