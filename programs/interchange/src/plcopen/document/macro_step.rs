//! Macro steps: a step that stands for a chart of its own. What enters it enters the first step of that chart, and what leaves it leaves the
//! last one, so the chart takes its place.

use std::collections::{HashMap, HashSet};

use understudy_ladder::Name;
use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use super::read::Reader;
use super::{Body, Graph, Kind, Language, Object};
use crate::plcopen::xml::child;

/// Objects within macro steps are numbered from here and by their places in the file, above what people number.
const FIRST_ID: u64 = 1 << 61;

/// The steps that the macro steps of a graph end in, by the numbers of the macro steps.
#[derive(Debug, Default)]
pub(super) struct Ends(HashMap<u64, u64>);

impl Ends {
    /// Appends the chart of a macro step, which was read as a step.
    pub(super) fn expand(
        &mut self,
        reader: &mut Reader,
        node: Node<'_, '_>,
        step: Object,
        objects: &mut Vec<Object>,
    ) {
        let Kind::Step(name, _) = step.kind else {
            return;
        };
        let Some(mut chart) = chart(reader, node, &name) else {
            return;
        };
        renumber(reader, &mut chart, node);
        let first = only(reader, node, &name, "first", &firsts(&chart));
        let last = only(reader, node, &name, "last", &lasts(&chart));
        let (Some(first), Some(last)) = (first, last) else {
            return;
        };
        self.0.insert(step.id, chart[last].id);
        chart[first].inputs.extend(step.inputs);
        for object in &mut chart {
            if let Kind::Step(_, is_initial) = &mut object.kind {
                *is_initial = false;
            }
        }
        objects.append(&mut chart);
    }

    /// Lets all that leaves a macro step leave its last step.
    pub(super) fn connect(self, reader: &mut Reader, graph: &mut Graph) {
        if self.0.is_empty() {
            return;
        }
        for object in &mut graph.objects {
            for wire in object.inputs.iter_mut().flat_map(|pin| &mut pin.wires) {
                let Some(last) = self.0.get(&wire.from) else {
                    continue;
                };
                if let Kind::Actions(_) = object.kind {
                    let message = "actions of a macro step are not supported: give them to the steps of its chart";
                    let span = object.span.clone();
                    let error = Diagnostic::error("U1010", message, span);
                    reader.diagnostics.push(error);
                }
                (wire.from, wire.pin) = (*last, None);
            }
        }
    }
}

fn chart(reader: &mut Reader, node: Node<'_, '_>, name: &Name) -> Option<Vec<Object>> {
    let message = match child(node, "body").map(|body| reader.body(body)) {
        Some(Some(Body::Graph(Graph { language: Language::Sequence, objects }))) => {
            return Some(objects);
        }
        Some(_) => {
            format!("the body of the macro step `{name}` is not a sequential function chart")
        }
        None => {
            format!("the macro step `{name}` has no body: give it the chart that it stands for")
        }
    };
    reader.error("U1015", message, node);
    None
}

/// Gives the objects of a chart numbers that no other object of the file has.
fn renumber(reader: &mut Reader, chart: &mut [Object], node: Node<'_, '_>) {
    let own: HashMap<u64, u64> =
        chart.iter().map(|object| (object.id, FIRST_ID + object.span.start as u64)).collect();
    for object in chart {
        object.id = own[&object.id];
        for wire in object.inputs.iter_mut().flat_map(|pin| &mut pin.wires) {
            match own.get(&wire.from) {
                Some(from) => wire.from = *from,
                None => {
                    let message =
                        format!("nothing in the macro step has the localId {}", wire.from);
                    reader.error("U1002", message, node);
                }
            }
        }
    }
}

fn is_step(object: &Object) -> bool {
    matches!(object.kind, Kind::Step(..))
}

/// The steps that are initial ones, or those that nothing enters.
fn firsts(chart: &[Object]) -> Vec<usize> {
    let is_initial = |object: &&Object| matches!(object.kind, Kind::Step(_, true));
    let has_initial = chart.iter().any(|object| is_initial(&object));
    let is_entered = |object: &Object| object.inputs.iter().any(|pin| !pin.wires.is_empty());
    let is_first = |object: &Object| match has_initial {
        true => is_initial(&object),
        false => is_step(object) && !is_entered(object),
    };
    (0..chart.len()).filter(|place| is_first(&chart[*place])).collect()
}

/// The steps that nothing but actions leaves.
fn lasts(chart: &[Object]) -> Vec<usize> {
    let others = chart.iter().filter(|object| !matches!(object.kind, Kind::Actions(_)));
    let wires = others.flat_map(|object| &object.inputs).flat_map(|pin| &pin.wires);
    let left: HashSet<u64> = wires.map(|wire| wire.from).collect();
    let is_last = |object: &Object| is_step(object) && !left.contains(&object.id);
    (0..chart.len()).filter(|place| is_last(&chart[*place])).collect()
}

fn only(
    reader: &mut Reader,
    node: Node<'_, '_>,
    name: &Name,
    which: &str,
    found: &[usize],
) -> Option<usize> {
    if let [only] = found {
        return Some(*only);
    }
    let rule = match which {
        "first" => "the initial one, or the one that no transition enters",
        _ => "the one that no transition leaves",
    };
    let count = found.len();
    let message =
        format!("the chart of the macro step `{name}` has {count} {which} steps, not one: {rule}");
    reader.error("U1015", message, node);
    None
}
