//! The ladder of a net and its supervisors, held to both scan by scan: everything that ladder, net and supervisors can reach
//! together, whatever the inputs do.
//!
//! The ladder is known by its bits only ([`HybridLadder`]). Timers are free in when they end, so that no number of scans has to
//! be waited for: `IN` of each becomes an output, which must be 1 exactly while the delay is to last, and its `Q` is `IN` in
//! any scan in which a new input says so. Every run of the real timer is one of these.

mod compare;
mod reference;
mod verdict;
mod waiting;

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use understudy_ladder::{Element, Name, Program, Signal};
use understudy_logic::{Circuit, LANES, Lanes, Run, Scan, bit};

use self::reference::{Joint, Reference, Seen};
use super::environment::images;
use super::explore::ProofSettings;
use super::verdict::{ProofError, ScanRecord};
use crate::Automaton;
use crate::ladder::rung::{open, rung, write};
use crate::petri::{HybridLadder, Net};

pub use verdict::{HybridCounterexample, HybridDeviation, HybridProof, HybridVerdict};

/// Holds `ladder` to `net` and `supervisors` through all that they can reach together. Breadth first, so that a counterexample
/// is as short as any. The mode of the settings means nothing here.
///
/// A ladder is right where in every scan, by the order of the net's transitions: what fires is enabled by the net, its condition
/// and the supervisors; what is enabled fires, unless it would take a token that has come in this scan, or a counter of its
/// places has just counted; no token passes a place with an action, or two transitions by one edge of a signal; and after it
/// tokens, states of the supervisors and actions are those of net and supervisors.
///
/// # Errors
/// An invalid ladder or one that lacks the bits, or more states than the limit.
pub fn prove_hybrid(
    net: &Net,
    supervisors: &[Automaton],
    ladder: &HybridLadder,
    settings: ProofSettings,
) -> Result<HybridVerdict, ProofError> {
    let freed = freed(ladder);
    let circuit = freed.lower(Duration::from_millis(1))?;
    let bits = Bits::new(&circuit, ladder, net)?;
    let reference = Reference::new(net, supervisors, ladder, circuit.inputs());
    let exploration = Exploration {
        lanes: Lanes::new(Scan::new(&circuit)),
        circuit: &circuit,
        reference,
        bits,
        settings,
        nodes: Vec::new(),
        known: HashSet::new(),
        fired: vec![false; net.transitions().len()],
        scans: 0,
    };
    exploration.run()
}

/// The program with all its bits as outputs and its timers freed.
fn freed(ladder: &HybridLadder) -> Program {
    let mut program = ladder.program.clone();
    let memory = std::mem::take(&mut program.memory);
    program.outputs.extend(memory);
    for timer in ladder.timers.iter().flatten() {
        let pin = |pin: &str| Name::from(format!("{timer}.{pin}"));
        let is_timer =
            |element: &Element| matches!(element, Element::Block(block) if block.name == *timer);
        let ends = |rung: &understudy_ladder::Rung| rung.network.last().is_some_and(is_timer);
        let Some(place) = program.rungs.iter().position(ends) else {
            continue;
        };
        let (power, over, output) = (pin("IN"), pin("over"), pin("Q"));
        program.rungs[place].network.pop();
        program.rungs[place].coils.push(write(&power));
        let ended = vec![open(&power), open(&over)];
        program.rungs.insert(place + 1, rung("the delay is over", ended, vec![write(&output)]));
        program.outputs.extend([power, output].map(Signal::new));
        program.inputs.push(Signal::new(over));
    }
    program
}

/// Positions of the ladder's bits among the outputs and registers of its circuit.
struct Bits {
    fires: Vec<usize>,
    /// For each place, bit k is 1 while there are more than k tokens.
    places: Vec<Vec<usize>>,
    /// For each place that is a counter the registers of its value, the low one first.
    counters: Vec<Vec<usize>>,
    states: Vec<Vec<usize>>,
    /// `IN` of each transition's timer.
    powers: Vec<Option<usize>>,
    /// The signals of actions, in the order of the reference.
    actions: Vec<usize>,
}

impl Bits {
    fn new(circuit: &Circuit, ladder: &HybridLadder, net: &Net) -> Result<Self, ProofError> {
        let outputs = circuit.outputs().iter().map(|output| output.name.as_str());
        let outputs: HashMap<&str, usize> = outputs.zip(0..).collect();
        let registers = circuit.registers().iter().map(|bit| bit.name.as_str());
        let registers: HashMap<&str, usize> = registers.zip(0..).collect();
        let output = |name: &Name| -> Result<usize, ProofError> {
            let place = outputs.get(name.as_str()).copied();
            place.ok_or_else(|| ProofError::NoBit { name: name.to_string() })
        };
        let all = |names: &Vec<Name>| names.iter().map(output).collect::<Result<Vec<_>, _>>();
        let counters = ladder.counters.iter().map(|counter| {
            let bits = (0..).map_while(|bit| {
                let name = format!("{}.CV.{bit}", counter.as_ref()?);
                registers.get(name.as_str()).copied()
            });
            bits.collect()
        });
        let powers = ladder.timers.iter().map(|timer| {
            let power = timer.as_ref().map(|timer| Name::from(format!("{timer}.IN")));
            power.map(|power| output(&power)).transpose()
        });
        let actions = reference::actions(net);
        let names: Vec<Name> = actions.iter().map(|(name, _)| name.clone()).collect();
        Ok(Self {
            fires: all(&ladder.fires)?,
            places: ladder.places.iter().map(all).collect::<Result<_, _>>()?,
            counters: counters.collect(),
            states: ladder.states.iter().map(all).collect::<Result<_, _>>()?,
            powers: powers.collect::<Result<_, _>>()?,
            actions: all(&names)?,
        })
    }

    /// What a run shows after a scan.
    fn see(&self, run: &Run) -> Seen {
        let on = |&place: &usize| bit(&run.signals, place);
        let all = |places: &Vec<usize>| places.iter().map(on).collect::<Vec<bool>>();
        let places = self.places.iter().zip(&self.counters);
        let tokens = places.map(|(bits, counter)| {
            if counter.is_empty() {
                let bits = all(bits);
                let held = bits.iter().take_while(|on| **on).count();
                let is_row = bits[held..].iter().all(|on| !on);
                return is_row.then_some(held as u32);
            }
            let value = counter.iter().zip(0..);
            let value = value.map(|(&place, power)| u32::from(bit(&run.state, place)) << power);
            Some(value.sum())
        });
        Seen {
            fires: all(&self.fires),
            tokens: tokens.collect(),
            states: self.states.iter().map(all).collect(),
            powers: self.powers.iter().map(|power| power.as_ref().map(on)).collect(),
            actions: all(&self.actions),
        }
    }
}

/// A reached state, and how.
struct Node {
    registers: Vec<u64>,
    kept: Vec<bool>,
    joint: Joint,
    parent: Option<(usize, Vec<bool>, Seen)>,
}

struct Exploration<'a> {
    lanes: Lanes,
    circuit: &'a Circuit,
    reference: Reference<'a>,
    bits: Bits,
    settings: ProofSettings,
    nodes: Vec<Node>,
    known: HashSet<(Vec<u64>, Vec<bool>, Joint)>,
    fired: Vec<bool>,
    scans: u64,
}

impl Exploration<'_> {
    fn run(mut self) -> Result<HybridVerdict, ProofError> {
        let kept = vec![false; self.circuit.inputs().len()];
        let registers = self.lanes.scan().initial().to_vec();
        self.keep(registers, kept, self.reference.initial(), None);
        let mut next = 0;
        while next < self.nodes.len() {
            if let Some(counterexample) = self.expand(next) {
                return Ok(HybridVerdict::Refuted(Box::new(counterexample)));
            }
            if self.nodes.len() > self.settings.maximum_states {
                return Err(ProofError::TooLarge { limit: self.settings.maximum_states });
            }
            next += 1;
        }
        let markings = self.nodes.iter().map(|node| &node.joint.marking);
        let markings: HashSet<_> = markings.collect();
        Ok(HybridVerdict::Proved(HybridProof {
            states: self.nodes.len(),
            scans: self.scans,
            markings: markings.len(),
            never_fired: self.reference.names(self.fired.iter().map(|fired| !fired)),
        }))
    }

    fn keep(
        &mut self,
        registers: Vec<u64>,
        kept: Vec<bool>,
        joint: Joint,
        parent: Option<(usize, Vec<bool>, Seen)>,
    ) {
        let key = (registers, kept, joint);
        if self.known.insert(key.clone()) {
            let (registers, kept, joint) = key;
            self.nodes.push(Node { registers, kept, joint, parent });
        }
    }

    fn expand(&mut self, index: usize) -> Option<HybridCounterexample> {
        let node = &self.nodes[index];
        let (kept, registers) = (node.kept.clone(), node.registers.clone());
        let rest = self.reference.rest(&kept);
        let choices: Vec<usize> = (0..rest.len()).collect();
        for images in images(&rest, &choices, self.settings.simultaneous).chunks(LANES) {
            let runs = self.lanes.fan_out(&registers, images);
            for (run, image) in runs.into_iter().zip(images) {
                self.scans += 1;
                let seen = self.bits.see(&run);
                let joint = &self.nodes[index].joint;
                match self.reference.scan(joint, &kept, image, &seen) {
                    Ok(next) => {
                        for (fired, &fires) in self.fired.iter_mut().zip(&seen.fires) {
                            *fired |= fires;
                        }
                        let parent = Some((index, image.clone(), seen));
                        let kept = self.reference.kept(image);
                        self.keep(run.state, kept, next, parent);
                    }
                    Err(deviation) => return Some(self.refute(index, image, &seen, deviation)),
                }
            }
        }
        None
    }

    fn refute(
        &self,
        index: usize,
        image: &[bool],
        seen: &Seen,
        deviation: HybridDeviation,
    ) -> HybridCounterexample {
        let mut scans = vec![self.record(image, seen)];
        let mut at = index;
        while let Some((parent, image, seen)) = &self.nodes[at].parent {
            scans.push(self.record(image, seen));
            at = *parent;
        }
        scans.reverse();
        HybridCounterexample { scans, deviation }
    }

    fn record(&self, image: &[bool], seen: &Seen) -> ScanRecord {
        let inputs = self.circuit.inputs().iter().zip(image);
        let actions = self.bits.actions.iter().zip(&seen.actions);
        ScanRecord {
            inputs: inputs.filter(|(_, value)| **value).map(|(name, _)| name.clone()).collect(),
            events: self.reference.names(seen.fires.iter().copied()),
            outputs: actions
                .filter(|(_, on)| **on)
                .map(|(&place, _)| self.circuit.outputs()[place].name.clone())
                .collect(),
            states: self.reference.state_names(seen),
        }
    }
}
