//! Algorithm 1 without luck: every scan that a ladder can come to against a model of its plant.
//!
//! The plant is a ladder as well: its inputs bear the names of the ladder's outputs, its outputs those of the ladder's inputs,
//! and its other inputs are free: each may be anything at any scan. A cycle is a scan of the ladder on what the plant shows,
//! and then a scan of the plant under the outputs. An input of the ladder that the plant does not show stays 0.

use rustc_hash::FxHashMap;
use understudy_logic::{Circuit, Scan, Scratch, bit, pack, unpack};

use crate::controller::Controller;
use crate::quotient::{Seen, quotient};
use crate::signals::{Bits, Signals};
use crate::timing::{Timing, timing};

/// More free inputs than this make too many combinations a scan.
pub const MAXIMUM_FREE_INPUTS: usize = 10;

/// What the exploration may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// States of ladder and plant together.
    pub maximum_states: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { maximum_states: 3_000_000 }
    }
}

/// Why there is no automaton.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unexplored {
    /// The plant has more free inputs than [`MAXIMUM_FREE_INPUTS`]; their names.
    TooFree(Vec<String>),
    /// More states than the limit.
    TooLarge(usize),
    /// From this state on nothing ever happens; the way there, as names of events.
    Deadlock {
        /// Its vector.
        state: String,
        /// The events that lead there.
        way: Vec<String>,
    },
}

/// What was explored.
#[derive(Debug, Clone)]
pub struct Explored {
    /// S.
    pub controller: Controller,
    /// States of ladder and plant together.
    pub joint_states: usize,
    /// Inputs of the ladder that the plant does not show.
    pub unseen_inputs: Vec<String>,
    /// How long states and pulses last.
    pub timing: Timing,
}

/// The registers of both and what the plant shows.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Joint {
    ladder: Box<[u64]>,
    plant: Box<[u64]>,
    shown: Box<[u64]>,
}

/// Explores `ladder` against `plant`. `memory` are the names of the ladder's memory bits: those among its registers tell
/// states of equal vectors apart.
///
/// # Errors
/// It is too large, or ladder and plant reach a permanent standstill.
pub fn explore(
    ladder: &Circuit,
    plant: &Circuit,
    memory: &[String],
    bounds: Bounds,
) -> Result<Explored, Unexplored> {
    let wiring = Wiring::new(ladder, plant)?;
    let registers = ladder.registers();
    let remembered: Vec<usize> =
        (0..registers.len()).filter(|&place| memory.contains(&registers[place].name)).collect();
    let mut walk = Walk {
        ladder: Scan::new(ladder),
        plant: Scan::new(plant),
        wiring,
        scratch: Scratch::default(),
        known: FxHashMap::default(),
        nodes: Vec::new(),
    };
    let first = walk.first();
    walk.number(first);
    let mut seen = Vec::new();
    let mut remembers = Vec::new();
    let mut edges = Vec::new();
    let mut next = 0;
    while next < walk.nodes.len() {
        let (vector, after, successors) = walk.step(next);
        remembers.push(Bits(remembered.iter().map(|&place| bit(&after, place)).collect()));
        seen.push(vector);
        for successor in successors {
            edges.push((next as u32, successor as u32));
        }
        if walk.nodes.len() > bounds.maximum_states {
            return Err(Unexplored::TooLarge(bounds.maximum_states));
        }
        next += 1;
    }
    let mut numbers: FxHashMap<&Bits, u64> = FxHashMap::default();
    let hidden: Vec<Vec<u64>> = remembers
        .iter()
        .map(|bits| {
            let next = numbers.len() as u64;
            vec![*numbers.entry(bits).or_insert(next)]
        })
        .collect();
    let signals = Signals {
        inputs: ladder.inputs().to_vec(),
        outputs: ladder.outputs().iter().map(|output| output.name.clone()).collect(),
    };
    let names = remembered.iter().map(|&place| registers[place].name.clone());
    let (controller, state_of) =
        quotient(signals, names.collect(), &seen, &hidden, &remembers, &edges);
    if let Some(&state) = controller.deadlocks().first() {
        let way = controller.way_to(state);
        let name = |events: &Vec<_>| match events.as_slice() {
            [] => "omega".to_owned(),
            events => controller.signals.event_names(events),
        };
        return Err(Unexplored::Deadlock {
            state: controller.state_name(state),
            way: way.iter().map(name).collect(),
        });
    }
    let shown = |node: usize, input: usize| seen[node].inputs.0[input];
    let inputs = ladder.inputs().len();
    Ok(Explored {
        timing: timing(controller.states().len(), &state_of, inputs, &shown, &edges),
        joint_states: walk.nodes.len(),
        unseen_inputs: walk.wiring.unseen(ladder),
        controller,
    })
}

/// Which signal of the ladder is which of the plant.
struct Wiring {
    /// Of each input of the ladder, the output of the plant.
    sensors: Vec<Option<usize>>,
    /// Of each input of the plant, the output of the ladder.
    actuators: Vec<Option<usize>>,
    /// Inputs of the plant that nothing drives.
    free: Vec<usize>,
}

impl Wiring {
    fn new(ladder: &Circuit, plant: &Circuit) -> Result<Self, Unexplored> {
        let shown = |name: &String| plant.outputs().iter().position(|output| output.name == *name);
        let driven =
            |name: &String| ladder.outputs().iter().position(|output| output.name == *name);
        let actuators: Vec<Option<usize>> = plant.inputs().iter().map(driven).collect();
        let free: Vec<usize> =
            (0..actuators.len()).filter(|&place| actuators[place].is_none()).collect();
        if free.len() > MAXIMUM_FREE_INPUTS {
            let names = free.iter().map(|&place| plant.inputs()[place].clone());
            return Err(Unexplored::TooFree(names.collect()));
        }
        Ok(Self { sensors: ladder.inputs().iter().map(shown).collect(), actuators, free })
    }

    fn unseen(&self, ladder: &Circuit) -> Vec<String> {
        let pairs = ladder.inputs().iter().zip(&self.sensors);
        pairs.filter(|(_, sensor)| sensor.is_none()).map(|(name, _)| name.clone()).collect()
    }
}

struct Walk {
    ladder: Scan,
    plant: Scan,
    wiring: Wiring,
    scratch: Scratch,
    known: FxHashMap<Joint, usize>,
    nodes: Vec<Joint>,
}

impl Walk {
    /// Before its first scan a plant shows the outputs of a scan with all inputs 0, without having stepped.
    fn first(&mut self) -> Joint {
        let mut outputs = vec![0; self.plant.output_count().div_ceil(64)];
        let inputs = vec![0; self.plant.input_count().div_ceil(64)];
        let mut state = self.plant.initial().to_vec();
        self.plant.step(&mut self.scratch, &mut state, &inputs, &mut outputs);
        Joint {
            ladder: self.ladder.initial().into(),
            plant: self.plant.initial().into(),
            shown: self.shown(&outputs),
        }
    }

    /// What the ladder sees of the outputs of the plant.
    fn shown(&self, outputs: &[u64]) -> Box<[u64]> {
        let sensors = self.wiring.sensors.iter();
        let shown = sensors.map(|sensor| sensor.is_some_and(|place| bit(outputs, place)));
        pack(shown).into()
    }

    fn number(&mut self, joint: Joint) -> usize {
        if let Some(&place) = self.known.get(&joint) {
            return place;
        }
        self.known.insert(joint.clone(), self.nodes.len());
        self.nodes.push(joint);
        self.nodes.len() - 1
    }

    /// One cycle: the vector of the scan, the ladder's registers after it, and the next nodes.
    fn step(&mut self, place: usize) -> (Seen, Vec<u64>, Vec<usize>) {
        let joint = self.nodes[place].clone();
        let mut ladder = joint.ladder.to_vec();
        let mut outputs = vec![0; self.ladder.output_count().div_ceil(64)];
        self.ladder.step(&mut self.scratch, &mut ladder, &joint.shown, &mut outputs);
        let actuators = self.wiring.actuators.iter();
        let driven = actuators.map(|actuator| actuator.is_some_and(|place| bit(&outputs, place)));
        let mut inputs: Vec<bool> = driven.collect();
        let mut successors = Vec::new();
        for choice in 0..1_usize << self.wiring.free.len() {
            for (number, &input) in self.wiring.free.iter().enumerate() {
                inputs[input] = choice >> number & 1 == 1;
            }
            let inputs = pack(inputs.iter().copied());
            let mut plant = joint.plant.to_vec();
            let mut shows = vec![0; self.plant.output_count().div_ceil(64)];
            self.plant.step(&mut self.scratch, &mut plant, &inputs, &mut shows);
            let shown = self.shown(&shows);
            let next =
                self.number(Joint { ladder: ladder.clone().into(), plant: plant.into(), shown });
            if !successors.contains(&next) {
                successors.push(next);
            }
        }
        let vector = Seen {
            inputs: Bits(unpack(&joint.shown, self.ladder.input_count())),
            outputs: Bits(unpack(&outputs, self.ladder.output_count())),
        };
        (vector, ladder, successors)
    }
}
