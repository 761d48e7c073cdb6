//! Ramps: a numeric output moves to its fail-safe value by a bounded amount from one deadline to the next.
//!
//! A ramp begins at the value that was applied last, proven or held. A remote I/O that has applied nothing yet knows no such value,
//! and drives the fail-safe value at once. Every value follows from the first one and the number of deadlines, so no error of
//! rounding adds up.

use understudy_wire::Image;

use crate::place::PointPlace;

/// Ramp of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Place in y(i); its type is an integer or a real.
    pub place: PointPlace,
    /// Greatest change from one deadline to the next, in units of the output; above 0.
    pub step: f64,
}

impl Ramp {
    /// The stored value of the output after a number of deadlines on its way between two stored values.
    pub fn value(self, from: u64, to: u64, deadlines: u32) -> u64 {
        let of = self.place.of;
        let change = self.step * f64::from(deadlines);
        if of.is_real() {
            let (start, end) = (of.number(from), of.number(to));
            let way = end - start;
            // Also where there is no number to start from.
            if way.is_nan() || way.abs() <= change || !start.is_finite() {
                return to;
            }
            let value = start + change.copysign(way);
            return match of.bits() {
                32 => u64::from((value as f32).to_bits()),
                _ => value.to_bits(),
            };
        }
        let (start, end) = (of.signed(from), of.signed(to));
        let change = change as i128;
        let value = end.clamp(start.saturating_sub(change), start.saturating_add(change));
        value as u64 & of.mask()
    }
}

/// Outputs on their way to the fail-safe values.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Descent {
    from: Image,
    deadlines: u32,
}

impl Descent {
    /// Begins at the outputs that were applied last.
    pub fn new(from: Image) -> Self {
        Self { from, deadlines: 0 }
    }

    /// The outputs at the next deadline; `fail_safe` itself once all ramps have ended.
    pub fn next(&mut self, fail_safe: &Image, ramps: &[Ramp]) -> Image {
        self.deadlines = self.deadlines.saturating_add(1);
        let mut outputs = fail_safe.clone();
        for ramp in ramps {
            let (from, to) = (ramp.place.get(&self.from), ramp.place.get(fail_safe));
            let value = ramp.value(from, to, self.deadlines);
            ramp.place.set(&mut outputs, value);
        }
        outputs
    }
}

#[cfg(test)]
mod tests {
    use understudy_typed::Elementary;

    use super::*;

    fn check(of: Elementary, step: f64, from: u64, to: u64, expected: &[u64]) {
        let place = PointPlace { bit: 0, of };
        let ramp = Ramp { place, step };
        for (deadlines, expected) in (1..).zip(expected) {
            let found = ramp.value(from, to, deadlines);
            assert_eq!(found, *expected, "{of:?} after {deadlines} deadlines");
        }
    }

    #[test]
    fn reals_move_by_their_step_and_end_at_the_value_itself() {
        let real = |value: f32| u64::from(value.to_bits());
        let down = [real(7.5), real(5.0), real(2.5), real(1.0), real(1.0)];
        check(Elementary::Real, 2.5, real(10.0), real(1.0), &down);
        let up = [(-0.75f64).to_bits(), (-0.5f64).to_bits(), (-0.5f64).to_bits()];
        check(Elementary::Lreal, 0.25, (-1.0f64).to_bits(), (-0.5f64).to_bits(), &up);
        check(Elementary::Real, 2.5, real(f32::NAN), real(1.0), &[real(1.0)]);
        check(Elementary::Real, 2.5, real(f32::INFINITY), real(1.0), &[real(1.0)]);
    }

    #[test]
    fn integers_move_by_less_than_one_a_deadline_too() {
        check(Elementary::Int, 0.4, 3, 0, &[3, 3, 2, 2, 1, 1, 1, 0, 0]);
        let below = |value: i16| u64::from(value as u16);
        check(Elementary::Int, 2.0, below(-3), 2, &[below(-1), 1, 2, 2]);
        check(Elementary::Ulint, 1e30, u64::MAX, 5, &[5]);
        check(Elementary::Ulint, 1.0, u64::MAX, 5, &[u64::MAX - 1, u64::MAX - 2]);
    }

    #[test]
    fn outputs_without_a_ramp_change_at_once() {
        let place = PointPlace { bit: 16, of: Elementary::Int };
        let image = |switch: u64, number: u64| {
            let mut image = Image::zero(32);
            PointPlace { bit: 0, of: Elementary::Int }.set(&mut image, switch);
            place.set(&mut image, number);
            image
        };
        let mut descent = Descent::new(image(1, 10));
        let ramps = [Ramp { place, step: 4.0 }];
        let driven = [(); 4].map(|()| descent.next(&image(9, 0), &ramps));
        assert_eq!(driven, [image(9, 6), image(9, 2), image(9, 0), image(9, 0)]);
    }
}
