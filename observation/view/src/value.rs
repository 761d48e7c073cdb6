//! The value of a point in an image that is written as bits, `0110`.

use serde_json::Value;
use understudy_cluster::{Card, Controller};
use understudy_typed::{Declared, Elementary, Point, Points, Program};
use understudy_wire::{Force, Image, SignalPlace};

/// The bits of a point as they are stored; nothing where the text ends before them.
pub fn stored(point: &Point, bits: &str) -> Option<u64> {
    let first = point.bit as usize;
    let own = bits.as_bytes().get(first..first + point.of.bits() as usize)?;
    let shifted = own.iter().rev();
    Some(shifted.fold(0, |value, &bit| value << 1 | u64::from(bit == b'1')))
}

/// The value of a point for a program that reads it: a BOOL as true or false, an integer or bit string as a number, a real as a number or, where
/// it is none, as null; a duration as a number of nanoseconds, a date or a time of day as a text, a value of an enumeration by its name.
pub fn value_of(point: &Point, bits: &str) -> Option<Value> {
    let value = stored(point, bits)?;
    Some(shown(&point.declared(), value))
}

/// The value of a point in an image, as [`value_of`] has it.
pub(crate) fn value_in(point: &Point, image: &Image) -> Value {
    shown(&point.declared(), point.get(image.words()))
}

/// The values of all points of an image, by name.
pub(crate) fn named(points: &Points, image: &Image) -> impl Iterator<Item = (String, Value)> {
    let points = points.iter();
    points.map(|point| (point.name.clone(), value_in(point, image)))
}

/// A stored value of what is declared so, as [`value_of`] has it.
pub fn shown(declared: &Declared, stored: u64) -> Value {
    match declared.of {
        Elementary::Bool | Elementary::Time => number(declared.of, stored),
        of if of.is_time() => Value::String(stored_text(declared, stored)),
        of => match declared.value_name(stored) {
            Some(name) => name.into(),
            None => number(of, stored),
        },
    }
}

/// A stored value as people read it: a BOOL as 0 or 1, a duration with its unit.
pub(crate) fn stored_text(declared: &Declared, stored: u64) -> String {
    if declared.of.is_time() {
        // A file has them in quotes.
        return understudy_cluster::value_text(declared, stored).replace('"', "");
    }
    value_text(&shown(declared, stored))
}

/// A stored value as a scale shows it: with the decimals and the unit of its card.
pub(crate) fn card_text(card: &Card, declared: &Declared, stored: u64) -> String {
    let rounded = card.rounded(declared, stored);
    card.with_unit(rounded.unwrap_or_else(|| stored_text(declared, stored)))
}

/// The values of the declared points of an image as people read them, with all digits: `level = 2.5 m, run = 1`.
pub(crate) fn named_text(points: &Points, image: &Image, card: impl Fn(&str) -> Card) -> String {
    let points = points.iter().filter(|point| is_declared(&point.name));
    let texts = points.map(|point| {
        let text = card(&point.name).with_unit(point_text(point, image));
        format!("{} = {text}", point.name)
    });
    texts.collect::<Vec<String>>().join(", ")
}

/// The value of a point in an image as people read it.
pub(crate) fn point_text(point: &Point, image: &Image) -> String {
    stored_text(&point.declared(), point.get(image.words()))
}

/// Whether a program has points that are numbers.
pub(crate) fn has_numbers(controller: &Controller) -> bool {
    let interface = &controller.interface;
    interface.inputs.iter().chain(&interface.outputs).any(|point| point.of != Elementary::Bool)
}

/// Whether a program declares the point of this name: its reset and its fault are told by events of their own.
pub(crate) fn is_declared(name: &str) -> bool {
    ![Program::RESET, Program::FAULT].contains(&name)
}

/// A value as people read it: a BOOL as 0 or 1.
pub(crate) fn value_text(value: &Value) -> String {
    match value {
        Value::Bool(value) => u8::from(*value).to_string(),
        Value::Null => "not a finite number".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A stored value of a point, for drawing: a BOOL as 0 or 1, all else as a number.
pub fn number_of(point: &Point, stored: u64) -> Value {
    match point.of {
        Elementary::Bool => stored.into(),
        of => number(of, stored),
    }
}

/// The same as a real number; not a number where it is none.
pub(crate) fn real_of(point: &Point, words: &[u64]) -> f64 {
    point.of.number(point.get(words))
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
    shown(&point.declared(), force.value.stored())
}

/// A stored value as a number; a BOOL as true or false.
pub(crate) fn number(of: Elementary, value: u64) -> Value {
    match of {
        Elementary::Bool => Value::Bool(value != 0),
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
            .map(|bit| if words[bit / 64] >> (bit % 64) & 1 == 1 { '1' } else { '0' })
            .collect();
        let found: Vec<Value> = points.iter().filter_map(|point| value_of(point, &bits)).collect();
        let expected: [Value; 4] = [true.into(), (-5).into(), 12.1.into(), u64::MAX.into()];
        assert_eq!(found, expected);
        let last = points.iter().next_back().expect("a point");
        assert_eq!(value_of(last, &bits[1..]), None);
    }
}
