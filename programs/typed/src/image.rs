//! Where each point of a process image stands.
//!
//! An image is a row of bits. A point takes as many as its type is wide, at a multiple of its width, in order of declaration; so one of BOOLs alone
//! is the image of a circuit, and no point crosses a word of 64 bits.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use crate::operation::number_text::DAY;
use crate::types::{Elementary, Enumeration};

/// An input or output of a program. The hash of a program covers what its `Debug` writes, so that leaves out what changes no value: a program with
/// LTIME in the place of TIME is the same one.
#[derive(Clone, PartialEq, Eq)]
pub struct Point {
    /// Its name, as declared.
    pub name: String,
    /// Its type.
    pub of: Elementary,
    /// The least and the greatest value of the subrange that it is declared with.
    pub range: Option<(i128, i128)>,
    /// The names of its values, where it is declared with an enumeration.
    pub values: Option<Arc<Enumeration>>,
    /// It is declared with the long name of its type, such as LTIME.
    pub is_long: bool,
    /// Its first bit in the image.
    pub bit: u32,
    /// Where it stands in the program's state, as a slot.
    pub slot: u32,
    /// The stored value of its variable before the first scan: that of an input that nothing drives.
    pub initial: u64,
}

/// Type, subrange and names of values, as a declaration writes them: `INT`, `INT (0..7)`, `(Off, Auto)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declared {
    /// The type.
    pub of: Elementary,
    /// The least and the greatest value of a subrange.
    pub range: Option<(i128, i128)>,
    /// The names of the values of an enumeration.
    pub values: Option<Arc<Enumeration>>,
    /// It is declared as LTIME, LDATE and the like, which have the values of TIME and DATE here.
    pub is_long: bool,
}

impl Declared {
    /// The article of its type: `an INT`, `a MODE`.
    pub fn article(&self) -> &'static str {
        let Some(known) = &self.values else {
            return self.of.article();
        };
        let is_vowel = |first: char| "aeiou".contains(first.to_ascii_lowercase());
        if known.name.starts_with(is_vowel) { "an" } else { "a" }
    }

    /// Whether every value of `sender` is one of this declaration, stored in the same bits: of two enumerations, whether each name of the sender has
    /// the same number here.
    pub fn takes(&self, sender: &Self) -> bool {
        if let (Some(own), Some(sent)) = (&self.values, &sender.values)
            && !own.has_all_of(sent)
        {
            return false;
        }
        let Some((low, high)) = self.range else {
            return self.of == sender.of;
        };
        let (least, most) = sender.range.unwrap_or_else(|| sender.of.limits());
        self.of == sender.of && low <= least && most <= high
    }

    /// Whether a stored value is one of the declaration: within its subrange, with a name where there are names, a whole day as a DATE, within a day
    /// as a TIME_OF_DAY.
    pub fn has(&self, stored: u64) -> bool {
        let of_its_type = match self.of {
            Elementary::Date => stored.cast_signed().rem_euclid(DAY) == 0,
            Elementary::TimeOfDay => (0..DAY).contains(&stored.cast_signed()),
            _ => self.values.is_none() || self.value_name(stored).is_some(),
        };
        of_its_type && self.contains(stored)
    }

    /// The whole number that is nearest to another one, of those that the declaration has.
    pub fn nearest(&self, wanted: i128) -> i128 {
        let (least, most) = self.range.unwrap_or_else(|| self.of.limits());
        let values = self.values.iter().flat_map(|known| &known.values);
        let values = values.map(|(_, value)| i128::from(*value));
        let nearest = values.min_by_key(|value| value.abs_diff(wanted));
        nearest.unwrap_or_else(|| wanted.clamp(least, most))
    }

    /// Whether a stored value is within the subrange.
    pub fn contains(&self, stored: u64) -> bool {
        self.limited(stored) == stored & self.of.mask()
    }

    /// The stored value of the subrange that is nearest to a stored value.
    pub fn limited(&self, stored: u64) -> u64 {
        let stored = stored & self.of.mask();
        let limited = |(low, high)| self.of.signed(stored).clamp(low, high) as u64 & self.of.mask();
        self.range.map_or(stored, limited)
    }

    /// A stored value as a program writes it: `Auto`, and all else as [`Elementary::text`] has it.
    pub fn text(&self, stored: u64) -> String {
        self.value_name(stored).map_or_else(|| self.long(self.of.text(stored)), str::to_owned)
    }

    /// The literal of a time in the form of its declaration: `LT#1s` of an LTIME.
    pub(crate) fn long(&self, literal: String) -> String {
        if self.is_long && literal.contains('#') { format!("L{literal}") } else { literal }
    }

    /// The name of a stored value of an enumeration; of several the first.
    pub fn value_name(&self, stored: u64) -> Option<&str> {
        let number = self.of.signed(stored);
        let mut values = self.values.as_ref()?.values.iter();
        let (name, _) = values.find(|(_, value)| i128::from(*value) == number)?;
        Some(name)
    }

    /// The stored value of this name of an enumeration, `Auto` or `MODE#Auto`, in any case of letters.
    pub fn value_named(&self, text: &str) -> Option<u64> {
        let known = self.values.as_ref()?;
        let name = match text.rsplit_once('#') {
            Some((of, name)) if of.eq_ignore_ascii_case(&known.name) => name,
            Some(_) => return None,
            None => text,
        };
        let (_, value) = known.values.iter().find(|(it, _)| it.eq_ignore_ascii_case(name))?;
        Some(*value as u64 & self.of.mask())
    }
}

impl From<Elementary> for Declared {
    fn from(of: Elementary) -> Self {
        Self { of, range: None, values: None, is_long: false }
    }
}

impl fmt::Display for Declared {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.values, self.range) {
            (Some(known), _) if !known.name.is_empty() => formatter.write_str(&known.name),
            (Some(known), _) => {
                let names: Vec<&str> = known.values.iter().map(|(name, _)| name.as_str()).collect();
                write!(formatter, "({})", names.join(", "))
            }
            (None, Some((low, high))) => write!(formatter, "{} ({low}..{high})", self.of),
            (None, None) if self.is_long => write!(formatter, "L{}", self.of),
            (None, None) => self.of.fmt(formatter),
        }
    }
}

impl fmt::Debug for Point {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, of, range, values, is_long: _, bit, slot, initial } = self;
        formatter
            .debug_struct("Point")
            .field("name", name)
            .field("of", of)
            .field("range", range)
            .field("values", values)
            .field("bit", bit)
            .field("slot", slot)
            .field("initial", initial)
            .finish()
    }
}

impl Point {
    /// How it is declared.
    pub fn declared(&self) -> Declared {
        let Self { of, range, is_long, .. } = *self;
        Declared { of, range, values: self.values.clone(), is_long }
    }

    /// Its value in a packed image, zero-extended.
    ///
    /// # Panics
    /// If the image is shorter than the point needs.
    #[inline]
    pub fn get(&self, image: &[u64]) -> u64 {
        image[self.bit as usize / 64] >> (self.bit % 64) & self.of.mask()
    }

    /// Writes its value into a packed image.
    ///
    /// # Panics
    /// If the image is shorter than the point needs.
    #[inline]
    pub fn set(&self, image: &mut [u64], value: u64) {
        let word = &mut image[self.bit as usize / 64];
        let shift = self.bit % 64;
        *word = *word & !(self.of.mask() << shift) | (value & self.of.mask()) << shift;
    }
}

/// The points of an image, in order of declaration.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Points {
    points: Vec<Point>,
    width: u32,
}

impl Points {
    /// Appends a point at the next multiple of its width.
    pub fn push(&mut self, name: impl Into<String>, of: Elementary, slot: u32) {
        self.push_declared(name, of.into(), slot);
    }

    /// As [`Self::push`], of a point that may have a subrange or names of values.
    pub fn push_declared(&mut self, name: impl Into<String>, declared: Declared, slot: u32) {
        let Declared { of, range, values, is_long } = declared;
        let bit = self.width.next_multiple_of(of.bits());
        self.width = bit + of.bits();
        let name = name.into();
        self.points.push(Point { name, of, range, values, is_long, bit, slot, initial: 0 });
    }

    /// Tells which points are declared with the long name of their type.
    pub fn declare_long(&mut self, is_long: impl Fn(&Point) -> bool) {
        for point in &mut self.points {
            point.is_long = is_long(point);
        }
    }

    /// Gives each point the initial value of its variable.
    pub(crate) fn begin_with(&mut self, state: &[u64]) {
        for point in self.points.iter_mut().filter(|point| point.slot != 0) {
            point.initial = state.get(point.slot as usize).copied().unwrap_or(0) & point.of.mask();
        }
    }

    /// Puts the points of these names first, in this order.
    pub fn put_first<'a>(&mut self, names: impl Iterator<Item = &'a str>) {
        let mut places: HashMap<&str, usize> = HashMap::new();
        for (place, name) in names.enumerate() {
            places.entry(name).or_insert(place);
        }
        let mut points = std::mem::take(self).points;
        points.sort_by_key(|point| places.get(point.name.as_str()).copied().unwrap_or(usize::MAX));
        for point in points {
            let declared = point.declared();
            self.push_declared(point.name, declared, point.slot);
            if let Some(last) = self.points.last_mut() {
                last.initial = point.initial;
            }
        }
    }

    /// Whether another image has the same points at the same places, whatever their values are before the first scan.
    pub fn are_laid_out_as(&self, other: &Self) -> bool {
        let place = |point: &Point| (point.bit, point.declared());
        self.len() == other.len()
            && self
                .iter()
                .zip(other.iter())
                .all(|(own, its)| own.name == its.name && place(own) == place(its))
    }

    /// The image of all initial values.
    pub fn initial_image(&self) -> Vec<u64> {
        let mut image = vec![0; self.width().div_ceil(64)];
        for point in &self.points {
            point.set(&mut image, point.initial);
        }
        image
    }

    /// The point of a name.
    pub fn find(&self, name: &str) -> Option<&Point> {
        self.points.iter().find(|point| point.name == name)
    }

    /// The names of all points, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.points.iter().map(|point| point.name.as_str())
    }

    pub(crate) fn names_mut(&mut self) -> impl Iterator<Item = &mut String> {
        self.points.iter_mut().map(|point| &mut point.name)
    }

    /// A name for each bit of the image: that of its point where it is a BOOL, else `NAME.0` for its lowest bit and so on; empty for a bit of no
    /// point.
    pub fn bit_names(&self) -> Vec<String> {
        let mut names = vec![String::new(); self.width()];
        for point in &self.points {
            let first = point.bit as usize;
            for (place, name) in names[first..][..point.of.bits() as usize].iter_mut().enumerate() {
                *name = match point.of {
                    Elementary::Bool => point.name.clone(),
                    _ => format!("{}.{place}", point.name),
                };
            }
        }
        names
    }

    /// Bits of the image.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// The points, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Point> {
        self.points.iter()
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

impl<'a> IntoIterator for &'a Points {
    type Item = &'a Point;
    type IntoIter = std::slice::Iter<'a, Point>;

    fn into_iter(self) -> Self::IntoIter {
        self.points.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(values: &[(&str, i64)]) -> Declared {
        let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let known = Enumeration { name: "Mode".to_owned(), values };
        Declared { values: Some(Arc::new(known)), ..Elementary::Int.into() }
    }

    #[test]
    fn a_receiver_has_the_values_of_its_sender_by_name() {
        let sender = mode(&[("Off", 0), ("Auto", 1)]);
        assert!(mode(&[("AUTO", 1), ("Off", 0), ("Man", 2)]).takes(&sender));
        for receiver in [&[("Auto", 0), ("Off", 1)][..], &[("Off", 0)], &[("A", 0), ("B", 1)]] {
            assert!(!mode(receiver).takes(&sender), "{receiver:?}");
        }
        let number = Declared::from(Elementary::Int);
        assert!(number.takes(&sender) && sender.takes(&number));
    }

    #[test]
    fn a_value_is_one_of_the_declaration() {
        let known = mode(&[("Auto", 5), ("Fault", -1)]);
        assert!(known.has(5) && known.has(0xffff) && !known.has(0));
        assert_eq!((known.nearest(0), known.nearest(100)), (-1, 5));
        let range = Declared { range: Some((4, 9)), ..Elementary::Int.into() };
        assert!(range.has(4) && !range.has(3));
        assert_eq!((range.nearest(0), range.nearest(100)), (4, 9));
        let day = 86_400_000_000_000;
        let [date, time] = [Elementary::Date, Elementary::TimeOfDay].map(Declared::from);
        assert!(date.has(day) && date.has(0) && !date.has(5));
        assert!(time.has(day - 1) && !time.has(day) && !time.has(u64::MAX));
    }

    /// A value that is kept keeps its name, and not its number.
    #[test]
    fn an_input_is_carried_by_the_name_of_its_value() {
        let points = |declared: Declared| {
            let mut points = Points::default();
            points.push_declared("want", declared, 4);
            points
        };
        let old = points(mode(&[("Off", 0), ("Auto", 1)]));
        let names = [["want", "want"].map(str::to_owned)];
        let carried = |new: Declared, stored: u64| {
            let new = points(new);
            let mut image = vec![0x7777];
            let lost = new.carry(&mut image, (&old, &[stored]), &names);
            lost.is_empty().then(|| image[0])
        };
        assert_eq!(carried(mode(&[("Man", 0), ("Off", 1), ("Auto", 2)]), 1), Some(2));
        assert_eq!(carried(mode(&[("Off", 0)]), 1), None);
        assert_eq!(carried(mode(&[("Off", 0), ("Auto", 1)]), 7), None);
        assert_eq!(carried(Elementary::Int.into(), 1), Some(1));
    }

    /// The hash of a program is of this text: stations and files of before know programs by it.
    #[test]
    fn what_the_hash_covers_of_a_point_stays() {
        let mut points = Points::default();
        points.push("t", Elementary::Time, 4);
        let text = "Point { name: \"t\", of: Time, range: None, values: None, bit: 0, slot: 4, initial: 0 }";
        for is_long in [false, true] {
            points.declare_long(|_| is_long);
            assert_eq!(format!("{:?}", points.iter().next().expect("a point")), text);
        }
    }
}
