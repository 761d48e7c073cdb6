//! Places: where they are, how they are loaded and stored.

use super::{Compiler, Own};
use crate::form::{Expression, ExpressionKind, Index, Place, Root};
use crate::machine::instruction::{Code, Element, RELATIVE};
use crate::operation::Operation;
use crate::types::{Elementary, Type};

/// Where the value of a place is, and the operands that find it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Location {
    /// A slot.
    Slot(u32),
    /// Bits of a slot, from the second on.
    Bits(u32, u32),
    /// An element that fills a slot: its array in the table, and the index.
    Word(u32, u32),
    /// A packed element.
    Packed(u32, u32),
    /// What lies at the address in a slot.
    Address(u32),
    /// The same, of a reference: the slot, and the bits from the address on that are used.
    Through(u32, u64),
}

impl Compiler<'_> {
    /// Where an elementary value is.
    pub(super) fn location(&mut self, place: &Place, of: Elementary) -> Location {
        if place.is_by_reference()
            && place.indices.is_empty()
            && (place.offset, place.bit) == (0, 0)
        {
            return Location::Through(self.reference(place.root), place.reach());
        }
        let Some(slot) = self.slot(place.root, place.offset) else {
            return Location::Address(self.address(place));
        };
        let is_part = place.is_packed && of.bits() < 64;
        match &*place.indices {
            [] if is_part => Location::Bits(slot, place.bit),
            [] => Location::Slot(slot),
            [index] => {
                let is_part = is_part || !index.stride.is_multiple_of(64);
                let (value, extension) = self.index(index);
                let table = self.element(Element {
                    base: slot,
                    bit: place.bit,
                    low: index.low,
                    span: index.high.abs_diff(index.low),
                    stride: index.stride,
                    mask: of.mask(),
                    extension,
                });
                if is_part { Location::Packed(table, value) } else { Location::Word(table, value) }
            }
            _ => Location::Address(self.address(place)),
        }
    }

    /// The operand of a slot; `None` where only an address leads to it.
    fn slot(&self, root: Root, offset: u32) -> Option<u32> {
        match (root, self.context.own) {
            (Root::Global(slot), _) => Some(slot + offset),
            (Root::Frame(slot), _) => Some(self.program.state + slot + offset),
            (Root::Own(slot), Own::At(own)) => Some(own + slot + offset),
            (Root::Own(slot), Own::Relative) => Some(RELATIVE | (slot + offset)),
            _ => None,
        }
    }

    fn element(&mut self, element: Element) -> u32 {
        self.tables.elements.push(element);
        self.tables.elements.len() as u32 - 1
    }

    /// The operand of an index and the bits by which it is to be sign-extended.
    fn index(&mut self, index: &Index) -> (u32, u32) {
        if let ExpressionKind::Apply(Operation::Convert(from, Elementary::Lint), operands) =
            &index.value.kind
            && from.is_signed()
            && let [value] = &**operands
        {
            return (self.operand(value), 64 - from.bits());
        }
        (self.operand(&index.value), 0)
    }

    /// A slot with the address of a place.
    pub(super) fn address(&mut self, place: &Place) -> u32 {
        let within = 64 * u64::from(place.offset) + u64::from(place.bit);
        let mut address = match (place.root, self.context.own) {
            (Root::OwnReference(_) | Root::FrameReference(_), _) => {
                let holder = self.reference(place.root);
                let address = self.temporary();
                let reach = self.constant(place.reach());
                self.emit(Code::Reference, address, holder, reach);
                self.moved(address, within)
            }
            (Root::Own(slot), Own::Address(own)) => self.moved(own, 64 * u64::from(slot) + within),
            (Root::Own(slot), Own::Relative) => {
                let address = self.temporary();
                self.emit(Code::OwnAddress, address, slot + place.offset, 0);
                self.moved(address, u64::from(place.bit))
            }
            (root, _) => {
                let slot = self.slot(root, place.offset).unwrap_or(0);
                self.constant(64 * u64::from(slot) + u64::from(place.bit))
            }
        };
        if !place.indices.is_empty() {
            let start = address;
            address = self.temporary();
            self.emit(Code::Move, address, start, 0);
        }
        for index in &place.indices {
            self.scope(|compiler| {
                let (value, extension) = compiler.index(index);
                let table = compiler.element(Element {
                    base: 0,
                    bit: 0,
                    low: index.low,
                    span: index.high.abs_diff(index.low),
                    stride: index.stride,
                    mask: u64::MAX,
                    extension,
                });
                compiler.emit(Code::Index, address, value, table);
            });
        }
        address
    }

    /// The operand with the address that a reference holds.
    fn reference(&mut self, root: Root) -> u32 {
        let root = match root {
            Root::OwnReference(slot) => Root::Own(slot),
            Root::FrameReference(slot) => Root::Frame(slot),
            other => other,
        };
        match self.slot(root, 0) {
            Some(slot) => slot,
            None => {
                let holder = Place::new(root, Type::Elementary(Elementary::Lword));
                let address = self.address(&holder);
                let held = self.temporary();
                self.load(Location::Address(address), Elementary::Lword, held);
                held
            }
        }
    }

    /// A slot with an address so many bits further.
    fn moved(&mut self, address: u32, bits: u64) -> u32 {
        if bits == 0 {
            return address;
        }
        let moved = self.temporary();
        let bits = self.constant(bits);
        self.emit(Code::Add64, moved, address, bits);
        moved
    }

    /// `to` := what is there.
    pub(super) fn load(&mut self, from: Location, of: Elementary, to: u32) {
        match from {
            Location::Slot(slot) => self.emit(Code::Move, to, slot, 0),
            Location::Bits(slot, bit) => {
                let mask = self.constant(of.mask());
                self.emit_with(Code::Extract, bit as u8, to, slot, mask);
            }
            Location::Word(table, index) => self.emit(Code::LoadWord, to, index, table),
            Location::Packed(table, index) => self.emit(Code::LoadPacked, to, index, table),
            Location::Address(address) => {
                self.emit_with(Code::LoadAt, of.bits() as u8, to, address, 0);
            }
            Location::Through(holder, reach) => {
                let reach = self.constant(reach);
                self.emit_with(Code::LoadThrough, of.bits() as u8, to, holder, reach);
            }
        }
    }

    /// What is there := `value`.
    pub(super) fn store(&mut self, to: Location, of: Elementary, value: u32) {
        match to {
            Location::Slot(slot) => self.emit(Code::Move, slot, value, 0),
            Location::Bits(slot, bit) => {
                let mask = self.constant(of.mask());
                self.emit_with(Code::StoreBits, bit as u8, slot, value, mask);
            }
            Location::Word(table, index) => self.emit(Code::StoreWord, value, index, table),
            Location::Packed(table, index) => self.emit(Code::StorePacked, value, index, table),
            Location::Address(address) => {
                self.emit_with(Code::StoreAt, of.bits() as u8, value, address, 0);
            }
            Location::Through(holder, reach) => {
                let reach = self.constant(reach);
                self.emit_with(Code::StoreThrough, of.bits() as u8, value, holder, reach);
            }
        }
    }
}

/// Whether an expression calls a routine, which may change variables.
pub(super) fn calls(expression: &Expression) -> bool {
    let mut found = false;
    crate::visit::in_expression(expression, &mut |inner| {
        found |= matches!(inner.kind, ExpressionKind::Call(_));
    });
    found
}

/// Whether an index of a place calls a routine.
pub(super) fn place_calls(place: &Place) -> bool {
    place.indices.iter().any(|index| calls(&index.value))
}
