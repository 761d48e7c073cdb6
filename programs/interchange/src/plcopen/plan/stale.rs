//! Objects that would let through something else later in a scan: what they read is written between the first and the last
//! step that asks for them.

use std::collections::{HashMap, HashSet};

use understudy_ladder::BlockKind;

use super::links::{Links, Source, is_eno};
use super::places::{Place, Places, is_anywhere, names};
use super::walk::Trace;
use super::{Action, Plan};
use crate::plcopen::document::{Graph, Kind, Object};

/// The steps that write, by what they write.
#[derive(Default)]
struct Writes {
    /// To variables, also to instances of blocks, and to bits at addresses.
    by_place: HashMap<Place, Vec<usize>>,
    /// The steps that write to anything in an area.
    by_area: HashMap<char, Vec<usize>>,
    /// Through pointers, and by units of the file.
    anywhere: Vec<usize>,
}

impl Writes {
    fn of(plan: &Plan, places: &Places) -> Self {
        let mut writes = Self::default();
        for (step, done) in plan.steps.iter().enumerate() {
            match &done.action {
                Action::Write { targets, .. } => {
                    for (target, _) in targets {
                        writes.write(target, step, places);
                    }
                }
                Action::Call(call) => {
                    writes.write(&call.instance, step, places);
                    // A unit of the file may write global variables, and those at its in-out pins.
                    if BlockKind::of_word(&call.type_name).is_none() {
                        writes.anywhere.push(step);
                    }
                }
                Action::Keep { .. } | Action::Jump { .. } | Action::Label(_) => {}
            }
        }
        writes
    }

    fn write(&mut self, target: &str, step: usize, places: &Places) {
        if is_anywhere(target) {
            self.anywhere.push(step);
        }
        // What chooses an element of an array is not written, and is taken with it.
        for place in places.of(target) {
            if let Place::Bit(area, _) | Place::Wide(area) = &place {
                self.by_area.entry(*area).or_default().push(step);
            }
            self.by_place.entry(place).or_default().push(step);
        }
    }

    /// Whether the value of an expression may change from one step to another.
    fn change(&self, text: &str, (first, last): (usize, usize), places: &Places) -> bool {
        let is_between =
            |steps: Option<&Vec<usize>>| steps.is_some_and(|steps| is_between(steps, first, last));
        let may = |place: &Place| {
            let wide = match place {
                Place::Variable(_) => false,
                Place::Bit(area, _) => is_between(self.by_place.get(&Place::Wide(*area))),
                Place::Wide(area) => is_between(self.by_area.get(area)),
            };
            wide || is_between(self.by_place.get(place))
        };
        let read = places.of(text);
        !read.is_empty() && is_between(Some(&self.anywhere)) || read.iter().any(may)
    }
}

fn is_between(steps: &[usize], first: usize, last: usize) -> bool {
    let next = steps.partition_point(|&step| step < first);
    steps.get(next).is_some_and(|&step| step < last)
}

/// The last steps that ask for each object, and for each whether it was enabled.
struct Asked {
    last: Vec<usize>,
    enabled: Vec<usize>,
}

fn asked(graph: &Graph, links: &Links, trace: &Trace) -> Asked {
    let count = graph.objects.len();
    let mut asked = Asked { last: vec![0; count], enabled: vec![0; count] };
    // What asks later has finished later, so the last step that asks is known before that of its sources.
    for &place in trace.finished.iter().rev() {
        let object = &graph.objects[place];
        let asks = trace.step[place].unwrap_or(asked.last[place]);
        asked.last[place] = asks;
        let is_written = matches!(object.kind, Kind::OutVariable(..) | Kind::InOutVariable(..));
        for (pin, sources) in object.inputs.iter().zip(&links.sources[place]) {
            let asks = match pin.name.eq_ignore_ascii_case("EN") {
                true => asks.max(asked.enabled[place]),
                false => asks,
            };
            for source in sources {
                let Source::Output(from, output) = source else { continue };
                asked.last[*from] = asked.last[*from].max(asks);
                // A variable is written only while the function in front of it is enabled.
                if is_eno(output.as_ref()) || is_written && sources.len() == 1 {
                    asked.enabled[*from] = asked.enabled[*from].max(asks);
                }
            }
        }
    }
    asked
}

/// The objects, and the EN of blocks, whose reading would differ between the first and the last step that asks for them.
pub(super) fn stale(
    graph: &Graph,
    links: &Links,
    (plan, trace): (&Plan, &Trace),
    places: &Places,
    kept: &HashSet<usize>,
) -> HashSet<usize> {
    let asked = asked(graph, links, trace);
    let writes = Writes::of(plan, places);
    let of_result = |source: &Source, from: usize, last: usize| match source {
        Source::Rail => false,
        Source::Output(at, _) => {
            // What is at its pins is kept in front of its own step.
            let is_changed =
                trace.step[*at].is_some() && (links.is_block[*at] || trace.fed_back.contains(at));
            is_changed && (from..last).contains(&trace.first[*at])
                || instance(&graph.objects[*at])
                    .filter(|_| links.is_block[*at])
                    .is_some_and(|name| writes.change(&name, (from, last), places))
        }
    };
    let mut stale = HashSet::new();
    for &place in &trace.finished {
        let object = &graph.objects[place];
        let (first, last) = (trace.first[place], asked.last[place]);
        let text = match &object.kind {
            Kind::Contact(text, _) | Kind::InVariable(text, _) => text.as_str(),
            Kind::InOutVariable(text, ..) => text.as_str(),
            Kind::Block(_) => "",
            _ => continue,
        };
        let mut is_stale = writes.change(text, (first, last), places);
        for (pin, sources) in object.inputs.iter().zip(&links.sources[place]) {
            if pin.name.eq_ignore_ascii_case("EN") {
                let last = last.max(asked.enabled[place]);
                if sources.iter().any(|source| of_result(source, first, last)) {
                    stale.insert(links.enable(place));
                }
            } else if !links.is_block[place] {
                is_stale |= sources.iter().any(|source| of_result(source, first, last));
            }
        }
        if is_stale {
            stale.insert(place);
        }
    }
    answers(graph, links, kept, &mut stale);
    stale
}

/// The variable that is the instance of a block.
fn instance(object: &Object) -> Option<String> {
    match &object.kind {
        Kind::Block(block) => block.instance.as_ref().and_then(|name| names(name).next()),
        _ => None,
    }
}

/// A number is kept as what a function makes of it: a comparison is one bit. Where that was not enough, it is kept itself.
fn answers(graph: &Graph, links: &Links, kept: &HashSet<usize>, stale: &mut HashSet<usize>) {
    // By variable: how many pins of functions ask for it, and whether one of these functions is not kept yet.
    let mut asked: HashMap<usize, (usize, bool)> = HashMap::new();
    for (place, object) in graph.objects.iter().enumerate() {
        if !matches!(object.kind, Kind::Block(_)) || links.is_block[place] {
            continue;
        }
        for (pin, sources) in object.inputs.iter().zip(&links.sources[place]) {
            if pin.name.eq_ignore_ascii_case("EN") {
                continue;
            }
            for source in sources {
                if let Source::Output(from, _) = source
                    && matches!(graph.objects[*from].kind, Kind::InVariable(..))
                    && stale.contains(from)
                {
                    stale.insert(place);
                    let (pins, is_new) = asked.entry(*from).or_default();
                    *pins += 1;
                    *is_new |= !kept.contains(&place);
                }
            }
        }
    }
    stale.retain(|place| {
        let fan_out = links.fan_out.get(*place);
        !asked.get(place).is_some_and(|(pins, is_new)| *is_new && Some(pins) == fan_out)
    });
}
