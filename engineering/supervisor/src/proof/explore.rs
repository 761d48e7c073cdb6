//! Ladder and automata side by side, scan by scan, through everything that they can reach together.

use std::collections::{HashMap, HashSet};
use std::hash::BuildHasher;
use std::time::Duration;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;
use understudy_ladder::{Name, Program, Signal};
use understudy_logic::{Circuit, SPARSE, Scan, Sparse, SparseRun, ones_in, pack};

use super::environment::Environment;
use super::reference::{Allowed, Happening, Joint, Reference};
use super::relevant::relevant;
use super::timers::free_timers;
use super::verdict::{Counterexample, Deviation, Proof, ProofError, ScanRecord, Verdict};
use super::view::{Bit, Seen, View};
use crate::ladder::{Correspondence, InputOutputMap, Mode, Modules, Partition};
use crate::{Label, State};

/// What the automata allow is remembered for this number of questions; the same ones come soon after each other.
const REMEMBERED: usize = 1 << 14;

/// How far a proof looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProofSettings {
    /// The mode that the ladder was generated for.
    pub mode: Mode,
    /// Maximum number of inputs that change in one scan.
    pub simultaneous: usize,
    /// Maximum number of states of ladder and inputs.
    pub maximum_states: usize,
}

impl Default for ProofSettings {
    fn default() -> Self {
        Self { mode: Mode::Automatic, simultaneous: 2, maximum_states: 2_000_000 }
    }
}

/// Progress of a proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Proving {
    /// States of ladder and inputs that were reached.
    pub reached: usize,
    /// Those of them that were scanned with every input.
    pub scanned: usize,
}

/// Holds `program` to the automata of `modules`, from its first scan through all that it can reach.
///
/// In each scan up to [`ProofSettings::simultaneous`] inputs change; a rising, falling, high or low signal keeps its value as
/// long as it likes, and any input may change at any time, whether the plant's model expects that or not; where the map assumes
/// one event in a scan, there is no scan with two. Breadth first, so that a counterexample is as short as any.
///
/// # Errors
/// An unsuitable map, an invalid ladder or one that lacks the bits, or more states than the limit.
pub fn prove(
    program: &Program,
    modules: &Modules,
    map: &InputOutputMap,
    correspondence: &Correspondence,
    settings: ProofSettings,
) -> Result<Verdict, ProofError> {
    prove_with_progress(program, modules, map, correspondence, settings, &mut |_| {})
}

/// As [`prove`]; reports its progress many times a second.
///
/// # Errors
/// As [`prove`].
pub fn prove_with_progress(
    program: &Program,
    modules: &Modules,
    map: &InputOutputMap,
    correspondence: &Correspondence,
    settings: ProofSettings,
    report: &mut dyn FnMut(Proving),
) -> Result<Verdict, ProofError> {
    let partition = Partition::new(map, modules).map_err(ProofError::Partition)?;
    let compared = relevant(program, map, correspondence);
    let (mut freed, timers) = free_timers(&compared);
    show(freed.to_mut(), map);
    let circuit = freed.lower(Duration::from_millis(1))?;
    drop(freed);
    let reference = Reference::new(modules, map, &partition, settings.mode);
    let environment = Environment::new(
        circuit.inputs(),
        map,
        &partition,
        correspondence,
        &timers,
        settings.simultaneous,
    );
    let view = View::new(&circuit, program, map, correspondence)?;
    let mut exploration = Exploration {
        sparse: Sparse::new(Scan::new(&circuit)),
        circuit: &circuit,
        reference,
        environment,
        view,
        settings,
        nodes: Vec::new(),
        known: HashTable::new(),
        cache: HashMap::new(),
        joint: HashSet::new(),
        used: HashSet::new(),
        scans: 0,
    };
    exploration.run(report)
}

/// Makes the memory bits that the map names outputs: what a scan leaves in them is looked at, and it need not outlive the scan.
fn show(program: &mut Program, map: &InputOutputMap) {
    let positions = map.switches.iter().flat_map(|switch| &switch.positions);
    let signals = positions.map(|position| &position.signal);
    let signals = signals.chain(map.pulses.iter().map(|pulse| &pulse.signal));
    let named: HashSet<&str> = signals.map(Name::as_str).collect();
    let is_named = |signal: &Signal| named.contains(signal.name.as_str());
    let (shown, kept) = std::mem::take(&mut program.memory).into_iter().partition(is_named);
    program.memory = kept;
    let shown: Vec<Signal> = shown;
    program.outputs.extend(shown);
}

/// A reached state, and how.
struct Node {
    /// The registers that are 1, ascending: of the state bits of an automaton one is.
    on: Box<[u32]>,
    kept: Box<[bool]>,
    state: Joint,
    positions: Box<[u8]>,
    /// Events that wait for their turn, ascending.
    waiting: Vec<Label>,
    parent: Option<(usize, Box<[bool]>)>,
}

type Question = (Joint, Box<[u8]>, Vec<Label>, Vec<Label>, Vec<Label>, bool);

struct Exploration<'a> {
    sparse: Sparse,
    circuit: &'a Circuit,
    reference: Reference<'a>,
    environment: Environment,
    view: View,
    settings: ProofSettings,
    nodes: Vec<Node>,
    /// Nodes by their registers and inputs.
    known: HashTable<usize>,
    cache: HashMap<Question, Vec<Allowed>>,
    joint: HashSet<Box<[State]>>,
    used: HashSet<Label>,
    scans: u64,
}

impl Exploration<'_> {
    fn run(&mut self, report: &mut dyn FnMut(Proving)) -> Result<Verdict, ProofError> {
        let on: Box<[u32]> =
            ones_in(self.sparse.scan().initial()).map(|place| place as u32).collect();
        let seen = self.see(&on, &[]);
        let state = seen.states.iter().map(|states| states.first().copied()).collect();
        self.keep(Node {
            on,
            kept: vec![false; self.circuit.inputs().len()].into(),
            state,
            positions: vec![0; self.reference.switch_count()].into(),
            waiting: Vec::new(),
            parent: None,
        });
        let mut next = 0;
        while next < self.nodes.len() {
            let first = next;
            let mut waiting = Vec::new();
            while next < self.nodes.len() && waiting.len() < SPARSE {
                let images = self.following(next);
                waiting.extend(images.into_iter().map(|image| (next, image)));
                next += 1;
            }
            for waiting in waiting.chunks(SPARSE) {
                if let Some(counterexample) = self.expand(waiting) {
                    return Ok(Verdict::Refuted(Box::new(counterexample)));
                }
            }
            report(Proving { reached: self.nodes.len(), scanned: next });
            for node in &self.nodes[first..next] {
                self.joint.extend(node.state.clone());
            }
            if self.nodes.len() > self.settings.maximum_states {
                return Err(ProofError::TooLarge { limit: self.settings.maximum_states });
            }
        }
        let mut events: Vec<Label> = self.used.iter().copied().collect();
        events.sort_unstable();
        Ok(Verdict::Proved(Proof {
            states: self.nodes.len(),
            scans: self.scans,
            joint_states: self.joint.len(),
            events,
        }))
    }

    /// The input images that may follow a node.
    fn following(&self, index: usize) -> Vec<Vec<bool>> {
        let node = &self.nodes[index];
        let is_on = |name: &Name| {
            let place = self.view.register_of.get(name.as_str());
            place.is_some_and(|&place| node.on.binary_search(&(place as u32)).is_ok())
        };
        self.environment.following(&node.kept, is_on)
    }

    /// Scans from nodes with images, at most [`SPARSE`] at once.
    fn expand(&mut self, waiting: &[(usize, Vec<bool>)]) -> Option<Counterexample> {
        let runs = waiting.iter().map(|(index, image)| SparseRun {
            on: self.nodes[*index].on.to_vec(),
            signals: pack(image.iter().copied()),
        });
        let mut runs: Vec<SparseRun> = runs.collect();
        self.sparse.step(&mut runs);
        for ((index, image), run) in waiting.iter().zip(runs) {
            self.scans += 1;
            let found = self.judge(*index, image, run);
            if found.is_some() {
                return found;
            }
        }
        None
    }

    /// Keeps a node that is new.
    fn keep(&mut self, node: Node) {
        let hash = |node: &Node| FxBuildHasher.hash_one((&node.on, &node.kept));
        let nodes = &self.nodes;
        let same = |&known: &usize| nodes[known].on == node.on && nodes[known].kept == node.kept;
        let code = hash(&node);
        if self.known.find(code, same).is_none() {
            self.known.insert_unique(code, nodes.len(), |&known| hash(&nodes[known]));
            self.nodes.push(node);
        }
    }

    /// Compares one scan with what is allowed, and keeps where it leads.
    fn judge(&mut self, index: usize, image: &[bool], run: SparseRun) -> Option<Counterexample> {
        let node = &self.nodes[index];
        let happening = self.environment.happening(&node.kept, image);
        if let Some(state) = &node.state {
            for &event in happening.events.iter().chain(&node.waiting) {
                if let Some(supervisor) = self.reference.forbids(state, event) {
                    let automaton = self.reference.automata()[supervisor];
                    let deviation = Deviation::Uncontrollable {
                        automaton: automaton.name().to_owned(),
                        event: automaton.alphabet().name(event),
                    };
                    let seen = self.see(&run.on, &run.signals);
                    return Some(self.refute(index, image, &seen, deviation, &[]));
                }
            }
        }
        let question = (
            node.state.clone(),
            node.positions.clone(),
            node.waiting.clone(),
            happening.events.clone(),
            happening.requests.clone(),
            happening.start,
        );
        if !self.cache.contains_key(&question) {
            if self.cache.len() >= REMEMBERED {
                self.cache.clear();
            }
            let allowed =
                self.reference.scan(&node.state, &node.positions, &node.waiting, &happening);
            self.cache.insert(question.clone(), allowed);
        }
        let seen = self.see(&run.on, &run.signals);
        let found = self.cache[&question].iter().find(|allowed| seen.is(allowed));
        let Some(found) = found else {
            let deviation = self.deviation(&seen, &question);
            let allowed = self.cache[&question].clone();
            return Some(self.refute(index, image, &seen, deviation, &allowed));
        };
        self.used.extend(found.word.iter().copied());
        self.keep(Node {
            on: run.on.into(),
            kept: self.environment.kept(image).into(),
            state: found.state.clone(),
            positions: found.positions.clone(),
            waiting: found.waiting.clone(),
            parent: Some((index, image.into())),
        });
        None
    }

    fn see(&self, registers: &[u32], outputs: &[u64]) -> Seen {
        let mut seen = Seen {
            states: vec![Vec::new(); self.reference.automata().len()],
            positions: vec![Vec::new(); self.reference.switch_count()],
            pulses: Vec::new(),
            waiting: Vec::new(),
        };
        for &(automaton, state) in &self.view.constant {
            seen.states[automaton].push(state);
        }
        let registers = registers.iter().map(|&place| self.view.registers[place as usize]);
        let outputs = ones_in(outputs).map(|place| self.view.outputs[place]);
        for bit in registers.chain(outputs) {
            match bit {
                Bit::Other => {}
                Bit::State { automaton, state } => seen.states[automaton].push(state),
                Bit::Switch { switch, position } => seen.positions[switch].push(position),
                Bit::Pulse(pulse) => seen.pulses.push(pulse),
                Bit::Waiting(label) => seen.waiting.push(label),
            }
        }
        seen.waiting.sort_unstable();
        seen
    }

    fn deviation(&self, seen: &Seen, question: &Question) -> Deviation {
        let automata = self.reference.automata();
        let is_started = question.0.is_some() || question.5;
        let name = |index: usize| automata[index].name().to_owned();
        if let Some(index) = seen.states.iter().position(|states| states.len() > 1) {
            return Deviation::StateDoubled { automaton: name(index) };
        }
        if let Some(index) = seen.states.iter().position(Vec::is_empty)
            && is_started
        {
            return Deviation::StateLost { automaton: name(index) };
        }
        if let Some(switch) = seen.positions.iter().position(|on| on.len() > 1) {
            let signals = seen.positions[switch].iter();
            return Deviation::SwitchDoubled {
                signals: signals.filter_map(|&position| self.signal(switch, position)).collect(),
            };
        }
        Deviation::NotAllowed
    }

    fn signal(&self, switch: usize, position: u8) -> Option<String> {
        let is = |bit: &Bit| matches!(bit, Bit::Switch { switch: s, position: p } if *s == switch && *p == position);
        let output = self.view.outputs.iter().position(is);
        let register = self.view.registers.iter().position(is);
        output
            .map(|place| self.circuit.outputs()[place].name.clone())
            .or_else(|| register.map(|place| self.circuit.registers()[place].name.clone()))
    }

    fn refute(
        &self,
        index: usize,
        image: &[bool],
        seen: &Seen,
        deviation: Deviation,
        allowed: &[Allowed],
    ) -> Counterexample {
        let mut scans = Vec::new();
        let mut at = index;
        while let Some((parent, image)) = &self.nodes[at].parent {
            let node = &self.nodes[at];
            let seen = Seen {
                states: match &node.state {
                    Some(states) => states.iter().map(|&state| vec![state]).collect(),
                    None => Vec::new(),
                },
                positions: node.positions.iter().map(|&position| vec![position]).collect(),
                pulses: Vec::new(),
                waiting: node.waiting.clone(),
            };
            scans.push(self.record(&self.nodes[*parent].kept, image, &seen));
            at = *parent;
        }
        scans.reverse();
        let states = |allowed: &Allowed| match &allowed.state {
            Some(states) => self.state_names(states.iter().map(std::slice::from_ref)),
            None => Vec::new(),
        };
        let last = self.record(&self.nodes[index].kept, image, seen);
        Counterexample {
            scans,
            last,
            deviation,
            allowed: allowed
                .iter()
                .map(|end| (end.word.iter().map(|&label| self.name(label)).collect(), states(end)))
                .collect(),
        }
    }

    fn name(&self, label: Label) -> String {
        let mut alphabets = self.reference.automata().iter().map(|automaton| automaton.alphabet());
        let known = alphabets.find(|alphabet| alphabet.contains(label));
        known.map_or_else(|| label.to_string(), |alphabet| alphabet.name(label))
    }

    fn state_names<'s>(&self, states: impl Iterator<Item = &'s [State]>) -> Vec<String> {
        let automata = self.reference.automata();
        let names = automata.iter().zip(states).flat_map(|(automaton, on)| {
            let name = |state: &State| match automata.len() {
                1 => automaton.state_name(*state).into_owned(),
                _ => format!("{}:{}", automaton.name(), automaton.state_name(*state)),
            };
            on.iter().map(name).collect::<Vec<_>>()
        });
        names.collect()
    }

    fn record(&self, last: &[bool], image: &[bool], seen: &Seen) -> ScanRecord {
        let Happening { events, .. } = self.environment.happening(last, image);
        let inputs = self.circuit.inputs().iter().zip(image);
        let mut outputs: Vec<String> = Vec::new();
        for (switch, positions) in seen.positions.iter().enumerate() {
            outputs.extend(positions.iter().filter_map(|&position| self.signal(switch, position)));
        }
        for &pulse in &seen.pulses {
            let is = |bit: &Bit| matches!(bit, Bit::Pulse(number) if *number == pulse);
            let place = self.view.outputs.iter().position(is);
            outputs.extend(place.map(|place| self.circuit.outputs()[place].name.clone()));
        }
        ScanRecord {
            inputs: inputs.filter(|(_, value)| **value).map(|(name, _)| name.clone()).collect(),
            events: events.into_iter().map(|label| self.name(label)).collect(),
            outputs,
            states: self.state_names(seen.states.iter().map(Vec::as_slice)),
        }
    }
}
