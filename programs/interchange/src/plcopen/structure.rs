//! Which steps each transition leaves and enters, looked for through divergences, convergences and jumps.

use std::collections::HashMap;

use understudy_text::Diagnostic;

use crate::plcopen::document::{Graph, Kind, Object, Pin};

/// A chart.
#[derive(Debug, Default)]
pub(in crate::plcopen) struct Structure {
    pub(in crate::plcopen) steps: Vec<usize>,
    pub(in crate::plcopen) transitions: Vec<usize>,
    /// Objects with actions.
    pub(in crate::plcopen) actions: Vec<usize>,
    /// The steps that a transition leaves.
    pub(in crate::plcopen) from: HashMap<usize, Vec<usize>>,
    /// The steps that it enters.
    pub(in crate::plcopen) to: HashMap<usize, Vec<usize>>,
    /// The step that has the actions.
    pub(in crate::plcopen) step_of: HashMap<usize, usize>,
}

/// The variable that the network of a chart writes for a transition.
pub(in crate::plcopen) fn wired(object: &Object) -> String {
    format!("transition_{}", object.id)
}

/// How many objects are looked through on one way.
const MAXIMUM_WAY: usize = 10_000;

pub(in crate::plcopen) fn structure(graph: &Graph, diagnostics: &mut Vec<Diagnostic>) -> Structure {
    let places: HashMap<u64, usize> =
        graph.objects.iter().enumerate().map(|(place, object)| (object.id, place)).collect();
    let mut found = Structure::default();
    let mut named: HashMap<String, usize> = HashMap::new();
    for (place, object) in graph.objects.iter().enumerate() {
        match &object.kind {
            Kind::Step(name, _) => {
                found.steps.push(place);
                if let Some(first) = named.insert(name.to_uppercase(), place) {
                    let error = Diagnostic::error(
                        "U1003",
                        format!("two steps are called `{name}`"),
                        object.span.clone(),
                    );
                    let first = graph.objects[first].span.clone();
                    diagnostics.push(error.with_related(first, "the first is here"));
                }
            }
            Kind::Transition(_) => found.transitions.push(place),
            Kind::Actions(_) => found.actions.push(place),
            _ => {}
        }
    }
    for (place, object) in graph.objects.iter().enumerate() {
        let (target, is_end) = match &object.kind {
            Kind::Step(..) => (Some(place), true),
            Kind::JumpStep(name) => {
                let target = named.get(&name.to_uppercase()).copied();
                if target.is_none() {
                    let message = format!("no step is called `{name}`");
                    diagnostics.push(Diagnostic::error("U1005", message, object.span.clone()));
                }
                (target, true)
            }
            Kind::Transition(_) => (Some(place), false),
            Kind::Actions(_) => (Some(place), false),
            _ => continue,
        };
        let Some(target) = target else { continue };
        for behind in back(graph, &places, place, is_end) {
            match (&object.kind, is_end) {
                (Kind::Actions(_), _) => {
                    found.step_of.entry(place).or_insert(behind);
                }
                (_, true) => push(found.to.entry(behind).or_default(), target),
                (_, false) => push(found.from.entry(place).or_default(), behind),
            }
        }
    }
    found
}

fn push(list: &mut Vec<usize>, place: usize) {
    if !list.contains(&place) {
        list.push(place);
    }
}

/// The transitions behind a step, or the steps behind a transition or an action.
fn back(graph: &Graph, places: &HashMap<u64, usize>, from: usize, transitions: bool) -> Vec<usize> {
    let mut found = Vec::new();
    let mut seen = Vec::new();
    let mut waiting = vec![from];
    while let Some(place) = waiting.pop() {
        for wire in
            graph.objects[place].inputs.iter().filter(|pin| is_flow(pin)).flat_map(|pin| &pin.wires)
        {
            let Some(&behind) = places.get(&wire.from) else {
                continue;
            };
            match &graph.objects[behind].kind {
                Kind::Transition(_) if transitions => push(&mut found, behind),
                Kind::Step(..) if !transitions => push(&mut found, behind),
                Kind::SelectionDivergence
                | Kind::SelectionConvergence
                | Kind::SimultaneousDivergence
                | Kind::SimultaneousConvergence
                    if !seen.contains(&behind) && seen.len() < MAXIMUM_WAY =>
                {
                    seen.push(behind);
                    waiting.push(behind);
                }
                _ => {}
            }
        }
    }
    found
}

/// Not the condition of a transition.
fn is_flow(pin: &Pin) -> bool {
    pin.name.is_empty()
}
