//! The row of slots that instructions work on.
//!
//! A row of [`SLOTS`] is what nearly every program needs: an operand is cut to 16 bits, which is always a slot of it, so no operand is checked while
//! a scan runs. [`crate::machine::compile`] makes operands below the length of the row only. Only a larger row checks each operand.

/// Slots of a row whose operands need no check.
pub(crate) const SLOTS: usize = 1 << 16;

pub(crate) trait Row {
    /// What the slot of an operand has.
    fn get(&self, operand: u32) -> u64;
    /// The slot of an operand.
    fn slot(&mut self, operand: u32) -> &mut u64;
    /// All slots.
    fn all(&mut self) -> &mut [u64];
}

impl Row for [u64; SLOTS] {
    #[inline(always)]
    fn get(&self, operand: u32) -> u64 {
        self[usize::from(operand as u16)]
    }

    #[inline(always)]
    fn slot(&mut self, operand: u32) -> &mut u64 {
        &mut self[usize::from(operand as u16)]
    }

    #[inline(always)]
    fn all(&mut self) -> &mut [u64] {
        self
    }
}

impl Row for [u64] {
    #[inline(always)]
    fn get(&self, operand: u32) -> u64 {
        self[operand as usize]
    }

    #[inline(always)]
    fn slot(&mut self, operand: u32) -> &mut u64 {
        &mut self[operand as usize]
    }

    #[inline(always)]
    fn all(&mut self) -> &mut [u64] {
        self
    }
}
