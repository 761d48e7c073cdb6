//! Whether two circuits do the same: a proof by induction where their registers correspond, and scans.
//!
//! The proof: corresponding registers begin with the same value, and as long as they hold the same, every output is the same and so are their
//! next values, whatever the inputs are. It covers every state in which no counter is above its preset, which is proved separately; also
//! states that no scan of a test would reach.

use std::collections::{HashMap, HashSet};

use understudy_logic::bdd::Diagrams;
use understudy_logic::{Circuit, Expression, Graph, Operation, Random, Running, Variable};

/// Scans that are compared.
const SCANS: usize = 500;

/// Operations that the compared scans take at most, where that is more than [`LEAST_SCANS`] scans.
const MAXIMUM_OPERATIONS: usize = 50_000_000;

/// Scans that are compared however large the program is.
const LEAST_SCANS: usize = 32;

/// Nodes of decision diagrams; functions that need more are not proved.
const MAXIMUM_NODES: usize = 300_000;

/// Two circuits, and what of the one is what of the other. Their inputs are in the same order.
pub(super) struct Pair<'a> {
    pub(super) before: &'a Circuit,
    pub(super) after: &'a Circuit,
    /// Places of the same output in both.
    pub(super) outputs: Vec<(usize, usize)>,
    /// What each counter of `before` holds, such as `parts.CV`, and its preset.
    pub(super) counters: Vec<(String, u16)>,
}

impl Pair<'_> {
    /// The first scan in which an output differs, and which; `Err` with the number of scans where none does.
    pub(super) fn difference(&self) -> Result<(usize, usize), usize> {
        let size = self.before.graph().operations().len() + self.after.graph().operations().len();
        let scans = (MAXIMUM_OPERATIONS / size.max(1)).clamp(LEAST_SCANS, SCANS);
        let (mut one, mut other) = (Running::new(self.before), Running::new(self.after));
        let mut inputs = vec![false; self.before.inputs().len()];
        let mut random = Random(0);
        for scan in 0..scans {
            for input in &mut inputs {
                *input ^= random.is_one_of(3);
            }
            let (left, right) = (one.step(&inputs), other.step(&inputs));
            let differs = |&&(before, after): &&(usize, usize)| left[before] != right[after];
            if let Some(&(place, _)) = self.outputs.iter().find(differs) {
                return Ok((scan, place));
            }
        }
        Err(scans)
    }

    /// Whether the proof succeeds; `written` gives the name in the other circuit of a register that a signal or a block has.
    ///
    /// The registers that are left, those of edge contacts and edge coils, correspond in the order of the scan.
    pub(super) fn is_proved(&self, written: impl Fn(&str) -> Option<String>) -> bool {
        let places = self.registers(written);
        let (before, after) = (self.before.registers(), self.after.registers());
        if places.iter().any(|&(place, other)| before[place].initial != after[other].initial) {
            return false;
        }
        // What no output depends on stays what it is, apart from the registers of the other circuit.
        let mut back: Vec<Variable> =
            (before.len()..before.len() + after.len()).map(register).collect();
        for &(place, other) in &places {
            back[other] = register(place);
        }
        let mut left: Vec<Expression> = Vec::new();
        let mut right: Vec<Expression> = Vec::new();
        for &(place, other) in &places {
            left.push(before[place].next);
            right.push(after[other].next);
        }
        for &(place, other) in &self.outputs {
            left.push(self.before.outputs()[place].value);
            right.push(self.after.outputs()[other].value);
        }
        let mut graph = Graph::new();
        let left = graph.import(self.before.graph(), &left, Graph::variable);
        let right = graph.import(self.after.graph(), &right, |graph, variable| {
            graph.variable(match variable {
                Variable::Input(_) => variable,
                Variable::Register(place) => back[place as usize],
            })
        });
        // What is the same function in another form is decided by its diagram, where no counter is above its preset.
        let other_form: HashSet<(Expression, Expression)> =
            left.iter().copied().zip(right).filter(|(left, right)| left != right).collect();
        if other_form.is_empty() {
            return true;
        }
        let now: Vec<Expression> =
            places.iter().map(|&(place, _)| graph.variable(register(place))).collect();
        let bounded = self.bounded(&mut graph, &places, &now);
        let stays = self.bounded(&mut graph, &places, &left);
        let mut equal: Vec<(Expression, Expression)> = other_form
            .into_iter()
            .map(|(left, right)| (graph.and(left, bounded), graph.and(right, bounded)))
            .collect();
        equal.push((graph.and(stays, bounded), bounded));
        let roots: Vec<Expression> =
            equal.iter().flat_map(|&(left, right)| [left, right]).collect();
        let diagrams = Diagrams::for_roots(&graph, &roots, MAXIMUM_NODES);
        equal.into_iter().all(|(left, right)| {
            let diagram = |root| diagrams.of(&graph, root).ok();
            diagram(left).is_some_and(|left| Some(left) == diagram(right))
        })
    }

    /// That no counter is above its preset, where the registers at `places` hold `values`.
    fn bounded(
        &self,
        graph: &mut Graph,
        places: &[(usize, usize)],
        values: &[Expression],
    ) -> Expression {
        let names = places.iter().map(|&(place, _)| place);
        let value_of: HashMap<&str, Expression> = names
            .map(|place| self.before.registers()[place].name.as_str())
            .zip(values.iter().copied())
            .collect();
        let mut all = graph.constant(true);
        for (counter, preset) in &self.counters {
            // From the lowest bit on: at most the preset, so far.
            let mut at_most = graph.constant(true);
            for bit in 0..u16::BITS {
                let Some(&value) = value_of.get(format!("{counter}.{bit}").as_str()) else {
                    break;
                };
                let off = graph.not(value);
                at_most = if preset >> bit & 1 == 1 {
                    graph.any([off, at_most])
                } else {
                    graph.and(off, at_most)
                };
            }
            all = graph.and(all, at_most);
        }
        all
    }

    /// The places of corresponding registers, of those that the outputs depend on. One without a counterpart may hold anything in the proof.
    fn registers(&self, written: impl Fn(&str) -> Option<String>) -> Vec<(usize, usize)> {
        let (before, after) = (self.before.registers(), self.after.registers());
        let known: HashMap<&str, usize> = after
            .iter()
            .enumerate()
            .map(|(place, register)| (register.name.as_str(), place))
            .collect();
        let (befores, afters) = self.outputs.iter().copied().unzip();
        let mut free = used(self.after, afters);
        let mut pairs = Vec::new();
        let mut edges = Vec::new();
        for (place, is_used) in used(self.before, befores).into_iter().enumerate() {
            if !is_used {
                continue;
            }
            match written(&before[place].name) {
                Some(name) => {
                    if let Some(&other) = known.get(name.as_str()) {
                        free[other] = false;
                        pairs.push((place, other));
                    }
                }
                None => edges.push(place),
            }
        }
        let free: Vec<usize> = (0..free.len()).filter(|&place| free[place]).collect();
        pairs.extend(edges.iter().copied().zip(free.iter().copied()));
        pairs
    }
}

fn register(place: usize) -> Variable {
    Variable::Register(u32::try_from(place).expect("fewer than 2^32 registers"))
}

/// For each register, whether one of `outputs` depends on it, now or in a later step.
fn used(circuit: &Circuit, outputs: Vec<usize>) -> Vec<bool> {
    let outputs = outputs.into_iter();
    let mut roots: Vec<Expression> = outputs.map(|place| circuit.outputs()[place].value).collect();
    let mut used = vec![false; circuit.registers().len()];
    while !roots.is_empty() {
        let reached = circuit.graph().reached(&roots);
        roots.clear();
        for (operation, is_reached) in circuit.graph().operations().iter().zip(reached) {
            if let (Operation::Variable(Variable::Register(place)), true) = (*operation, is_reached)
                && !std::mem::replace(&mut used[place as usize], true)
            {
                roots.push(circuit.registers()[place as usize].next);
            }
        }
    }
    used
}
