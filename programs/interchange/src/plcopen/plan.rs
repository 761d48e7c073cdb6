//! In which order the objects of a graph act, and on what: the graph as a list of steps.
//!
//! Coils, written variables, blocks and functions act in the order of `executionOrderId` where they have one, and else as a person reads: by y,
//! then by x (as xml2st does). Before something acts, the blocks that feed it act. Power is what it is at the moment when
//! it is first asked for, and stays so: what an object has let through is not asked again when a coil has changed the
//! variable meanwhile. Where that matters, the power is *kept* in a bit of its own.

mod links;
mod places;
mod rings;
mod stale;
mod walk;

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use understudy_ladder::Name;
use understudy_text::Diagnostic;

use self::links::Links;
use self::stale::stale;
use self::walk::Walk;
use super::document::{Edge, Graph, Kind, Language, Modifier};
use super::power::Power;

pub(crate) use self::places::{Named, Places};

/// Distances between comments and rungs that are measured; with more, comments stand at the end.
const MAXIMUM_DISTANCES: usize = 10_000_000;

/// What a graph does in one scan.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    pub(crate) steps: Vec<Step>,
    /// Comments that stand below everything.
    pub(crate) footer: Vec<String>,
    /// What is worth knowing and changes nothing.
    pub(crate) notes: Vec<(String, Range<usize>)>,
}

/// One step with the comments above it.
#[derive(Debug)]
pub(crate) struct Step {
    pub(crate) comments: Vec<String>,
    pub(crate) span: Range<usize>,
    pub(crate) action: Action,
}

#[derive(Debug)]
pub(crate) enum Action {
    /// Coils or a variable that take the same power.
    Write {
        targets: Vec<(Name, Modifier)>,
        power: Power,
        /// Nothing is written without it.
        guard: Option<Power>,
    },
    /// A function block's turn.
    Call(Call),
    /// The power of an object, or its edge, is kept for later steps of this scan; with a guard, for later scans too. The
    /// pins of blocks have numbers of their own behind those of the objects.
    Keep {
        object: usize,
        power: Power,
        edge: Option<Edge>,
        guard: Option<Power>,
    },
    /// With power, what comes before the label is not done; without a name, what comes before the end.
    Jump {
        label: Option<Name>,
        power: Power,
    },
    Label(Name),
}

/// A call of a function block.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) type_name: Name,
    pub(crate) instance: Name,
    /// The file names the instance.
    pub(crate) is_named: bool,
    pub(crate) inputs: Vec<Input>,
    /// The power at EN; without it the block does not act.
    pub(crate) enable: Option<Power>,
}

/// What a call gives to one input.
#[derive(Debug)]
pub(crate) struct Input {
    pub(crate) pin: Name,
    pub(crate) modifier: Modifier,
    pub(crate) power: Power,
}

impl Action {
    pub(crate) fn powers(&self) -> Vec<&Power> {
        match self {
            Self::Write { power, guard, .. } | Self::Keep { power, guard, .. } => {
                guard.iter().chain([power]).collect()
            }
            Self::Jump { power, .. } => vec![power],
            Self::Label(_) => Vec::new(),
            Self::Call(call) => {
                let inputs = call.inputs.iter().map(|input| &input.power);
                inputs.chain(&call.enable).collect()
            }
        }
    }
}

/// Plans a graph of LD or FBD; `is_block` tells instances' types from functions, `places` has the addresses of variables. What goes round in a circle
/// is what it was in the last scan.
pub(crate) fn plan(
    graph: &Graph,
    is_block: &dyn Fn(&str) -> bool,
    places: &Places,
    diagnostics: &mut Vec<Diagnostic>,
) -> Plan {
    let links = Links::new(graph, is_block, diagnostics);
    let mut keep = HashSet::new();
    let mut reread: HashSet<usize> = HashSet::new();
    let mut plan = loop {
        let mut found = Vec::new();
        let (plan, trace) = Walk::new(graph, &links, &keep).run(&mut found);
        let stale = stale(graph, &links, (&plan, &trace), places, &keep);
        let known = keep.len();
        keep.extend(&trace.fed_back);
        reread.extend(stale.iter().filter(|object| !keep.contains(*object)));
        keep.extend(stale);
        if keep.len() == known {
            diagnostics.append(&mut found);
            break plan;
        }
    };
    for place in reread {
        // Other tools evaluate a function once too.
        let object = graph.objects.get(place);
        let Some(object) = object.filter(|object| !matches!(object.kind, Kind::Block(_))) else {
            continue;
        };
        let message = "it is asked for again after its variable has been written: it keeps what it let through first, where tools that \
                       write Structured Text read the variable again";
        plan.notes.push((message.to_owned(), object.span.clone()));
    }
    plan.notes.sort_by_key(|(_, span)| span.start);
    plan.notes.dedup();
    comments(graph, &mut plan);
    plan
}

/// Gives each comment to the nearest step below it; there may be several columns of rungs on a sheet.
fn comments(graph: &Graph, plan: &mut Plan) {
    let mut comments: Vec<((i64, i64), &String)> = graph
        .objects
        .iter()
        .filter_map(|object| match &object.kind {
            Kind::Comment(text) if !text.is_empty() => {
                Some(((object.position.1, object.position.0), text))
            }
            _ => None,
        })
        .collect();
    comments.sort_by_key(|(place, _)| *place);
    let places: HashMap<usize, (i64, i64)> =
        graph.objects.iter().map(|object| (object.span.start, object.position)).collect();
    let by_distance = comments.len().saturating_mul(plan.steps.len()) <= MAXIMUM_DISTANCES;
    for ((y, x), text) in comments {
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let lines = lines.map(str::to_owned);
        let distance = |step: &Step| {
            let place = places.get(&step.span.start)?;
            let (right, down) = (place.0.saturating_sub(x), place.1.saturating_sub(y));
            let sideways = if right < 0 { right.saturating_mul(-8) } else { right };
            (down >= 0).then(|| down.saturating_mul(2).saturating_add(sideways))
        };
        let below = plan.steps.iter_mut().filter(|step| by_distance && distance(step).is_some());
        let below = below.min_by_key(|step| distance(step));
        match below {
            Some(step) => step.comments.extend(lines),
            None => plan.footer.extend(lines),
        }
    }
}

/// Whether the graph is drawn from left to right.
fn is_ladder(graph: &Graph) -> bool {
    graph.language == Language::Ladder
}
