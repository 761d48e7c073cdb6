//! Initial contents of memory: the slots that are not 0.

use std::collections::BTreeMap;
use std::rc::Rc;

use understudy_typed::{Initial, Type};

/// Slots that are not 0, in order, counted from the start of a variable.
pub(super) type Image = Rc<[(u32, u64)]>;

/// One that is all 0.
pub(super) fn zero() -> Image {
    Rc::from([])
}

/// An image that is being made.
#[derive(Debug, Clone, Default)]
pub(super) struct Builder {
    slots: BTreeMap<u32, u64>,
}

impl Builder {
    /// Begins with an image.
    pub(super) fn of(image: &Image) -> Self {
        Self { slots: image.iter().copied().collect() }
    }

    /// Writes bits that do not cross a slot.
    pub(super) fn set(&mut self, bit: u64, width: u32, value: u64) {
        let Ok(slot) = u32::try_from(bit / 64) else {
            return;
        };
        let shift = (bit % 64) as u32;
        let mask = (u64::MAX >> (64 - width)) << shift;
        let old = self.slots.get(&slot).copied().unwrap_or(0);
        let new = old & !mask | (value << shift) & mask;
        if new == 0 {
            self.slots.remove(&slot);
        } else {
            self.slots.insert(slot, new);
        }
    }

    /// Writes the variable of a type, which begins at a bit.
    pub(super) fn put(&mut self, bit: u64, of: &Type, image: &Image) {
        if let Some(elementary) = of.elementary() {
            let value = image.first().map_or(0, |(_, value)| *value);
            self.set(bit, elementary.bits(), value);
            return;
        }
        let Ok(start) = u32::try_from(bit / 64) else {
            return;
        };
        let end = start.saturating_add(u32::try_from(of.slots()).unwrap_or(u32::MAX));
        let old: Vec<u32> = self.slots.range(start..end).map(|(slot, _)| *slot).collect();
        for slot in old {
            self.slots.remove(&slot);
        }
        for (slot, value) in image.iter() {
            self.slots.insert(start + slot, *value);
        }
    }

    /// Writes a text.
    pub(super) fn text(&mut self, bit: u64, bytes: &[u8]) {
        self.set(bit, 64, bytes.len() as u64);
        for (at, byte) in bytes.iter().enumerate() {
            self.set(bit + 64 + at as u64 * 8, 8, u64::from(*byte));
        }
    }

    pub(super) fn done(self) -> Image {
        self.slots.into_iter().collect()
    }
}

/// An image at a place of the program's memory.
pub(super) fn initial(image: &Image, start: u32) -> impl Iterator<Item = Initial> + '_ {
    image.iter().map(move |(slot, value)| Initial { slot: start + slot, value: *value })
}
