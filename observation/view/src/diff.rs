//! Where two runs part: the first cycle in which the inputs, the outputs, the sources or the events of a program differ.

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::source_word;
use understudy_typed::{Point, Points};
use understudy_wire::{Image, ProgramId};

use crate::model::Model;
use crate::series::Images;
use crate::value::point_text;

/// What differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Differing {
    /// u(i).
    Inputs,
    /// y(i), as it was driven.
    Outputs,
    /// Where y(i) came from.
    Source,
    /// What happened to a member.
    Events,
}

/// The first cycle in which something differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Difference {
    /// From the origins of the runs.
    pub cycle: i64,
    /// Program or member that differs.
    pub name: String,
    /// What.
    pub what: Differing,
    /// In the one run.
    pub left: String,
    /// In the other.
    pub right: String,
    /// Cycles in which it differs, or events that only one run has.
    pub count: u64,
}

/// Comparison of two runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct RunDiff {
    /// Whether both ran the same programs with the same timing; otherwise only what has the same name is compared.
    pub same_configuration: bool,
    /// Cycles that both have, from the origin.
    pub compared: u64,
    /// The last cycles of both.
    pub cycles: [Option<i64>; 2],
    /// For each program and kind the first, in the order of cycles.
    pub differences: Vec<Difference>,
}

impl RunDiff {
    /// Whether inputs, outputs, sources and events are the same.
    pub fn is_equal(&self) -> bool {
        self.differences.is_empty()
    }

    /// For a terminal.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        if !self.same_configuration {
            text += "They ran different configurations: what has the same name is compared.\n";
        }
        let last =
            self.cycles.map(|cycle| cycle.map_or("none".to_owned(), |cycle| cycle.to_string()));
        text += &format!(
            "{} cycles compared (the runs end at {} and {})\n",
            self.compared, last[0], last[1]
        );
        match self.differences.first() {
            None => text += "No difference in inputs, outputs, sources and events.\n",
            Some(first) => {
                text += &format!("The first difference is in cycle {}.\n\n", first.cycle);
                for found in &self.differences {
                    let what = match found.what {
                        Differing::Inputs => "inputs",
                        Differing::Outputs => "outputs",
                        Differing::Source => "source",
                        Differing::Events => "events",
                    };
                    let unit = if found.what == Differing::Events { "events" } else { "cycles" };
                    text += &format!(
                        "{:>8}  {:14} {what:8} {} | {}  ({} {unit})\n",
                        found.cycle, found.name, found.left, found.right, found.count
                    );
                }
            }
        }
        text
    }
}

/// Compares two runs from their origins on.
pub fn diff(left: &Model, right: &Model) -> RunDiff {
    let configuration = |model: &Model| model.cluster().agreement().configuration;
    let cycles = [left.cycle(), right.cycle()];
    let end = cycles.iter().flatten().min().map_or(0, |last| last.saturating_add(1)).max(0);
    let mut differences = Vec::new();
    for (place, controller) in left.cluster().controllers().iter().enumerate() {
        let name = &controller.name;
        let other = right.cluster().controllers();
        let Some(other) = other.iter().position(|other| other.name == *name) else {
            continue;
        };
        let (ours, theirs) = (ProgramId(place as u8), ProgramId(other as u8));
        let (one, two) = (left.series(), right.series());
        let pairs = [
            (Differing::Inputs, one.inputs(ours), two.inputs(theirs)),
            (Differing::Outputs, one.outputs(ours), two.outputs(theirs)),
        ];
        for (what, one, two) in pairs {
            if let (Some(one), Some(two)) = (one, two) {
                let borders = [one.borders(0, end), two.borders(0, end)].concat();
                let image =
                    |images: &'_ Images, cycle| images.at(cycle).map(|(_, image)| image.clone());
                let at = |cycle| [image(one, cycle), image(two, cycle)];
                let mut found = first(name, what, borders, end, at, image_text);
                if let Some(found) = &mut found {
                    let images = [one.at(found.cycle), two.at(found.cycle)];
                    differing_values(found, images);
                }
                differences.extend(found);
            }
        }
        if let (Some(one), Some(two)) = (one.sources(ours), two.sources(theirs)) {
            let word = |source: Option<&understudy_wire::Source>| {
                source.map_or("nothing", |source| source_word(*source)).to_owned()
            };
            let borders = [one, two].map(|timeline| {
                let spans = timeline.spans(0, end);
                spans.flat_map(|span| [span.from, span.to]).collect::<Vec<i64>>()
            });
            let at = |cycle| [one, two].map(|timeline| timeline.at(cycle).copied());
            differences.extend(first(name, Differing::Source, borders.concat(), end, at, word));
        }
    }
    differences.extend(events(left, right, end));
    differences.sort_by(|one, two| {
        (one.cycle, one.what, &one.name).cmp(&(two.cycle, two.what, &two.name))
    });
    RunDiff {
        same_configuration: configuration(left) == configuration(right),
        compared: end.unsigned_abs(),
        cycles,
        differences,
    }
}

fn image_text(image: Option<&Image>) -> String {
    image.map_or("nothing".to_owned(), Image::to_string)
}

/// Shows images by the points that differ, by name and value.
fn differing_values(found: &mut Difference, images: [Option<(&Points, &Image)>; 2]) {
    let [Some((points, left)), Some((others, right))] = images else {
        return;
    };
    if !points.are_laid_out_as(others)
        || [left, right].iter().any(|it| it.width() != points.width())
    {
        return;
    }
    let points = points.iter();
    let differing: Vec<&Point> =
        points.filter(|point| point.get(left.words()) != point.get(right.words())).collect();
    let text = |image: &Image| {
        let values = differing.iter();
        let texts: Vec<String> =
            values.map(|point| format!("{} = {}", point.name, point_text(point, image))).collect();
        texts.join(", ")
    };
    (found.left, found.right) = (text(left), text(right));
}

/// The first cycle from 0 to below `end` in which the values of two runs differ, and how many there are. They can only begin or cease to differ at the
/// `borders`, where one of them changes.
fn first<T: PartialEq>(
    name: &str,
    what: Differing,
    mut borders: Vec<i64>,
    end: i64,
    at: impl Fn(i64) -> [Option<T>; 2],
    text: impl Fn(Option<&T>) -> String,
) -> Option<Difference> {
    borders.extend([0, end]);
    borders.sort_unstable();
    borders.dedup();
    let mut found: Option<Difference> = None;
    for pair in borders.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let [left, right] = at(from);
        if left == right {
            continue;
        }
        let difference = found.get_or_insert_with(|| Difference {
            cycle: from,
            name: name.to_owned(),
            what,
            left: text(left.as_ref()),
            right: text(right.as_ref()),
            count: 0,
        });
        difference.count += (to - from).unsigned_abs();
    }
    found
}

/// For each member and event the first that only one run has. Cycles of equal events may be a little apart, for real clocks are;
/// so they are compared by their order.
fn events(left: &Model, right: &Model, end: i64) -> Vec<Difference> {
    type Key<'m> = (&'m str, &'static str);
    type Told<'m> = Vec<(i64, &'m str)>;
    fn told(model: &Model, end: i64) -> std::collections::BTreeMap<Key<'_>, Told<'_>> {
        let mut told = std::collections::BTreeMap::<Key<'_>, Told<'_>>::new();
        for event in model.events() {
            let of_the_host = ["stalled", "ready", "stopped", "started", "origin", "finished"];
            if (0..end).contains(&event.cycle) && !of_the_host.contains(&event.event) {
                let key = (event.name.as_str(), event.event);
                told.entry(key).or_default().push((event.cycle, &event.text));
            }
        }
        told
    }
    let (one, two) = (told(left, end), told(right, end));
    let keys: std::collections::BTreeSet<Key<'_>> = one.keys().chain(two.keys()).copied().collect();
    let nothing = Told::new();
    let mut found = Vec::new();
    for key in keys {
        let one = one.get(&key).unwrap_or(&nothing);
        let two = two.get(&key).unwrap_or(&nothing);
        let longest = one.len().max(two.len());
        let differing = (0..longest).filter(|&place| {
            one.get(place).map(|(_, text)| text) != two.get(place).map(|(_, text)| text)
        });
        let places: Vec<usize> = differing.collect();
        let Some(&place) = places.first() else {
            continue;
        };
        let at = |told: &Told<'_>| told.get(place).map(|(cycle, _)| *cycle);
        let text = |told: &Told<'_>| {
            told.get(place)
                .map_or_else(|| format!("no `{}`", key.1), |(_, text)| (*text).to_owned())
        };
        found.push(Difference {
            cycle: [at(one), at(two)].into_iter().flatten().min().unwrap_or(0),
            name: key.0.to_owned(),
            what: Differing::Events,
            left: text(one),
            right: text(two),
            count: places.len() as u64,
        });
    }
    found
}
