//! Numbers that two modules drive together, such as two current outputs into one load: what they drive adds up, so each drives a part.
//!
//! | one module | the other one |
//! |---|---|
//! | nothing | the whole |
//! | half | half |
//! | the whole | nothing |

use understudy_typed::Elementary;
use understudy_wire::{Image, Share};

use crate::place::PointPlace;

/// The outputs of a program that two modules drive together.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct SharedOutputs {
    /// Whole numbers and reals, in the order of their bits.
    pub places: Vec<PointPlace>,
    /// Periods that a module may take to drive what it is told to, longer than one that is simulated: those of a device that is slow to answer.
    pub delay: u32,
}

impl SharedOutputs {
    /// Whether a number of this type can be shared.
    pub fn can_share(of: Elementary) -> bool {
        of.is_real() || of.is_integer()
    }

    /// The outputs as one module drives them: its share of each of these numbers, and all else whole. Two halves make the whole.
    pub fn part(&self, outputs: &Image, share: Share, is_twin: bool) -> Image {
        let mut part = outputs.clone();
        for place in &self.places {
            let value = match share {
                Share::Nothing => 0,
                Share::Half => half(*place, place.get(outputs), is_twin),
                Share::Whole => continue,
            };
            place.set(&mut part, value);
        }
        part
    }

    /// What actuators get of modules that drive this: a bit is 1 where one of them drives it, and shared numbers add up.
    pub fn sum<'a>(&self, width: usize, driven: impl Iterator<Item = &'a Image>) -> Image {
        let mut all = Image::zero(width);
        for outputs in driven {
            let sums = self.places.iter().map(|place| {
                let both = [&all, outputs].map(|image| place.get(image));
                (*place, add(*place, both))
            });
            let sums: Vec<(PointPlace, u64)> = sums.collect();
            all.unite(outputs);
            sums.into_iter().for_each(|(place, sum)| place.set(&mut all, sum));
        }
        all
    }

    /// Whether each of these numbers lies between 0 and one of what was to be driven.
    pub fn is_within<'a>(
        &self,
        found: &Image,
        whole: impl Iterator<Item = &'a Image> + Clone,
    ) -> bool {
        self.places.iter().all(|place| {
            let found = place.of.number(place.get(found));
            let mut bounds = whole.clone().map(|image| place.of.number(place.get(image)));
            found == 0.0
                || bounds
                    .any(|bound| found.signum() == bound.signum() && found.abs() <= bound.abs())
        })
    }
}

/// Half of a stored number. The first module drives the larger half of an odd one.
fn half(place: PointPlace, stored: u64, is_twin: bool) -> u64 {
    let of = place.of;
    if of.is_real() {
        return real_bits(of, of.number(stored) / 2.0);
    }
    let value = of.signed(stored);
    let of_twin = value / 2;
    let half = if is_twin { of_twin } else { value - of_twin };
    half as u64 & of.mask()
}

fn add(place: PointPlace, [one, other]: [u64; 2]) -> u64 {
    let of = place.of;
    if of.is_real() {
        return real_bits(of, of.number(one) + of.number(other));
    }
    let sum = of.signed(one) + of.signed(other);
    // More than the type has is not the remainder of it.
    let most = i128::from(of.mask() >> u32::from(of.is_signed()));
    let least = if of.is_signed() { -most - 1 } else { 0 };
    sum.clamp(least, most) as u64 & of.mask()
}

fn real_bits(of: Elementary, value: f64) -> u64 {
    match of {
        Elementary::Real => u64::from((value as f32).to_bits()),
        _ => value.to_bits(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(of: Elementary, stored: u64, halves: [u64; 2]) {
        let place = PointPlace { bit: 1, of };
        let shared = SharedOutputs { places: vec![place], delay: 0 };
        let width = 1 + of.bits() as usize;
        let mut whole = Image::zero(width);
        whole.set(0, true);
        place.set(&mut whole, stored);
        let parts = [false, true].map(|is_twin| shared.part(&whole, Share::Half, is_twin));
        assert_eq!(parts.each_ref().map(|part| place.get(part)), halves, "{of} {stored:#x}");
        assert!(parts.iter().all(|part| part.get(0)), "a bit is no number");
        assert_eq!(shared.sum(width, parts.iter()), whole, "{of} {stored:#x}");
        let nothing = shared.part(&whole, Share::Nothing, true);
        assert_eq!(place.get(&nothing), 0);
        assert_eq!(shared.part(&whole, Share::Whole, true), whole);
        assert_eq!(shared.sum(width, [&whole, &nothing].into_iter()), whole);
        for part in parts.iter().chain([&nothing, &whole]) {
            assert!(shared.is_within(part, std::iter::once(&whole)), "{of} {stored:#x}");
        }
        let more = shared.sum(width, [&whole, &parts[1]].into_iter());
        let is_more = place.get(&parts[1]) != 0;
        assert_eq!(shared.is_within(&more, std::iter::once(&whole)), !is_more, "{of} {stored:#x}");
    }

    #[test]
    fn two_halves_make_the_whole_and_a_half_more_is_found() {
        check(Elementary::Int, 7, [4, 3]);
        check(Elementary::Int, 1, [1, 0]);
        check(Elementary::Int, 0, [0, 0]);
        check(Elementary::Int, 0xFFF9, [0xFFFC, 0xFFFD]);
        check(Elementary::Uint, 0x9001, [0x4801, 0x4800]);
        check(Elementary::Usint, 201, [101, 100]);
        let real = |value: f32| u64::from(value.to_bits());
        check(Elementary::Real, real(12.5), [real(6.25); 2]);
        check(Elementary::Real, real(-3.0), [real(-1.5); 2]);
        check(Elementary::Lreal, 5.5_f64.to_bits(), [2.75_f64.to_bits(); 2]);
    }

    /// A sum that the type does not hold is the end of it, and no small number.
    #[test]
    fn a_sum_is_not_wrapped() {
        for (of, value, end) in [
            (Elementary::Usint, 200, 255),
            (Elementary::Sint, 100, 127),
            (Elementary::Sint, 0x90, 0x80),
        ] {
            let place = PointPlace { bit: 0, of };
            assert_eq!(add(place, [value; 2]), end, "{of}");
        }
    }
}
