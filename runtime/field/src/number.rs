//! Numbers of a program in the registers of a device.
//!
//! A signal has the value `raw * scale + offset`, where `raw` is the number in its registers; so the remote I/O writes `(value - offset) / scale`.
//! Without scale and offset, whole numbers convert exactly. All else is computed in LREAL; a whole number is then the nearest one, half to even. A
//! number beyond the range of the target becomes the end of that range.

use understudy_cluster::{ByteOrder, Registers};
use understudy_typed::Elementary;

/// A REAL of a device that is infinite or not a number, or that is so once it is converted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotFinite;

/// The value of a signal of type `of`, as the process image stores it, from the words of its registers.
pub(crate) fn value(
    registers: &Registers,
    of: Elementary,
    words: &[u16],
) -> Result<u64, NotFinite> {
    let raw = joined(registers, words);
    let stored = if registers.is_scaled() {
        store(of, registers.of.number(raw) * registers.scale + registers.offset)
    } else {
        convert(registers.of, of, raw)
    };
    let is_finite = !of.is_real() || of.number(stored).is_finite();
    is_finite.then_some(stored).ok_or(NotFinite)
}

/// The words of the registers for a stored value of a signal of type `of`.
pub(crate) fn words(
    registers: &Registers,
    of: Elementary,
    stored: u64,
) -> impl Iterator<Item = u16> {
    let raw = if registers.is_scaled() {
        store(registers.of, (of.number(stored) - registers.offset) / registers.scale)
    } else {
        convert(of, registers.of, stored)
    };
    split(registers, raw)
}

fn joined(registers: &Registers, words: &[u16]) -> u64 {
    let count = usize::from(registers.count());
    let mut raw = 0;
    for at in 0..count {
        // The most significant register first.
        let place = match registers.order.starts_with_low_register() {
            true => count - 1 - at,
            false => at,
        };
        let word = words.get(place).copied().unwrap_or_default();
        raw = raw << 16 | u64::from(in_order(registers.order, word));
    }
    raw
}

fn split(registers: &Registers, raw: u64) -> impl Iterator<Item = u16> {
    let Registers { order, .. } = *registers;
    let count = registers.count();
    (0..count).map(move |at| {
        let place = match order.starts_with_low_register() {
            true => at,
            false => count - 1 - at,
        };
        in_order(order, (raw >> (16 * place)) as u16)
    })
}

fn in_order(order: ByteOrder, word: u16) -> u16 {
    if order.swaps_bytes() { word.swap_bytes() } else { word }
}

fn convert(from: Elementary, to: Elementary, stored: u64) -> u64 {
    if from == to {
        stored
    } else if from.is_real() || to.is_real() {
        store(to, from.number(stored))
    } else {
        saturated(to, from.signed(stored))
    }
}

/// The stored value of a type that is nearest to `number`; NaN as a whole number is 0.
fn store(of: Elementary, number: f64) -> u64 {
    match of {
        Elementary::Real => u64::from((number as f32).to_bits()),
        Elementary::Lreal => number.to_bits(),
        // Beyond i128, the cast gives its ends.
        _ => saturated(of, number.round_ties_even() as i128),
    }
}

fn saturated(of: Elementary, number: i128) -> u64 {
    let (least, most) = of.limits();
    number.clamp(least, most) as u64 & of.mask()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use understudy_cluster::Place;

    use super::*;

    fn registers(text: &str, scale: f64, offset: f64) -> Registers {
        match text.parse() {
            Ok(Place::Number(registers)) => Registers { scale, offset, ..registers },
            other => panic!("{text}: {other:?}"),
        }
    }

    fn real(number: f32) -> u64 {
        u64::from(number.to_bits())
    }

    #[test]
    fn bytes_have_an_order() {
        // 12.5 is 0x41480000, and 1.5e9 is 0x59682F00.
        for (text, words) in [
            ("input:0 real", [0x4148, 0x0000]),
            ("input:0 real cdab", [0x0000, 0x4148]),
            ("input:0 real badc", [0x4841, 0x0000]),
            ("input:0 real dcba", [0x0000, 0x4841]),
        ] {
            let registers = registers(text, 1.0, 0.0);
            let found = value(&registers, Elementary::Real, &words);
            assert_eq!(found, Ok(real(12.5)), "{text}");
            let back: Vec<u16> = super::words(&registers, Elementary::Real, real(12.5)).collect();
            assert_eq!(back, words, "{text}");
        }
        let registers = registers("input:0 lint cdab", 1.0, 0.0);
        let found = value(&registers, Elementary::Lint, &[4, 3, 2, 1]);
        assert_eq!(found, Ok(0x0001_0002_0003_0004));
    }

    #[test]
    fn numbers_are_scaled_rounded_and_kept_in_their_range() {
        let check = |text: &str, scale, offset, of, word: u16, expected: u64, back: u16| {
            let registers = registers(text, scale, offset);
            assert_eq!(value(&registers, of, &[word]), Ok(expected), "{text}");
            let words: Vec<u16> = words(&registers, of, expected).collect();
            assert_eq!(words, [back], "{text}");
        };
        let (int, uint) = ("holding:0 int", "holding:0 uint");
        // 4 to 20 mA in 1/100 mA above -20 °C.
        check(int, 0.01, -20.0, Elementary::Real, 2000, real(0.0), 2000);
        check(int, 0.01, -20.0, Elementary::Real, 0xFFFF, real(-20.01), 0xFFFF);
        check(int, 1.0, 0.0, Elementary::Lreal, 7, 7.0_f64.to_bits(), 7);
        check(int, 1.0, 0.0, Elementary::Int, 0xFFFE, 0xFFFE, 0xFFFE);
        check(int, 1.0, 0.0, Elementary::Sint, 300, 127, 127);
        check(uint, 1.0, 0.0, Elementary::Byte, 256, 255, 255);
        // 5 halves are 2 and 7 halves are 4; back, 4 and 8 halves.
        check(int, 0.5, 0.0, Elementary::Int, 5, 2, 4);
        check(int, 0.5, 0.0, Elementary::Int, 7, 4, 8);
        let out = |text: &str, scale, number: f32| -> Vec<u16> {
            words(&registers(text, scale, 0.0), Elementary::Real, real(number)).collect()
        };
        assert_eq!(out(int, 1.0, 1e9), [0x7FFF]);
        assert_eq!(out(int, 1.0, -1e9), [0x8000]);
        assert_eq!(out(uint, 1.0, -1.0), [0]);
        assert_eq!(out(uint, 0.1, 12.34), [123]);
        assert_eq!(out(int, 1.0, f32::NAN), [0]);
        assert_eq!(out(int, 1.0, f32::INFINITY), [0x7FFF]);
    }

    #[test]
    fn infinity_and_what_is_not_a_number_are_no_value() {
        for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let bits = number.to_bits();
            let words = [(bits >> 16) as u16, bits as u16];
            let registers = registers("input:0 real", 1.0, 0.0);
            assert_eq!(value(&registers, Elementary::Real, &words), Err(NotFinite));
            assert_eq!(value(&registers, Elementary::Lreal, &words), Err(NotFinite));
        }
        let words: Vec<u16> =
            (0..4).map(|at| (1e300_f64.to_bits() >> (48 - 16 * at)) as u16).collect();
        let registers = registers("input:0 lreal", 1.0, 0.0);
        assert_eq!(value(&registers, Elementary::Real, &words), Err(NotFinite));
        assert_eq!(value(&registers, Elementary::Lreal, &words), Ok(1e300_f64.to_bits()));
    }

    proptest! {
        /// What is written without scale is read back.
        #[test]
        fn what_is_written_is_read_back(
            of in proptest::sample::select(Registers::TYPES.to_vec()),
            order in proptest::sample::select(vec!["abcd", "cdab", "badc", "dcba"]),
            bits: u64,
        ) {
            let text = format!("holding:3 {} {order}", of.name().to_ascii_lowercase());
            let registers = registers(&text, 1.0, 0.0);
            let stored = bits & of.mask();
            let words: Vec<u16> = words(&registers, of, stored).collect();
            prop_assert_eq!(words.len(), usize::from(registers.count()));
            match value(&registers, of, &words) {
                Ok(read) => prop_assert_eq!(read, stored),
                Err(NotFinite) => prop_assert!(!of.number(stored).is_finite()),
            }
        }
    }
}
