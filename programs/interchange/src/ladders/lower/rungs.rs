//! Rungs from expressions: what is used more than once becomes a memory bit, and assignments that read each other's old values
//! stand in an order in which they still find them, or are held until all are known.

use std::collections::{HashMap, HashSet};

use understudy_ladder::{
    Block, BlockKind, Coil, CoilKind, Comparison, Contact, ContactKind, Element, Feed,
    MAXIMUM_RUNGS, Name, Program, Rung, Series, Signal, from_circuit, visit,
};
use understudy_logic::{CircuitBuilder, Expression, Graph, Operation, Variable};

use super::super::bounds::Interval;
use super::super::program::{Cell, Resolved, Role};
use super::{Leaf, signals};

/// One network with the coil that takes its power: a wire cannot be off, so a constant 0 is a wire to a negated coil.
struct Network {
    series: Series,
    coil: CoilKind,
}

pub(super) struct Rungs<'a> {
    cells: &'a [Cell],
    intervals: &'a [Interval],
    rungs: Vec<Rung>,
    /// For the next rung.
    comments: Vec<String>,
    /// Bits that only hold something within a scan.
    helpers: Vec<String>,
    /// All names of signals and blocks.
    taken: HashSet<String>,
    written: HashSet<String>,
    /// Read above the rung that writes them.
    states: HashSet<String>,
}

impl<'a> Rungs<'a> {
    pub(super) fn new(resolved: &'a Resolved, intervals: &'a [Interval]) -> Self {
        let cells = resolved.cells.iter().zip(intervals);
        let bits = cells.flat_map(|(cell, interval)| signals(cell, *interval));
        Self {
            cells: &resolved.cells,
            intervals,
            rungs: Vec::new(),
            comments: Vec::new(),
            helpers: Vec::new(),
            taken: bits.chain(resolved.names.iter().cloned()).collect(),
            written: HashSet::new(),
            states: HashSet::new(),
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.rungs.len() >= MAXIMUM_RUNGS
    }

    pub(super) fn comment(&mut self, comments: &[String]) {
        self.comments.extend(comments.iter().cloned());
    }

    fn helper(&mut self) -> String {
        let mut count = self.helpers.len() + 1;
        loop {
            let name = format!("shared_{count}");
            if self.taken.insert(name.clone()) {
                self.helpers.push(name.clone());
                return name;
            }
            count += 1;
        }
    }

    fn push(&mut self, network: Series, coils: Vec<Coil>) {
        visit(&network, &mut |element| {
            if let Element::Contact(contact) = element
                && !self.written.contains(contact.operand.as_str())
            {
                self.states.insert(contact.operand.to_string());
            }
        });
        for coil in &coils {
            let target = coil.target.to_string();
            if coil.kind.is_latch() && !self.written.contains(&target) {
                self.states.insert(target.clone());
            }
            self.written.insert(target);
        }
        self.rungs.push(Rung {
            network,
            coils,
            comments: std::mem::take(&mut self.comments),
            ..Rung::default()
        });
    }

    /// Gives each name its expression, all at the same moment.
    pub(super) fn assign(
        &mut self,
        graph: &mut Graph,
        leaves: &[Leaf],
        targets: Vec<(String, Expression)>,
    ) {
        let own = |graph: &mut Graph, name: &str| {
            let is_own = |leaf: &Leaf| matches!(leaf, Leaf::Signal(signal) if signal == name);
            let place = u32::try_from(leaves.iter().position(is_own)?).ok()?;
            Some(graph.variable(Variable::Input(place)))
        };
        let mut wanted = Vec::new();
        for (name, value) in targets {
            let own = own(graph, &name);
            if own == Some(value) {
                continue;
            }
            let (root, kind) = match (own, graph.operation(value)) {
                (Some(own), Operation::Or(left, right)) if left == own => (right, CoilKind::Set),
                (Some(own), Operation::Or(left, right)) if right == own => (left, CoilKind::Set),
                (Some(own), Operation::And(left, right)) if left == own => {
                    (graph.not(right), CoilKind::Reset)
                }
                (Some(own), Operation::And(left, right)) if right == own => {
                    (graph.not(left), CoilKind::Reset)
                }
                _ => (value, CoilKind::Plain),
            };
            wanted.push((name, root, kind));
        }
        if wanted.is_empty() {
            return;
        }
        let roots: Vec<Expression> = wanted.iter().map(|(_, root, _)| *root).collect();
        let networks = self.networks(graph, leaves, &roots);
        let mut pending = Vec::new();
        for ((name, _, kind), network) in wanted.into_iter().zip(networks) {
            let kind = match kind {
                CoilKind::Plain => network.coil,
                kind => kind,
            };
            pending.push((name, kind, network.series));
        }
        self.ordered(pending);
    }

    /// Rungs in an order in which each reads the old values of the others; in a circle one is held.
    fn ordered(&mut self, pending: Vec<(String, CoilKind, Series)>) {
        let place_of: HashMap<String, usize> =
            pending.iter().enumerate().map(|(place, (name, ..))| (name.clone(), place)).collect();
        let reads: Vec<HashSet<usize>> = pending
            .iter()
            .enumerate()
            .map(|(place, (_, _, series))| {
                let mut read = HashSet::new();
                visit(series, &mut |element| {
                    if let Element::Contact(contact) = element {
                        read.extend(
                            place_of.get(contact.operand.as_str()).filter(|other| **other != place),
                        );
                    }
                });
                read
            })
            .collect();
        let mut readers = vec![0_usize; pending.len()];
        reads.iter().flatten().for_each(|read| readers[*read] += 1);
        let mut free: Vec<usize> =
            (0..pending.len()).rev().filter(|place| readers[*place] == 0).collect();
        let mut contents: Vec<Option<(String, CoilKind, Series)>> =
            pending.into_iter().map(Some).collect();
        let mut late = Vec::new();
        let mut next_waiting = 0;
        loop {
            let (place, is_held) = match free.pop() {
                Some(place) => (place, false),
                None => {
                    while contents.get(next_waiting).is_some_and(Option::is_none) {
                        next_waiting += 1;
                    }
                    if next_waiting == contents.len() {
                        break;
                    }
                    (next_waiting, true)
                }
            };
            let Some((name, kind, series)) = contents[place].take() else {
                continue;
            };
            if is_held {
                let held = self.helper();
                self.push(series, vec![coil(CoilKind::Plain, &held)]);
                late.push((held, kind, name));
            } else {
                self.push(series, vec![coil(kind, &name)]);
            }
            for &read in &reads[place] {
                readers[read] -= 1;
                if readers[read] == 0 && contents[read].is_some() {
                    free.push(read);
                }
            }
        }
        for (held, kind, name) in late {
            self.push(vec![contact(&held)], vec![coil(kind, &name)]);
        }
    }

    /// A rung that ends in a block.
    pub(super) fn block(
        &mut self,
        graph: &Graph,
        leaves: &[Leaf],
        name: &str,
        kind: BlockKind,
        wire: Expression,
        feeds: &[(&'static str, Expression)],
    ) {
        let mut roots = vec![wire];
        roots.extend(feeds.iter().map(|(_, root)| *root));
        let mut networks = self.networks(graph, leaves, &roots).into_iter();
        let mut series = networks.next().map(|network| self.passing(network)).unwrap_or_default();
        let mut pins = Vec::new();
        for ((pin, root), network) in feeds.iter().zip(networks) {
            let off = graph.operation(*root) == Operation::Constant(false);
            let needed = kind.side_inputs().iter().any(|(side, required)| side == pin && *required);
            if off && !needed {
                continue;
            }
            let mut network = self.passing(network);
            if network.is_empty() {
                // What feeds an input is at least one contact.
                let on = self.helper();
                self.push(Vec::new(), vec![coil(CoilKind::Plain, &on)]);
                network = vec![contact(&on)];
            }
            pins.push(Feed { pin: Name::from(*pin), network });
        }
        series.push(Element::Block(Block { name: Name::from(name), kind, pins }));
        self.push(series, Vec::new());
        for pin in kind.outputs() {
            self.written.insert(format!("{name}.{pin}"));
        }
    }

    /// A series that passes what the network gives its coil.
    fn passing(&mut self, network: Network) -> Series {
        if network.coil == CoilKind::Plain {
            return network.series;
        }
        let held = self.helper();
        self.push(network.series, vec![coil(network.coil, &held)]);
        vec![contact(&held)]
    }

    /// A network for each root; rungs for what they share come at once.
    fn networks(&mut self, graph: &Graph, leaves: &[Leaf], roots: &[Expression]) -> Vec<Network> {
        let mut builder = CircuitBuilder::new("step");
        let reached = graph.reached(roots);
        let mut inputs: HashMap<u32, Expression> = HashMap::new();
        let mut read = Vec::new();
        for (operation, reached) in graph.operations().iter().zip(reached) {
            if let (Operation::Variable(Variable::Input(place)), true) = (*operation, reached) {
                let value = builder.input(format!("i{place}"));
                inputs.insert(place, value);
                read.push(&leaves[place as usize]);
            }
        }
        let roots = builder.graph().import(graph, roots, |_, variable| match variable {
            Variable::Input(place) | Variable::Register(place) => inputs[&place],
        });
        for (place, root) in roots.iter().enumerate() {
            builder.output(format!("o{place}"), *root);
        }
        let circuit = builder.finish().expect("names are numbered");
        let program = from_circuit(&circuit);
        let mut meanings: HashMap<String, Leaf> = HashMap::new();
        for (input, leaf) in program.inputs.iter().zip(read) {
            meanings.insert(input.name.to_string(), leaf.clone());
        }
        for helper in &program.memory {
            let name = self.helper();
            meanings.insert(helper.name.to_string(), Leaf::Signal(name));
        }
        let outputs: HashMap<String, usize> = program
            .outputs
            .iter()
            .enumerate()
            .map(|(place, output)| (output.name.to_string(), place))
            .collect();
        let mut networks: Vec<Option<Network>> = Vec::new();
        networks.resize_with(roots.len(), || None);
        for mut rung in program.rungs {
            rename(&mut rung.network, &meanings);
            for written in &rung.coils {
                match (outputs.get(written.target.as_str()), meanings.get(written.target.as_str()))
                {
                    (Some(place), _) => {
                        networks[*place] =
                            Some(Network { series: rung.network.clone(), coil: written.kind });
                    }
                    (None, Some(Leaf::Signal(name))) => {
                        let name = name.clone();
                        self.push(rung.network.clone(), vec![coil(written.kind, &name)]);
                    }
                    (None, _) => {}
                }
            }
        }
        networks.into_iter().map(|network| network.expect("every output has its rung")).collect()
    }

    /// Everything as a program.
    pub(super) fn finish(self, name: &Name) -> Program {
        let mut program = Program {
            name: name.clone(),
            rungs: self.rungs,
            footer: self.comments,
            ..Program::default()
        };
        for (cell, interval) in self.cells.iter().zip(self.intervals) {
            if cell.role == Role::Pin {
                continue;
            }
            for (place, name) in signals(cell, *interval).into_iter().enumerate() {
                let is_state = self.states.contains(&name) && self.written.contains(&name);
                let initial = cell.initial >> place.min(63) & 1 == 1;
                let shows = cell.is_given || is_state || initial;
                let signal = Signal {
                    initial: (shows && cell.role != Role::Input).then_some(initial),
                    address: cell.address.clone(),
                    description: cell.description.clone(),
                    ..Signal::new(name)
                };
                match cell.role {
                    Role::Input => program.inputs.push(signal),
                    Role::Output => program.outputs.push(signal),
                    Role::Memory | Role::Pin | Role::Held | Role::Passing => {
                        program.memory.push(signal)
                    }
                }
            }
        }
        program.memory.extend(self.helpers.iter().map(|helper| Signal::new(helper.as_str())));
        program
    }
}

fn coil(kind: CoilKind, target: &str) -> Coil {
    Coil { kind, target: Name::from(target) }
}

fn contact(operand: &str) -> Element {
    Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand: Name::from(operand) })
}

/// Puts what the contacts mean in their place.
fn rename(series: &mut Series, meanings: &HashMap<String, Leaf>) {
    for element in series {
        match element {
            Element::Contact(contact) => match meanings.get(contact.operand.as_str()) {
                Some(Leaf::Signal(name)) => contact.operand = Name::from(name.as_str()),
                Some(Leaf::Counter(counter, relation, value)) => {
                    let closed = contact.kind == ContactKind::NormallyClosed;
                    *element = Element::Comparison(Comparison {
                        counter: Name::from(counter.as_str()),
                        relation: if closed { relation.opposite() } else { *relation },
                        value: *value,
                    });
                }
                None => {}
            },
            Element::Branches(branches) => {
                branches.iter_mut().for_each(|branch| rename(branch, meanings))
            }
            Element::Comparison(_) | Element::Block(_) => {}
        }
    }
}
