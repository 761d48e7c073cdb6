//! The value of a point in an image that is written as bits, `0110`.

use serde_json::Value;
use understudy_cluster::Controller;
use understudy_typed::{Elementary, Point};
use understudy_wire::{Force, SignalPlace};

/// The bits of a point as they are stored; nothing where the text ends before them.
pub fn stored(point: &Point, bits: &str) -> Option<u64> {
    let first = point.bit as usize;
    let own = bits
        .as_bytes()
        .get(first..first + point.of.bits() as usize)?;
    let shifted = own.iter().rev();
    Some(shifted.fold(0, |value, &bit| value << 1 | u64::from(bit == b'1')))
}

/// The value of a point for a program that reads it: a BOOL as true or false, an integer or bit string as a number, a real as a number or, where
/// it is none, as null; a time as a number of nanoseconds.
pub fn value_of(point: &Point, bits: &str) -> Option<Value> {
    let value = stored(point, bits)?;
    Some(match point.of {
        Elementary::Bool => Value::Bool(value != 0),
        of => number(of, value),
    })
}

/// The value of a point in a packed image, for drawing: a BOOL as 0 or 1, all else as [`value_of`] has it.
pub fn number_of(point: &Point, words: &[u64]) -> Value {
    number(point.of, point.get(words))
}

/// The point of a program that is forced; nothing where the program has none of that place and width.
pub fn forced_point<'a>(controller: &'a Controller, force: &Force) -> Option<&'a Point> {
    let points = match force.signal {
        SignalPlace::Input(_) => &controller.interface.inputs,
        SignalPlace::Output(_) => &controller.interface.outputs,
    };
    let (bit, width) = (force.signal.first_bit(), force.value.width());
    let is_it = |point: &&Point| (point.bit, point.of.bits()) == (u32::from(bit), u32::from(width));
    points.iter().find(is_it)
}

/// The forced value of a point as [`value_of`] has it.
pub fn forced_value(point: &Point, force: &Force) -> Value {
    match point.of {
        Elementary::Bool => Value::Bool(force.value.stored() != 0),
        of => number(of, force.value.stored()),
    }
}

fn number(of: Elementary, value: u64) -> Value {
    match of {
        // The shortest decimal that reads back as the same binary32.
        Elementary::Real => {
            let real = f32::from_bits(value as u32).to_string();
            Value::from(real.parse::<f64>().ok().filter(|real| real.is_finite()))
        }
        Elementary::Lreal => {
            Value::from(Some(f64::from_bits(value)).filter(|real| real.is_finite()))
        }
        of => match i64::try_from(of.signed(value)) {
            Ok(number) => number.into(),
            Err(_) => value.into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use understudy_typed::Points;

    use super::*;

    #[test]
    fn values_are_those_of_the_image() {
        let mut points = Points::default();
        for (name, of) in [
            ("on", Elementary::Bool),
            ("count", Elementary::Int),
            ("level", Elementary::Real),
            ("mask", Elementary::Lword),
        ] {
            points.push(name, of, 0);
        }
        let mut words = vec![0; points.width().div_ceil(64)];
        let stored = [1, (-5i16) as u16 as u64, 12.1f32.to_bits().into(), u64::MAX];
        for (point, value) in points.iter().zip(stored) {
            point.set(&mut words, value);
        }
        let bits: String = (0..points.width())
            .map(|bit| {
                if words[bit / 64] >> (bit % 64) & 1 == 1 {
                    '1'
                } else {
                    '0'
                }
            })
            .collect();
        let found: Vec<Value> = points
            .iter()
            .filter_map(|point| value_of(point, &bits))
            .collect();
        let expected: [Value; 4] = [true.into(), (-5).into(), 12.1.into(), u64::MAX.into()];
        assert_eq!(found, expected);
        let last = points.iter().next_back().expect("a point");
        assert_eq!(value_of(last, &bits[1..]), None);
    }
}
