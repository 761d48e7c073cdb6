//! The last samples of a remote I/O that was killed before they were in its journal.

use std::collections::VecDeque;

use understudy_wire::{Image, Lineage, PointValue};

/// Different images of a plant that are remembered.
const SEEN: usize = 16;

/// Requests of operators that are remembered.
const ASKED: usize = 4;

/// Samples in a row without a record, at most.
const SAMPLES: usize = 4;

/// Lineages that are tried to find them.
const TRIED: usize = 1 << 20;

/// What samples without a record may have had. The lineage that they led to proves which they were.
#[derive(Debug, Clone)]
pub(super) struct Unrecorded {
    /// What the plant showed last: any of these may have been sampled.
    seen: VecDeque<Image>,
    /// Bits of u(i) that do not come from the plant, by their places, as of the newest sample.
    sourced: Vec<(usize, bool)>,
    /// Those bits with the writes that the remote I/O has taken since.
    taken: Vec<(usize, bool)>,
    /// What operators asked for last, by the first bit of the input: the record of a write that was taken may be missing too.
    asked: VecDeque<(u16, PointValue)>,
}

impl Unrecorded {
    /// Of a program, of whose inputs these bits do not come from the plant.
    pub(super) fn new(sourced: impl Iterator<Item = usize>) -> Self {
        Self {
            seen: VecDeque::new(),
            sourced: sourced.map(|bit| (bit, false)).collect(),
            taken: Vec::new(),
            asked: VecDeque::new(),
        }
    }

    /// The plant shows these sensors.
    pub(super) fn saw(&mut self, sensors: &Image) {
        let inputs = with(sensors, &self.sourced);
        if self.seen.contains(&inputs) {
            return;
        }
        if self.seen.len() == SEEN {
            self.seen.pop_front();
        }
        self.seen.push_back(inputs);
    }

    /// An operator asks to write a value.
    pub(super) fn asked(&mut self, input: u16, value: PointValue) {
        if self.asked.len() == ASKED {
            self.asked.pop_front();
        }
        self.asked.push_back((input, value));
    }

    /// The remote I/O has taken a write.
    pub(super) fn written(&mut self, input: u16, value: PointValue) {
        set_point(&mut self.taken, input, value);
    }

    /// A sample with a record, before it is known which state it extends.
    pub(super) fn resumes(&mut self, inputs: &Image) {
        for (place, bit) in &mut self.sourced {
            *bit = inputs.get(*place);
        }
    }

    /// That sample is known.
    pub(super) fn sampled(&mut self) {
        self.taken.clone_from(&self.sourced);
    }

    /// The samples that lead from one of these lineages to `to`, the fewest, and the place in `from` where they begin.
    pub(super) fn samples_to(&self, to: Lineage, from: &[Lineage]) -> Option<(usize, Vec<Image>)> {
        let candidates = self.candidates();
        let mut left = TRIED;
        let mut samples = Vec::new();
        for count in 1..=SAMPLES {
            for (start, known) in from.iter().enumerate() {
                if leads_to(*known, to, &candidates, count, &mut samples, &mut left) {
                    let images = samples.iter().map(|place| candidates[*place].clone());
                    return Some((start, images.collect()));
                }
            }
        }
        None
    }

    /// What the plant has shown, with the values of other sources then, with those that were written or asked for since, or with those
    /// that the stations recall.
    fn candidates(&self) -> Vec<Image> {
        let mut images: Vec<Image> = self.seen.iter().cloned().collect();
        let mut sources = vec![self.taken.clone(), self.sourced.clone()];
        for &(input, value) in &self.asked {
            let mut asked = self.taken.clone();
            set_point(&mut asked, input, value);
            sources.push(asked);
        }
        for values in sources {
            for seen in &self.seen {
                let image = with(seen, &values);
                if !images.contains(&image) {
                    images.push(image);
                }
            }
        }
        images
    }
}

fn with(inputs: &Image, values: &[(usize, bool)]) -> Image {
    let mut image = inputs.clone();
    for &(place, bit) in values {
        image.set(place, bit);
    }
    image
}

/// Writes a value to the input whose first bit in u(i) is `input`.
fn set_point(bits: &mut [(usize, bool)], input: u16, value: PointValue) {
    for (place, bit) in bits {
        let at = place.wrapping_sub(usize::from(input));
        if at < usize::from(value.width()) {
            *bit = value.stored() >> at & 1 == 1;
        }
    }
}

/// Whether `count` of these samples lead from one lineage to the other; `samples` are then their places. At most `left` lineages are tried.
fn leads_to(
    from: Lineage,
    to: Lineage,
    candidates: &[Image],
    count: usize,
    samples: &mut Vec<usize>,
    left: &mut usize,
) -> bool {
    for (place, inputs) in candidates.iter().enumerate() {
        if *left == 0 {
            break;
        }
        *left -= 1;
        let next = from.after(inputs);
        samples.push(place);
        let is_found = match count {
            0 | 1 => next == to,
            _ => leads_to(next, to, candidates, count - 1, samples, left),
        };
        if is_found {
            return true;
        }
        samples.pop();
    }
    false
}
