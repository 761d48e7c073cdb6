//! What several instructions need: masks, indices, counters, texts in slots.

use crate::fault::Cause;
use crate::machine::instruction::{Application, Element, Loop, TextApplication, TextSource};
use crate::operation::TextOperand;
use crate::operation::real::Float;
use crate::types::Elementary;

/// As many ones as a value has bits.
#[inline]
pub(super) fn mask(bits: u8) -> u64 {
    u64::MAX >> (64 - u32::from(bits).clamp(1, 64))
}

/// A number whose high bits are unused.
#[inline]
pub(super) fn extend(value: u64, unused: u32) -> i64 {
    (value << (unused & 63)) as i64 >> (unused & 63)
}

/// Bits of a word from `at` (modulo 64) on := as many of `value` as the mask has.
#[inline]
pub(super) fn insert(word: &mut u64, at: u64, mask: u64, value: u64) {
    let shift = at % 64;
    *word = *word & !(mask << shift) | (value & mask) << shift;
}

/// Whether [`saturated`] gives numbers of a type: those of 64 bits without a sign do not fit into its i64.
pub(super) fn is_saturated(of: Elementary) -> bool {
    let is_whole = !of.is_real() && of != Elementary::Bool;
    is_whole && (of.is_signed() || of.bits() < 64)
}

/// The nearest number to a whole one that a type has, stored; the type is that of such a number. NaN is 0.
#[inline]
pub(super) fn saturated(whole: f64, of: u8) -> u64 {
    let of = Elementary::ALL[usize::from(of)];
    let mask = of.mask();
    let (least, greatest) = match of.is_signed() {
        true => (-((mask >> 1) as i64) - 1, (mask >> 1) as i64),
        false => (0, mask as i64),
    };
    (whole as i64).clamp(least, greatest) as u64 & mask
}

/// The same of the nearest whole number, half to even.
#[inline]
pub(super) fn rounded(value: f64, of: u8) -> u64 {
    saturated(Float::round(value), of)
}

/// Bits from the first element of an array to the one of an index.
#[inline]
pub(super) fn offset(element: &Element, index: u64) -> Result<u64, Cause> {
    let index = extend(index, element.extension);
    let from_first = index.wrapping_sub(element.low) as u64;
    if from_first > element.span {
        return Err(outside(element, index));
    }
    Ok(from_first.wrapping_mul(element.stride))
}

/// The fault of an index outside its array.
#[cold]
fn outside(element: &Element, index: i64) -> Cause {
    let bound = if index < element.low {
        element.low
    } else {
        element.low.wrapping_add(element.span as i64)
    };
    Cause::IndexOutOfRange { index, bound }
}

/// The counter behind a turn; `None` where it would leave its type.
pub(super) fn next(each: &Loop, counter: u64, by: u64) -> Option<u64> {
    let next = each.of.signed(counter) + each.of.signed(by);
    let stored = next as u64 & each.of.mask();
    (each.of.signed(stored) == next).then_some(stored)
}

pub(super) fn has_passed(each: &Loop, counter: u64, limit: u64, by: u64) -> bool {
    let [counter, limit, by] = [counter, limit, by].map(|stored| each.of.signed(stored));
    if by >= 0 { counter > limit } else { counter < limit }
}

pub(super) fn load_text(slots: &[u64], capacity: usize, text: &mut Vec<u8>) {
    let length = slots[0].min(capacity as u64) as usize;
    text.clear();
    for word in &slots[1..1 + length.div_ceil(8)] {
        text.extend_from_slice(&word.to_le_bytes());
    }
    text.truncate(length);
}

pub(super) fn store_text(slots: &mut [u64], capacity: usize, text: &[u8]) {
    slots[0] = text.len() as u64;
    let slots = &mut slots[1..1 + capacity.div_ceil(8)];
    slots.fill(0);
    for (slot, bytes) in slots.iter_mut().zip(text.chunks(8)) {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        *slot = u64::from_le_bytes(word);
    }
}

/// Applies an operation that has no instruction of its own to operands that `get` reads.
pub(super) fn apply(application: &Application, get: impl Fn(u32) -> u64) -> Result<u64, Cause> {
    let given = application.operands.iter().map(|&operand| get(operand));
    let mut few = [0; 4];
    match few.get_mut(..application.operands.len()) {
        Some(operands) => {
            for (operand, value) in operands.iter_mut().zip(given) {
                *operand = value;
            }
            application.operation.apply(operands)
        }
        None => application.operation.apply(&given.collect::<Vec<u64>>()),
    }
}

/// Applies an operation on texts; `slot` reads a slot, and writes it before where a value is given.
pub(super) fn apply_to_texts(
    application: &TextApplication,
    texts: &mut [Vec<u8>],
    slot: &mut dyn FnMut(u32, Option<u64>) -> u64,
) {
    let mut result = match application.target {
        TextSource::Text(target) => std::mem::take(&mut texts[target as usize]),
        TextSource::Number(_) => Vec::new(),
    };
    result.clear();
    let operands = application.operands.iter().map(|operand| match *operand {
        TextSource::Number(operand) => TextOperand::Number(slot(operand, None)),
        TextSource::Text(text) => TextOperand::Text(&texts[text as usize]),
    });
    let operands: Vec<TextOperand<'_>> = operands.collect();
    let number = application.operation.apply(&operands, &mut result);
    match application.target {
        TextSource::Text(target) => texts[target as usize] = result,
        TextSource::Number(target) => {
            slot(target, Some(number));
        }
    }
}
