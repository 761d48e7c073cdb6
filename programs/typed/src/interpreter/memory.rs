//! Memory of the interpreter: the state and behind it the frames, read and written by address.

use crate::fault::Cause;
use crate::form::Program;
use crate::types::{Elementary, Type};

/// The number of a bit: 64 · slot + bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Address(pub(super) u64);

/// What an expression gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Value {
    /// An elementary value, as it is stored.
    Number(u64),
    /// A text.
    Text(Vec<u8>),
    /// An array or a structure: its slots.
    Slots(Vec<u64>),
}

#[derive(Debug, Clone)]
pub(super) struct Memory(Vec<u64>);

impl Memory {
    pub(super) fn new(state: &[u64], frames: u32) -> Self {
        let mut slots = state.to_vec();
        slots.resize(state.len() + frames as usize, 0);
        Self(slots)
    }

    pub(super) fn slots(&self) -> &[u64] {
        &self.0
    }

    pub(super) fn slots_mut(&mut self) -> &mut [u64] {
        &mut self.0
    }

    /// Whether an address may be that of a variable of which so many bits are used.
    pub(super) fn holds(&self, address: u64, reach: u64) -> bool {
        let end = address.saturating_add(reach);
        address >= 64 * u64::from(Program::HEADER) && end <= 64 * self.0.len() as u64
    }

    pub(super) fn get(&self, Address(address): Address, of: Elementary) -> u64 {
        self.0[(address / 64) as usize] >> (address % 64) & of.mask()
    }

    pub(super) fn set(&mut self, Address(address): Address, of: Elementary, value: u64) {
        let slot = &mut self.0[(address / 64) as usize];
        let shift = address % 64;
        *slot = *slot & !(of.mask() << shift) | (value & of.mask()) << shift;
    }

    pub(super) fn set_word(&mut self, Address(address): Address, value: u64) {
        self.0[(address / 64) as usize] = value;
    }

    pub(super) fn load(&self, address: Address, of: &Type) -> Value {
        let first = (address.0 / 64) as usize;
        match of {
            Type::Elementary(of) | Type::Enumeration(_, of) => {
                Value::Number(self.get(address, *of))
            }
            Type::Text(capacity) => {
                let length = self.0[first].min(u64::from(*capacity)) as usize;
                let bytes = self.0[first + 1..].iter().flat_map(|word| word.to_le_bytes());
                Value::Text(bytes.take(length).collect())
            }
            _ => Value::Slots(self.0[first..][..of.slots() as usize].to_vec()),
        }
    }

    pub(super) fn store(&mut self, address: Address, of: &Type, value: Value) -> Result<(), Cause> {
        let first = (address.0 / 64) as usize;
        match (of, value) {
            (Type::Text(capacity), Value::Text(text)) => {
                if text.len() > usize::from(*capacity) {
                    return Err(Cause::TextTooLong {
                        length: text.len() as u64,
                        capacity: u64::from(*capacity),
                    });
                }
                let slots = &mut self.0[first..][..of.slots() as usize];
                slots.fill(0);
                slots[0] = text.len() as u64;
                for (index, byte) in text.into_iter().enumerate() {
                    slots[1 + index / 8] |= u64::from(byte) << (index % 8 * 8);
                }
            }
            (_, Value::Number(number)) => {
                let of = of.elementary().expect("a number is stored as one");
                self.set(address, of, number);
            }
            (_, Value::Slots(slots)) => self.0[first..][..slots.len()].copy_from_slice(&slots),
            (_, Value::Text(_)) => panic!("a text is stored as one"),
        }
        Ok(())
    }
}
