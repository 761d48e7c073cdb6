//! One walk over a graph, from what acts back to the rails, without recursion.

mod finish;

use std::collections::{HashMap, HashSet};

use understudy_ladder::{BlockKind, Name};
use understudy_text::Diagnostic;

use super::Plan;
use super::links::{Links, Source, is_eno};
use finish::read;

use crate::plcopen::document::{Condition, Graph, Kind, Language, Object, Pin};
use crate::plcopen::power::Power;
use crate::plcopen::standard;

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
    /// Objects that feed themselves, and EN of blocks that do, which are what they were in the last scan.
    pub(super) fed_back: HashSet<usize>,
}

/// An object whose sources are looked for.
struct Open {
    place: usize,
    /// The object that acts and for which the source is looked for.
    asker: usize,
    waiting: Vec<usize>,
}

pub(super) struct Walk<'a> {
    graph: &'a Graph,
    links: &'a Links,
    /// Objects whose power is kept.
    keep: &'a HashSet<usize>,
    states: Vec<State>,
    /// What each object lets through; for a block, of which there are several outputs, unused.
    powers: Vec<Option<Power>>,
    /// What is at the EN of blocks that have acted.
    enables: HashMap<usize, Power>,
    /// The place of each object in the order of all that act.
    rank: Vec<Option<usize>>,
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
            enables: HashMap::new(),
            rank: vec![None; graph.objects.len()],
            plan: Plan::default(),
            trace: Trace {
                finished: Vec::new(),
                first: vec![0; graph.objects.len()],
                step: vec![None; graph.objects.len()],
                fed_back: HashSet::new(),
            },
            last_coils: None,
        }
    }

    pub(super) fn run(mut self, diagnostics: &mut Vec<Diagnostic>) -> (Plan, Trace) {
        let objects = &self.graph.objects;
        let mut acting: Vec<usize> = (0..objects.len()).filter(|&place| self.acts(place)).collect();
        acting.extend(self.functions_behind(&acting));
        acting.sort_by_cached_key(|&place| {
            let object = &objects[place];
            (self.order(object), object.position.1, object.position.0)
        });
        for (rank, &place) in acting.iter().enumerate() {
            self.rank[place] = Some(rank);
        }
        for place in acting {
            self.visit(place, diagnostics);
        }
        for (place, object) in objects.iter().enumerate() {
            diagnostics.extend(self.left_out(place, object));
        }
        (self.plan, self.trace)
    }

    /// The finding on an object that no step comes from.
    fn left_out(&self, place: usize, object: &Object) -> Option<Diagnostic> {
        let lost = |what: &str| {
            let message = format!("{what} has no effect: no coil and no variable is behind it");
            let found = Diagnostic::warning("U1023", message, object.span.clone());
            Some(found.with_help("connect it to what it drives, or remove it"))
        };
        let foreign = |what: &str| {
            let message = format!("{what} is not supported");
            Some(Diagnostic::error("U1010", message, object.span.clone()))
        };
        match &object.kind {
            Kind::Other(what) => foreign(what),
            Kind::Step(..)
            | Kind::Transition(_)
            | Kind::SelectionDivergence
            | Kind::SelectionConvergence
            | Kind::SimultaneousDivergence
            | Kind::SimultaneousConvergence
            | Kind::JumpStep(_)
            | Kind::Actions(_)
                if self.graph.language != Language::Sequence =>
            {
                foreign("an object of a sequence in another language")
            }
            // The way through a connector is taken by its continuations.
            Kind::Connector(name) => {
                let mut objects = self.graph.objects.iter();
                let is_used = objects.any(
                    |object| matches!(&object.kind, Kind::Continuation(other) if other == name),
                );
                if is_used { None } else { lost(&format!("the connector `{name}`")) }
            }
            Kind::Continuation(name) if self.links.fan_out_of(self.graph, object) == 0 => {
                lost(&format!("the continuation `{name}`"))
            }
            _ if self.states[place] != State::New => None,
            Kind::Contact(variable, _) => lost(&format!("the contact `{variable}`")),
            Kind::InVariable(variable, _) | Kind::InOutVariable(variable, ..) => {
                lost(&format!("`{variable}`"))
            }
            Kind::Block(block) => lost(&format!("the function {}", block.type_name)),
            _ => None,
        }
    }

    /// When an object acts; a label without an order, just before the object below it.
    fn order(&self, object: &Object) -> (u64, bool) {
        if object.order != 0 {
            return (object.order, true);
        }
        let others = self.graph.objects.iter().filter(|other| {
            matches!(object.kind, Kind::Label(_))
                && other.order != 0
                && other.position.1 >= object.position.1
        });
        match others.map(|other| other.order).min() {
            Some(next) => (next, false),
            None => (u64::MAX, true),
        }
    }

    /// The functions that feed something that acts. They have their place in the order too: what they read may be written
    /// between there and where their result is used.
    fn functions_behind(&self, acting: &[usize]) -> Vec<usize> {
        let mut is_behind = vec![false; self.graph.objects.len()];
        let mut waiting = acting.to_vec();
        while let Some(place) = waiting.pop() {
            for source in self.links.sources[place].iter().flatten() {
                if let Source::Output(from, _) = source
                    && !std::mem::replace(&mut is_behind[*from], true)
                {
                    waiting.push(*from);
                }
            }
        }
        let is_function = |&place: &usize| {
            matches!(self.graph.objects[place].kind, Kind::Block(_)) && !self.links.is_block[place]
        };
        let objects = 0..self.graph.objects.len();
        objects.filter(|&place| is_behind[place]).filter(is_function).collect()
    }

    /// Coils, written variables, function blocks and jumps act of themselves.
    fn acts(&self, place: usize) -> bool {
        match &self.graph.objects[place].kind {
            Kind::Coil(..)
            | Kind::OutVariable(..)
            | Kind::Jump(_)
            | Kind::Label(_)
            | Kind::Return => true,
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
        let mut open: Vec<Open> = vec![self.enter(root, root)];
        while let Some(Open { place, asker, waiting }) = open.last_mut() {
            let (place, asker) = (*place, *asker);
            let Some(next) = waiting.pop() else {
                open.pop();
                self.trace.first[place] = self.plan.steps.len();
                self.trace.finished.push(place);
                self.finish(place, diagnostics);
                self.states[place] = State::Done;
                continue;
            };
            let is_later = self.acts_later(next, asker);
            match self.states[next] {
                State::Done => {}
                State::New if is_later && self.links.ring[next] == self.links.ring[asker] => {
                    self.goes_back(next, &open, diagnostics);
                }
                State::New => {
                    if is_later {
                        diagnostics.push(self.out_of_order(next, asker));
                    }
                    let entered = self.enter(next, asker);
                    open.push(entered);
                }
                State::Open => self.goes_back(next, &open, diagnostics),
            }
        }
    }

    /// Whether an object comes behind another one by its executionOrderId.
    fn acts_later(&self, place: usize, asker: usize) -> bool {
        self.object(asker).order != 0
            && self.rank[place].zip(self.rank[asker]).is_some_and(|(place, asker)| place > asker)
    }

    /// The finding on an object that acts before its place, since another one needs its result.
    fn out_of_order(&self, place: usize, asker: usize) -> Diagnostic {
        let (object, asker) = (self.object(place), self.object(asker));
        let order = |object: &Object| match object.order {
            0 => "no executionOrderId".to_owned(),
            order => format!("the executionOrderId {order}"),
        };
        let message = format!(
            "object {} has {}, and feeds object {}, which has {}: it acts before that object here, \
             and other tools use its result of the last scan",
            object.id,
            order(object),
            asker.id,
            order(asker)
        );
        Diagnostic::warning("U1024", message, object.span.clone())
            .with_related(asker.span.clone(), "it feeds this object")
            .with_help("number what feeds an object before the object; a value of the last scan goes through a variable")
    }

    /// An object feeds itself: what is asked of it is what it was in the last scan. Contacts alone have nothing that could keep it.
    fn goes_back(&mut self, next: usize, open: &[Open], diagnostics: &mut Vec<Diagnostic>) {
        let ring = open.iter().rev().map(|open| open.place);
        let ring: Vec<usize> = ring.take_while(|place| *place != next).chain([next]).collect();
        let is_contact = |place: &usize| matches!(self.object(*place).kind, Kind::Contact(..));
        if ring.iter().all(is_contact) {
            diagnostics.push(self.circle(&ring));
            self.powers[next].get_or_insert(Power::Constant(false));
            return;
        }
        if self.links.takes_eno[next] && self.enable_input(next).is_some() {
            self.trace.fed_back.insert(self.links.enable(next));
        }
        if self.links.is_block[next] {
            let message =
                "its output goes back to its own inputs: they see what it was in the last scan";
            let span = self.graph.objects[next].span.clone();
            self.plan.notes.push((message.to_owned(), span));
        } else {
            self.feed_back(next);
        }
    }

    /// The finding on contacts that feed each other, the last one of them first.
    fn circle(&self, ring: &[usize]) -> Diagnostic {
        let ids: Vec<String> =
            ring.iter().take(8).map(|place| self.object(*place).id.to_string()).collect();
        let more = if ring.len() > 8 { ", …" } else { "" };
        let message =
            format!("the connections of objects {}{more} go round in a circle", ids.join(", "));
        let (last, first) = (self.object(ring[0]), self.object(ring[ring.len() - 1]));
        Diagnostic::error("U1006", message, last.span.clone())
            .with_related(first.span.clone(), "which feeds this, and so itself")
            .with_help("power flows from the left rail to the right; a value of the last scan goes through a variable")
    }

    /// What is asked of an object while what feeds it is still looked for.
    fn feed_back(&mut self, place: usize) {
        let last = match &self.graph.objects[place].kind {
            // The variable itself is what it was.
            Kind::InOutVariable(variable, _, from) => read(variable, *from, place),
            _ => {
                self.trace.fed_back.insert(place);
                Power::Kept(place)
            }
        };
        self.powers[place].get_or_insert(last);
    }

    fn enter(&mut self, place: usize, asker: usize) -> Open {
        self.states[place] = State::Open;
        let mut waiting: Vec<usize> = Vec::new();
        for source in self.links.sources[place].iter().flatten() {
            if let Source::Output(from, _) = source {
                waiting.push(*from);
            }
        }
        // They are taken from the end.
        waiting.reverse();
        let asker = if self.rank[place].is_some() { place } else { asker };
        Open { place, asker, waiting }
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
            let first = object.outputs.iter().find(|pin| !pin.name.eq_ignore_ascii_case("ENO"));
            first.map(|pin| pin.name.clone())
        });
        let declared = object
            .outputs
            .iter()
            .find(|output| pin.as_ref().is_some_and(|pin| output.name.eq_ignore_ascii_case(pin)));
        let modifier = declared.map(|output| output.modifier).unwrap_or_default();
        let power = if is_eno(pin.as_ref()) {
            self.enabled(place)
        } else if self.links.is_block[place] {
            let instance = self.instance(object);
            let pin = match (BlockKind::of_word(&block.type_name), pin) {
                (Some(kind), Some(pin)) => {
                    let name = standard::output(kind, &pin).unwrap_or(pin.as_str()).to_owned();
                    Name::at(name, pin.span())
                }
                (Some(kind), None) => Name::at(kind.outputs()[0], object.span.clone()),
                (None, pin) => pin.unwrap_or_default(),
            };
            Power::Output(instance, pin)
        } else {
            self.powers[place].clone().unwrap_or(Power::Constant(false))
        };
        if modifier.negated { power.not() } else { power }
    }

    /// The instance of a block, or a name for it where the file gives none.
    fn instance(&self, object: &Object) -> Name {
        // With a dot it is no name that a person can write.
        match &object.kind {
            Kind::Block(block) => block.instance.clone().unwrap_or_else(|| {
                let name = format!("{}.{}", block.type_name, object.id);
                Name::at(name, object.span.clone())
            }),
            _ => Name::default(),
        }
    }

    /// The power at ENO: that at EN, where it is connected.
    fn enabled(&self, place: usize) -> Power {
        let fed_back = || match self.enable_input(place) {
            // It is asked for before it is known.
            Some(_) if self.states[place] != State::Done => Power::Kept(self.links.enable(place)),
            _ => Power::Constant(true),
        };
        self.enables.get(&place).cloned().unwrap_or_else(fed_back)
    }

    /// The input EN, where it is connected.
    fn enable_input(&self, place: usize) -> Option<usize> {
        let is_enable = |pin: &Pin| pin.name.eq_ignore_ascii_case("EN") && !pin.wires.is_empty();
        self.object(place).inputs.iter().position(is_enable)
    }
}
