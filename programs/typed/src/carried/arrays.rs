//! Elements of arrays: an element keeps its indices, whatever the bounds have become.

use super::{CarriedPath, Fate, Spot, Walk, conversion};
use crate::naming::indices;
use crate::types::{Array, Type};

/// Least and greatest index of each dimension that two arrays share; none where they share no element, or have different dimensions.
fn shared(one: &Array, other: &Array) -> Option<Vec<(i64, i64)>> {
    if one.ranges.len() != other.ranges.len() {
        return None;
    }
    let ranges = one.ranges.iter().zip(&other.ranges);
    let both = ranges.map(|(one, other)| (one.0.max(other.0), one.1.min(other.1)));
    both.map(|(low, high)| (low <= high).then_some((low, high))).collect()
}

/// Where an element of `shared` is in an array.
fn place(array: &Array, shared: &Array, element: u64) -> u64 {
    let (mut rest, mut place, mut row) = (element, 0, 1);
    for (&(low, high), &(first, last)) in array.ranges.iter().zip(&shared.ranges).rev() {
        let length = last.abs_diff(first) + 1;
        place += row * (first.abs_diff(low) + rest % length);
        rest /= length;
        row *= high.abs_diff(low) + 1;
    }
    place
}

impl<'p> Walk<'p> {
    pub(super) fn array(&mut self, path: &str, from: Spot<'p>, to: Spot<'p>) -> Vec<CarriedPath> {
        let (Type::Array(old), Type::Array(new)) = (from.of, to.of) else {
            return Vec::new();
        };
        let Some(ranges) = shared(old, new) else {
            return vec![self.entry(path, Fate::Dropped, Some(from), Some(to))];
        };
        let both = Array { ranges, element: new.element.clone() };
        let bounds = both.ranges.iter().map(|(low, high)| format!("{low}..{high}"));
        let bounds = format!("[{}]", bounds.collect::<Vec<_>>().join(","));
        let mut parts = if new.element.elementary().is_some() {
            self.packed(&format!("{path}{bounds}"), (from, old), (to, new), &both)
        } else {
            self.elements(path, (from, old), (to, new), &both)
        };
        let (has_all, is_all) = (both.length() == old.length(), both.length() == new.length());
        if has_all && is_all {
            return self.together(path, parts, (from, to));
        }
        // Elements that only one of them has.
        let outside = format!("{path} outside of {bounds}");
        if !has_all {
            parts.push(self.entry(&outside, Fate::Dropped, Some(from), None));
        }
        if !is_all {
            parts.push(self.entry(&outside, Fate::New, None, Some(to)));
        }
        parts
    }

    fn elements(
        &mut self,
        path: &str,
        (from, old): (Spot<'p>, &'p Array),
        (to, new): (Spot<'p>, &'p Array),
        both: &Array,
    ) -> Vec<CarriedPath> {
        let spot = |first: Spot<'p>, array: &'p Array, element: u64| Spot {
            of: &array.element,
            slot: first.slot + (element * array.stride() / 64) as u32,
        };
        let mut parts = Vec::new();
        for element in 0..both.length() {
            let before = spot(from, old, place(old, both, element));
            let now = spot(to, new, place(new, both, element));
            let name = format!("{path}{}", indices(both, element).unwrap_or_default());
            parts.extend(self.part(&name, Some(before), Some(now)));
        }
        parts
    }

    /// Elements that stand packed, several in a slot.
    fn packed(
        &mut self,
        path: &str,
        (from, old): (Spot<'p>, &'p Array),
        (to, new): (Spot<'p>, &'p Array),
        both: &Array,
    ) -> Vec<CarriedPath> {
        let elements = |fate| CarriedPath {
            path: path.to_owned(),
            fate,
            renamed_from: None,
            before: Some(self.old.type_name(&old.element)),
            now: Some(self.new.type_name(&new.element)),
        };
        let (Some(before), Some(now)) = (old.element.elementary(), new.element.elementary()) else {
            return vec![elements(Fate::Dropped)];
        };
        let conversion = conversion((self.old, &old.element), (self.new, &new.element));
        let Some(conversion) = conversion else {
            return vec![elements(Fate::Dropped)];
        };
        let mut parts = vec![elements(super::taken(&conversion))];
        let at = |first: Spot<'_>, bits: u64| {
            let address = 64 * u64::from(first.slot) + bits;
            ((address / 64) as usize, address % 64)
        };
        let mut dropped = Vec::new();
        for element in 0..both.length() {
            let (slot, bit) = at(from, place(old, both, element) * old.stride());
            let value = self.kept[slot] >> bit & before.mask();
            let is_retentive = |program: &crate::form::Program, slot| program.retains(slot as u32);
            let (target, shift) = at(to, place(new, both, element) * new.stride());
            let value = conversion.of(value).filter(|_| is_retentive(self.old, slot));
            self.comes_from(64 * slot as u64 + bit, 64 * target as u64 + shift, Some(&conversion));
            match value.filter(|_| is_retentive(self.new, target)) {
                Some(_) if !(self.told.is_known)(64 * slot as u64 + bit) => {
                    if (self.told.is_read)(64 * target as u64 + shift) {
                        dropped.push(element);
                    }
                }
                Some(value) => {
                    let word = &mut self.state[target];
                    *word = *word & !(now.mask() << shift) | value << shift;
                }
                None => dropped.push(element),
            }
        }
        if dropped.len() as u64 == both.length() {
            return vec![CarriedPath { fate: Fate::Dropped, ..parts.remove(0) }];
        }
        for element in dropped {
            let name = indices(both, element).unwrap_or_default();
            let array = path.rsplit_once('[').map_or(path, |(array, _)| array);
            let entry = parts[0].clone();
            parts.push(CarriedPath {
                path: format!("{array}{name}"),
                fate: Fate::Dropped,
                ..entry
            });
        }
        parts
    }
}
