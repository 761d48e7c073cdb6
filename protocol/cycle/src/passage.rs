//! The points of a program in an online change: those that both programs have, by name and type, and the way of their values.
//!
//! ```text
//!   input that stays     its value goes with it, wherever its bits are, and whatever it comes from: the newest one counts until the next one
//!   input that is new    its initial value, until it is read or written
//!   output that stays    what is held, and its ramp, go with it
//!   output that is new   its fail-safe value where nothing is proved
//! ```
//!
//! A point with another type is a new one: what its bits would mean is not known.

use std::collections::BTreeSet;
use std::sync::Arc;

use understudy_wire::Image;

use crate::fallback::Fallback;
use crate::layout::Layout;
use crate::place::PointPlace;
use crate::ramp::Ramp;

/// A point that both programs have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Moved {
    /// Place in the layout before.
    pub before: PointPlace,
    /// Place in the layout after, of the same type.
    pub after: PointPlace,
}

/// What an online change does to the points of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointsChange {
    /// The layout of the program before.
    pub before: Arc<Layout>,
    /// The layout of the program after.
    pub after: Arc<Layout>,
    /// Inputs that stay.
    pub inputs: Vec<Moved>,
    /// Outputs that stay.
    pub outputs: Vec<Moved>,
}

/// The way from one layout of a change to the other one.
#[derive(Debug, Clone, Copy)]
pub struct Passage<'a> {
    points: &'a PointsChange,
    is_back: bool,
}

impl PointsChange {
    /// From the layout before to the one after.
    pub fn forward(&self) -> Passage<'_> {
        Passage { points: self, is_back: false }
    }

    /// From the layout after to the one before.
    pub fn back(&self) -> Passage<'_> {
        Passage { points: self, is_back: true }
    }
}

impl<'a> Passage<'a> {
    /// The layout that it leads to.
    pub fn to(self) -> &'a Arc<Layout> {
        if self.is_back { &self.points.before } else { &self.points.after }
    }

    fn places(self, moved: &[Moved]) -> impl Iterator<Item = (PointPlace, PointPlace)> + '_ {
        moved.iter().map(move |it| match self.is_back {
            true => (it.after, it.before),
            false => (it.before, it.after),
        })
    }

    /// Where an input is then; `None` where it goes.
    pub fn input(self, place: PointPlace) -> Option<PointPlace> {
        self.places(&self.points.inputs).find_map(|(from, to)| (from == place).then_some(to))
    }

    /// Where an input with this first bit is then; `None` where it goes.
    pub fn input_at(self, bit: u16) -> Option<u16> {
        self.places(&self.points.inputs).find_map(|(from, to)| (from.bit == bit).then_some(to.bit))
    }

    /// Where an output is then; `None` where it goes.
    pub fn output(self, place: PointPlace) -> Option<PointPlace> {
        self.places(&self.points.outputs).find_map(|(from, to)| (from == place).then_some(to))
    }

    /// `values`, an u(i) of the layout that it leads to, with the inputs that stay as they are in `inputs`.
    pub fn inputs(self, inputs: &Image, values: &Image) -> Image {
        carried(self.places(&self.points.inputs), inputs, values)
    }

    /// As [`Self::inputs`], with the inputs that the field showed alone; `from` is the layout of `inputs`, in which the others have no value.
    pub fn field_inputs(self, from: &Layout, inputs: &Image, values: &Image) -> Image {
        let sourced: BTreeSet<usize> = from.sourced_bits().collect();
        let places = self.places(&self.points.inputs);
        let shown = places.filter(|(place, _)| !sourced.contains(&usize::from(place.bit)));
        carried(shown, inputs, values)
    }

    /// Whether the input there stays, of the layout that it leads to.
    pub fn has_input(self, place: PointPlace) -> bool {
        self.places(&self.points.inputs).any(|(_, to)| to == place)
    }

    /// `values`, a y(i) of the layout that it leads to, with the outputs that stay as they are in `outputs`.
    pub fn outputs(self, outputs: &Image, values: &Image) -> Image {
        carried(self.places(&self.points.outputs), outputs, values)
    }

    /// Settings for the layout that it leads to, with the fail-safe values and the ramps of new outputs from `theirs`, the settings of that layout's own
    /// configuration.
    pub fn fallback(self, own: &Fallback, theirs: &Fallback) -> Fallback {
        let stays =
            |ramp: &&Ramp| self.places(&self.points.outputs).all(|(_, place)| place != ramp.place);
        let moved = own
            .ramps
            .iter()
            .filter_map(|ramp| Some(Ramp { place: self.output(ramp.place)?, step: ramp.step }));
        let mut ramps: Vec<Ramp> =
            moved.chain(theirs.ramps.iter().filter(stays).copied()).collect();
        ramps.sort_by_key(|ramp| ramp.place.bit);
        Fallback {
            fail_safe: self.outputs(&own.fail_safe, &theirs.fail_safe),
            ramps,
            ..own.clone()
        }
    }
}

fn carried(
    places: impl Iterator<Item = (PointPlace, PointPlace)>,
    from: &Image,
    values: &Image,
) -> Image {
    let mut image = values.clone();
    for (before, after) in places {
        after.set(&mut image, before.get(from));
    }
    image
}

#[cfg(test)]
mod tests {
    use understudy_typed::Elementary;

    use super::*;
    use crate::fallback::{Release, StaleState, ValueFault};

    fn place(bit: u16, of: Elementary) -> PointPlace {
        PointPlace { bit, of }
    }

    /// y before: a BOOL, and an INT at 16; after: an INT at 0 that is the same, a BOOL at 16 that is new, and an INT at 32 that is new.
    fn points() -> PointsChange {
        let [old, new] = [1, 3].map(|width| Layout::booleans(0, width));
        let number = Moved { before: place(16, Elementary::Int), after: place(0, Elementary::Int) };
        PointsChange {
            before: Arc::new(old),
            after: Arc::new(new),
            inputs: vec![],
            outputs: vec![number],
        }
    }

    fn image(values: &[(PointPlace, u64)], width: usize) -> Image {
        let mut image = Image::zero(width);
        values.iter().for_each(|(place, value)| place.set(&mut image, *value));
        image
    }

    fn fallback(fail_safe: Image, ramps: &[(PointPlace, f64)], hold_cycles: u32) -> Fallback {
        Fallback {
            hold_cycles,
            trial_cycles: 0,
            fail_safe,
            ramps: ramps.iter().map(|&(place, step)| Ramp { place, step }).collect(),
            release: Release::Automatic,
            value_fault: ValueFault::Hold,
            stale_state: StaleState::Operator,
            restart: None,
        }
    }

    #[test]
    fn outputs_that_stay_take_their_fail_safe_values_and_ramps_with_them() {
        let points = points();
        let [flag, number] = [place(0, Elementary::Bool), place(16, Elementary::Int)];
        let [moved, new_flag, new_number] =
            [(0, Elementary::Int), (16, Elementary::Bool), (32, Elementary::Int)]
                .map(|(bit, of)| place(bit, of));
        let old = fallback(image(&[(flag, 1), (number, 7)], 32), &[(number, 2.0)], 3);
        let new = fallback(
            image(&[(moved, 9), (new_flag, 1), (new_number, 5)], 48),
            &[(moved, 4.0), (new_number, 8.0)],
            6,
        );
        let expected = fallback(
            image(&[(moved, 7), (new_flag, 1), (new_number, 5)], 48),
            &[(moved, 2.0), (new_number, 8.0)],
            3,
        );
        assert_eq!(points.forward().fallback(&old, &new), expected);
        let back = fallback(image(&[(flag, 1), (number, 9)], 32), &[(number, 4.0)], 6);
        assert_eq!(points.back().fallback(&new, &old), back);
    }

    #[test]
    fn values_of_points_that_stay_go_with_them() {
        let points = points();
        let held =
            image(&[(place(0, Elementary::Bool), 1), (place(16, Elementary::Int), 0xABCD)], 32);
        let other = image(&[(place(16, Elementary::Bool), 1)], 48);
        let moved = points.forward().outputs(&held, &other);
        assert_eq!(moved.words(), [0x1_ABCD]);
        assert_eq!(points.back().outputs(&moved, &Image::zero(32)).words(), [0xABCD_0000]);
        assert_eq!(points.forward().output(place(0, Elementary::Bool)), None);
        // A point of another type is another point.
        assert_eq!(points.forward().output(place(16, Elementary::Uint)), None);
    }
}
