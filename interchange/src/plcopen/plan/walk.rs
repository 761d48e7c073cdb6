//! One walk over a graph, from what acts back to the rails, without recursion.

use std::collections::{HashMap, HashSet};

use understudy_diagnostic::Diagnostic;
use understudy_ladder::Name;

use super::links::{Links, Source};
use super::{Action, Call, Input, Plan, Step};
use crate::plcopen::document::{CONDITION, Condition, Graph, Kind, Modifier, Object, Pin};
use crate::plcopen::power::{Power, Read};
use crate::plcopen::sequence::wired;
use crate::plcopen::standard::StandardBlock;

/// Power that is used more than once and has more readings is kept.
const MAXIMUM_SHARED: usize = 40;

/// Power with more readings, or deeper, is kept in any case.
const MAXIMUM_SIZE: usize = 400;
const MAXIMUM_DEPTH: usize = 24;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    New,
    Open,
    Done,
}

/// When each object was asked for.
pub(super) struct Trace {
    /// In the order in which everything that feeds them was there.
    pub(super) finished: Vec<usize>,
    /// By object: the number of the step before which it was asked for first.
    pub(super) first: Vec<usize>,
    /// By object: its own step, where it has one.
    pub(super) step: Vec<Option<usize>>,
}

pub(super) struct Walk<'a> {
    graph: &'a Graph,
    links: &'a Links,
    /// Objects whose power is kept.
    keep: &'a HashSet<usize>,
    states: Vec<State>,
    /// What each object lets through; for a block, of which there are several outputs, unused.
    powers: Vec<Option<Power>>,
    /// The guard of a function with EN.
    guards: HashMap<usize, Power>,
    plan: Plan,
    trace: Trace,
    /// The sources of the last step, if it is one of coils.
    last_coils: Option<Vec<Source>>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(graph: &'a Graph, links: &'a Links, keep: &'a HashSet<usize>) -> Self {
        Self {
            graph,
            links,
            keep,
            states: vec![State::New; graph.objects.len()],
            powers: vec![None; graph.objects.len()],
            guards: HashMap::new(),
            plan: Plan::default(),
            trace: Trace {
                finished: Vec::new(),
                first: vec![0; graph.objects.len()],
                step: vec![None; graph.objects.len()],
            },
            last_coils: None,
        }
    }

    pub(super) fn run(mut self, diagnostics: &mut Vec<Diagnostic>) -> (Plan, Trace) {
        let objects = &self.graph.objects;
        let mut acting: Vec<usize> = (0..objects.len())
            .filter(|&place| self.acts(place))
            .collect();
        acting.sort_by_key(|&place| {
            let object = &objects[place];
            let order = if object.order == 0 {
                u64::MAX
            } else {
                object.order
            };
            (order, object.position.1, object.position.0)
        });
        for place in acting {
            self.visit(place, diagnostics);
        }
        for (place, object) in objects.iter().enumerate() {
            let what = match &object.kind {
                Kind::Other(what) => {
                    let message = format!("{what} is not taken");
                    diagnostics.push(Diagnostic::error("U1010", message, object.span.clone()));
                    continue;
                }
                Kind::Contact(..) | Kind::InVariable(..) | Kind::Block(_)
                    if self.states[place] == State::New =>
                {
                    "nothing that acts is behind it"
                }
                _ => continue,
            };
            self.plan.notes.push((what.to_owned(), object.span.clone()));
        }
        (self.plan, self.trace)
    }

    /// Coils, written variables, and function blocks act of themselves.
    fn acts(&self, place: usize) -> bool {
        match &self.graph.objects[place].kind {
            Kind::Coil(..) | Kind::OutVariable(..) => true,
            Kind::InOutVariable(..) => !self.graph.objects[place].inputs.is_empty(),
            Kind::Block(_) => self.links.is_block[place],
            Kind::Transition(transition) => matches!(transition.condition, Condition::Wired),
            _ => false,
        }
    }

    /// Finishes an object after everything that feeds it.
    fn visit(&mut self, root: usize, diagnostics: &mut Vec<Diagnostic>) {
        if self.states[root] == State::Done {
            return;
        }
        let mut open: Vec<(usize, Vec<usize>)> = vec![self.enter(root)];
        while let Some((place, waiting)) = open.last_mut() {
            let place = *place;
            let Some(next) = waiting.pop() else {
                open.pop();
                self.trace.first[place] = self.plan.steps.len();
                self.trace.finished.push(place);
                self.finish(place, diagnostics);
                self.states[place] = State::Done;
                continue;
            };
            match self.states[next] {
                State::Done => {}
                State::New => {
                    let entered = self.enter(next);
                    open.push(entered);
                }
                State::Open if self.links.is_block[next] => {
                    let message = "its output goes back to its own inputs: they see what it was in the last scan";
                    let span = self.graph.objects[next].span.clone();
                    self.plan.notes.push((message.to_owned(), span));
                }
                State::Open => {
                    let ring: Vec<usize> = open.iter().map(|(place, _)| *place).collect();
                    diagnostics.push(self.cycle(next, place, &ring));
                    self.powers[next].get_or_insert(Power::Constant(false));
                }
            }
        }
    }

    fn enter(&mut self, place: usize) -> (usize, Vec<usize>) {
        self.states[place] = State::Open;
        let mut feeding: Vec<usize> = Vec::new();
        for source in self.links.sources[place].iter().flatten() {
            if let Source::Output(from, _) = source {
                feeding.push(*from);
            }
        }
        // They are taken from the end.
        feeding.reverse();
        (place, feeding)
    }

    fn cycle(&self, first: usize, last: usize, open: &[usize]) -> Diagnostic {
        let start = open.iter().position(|place| *place == first).unwrap_or(0);
        let ring: Vec<String> = open[start..]
            .iter()
            .rev()
            .take(8)
            .map(|place| self.graph.objects[*place].id.to_string())
            .collect();
        let more = if open.len() - start > 8 { ", …" } else { "" };
        let message = format!(
            "the connections of objects {}{more} go round in a circle",
            ring.join(", ")
        );
        let objects = &self.graph.objects;
        Diagnostic::error("U1006", message, objects[last].span.clone())
            .with_related(objects[first].span.clone(), "which feeds this, and so itself")
            .with_help("power flows from the left rail to the right; a value of the last scan goes through a variable")
    }

    fn object(&self, place: usize) -> &'a Object {
        &self.graph.objects[place]
    }

    /// The power at an input.
    fn power(&self, place: usize, input: usize) -> Power {
        let sources = self.links.sources[place].get(input);
        let branches = sources.into_iter().flatten();
        Power::any(branches.map(|source| self.source(source)).collect())
    }

    fn source(&self, source: &Source) -> Power {
        match source {
            Source::Rail => Power::Constant(true),
            Source::Output(from, pin) => self.output(*from, pin.as_ref()),
        }
    }

    fn output(&self, place: usize, pin: Option<&Name>) -> Power {
        let object = self.object(place);
        let Kind::Block(block) = &object.kind else {
            return self.powers[place].clone().unwrap_or(Power::Constant(false));
        };
        let pin = pin.cloned().or_else(|| {
            let first = object
                .outputs
                .iter()
                .find(|pin| !pin.name.eq_ignore_ascii_case("ENO"));
            first.map(|pin| pin.name.clone())
        });
        let declared = object.outputs.iter().find(|output| {
            pin.as_ref()
                .is_some_and(|pin| output.name.eq_ignore_ascii_case(pin))
        });
        let modifier = declared.map(|output| output.modifier).unwrap_or_default();
        let power = if pin
            .as_ref()
            .is_some_and(|pin| pin.eq_ignore_ascii_case("ENO"))
        {
            self.enable(place).unwrap_or(Power::Constant(true))
        } else if self.links.is_block[place] {
            let instance = instance(object);
            let standard = StandardBlock::of(&block.type_name);
            let pin = match (standard, pin) {
                (Some(standard), Some(pin)) => {
                    let name = standard.output(&pin).unwrap_or(pin.as_str()).to_owned();
                    Name::at(name, pin.span())
                }
                (Some(standard), None) => Name::at(standard.wire_output(), object.span.clone()),
                (None, pin) => pin.unwrap_or_default(),
            };
            Power::Output(instance, pin)
        } else {
            self.powers[place].clone().unwrap_or(Power::Constant(false))
        };
        if modifier.negated { power.not() } else { power }
    }

    /// The power at EN, where it is connected.
    fn enable(&self, place: usize) -> Option<Power> {
        let object = self.object(place);
        let input = object
            .inputs
            .iter()
            .position(|pin| pin.name.eq_ignore_ascii_case("EN") && !pin.wires.is_empty())?;
        let power = self.power(place, input);
        let power = if object.inputs[input].modifier.negated {
            power.not()
        } else {
            power
        };
        (power != Power::Constant(true)).then_some(power)
    }

    fn finish(&mut self, place: usize, diagnostics: &mut Vec<Diagnostic>) {
        let object = self.object(place);
        match &object.kind {
            Kind::Contact(variable, modifier) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
                    unconnected(object, "the contact", diagnostics);
                }
                let own = read(variable, *modifier, place);
                let power = self.power(place, 0).and(own);
                self.pass(place, power);
            }
            Kind::InVariable(expression, modifier) => {
                self.named(expression, object, diagnostics);
                let power = read(expression, *modifier, place);
                self.pass(place, power);
            }
            Kind::Coil(variable, modifier) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
                    unconnected(object, "the coil", diagnostics);
                    return;
                }
                self.coil(place, variable, *modifier);
            }
            Kind::OutVariable(variable, modifier) => {
                self.named(variable, object, diagnostics);
                self.written(place, variable, *modifier, diagnostics);
            }
            Kind::InOutVariable(variable, to, from) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().any(|pin| !pin.wires.is_empty()) {
                    self.written(place, variable, *to, diagnostics);
                }
                let power = read(variable, *from, place);
                self.pass(place, power);
            }
            Kind::Transition(_) => {
                let input = object
                    .inputs
                    .iter()
                    .position(|pin| pin.name.as_str() == CONDITION);
                let power = self.power(place, input.unwrap_or(0));
                let target = Name::at(wired(object), object.span.clone());
                let targets = vec![(target, Modifier::default())];
                self.step(
                    place,
                    Action::Write {
                        targets,
                        power,
                        guard: None,
                    },
                );
            }
            Kind::Block(_) if self.links.is_block[place] => self.call(place),
            Kind::Block(_) => self.function(place),
            _ => {}
        }
    }

    fn named(&self, variable: &Name, object: &Object, diagnostics: &mut Vec<Diagnostic>) {
        if variable.is_empty() {
            let message = format!("object {} names no variable", object.id);
            diagnostics.push(Diagnostic::error("U1002", message, object.span.clone()));
        }
    }

    /// Remembers what an object lets through, or keeps it in a step of its own.
    fn pass(&mut self, place: usize, power: Power) {
        let (size, depth) = power.measure();
        let shared = self.links.fan_out[place] > 1 && size > MAXIMUM_SHARED;
        let large = size > MAXIMUM_SIZE || depth > MAXIMUM_DEPTH;
        let guard = self.guards.get(&place).cloned();
        if guard.is_none() && !shared && !large && !self.keep.contains(&place) {
            self.powers[place] = Some(power);
            return;
        }
        self.powers[place] = Some(Power::Kept(place));
        self.step(
            place,
            Action::Keep {
                object: place,
                power,
                guard,
            },
        );
    }

    fn step(&mut self, place: usize, action: Action) {
        self.last_coils = None;
        self.trace.step[place] = Some(self.plan.steps.len());
        self.plan.steps.push(Step {
            comments: Vec::new(),
            span: self.object(place).span.clone(),
            action,
        });
    }

    /// Coils that follow each other on the same wires are one step.
    fn coil(&mut self, place: usize, variable: &Name, modifier: Modifier) {
        let sources = self.links.sources[place]
            .first()
            .cloned()
            .unwrap_or_default();
        if self.last_coils.as_ref() == Some(&sources)
            && let Some(step) = self.plan.steps.last_mut()
            && let Action::Write { targets, .. } = &mut step.action
        {
            targets.push((variable.clone(), modifier));
            self.trace.step[place] = Some(self.plan.steps.len() - 1);
            return;
        }
        let power = self.power(place, 0);
        let targets = vec![(variable.clone(), modifier)];
        self.step(
            place,
            Action::Write {
                targets,
                power,
                guard: None,
            },
        );
        self.last_coils = Some(sources);
    }

    fn written(
        &mut self,
        place: usize,
        variable: &Name,
        modifier: Modifier,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let object = self.object(place);
        if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
            unconnected(object, "the variable", diagnostics);
            return;
        }
        let sources = self.links.sources[place]
            .first()
            .cloned()
            .unwrap_or_default();
        let guard = match sources.as_slice() {
            [Source::Output(from, _)] => self.guards.get(from).cloned(),
            _ => None,
        };
        let power = self.power(place, 0);
        let targets = vec![(variable.clone(), modifier)];
        self.step(
            place,
            Action::Write {
                targets,
                power,
                guard,
            },
        );
    }

    fn inputs(&self, place: usize) -> Vec<Input> {
        let object = self.object(place);
        let connected = |pin: &Pin| !pin.wires.is_empty() && !pin.name.eq_ignore_ascii_case("EN");
        let pins = object.inputs.iter().enumerate();
        pins.filter(|(_, pin)| connected(pin))
            .map(|(input, pin)| Input {
                pin: pin.name.clone(),
                modifier: pin.modifier,
                power: self.power(place, input),
            })
            .collect()
    }

    fn call(&mut self, place: usize) {
        let object = self.object(place);
        let Kind::Block(block) = &object.kind else {
            return;
        };
        let call = Call {
            type_name: block.type_name.clone(),
            instance: instance(object),
            inputs: self.inputs(place),
            enable: self.enable(place),
            in_wire: self.links.fan_out[place] == 1,
        };
        self.step(place, Action::Call(call));
    }

    fn function(&mut self, place: usize) {
        let object = self.object(place);
        let Kind::Block(block) = &object.kind else {
            return;
        };
        let inputs: Vec<(Name, Power)> = self
            .inputs(place)
            .into_iter()
            .map(|input| {
                let power = if input.modifier.negated {
                    input.power.not()
                } else {
                    input.power
                };
                (input.pin, power)
            })
            .collect();
        if let Some(enable) = self.enable(place) {
            self.guards.insert(place, enable);
        }
        self.pass(place, function(&block.type_name, inputs));
    }
}

/// The Boolean functions are power itself; `EQ` and the like stay functions.
fn function(name: &Name, inputs: Vec<(Name, Power)>) -> Power {
    let values = || inputs.iter().map(|(_, power)| power.clone());
    match name.to_ascii_uppercase().as_str() {
        "AND" => values().fold(Power::Constant(true), Power::and),
        "OR" => Power::any(values().collect()),
        "NOT" if inputs.len() == 1 => values().fold(Power::Constant(true), Power::and).not(),
        "MOVE" if inputs.len() == 1 => values().fold(Power::Constant(true), Power::and),
        _ => Power::Function(name.clone(), inputs),
    }
}

fn read(text: &Name, modifier: Modifier, object: usize) -> Power {
    let read = Power::Read(Read {
        text: text.clone(),
        edge: modifier.edge,
        object,
    });
    if modifier.negated { read.not() } else { read }
}

/// The instance of a block, or a name for it where the file gives none.
fn instance(object: &Object) -> Name {
    match &object.kind {
        Kind::Block(block) => block.instance.clone().unwrap_or_else(|| {
            Name::at(
                format!("{}_{}", block.type_name, object.id),
                object.span.clone(),
            )
        }),
        _ => Name::default(),
    }
}

fn unconnected(object: &Object, what: &str, diagnostics: &mut Vec<Diagnostic>) {
    let message = format!("nothing is connected to {what}, object {}", object.id);
    diagnostics.push(Diagnostic::error("U1009", message, object.span.clone()));
}
