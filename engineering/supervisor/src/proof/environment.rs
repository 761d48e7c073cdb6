//! What operator and plant may do to the inputs of a ladder from one scan to the next.

use std::collections::{BTreeMap, HashMap};

use understudy_ladder::Name;

use super::reference::Happening;
use super::timers::FreeTimer;
use crate::Label;
use crate::ladder::{Correspondence, InputOutputMap, Meaning, OneEvent, Partition, When};

/// An input and how it may change.
#[derive(Debug, Clone)]
enum Kind {
    /// x^0, requests and pulses: 1 for one scan.
    Momentary,
    /// Keeps its value until it changes.
    Level,
    /// A freed timer: 0 unless its bit was on, and then 1 until it is not.
    Timer(Name),
}

/// All inputs of a ladder.
#[derive(Debug)]
pub(super) struct Environment {
    kinds: Vec<Kind>,
    start: Option<usize>,
    requests: Vec<(Label, usize)>,
    /// Event, input, and what of it.
    events: Vec<(Label, usize, When)>,
    simultaneous: usize,
    /// Whether a scan has at most one event.
    one_event: bool,
}

impl Environment {
    /// `inputs` are the ladder's inputs in order. At most `simultaneous` of them change on purpose in one scan.
    pub(super) fn new(
        inputs: &[String],
        map: &InputOutputMap,
        partition: &Partition,
        correspondence: &Correspondence,
        timers: &[FreeTimer],
        simultaneous: usize,
    ) -> Self {
        let place: HashMap<&str, usize> = inputs.iter().map(String::as_str).zip(0..).collect();
        let at = |name: &str| place.get(name).copied();
        let mut kinds = vec![Kind::Momentary; inputs.len()];
        let mut events = Vec::new();
        let labels: BTreeMap<usize, Label> = Self::labels(map, partition, true);
        for (input, &label) in &labels {
            let content = &map.inputs[*input];
            if let Some(place) = at(&content.signal) {
                if content.when != When::Pulse {
                    kinds[place] = Kind::Level;
                }
                events.push((label, place, content.when));
            }
        }
        for (timer, &label) in &Self::labels(map, partition, false) {
            let output = format!("{}.Q", map.timers[*timer].name);
            if let Some(place) = at(&output) {
                events.push((label, place, When::Rising));
            }
        }
        for timer in timers {
            if let Some(place) = at(&timer.input) {
                kinds[place] = Kind::Timer(timer.runs_while.clone());
            }
        }
        let requests = correspondence.requests.iter();
        Self {
            kinds,
            start: map.start.as_ref().and_then(|start| at(start)),
            requests: requests.filter_map(|(&label, name)| Some((label, at(name)?))).collect(),
            events,
            simultaneous,
            one_event: map.one_event == Some(OneEvent::Assumed),
        }
    }

    /// The event of each input, or of each timer.
    fn labels(map: &InputOutputMap, partition: &Partition, inputs: bool) -> BTreeMap<usize, Label> {
        partition
            .labels()
            .filter_map(|label| match partition.meaning(label)? {
                Meaning::Input(place) if inputs => Some((place, label)),
                Meaning::Timer(place) if !inputs && place < map.timers.len() => {
                    Some((place, label))
                }
                _ => None,
            })
            .collect()
    }

    /// Every input image that may follow `last`; `is_on` tells a bit of the ladder after the last scan.
    pub(super) fn following(&self, last: &[bool], is_on: impl Fn(&Name) -> bool) -> Vec<Vec<bool>> {
        let mut rest = Vec::with_capacity(last.len());
        let mut choices = Vec::new();
        for (place, kind) in self.kinds.iter().enumerate() {
            let (value, may_change) = match kind {
                Kind::Momentary => (false, true),
                Kind::Level => (last[place], true),
                Kind::Timer(runs_while) => {
                    let runs = is_on(runs_while);
                    (runs && last[place], runs && !last[place])
                }
            };
            rest.push(value);
            if may_change {
                choices.push(place);
            }
        }
        let mut images = images(&rest, &choices, self.simultaneous);
        if self.one_event {
            images.retain(|image| self.happening(last, image).events.len() <= 1);
        }
        images
    }

    /// What the change from `last` to `now` means.
    pub(super) fn happening(&self, last: &[bool], now: &[bool]) -> Happening {
        let occurs = |&&(_, place, when): &&(Label, usize, When)| match when {
            When::Pulse | When::High => now[place],
            When::Low => !now[place],
            When::Rising => now[place] && !last[place],
            When::Falling => !now[place] && last[place],
        };
        let mut events: Vec<Label> =
            self.events.iter().filter(occurs).map(|(label, _, _)| *label).collect();
        events.sort_unstable();
        Happening {
            start: self.start.is_some_and(|place| now[place]),
            events,
            requests: self
                .requests
                .iter()
                .filter(|(_, place)| now[*place])
                .map(|(label, _)| *label)
                .collect(),
        }
    }

    /// Part of an image kept for the next scan: momentary inputs return to 0.
    pub(super) fn kept(&self, image: &[bool]) -> Vec<bool> {
        let kinds = self.kinds.iter().zip(image);
        kinds.map(|(kind, &value)| value && !matches!(kind, Kind::Momentary)).collect()
    }
}

/// `rest`, and every image that differs from it in at most `simultaneous` of the places `choices`.
pub(super) fn images(rest: &[bool], choices: &[usize], simultaneous: usize) -> Vec<Vec<bool>> {
    let mut images = vec![rest.to_vec()];
    let mut begin = 0;
    // Images with one change more than those of the round before; places ascend, so none comes twice.
    let mut highest = vec![0_usize];
    for _ in 0..simultaneous {
        let end = images.len();
        for index in begin..end {
            for (rank, &place) in choices.iter().enumerate().skip(highest[index]) {
                let mut image = images[index].clone();
                image[place] = !rest[place];
                images.push(image);
                highest.push(rank + 1);
            }
        }
        begin = end;
    }
    images
}
