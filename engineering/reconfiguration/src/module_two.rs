//! Module 2: the rungs below the ladder that take over while channels are failed, section 6.
//!
//! Module 1, the ladder itself, stays as it is and goes on computing. Module 2 is transparent as long as the ladder's own
//! outputs are right; then it only knows from the scan's signals in which state of S the ladder is (`x`). When a
//! channel that matters fails, it latches a state of Θ, follows Θ from there, and writes that state's command over the
//! outputs. It gives back when Θ is down to one state, no unseen event is possible in it, and the ladder is in that state.
//!
//! ```text
//! x.N        the ladder is in state N of S                    written in every scan, before it is read
//! u.K        Θ is in state K; at most one is on, and held with it
//! moved      something was followed in this phase: one phase for each channel, one for what is seen
//! lost       the plant did what the model does not know: outputs off until the operator releases
//! C.failed   input: channel C is failed, and C keeps its last good value
//! C.was      C.failed of the scan before
//! release    input: the operator says that plant and ladder agree
//! ```
//!
//! A scan makes at most one transition in each phase, because `moved` closes the phase behind the first. So no transition runs
//! through to the next: there is no avalanche.

mod phases;

use std::collections::{BTreeMap, BTreeSet, HashSet};

use understudy_ladder::{Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Signal};

use crate::controller::Controller;
use crate::mega::{MegaController, Question, failed_channels};
use crate::signals::Bits;

/// A combined ladder would have more rungs than this.
pub const MAXIMUM_RUNGS: usize = 60_000;

/// Meaning of the bits, for the proof.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Correspondence {
    /// The bit of each latched state of Θ.
    pub latches: Vec<(Name, usize)>,
    /// The bit of each state of S that can be told from the signals.
    pub at: Vec<(Name, usize)>,
    /// Outside of the model.
    pub lost: Name,
    /// The status input of each channel of the question.
    pub failed: Vec<Name>,
    /// The operator's input.
    pub release: Name,
}

/// Module 1 with module 2 below it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Combined {
    /// The whole.
    pub program: Program,
    /// The first rung of module 2.
    pub first_rung: usize,
    /// Which bit means what.
    pub correspondence: Correspondence,
}

/// Puts module 2 below `module_one`. `lost_outputs` are commanded outside of the model.
///
/// # Errors
/// The number of rungs, where it is more than [`MAXIMUM_RUNGS`].
pub fn combine(
    module_one: &Program,
    controller: &Controller,
    mega: &MegaController,
    question: &Question,
    lost_outputs: &Bits,
) -> Result<Combined, usize> {
    let mut writer = Writer::new(module_one, controller, mega, question);
    let edges: usize = writer.latched.keys().map(|&place| mega.edges[place].len()).sum();
    if edges > MAXIMUM_RUNGS {
        return Err(edges);
    }
    let first_rung = writer.program.rungs.len();
    writer.see();
    for bit in 0..question.channels.len() {
        writer.channel(bit);
    }
    writer.follow();
    writer.give_back();
    writer.enter();
    writer.command(lost_outputs);
    let rungs = writer.program.rungs.len();
    if rungs > MAXIMUM_RUNGS {
        return Err(rungs);
    }
    let Writer { program, names, latched, at, .. } = writer;
    Ok(Combined {
        program,
        first_rung,
        correspondence: Correspondence {
            latches: latched.into_iter().map(|(place, name)| (name, place)).collect(),
            at: at.into_iter().map(|(state, name)| (name, state)).collect(),
            lost: names.lost,
            failed: names.failed,
            release: names.release,
        },
    })
}

struct Names {
    moved: Name,
    held: Name,
    lost: Name,
    fresh: Name,
    known: Name,
    release: Name,
    failed: Vec<Name>,
    was: Vec<Name>,
}

struct Writer<'a> {
    controller: &'a Controller,
    mega: &'a MegaController,
    question: &'a Question,
    program: Program,
    names: Names,
    latched: BTreeMap<usize, Name>,
    at: BTreeMap<usize, Name>,
}

fn contact(name: &str, value: bool) -> Element {
    Element::Contact(Contact {
        kind: if value { ContactKind::NormallyOpen } else { ContactKind::NormallyClosed },
        operand: Name::from(name),
    })
}

fn on(name: &Name) -> Element {
    contact(name, true)
}

fn off(name: &Name) -> Element {
    contact(name, false)
}

/// Passes when one of `branches` does; nothing where there is none.
fn any(mut branches: Vec<Vec<Element>>) -> Option<Vec<Element>> {
    match branches.len() {
        0 => None,
        1 => branches.pop(),
        _ => Some(vec![Element::Branches(branches)]),
    }
}

fn coil(kind: CoilKind, target: &Name) -> Coil {
    Coil { kind, target: target.clone() }
}

impl<'a> Writer<'a> {
    fn new(
        module_one: &Program,
        controller: &'a Controller,
        mega: &'a MegaController,
        question: &'a Question,
    ) -> Self {
        let mut taken: HashSet<String> = module_one
            .inputs
            .iter()
            .chain(module_one.writable())
            .map(|signal| signal.name.to_string())
            .chain(module_one.blocks().iter().map(|block| block.name.to_string()))
            .collect();
        let mut fresh = |wanted: String| {
            let mut name = wanted.clone();
            let mut number = 2_usize;
            while !taken.insert(name.clone()) {
                name = format!("{wanted}_{number}");
                number += 1;
            }
            Name::from(name)
        };
        let channel = |bit: usize| &controller.signals.inputs[question.channels[bit]];
        let bits = 0..question.channels.len();
        let failed = bits.clone().map(|bit| fresh(format!("{}.failed", channel(bit)))).collect();
        let was = bits.map(|bit| fresh(format!("{}.was", channel(bit)))).collect();
        let names = Names {
            failed,
            was,
            moved: fresh("module_2.moved".into()),
            held: fresh("module_2.held".into()),
            lost: fresh("module_2.lost".into()),
            fresh: fresh("module_2.fresh".into()),
            known: fresh("module_2.known".into()),
            release: fresh("module_2.release".into()),
        };
        let latched = latched(mega);
        let latched = latched.into_iter().map(|place| (place, fresh(format!("u.{place}"))));
        let latched: BTreeMap<usize, Name> = latched.collect();
        let at = decodable(controller)
            .into_iter()
            .map(|state| (state, fresh(format!("x.{}", Controller::number(state)))))
            .collect();
        let mut writer =
            Self { controller, mega, question, program: module_one.clone(), names, latched, at };
        writer.declare();
        writer
    }

    fn declare(&mut self) {
        let input = |name: &Name, description: String| Signal {
            description: Some(description),
            ..Signal::new(name.clone())
        };
        let memory = |name: &Name, description: String| Signal {
            initial: Some(false),
            ..input(name, description)
        };
        for (bit, name) in self.names.failed.iter().enumerate() {
            let channel = &self.controller.signals.inputs[self.question.channels[bit]];
            let text = format!("channel {channel} has failed; its last good value is held");
            self.program.inputs.push(input(name, text));
        }
        let text = "operator: plant and ladder agree".to_owned();
        self.program.inputs.push(input(&self.names.release, text));
        let names = &self.names;
        let mut declared = vec![
            memory(&names.moved, "state changed in this phase".into()),
            memory(&names.held, "module 2 sets the outputs".into()),
            memory(&names.lost, "outside of the model".into()),
            memory(&names.fresh, "a channel has failed in this scan".into()),
            memory(&names.known, "the ladder is in a state of the model".into()),
        ];
        for (bit, name) in names.was.iter().enumerate() {
            declared.push(memory(name, format!("{} in the previous scan", names.failed[bit])));
        }
        for (&state, name) in &self.at {
            declared.push(memory(name, self.controller.state_name(state)));
        }
        for (&place, name) in &self.latched {
            declared.push(memory(name, self.describe(place)));
        }
        self.program.memory.extend(declared);
    }

    /// `1 2 3, failed: Ready`.
    fn describe(&self, place: usize) -> String {
        let state = &self.mega.states[place];
        let members: Vec<String> = state
            .members
            .iter()
            .take(12)
            .map(|&member| Controller::number(member as usize).to_string())
            .collect();
        let more = if state.members.len() > 12 { " ..." } else { "" };
        let failed: Vec<&str> = failed_channels(&self.question.channels, state.failed)
            .map(|input| self.controller.signals.inputs[input].as_str())
            .collect();
        match failed.as_slice() {
            [] => format!("{}{more}", members.join(" ")),
            failed => format!("{}{more}, failed: {}", members.join(" "), failed.join(" ")),
        }
    }

    /// In which state of S the ladder is, and whether a channel has just failed.
    fn see(&mut self) {
        let inputs = &self.controller.signals.inputs;
        let outputs = &self.controller.signals.outputs;
        let mut rungs = Vec::new();
        for (&state, name) in &self.at {
            let found = &self.controller.states()[state];
            let vector = inputs.iter().zip(&found.inputs.0);
            let vector = vector.chain(outputs.iter().zip(&found.outputs.0));
            let mut network: Vec<Element> =
                vector.map(|(name, &value)| contact(name, value)).collect();
            let memories: Vec<Vec<Element>> = found
                .memory
                .iter()
                .map(|bits| {
                    let pairs = self.controller.memory.iter().zip(&bits.0);
                    pairs.map(|(name, &value)| contact(name, value)).collect()
                })
                .collect();
            if !self.controller.memory.is_empty() {
                network.extend(any(memories).unwrap_or_default());
            }
            rungs.push((network, name.clone()));
        }
        for (network, name) in rungs {
            self.program.push_rung(network, vec![coil(CoilKind::Plain, &name)]);
        }
        let states = self.at.values().map(|name| vec![on(name)]).collect();
        if let Some(network) = any(states) {
            let known = coil(CoilKind::Plain, &self.names.known);
            self.program.push_titled(
                "module 2: the ladder is in a state of the model",
                network,
                vec![known],
            );
        }
        let pairs = self.names.failed.iter().zip(&self.names.was);
        let newly = pairs.map(|(failed, was)| vec![on(failed), off(was)]).collect();
        if let Some(network) = any(newly) {
            let fresh = coil(CoilKind::Plain, &self.names.fresh);
            self.program.push_titled(
                "module 2: a channel has failed in this scan",
                network,
                vec![fresh],
            );
        }
    }
}

/// The states of Θ with a command, and all that follow them: until the ladder agrees, these are followed too.
fn latched(mega: &MegaController) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let commands = mega.states.iter().enumerate();
    let mut stack: Vec<usize> =
        commands.filter(|(_, state)| state.command.is_some()).map(|(place, _)| place).collect();
    while let Some(place) = stack.pop() {
        if found.insert(place) {
            stack.extend(mega.edges[place].iter().map(|(_, target)| *target));
        }
    }
    found
}

/// The states that the signals of a scan tell from all others.
fn decodable(controller: &Controller) -> Vec<usize> {
    let mut by_vector: BTreeMap<(&Bits, &Bits), Vec<usize>> = BTreeMap::new();
    for (place, state) in controller.states().iter().enumerate() {
        by_vector.entry((&state.inputs, &state.outputs)).or_default().push(place);
    }
    let mut found = Vec::new();
    for siblings in by_vector.values() {
        for &state in siblings {
            let memory = &controller.states()[state].memory;
            let is_apart = |&other: &usize| {
                let theirs = &controller.states()[other].memory;
                !memory.is_empty() && !theirs.iter().any(|bits| memory.contains(bits))
            };
            let mut others = siblings.iter().copied().filter(|&other| other != state);
            if others.all(|other| is_apart(&other)) {
                found.push(state);
            }
        }
    }
    found.sort_unstable();
    found
}

/// The sets of one to `most` of `channels` channels, as bits.
fn patterns(channels: usize, most: usize) -> Vec<u64> {
    (1..=most.min(channels)).flat_map(|count| exactly(channels, count)).collect()
}

/// The sets of `count` of `channels` channels, as bits.
fn exactly(channels: usize, count: usize) -> Vec<u64> {
    fn extend(channels: usize, count: usize, from: usize, set: u64, found: &mut Vec<u64>) {
        if count == 0 {
            found.push(set);
            return;
        }
        for bit in from..channels {
            extend(channels, count - 1, bit + 1, set | 1 << bit, found);
        }
    }
    let mut found = Vec::new();
    if count <= channels {
        extend(channels, count, 0, 0, &mut found);
    }
    found
}
