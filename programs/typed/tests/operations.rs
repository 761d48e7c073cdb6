//! Operations against independent references: arithmetic of 128 bits, rounding by search, all values of the types of 8 bits.

mod common;

use common::Random;
use understudy_typed::{
    Cause, Comparison, Elementary, Operation, RealFunction, TextOperand, TextOperation,
};

const WHOLE: [Elementary; 9] = [
    Elementary::Sint,
    Elementary::Int,
    Elementary::Dint,
    Elementary::Lint,
    Elementary::Usint,
    Elementary::Uint,
    Elementary::Udint,
    Elementary::Ulint,
    Elementary::Time,
];

/// A number as a type of so many bits stores it.
fn wrapped(of: Elementary, number: i128) -> u64 {
    number.rem_euclid(1 << of.bits()) as u64
}

/// The number that is stored, found without shifting.
fn number(of: Elementary, stored: u64) -> i128 {
    let number = i128::from(stored);
    let half = 1_i128 << (of.bits() - 1);
    if of.is_signed() && number >= half { number - 2 * half } else { number }
}

/// What arithmetic without bounds gives; `None` for a fault.
fn expected(operation: Operation, of: Elementary, a: i128, b: i128) -> Option<u64> {
    let result = match operation {
        Operation::Add(_) => a + b,
        Operation::Subtract(_) => a - b,
        Operation::Multiply(_) => (a.rem_euclid(1 << 64)).wrapping_mul(b.rem_euclid(1 << 64)),
        Operation::Divide(_) => a.checked_div(b)?,
        Operation::Modulo(_) => a.checked_rem(b).unwrap_or(0),
        Operation::Negate(_) => -a,
        Operation::Absolute(_) => a.abs(),
        Operation::Minimum(_) => a.min(b),
        _ => a.max(b),
    };
    Some(wrapped(of, result))
}

fn check(of: Elementary, a: u64, b: u64) {
    use Operation as O;
    let (left, right) = (number(of, a), number(of, b));
    for operation in [
        O::Add(of),
        O::Subtract(of),
        O::Multiply(of),
        O::Divide(of),
        O::Modulo(of),
        O::Negate(of),
        O::Absolute(of),
        O::Minimum(of),
        O::Maximum(of),
    ] {
        let expected =
            expected(operation, of, left, right).ok_or(Cause::DivisionByZero { dividend: a, of });
        assert_eq!(operation.apply(&[a, b]), expected, "{operation:?} {left} {right}");
    }
    let less = O::Compare(Comparison::Less, of).apply(&[a, b]);
    assert_eq!(less, Ok(u64::from(left < right)));
    for to in WHOLE {
        let converted = O::Convert(of, to).apply(&[a]);
        assert_eq!(converted, Ok(wrapped(to, left)), "{of} to {to}: {left}");
    }
}

#[test]
fn integers_of_8_bits_are_exhausted() {
    for of in [Elementary::Sint, Elementary::Usint] {
        for a in 0..256 {
            for b in 0..256 {
                check(of, a, b);
            }
        }
    }
}

#[test]
fn integers_of_more_bits_are_drawn() {
    let mut random = Random(1);
    for _ in 0..20_000 {
        let of = *random.pick(&WHOLE);
        let (a, b) = (random.value(of), random.value(of));
        check(of, a, b);
    }
}

#[test]
fn shifts_and_rotations_move_bit_by_bit() {
    let mut random = Random(2);
    let of_bits = Elementary::ALL.into_iter().filter(|of| of.is_bit_string());
    for of in of_bits {
        for by in -70_i64..70 {
            let (a, width) = (random.value(of), i64::from(of.bits()));
            let moved = |from: &dyn Fn(i64) -> Option<i64>| {
                (0..width).fold(0, |word, bit| {
                    let source = from(bit).filter(|bit| (0..width).contains(bit));
                    word | source.map_or(0, |source| a >> source & 1) << bit
                })
            };
            let is_shift = by >= 0;
            let cases = [
                (Operation::ShiftLeft(of), moved(&|bit| is_shift.then_some(bit - by))),
                (Operation::ShiftRight(of), moved(&|bit| is_shift.then_some(bit + by))),
                (Operation::RotateLeft(of), moved(&|bit| Some((bit - by).rem_euclid(width)))),
                (Operation::RotateRight(of), moved(&|bit| Some((bit + by).rem_euclid(width)))),
            ];
            for (operation, expected) in cases {
                let found = operation.apply(&[a, by as u64]);
                assert_eq!(found, Ok(expected), "{operation:?} {a:#x} by {by}");
            }
        }
    }
}

/// The real nearest to a number, half to even, found among its neighbours by exact comparison.
fn nearest_single(number: i128) -> f32 {
    let guess = number as f64 as f32;
    let exact = |value: f32| value as i128 - number;
    let candidates = [guess.next_down(), guess, guess.next_up()];
    let best = candidates.into_iter().min_by_key(|&value| {
        let is_odd = value.to_bits() & 1;
        (exact(value).abs(), is_odd)
    });
    best.expect("three candidates")
}

#[test]
fn an_integer_becomes_the_nearest_real() {
    let mut random = Random(3);
    for _ in 0..20_000 {
        let of = *random.pick(&[Elementary::Dint, Elementary::Lint, Elementary::Ulint]);
        let stored = random.next() >> random.below(40) & of.mask();
        // What a double rounds already may not be rounded a second time.
        let stored = if random.percent(50) { stored | 1 << 24 & of.mask() } else { stored };
        let expected = nearest_single(number(of, stored));
        let found = Operation::Convert(of, Elementary::Real).apply(&[stored]);
        assert_eq!(found, Ok(u64::from(expected.to_bits())), "{of} {stored}");
    }
    let halfway = [(1_u64 << 24) + 1, (1 << 24) + 3, (1 << 60) + (1 << 36) + 1];
    let expected = [16_777_216.0_f32, 16_777_220.0, 1.152_921_6e18];
    for (stored, expected) in halfway.into_iter().zip(expected) {
        let found = Operation::Convert(Elementary::Ulint, Elementary::Real).apply(&[stored]);
        assert_eq!(found, Ok(u64::from(expected.to_bits())), "{stored}");
    }
}

#[test]
fn a_real_becomes_the_nearest_integer() {
    let convert = |value: f64, to| {
        let operation = Operation::Convert(Elementary::Lreal, to);
        number(to, operation.apply(&[value.to_bits()]).expect("no fault"))
    };
    let truncate = |value: f64, to| {
        let operation = Operation::Truncate(Elementary::Lreal, to);
        number(to, operation.apply(&[value.to_bits()]).expect("no fault"))
    };
    let cases = [
        (0.5, Elementary::Int, 0, 0),
        (1.5, Elementary::Int, 2, 1),
        (2.5, Elementary::Int, 2, 2),
        (-0.5, Elementary::Int, 0, 0),
        (-1.5, Elementary::Int, -2, -1),
        (-2.5, Elementary::Int, -2, -2),
        (1e9, Elementary::Int, 32_767, 32_767),
        (-1e9, Elementary::Int, -32_768, -32_768),
        (-3.0, Elementary::Usint, 0, 0),
        (255.5, Elementary::Usint, 255, 255),
        (f64::NAN, Elementary::Dint, 0, 0),
        (f64::INFINITY, Elementary::Lint, i128::from(i64::MAX), i128::from(i64::MAX)),
        (1e30, Elementary::Ulint, i128::from(u64::MAX), i128::from(u64::MAX)),
        (1.6, Elementary::Time, 2, 1),
    ];
    for (value, to, nearest, towards_zero) in cases {
        assert_eq!(convert(value, to), nearest, "{value} to {to}");
        assert_eq!(truncate(value, to), towards_zero, "{value} to {to}");
    }
}

#[test]
fn every_nan_is_the_canonical_one() {
    use Elementary::{Lreal, Real};
    use Operation as O;
    let mut random = Random(4);
    for (of, quiet) in [(Real, 0x7fc0_0000_u64), (Lreal, 0x7ff8_0000_0000_0000)] {
        let odd = quiet | 1;
        let negative = odd | 1 << (of.bits() - 1);
        let signalling = quiet ^ (quiet & quiet.wrapping_neg()) | 1;
        for nan in [quiet, odd, negative, signalling] {
            let other = random.value(of);
            for operation in [
                O::Add(of),
                O::Subtract(of),
                O::Multiply(of),
                O::Divide(of),
                O::Negate(of),
                O::Absolute(of),
                O::Minimum(of),
                O::Maximum(of),
                O::Convert(of, of),
                O::Real(RealFunction::SquareRoot, of),
                O::Real(RealFunction::Sine, of),
                O::Real(RealFunction::Floor, of),
                O::Real(RealFunction::Round, of),
            ] {
                assert_eq!(operation.apply(&[nan, other]), Ok(quiet), "{operation:?} {nan:#x}");
            }
            // NaN is taken only where it stands first.
            let one = O::Convert(Elementary::Int, of).apply(&[1]).expect("1.0");
            assert_eq!(O::Minimum(of).apply(&[one, nan]), Ok(one));
            for (comparison, holds) in [
                (Comparison::Equal, 0),
                (Comparison::NotEqual, 1),
                (Comparison::Less, 0),
                (Comparison::GreaterOrEqual, 0),
            ] {
                let found = O::Compare(comparison, of).apply(&[nan, nan]);
                assert_eq!(found, Ok(holds), "{comparison:?}");
            }
        }
    }
    let zero = 0.0_f64.to_bits();
    let infinity = O::Divide(Lreal).apply(&[1.0_f64.to_bits(), zero]);
    assert_eq!(infinity, Ok(f64::INFINITY.to_bits()));
    assert_eq!(O::Divide(Lreal).apply(&[zero, zero]), Ok(0x7ff8_0000_0000_0000));
}

/// Whether a + b, of binary64, is the real nearest to the exact sum: no neighbour is nearer, and at half the even one is taken.
fn is_nearest(a: f64, b: f64, sum: f64) -> bool {
    // Of numbers with exponents this near, sums and distances are exact in 2⁻⁴⁰ steps of 128 bits.
    let exact = |value: f64| (value * 1024.0_f64.powi(4)) as i128;
    let wanted = exact(a) + exact(b);
    let distance = |value: f64| (exact(value) - wanted).abs();
    let own = distance(sum);
    [sum.next_down(), sum.next_up()]
        .into_iter()
        .all(|other| own < distance(other) || own == distance(other) && sum.to_bits() & 1 == 0)
}

#[test]
fn sums_are_rounded_to_nearest_even() {
    let mut random = Random(5);
    for _ in 0..20_000 {
        let mut draw = || (random.next() >> 12) as f64 / 4096.0 - 1e11;
        let (a, b) = (draw(), draw() * 512.0);
        let found = Operation::Add(Elementary::Lreal).apply(&[a.to_bits(), b.to_bits()]);
        let sum = f64::from_bits(found.expect("no fault"));
        assert!(is_nearest(a, b, sum), "{a:e} + {b:e} = {sum:e}");
    }
}

#[test]
fn binary_coded_decimals_and_parts_of_words() {
    let apply =
        |operation: Operation, operands: &[u64]| operation.apply(operands).expect("no fault");
    let (word, uint) = (Elementary::Word, Elementary::Uint);
    for value in 0..10_000_u64 {
        let digits = u64::from_str_radix(&value.to_string(), 16).expect("digits");
        assert_eq!(apply(Operation::ToBcd(uint, word), &[value]), digits);
        assert_eq!(apply(Operation::FromBcd(word, uint), &[digits]), value);
    }
    assert_eq!(apply(Operation::ToBcd(uint, word), &[12_345]), 0x2345);
    let byte = Elementary::Byte;
    let extract = Operation::Extract { from: word, to: byte, at: 8 };
    let insert = Operation::Insert { of: word, part: byte, at: 8 };
    assert_eq!(apply(extract, &[0xabcd]), 0xab);
    assert_eq!(apply(insert, &[0xabcd, 0x12]), 0x12cd);
    let multiplex = Operation::Multiplex(uint);
    assert_eq!(multiplex.apply(&[1, 5, 6]), Ok(6));
    let number = -1_i64;
    assert_eq!(
        multiplex.apply(&[number as u64, 5, 6]),
        Err(Cause::NoSuchOperand { number, count: 2 })
    );
}

fn text(operation: TextOperation, operands: &[TextOperand<'_>]) -> String {
    let mut result = Vec::new();
    operation.apply(operands, &mut result);
    String::from_utf8(result).expect("text")
}

#[test]
fn operations_on_texts() {
    use TextOperand::{Number as N, Text as T};
    use TextOperation as O;
    let minus = u64::MAX;
    let cases: [(O, &[TextOperand<'_>], &str); 14] = [
        (O::Left, &[T(b"valve"), N(3)], "val"),
        (O::Left, &[T(b"valve"), N(minus)], ""),
        (O::Right, &[T(b"valve"), N(2)], "ve"),
        (O::Right, &[T(b"valve"), N(9)], "valve"),
        (O::Middle, &[T(b"valve"), N(2), N(3)], "lv"),
        (O::Middle, &[T(b"valve"), N(2), N(9)], ""),
        (O::Concatenate, &[T(b"a"), T(b""), T(b"bc")], "abc"),
        (O::Insert, &[T(b"valve"), T(b"--"), N(2)], "va--lve"),
        (O::Insert, &[T(b"valve"), T(b"--"), N(9)], "valve"),
        (O::Delete, &[T(b"valve"), N(2), N(4)], "val"),
        (O::Replace, &[T(b"valve"), T(b"X"), N(3), N(2)], "vXe"),
        (O::Select, &[N(1), T(b"no"), T(b"yes")], "yes"),
        (O::UpperCase, &[T(b"Valve 1")], "VALVE 1"),
        (O::LowerCase, &[T(b"Valve 1")], "valve 1"),
    ];
    for (operation, operands, expected) in cases {
        assert_eq!(text(operation, operands), expected, "{operation:?} {operands:?}");
    }
    let number =
        |operation: O, operands: &[TextOperand<'_>]| operation.apply(operands, &mut Vec::new());
    assert_eq!(number(O::Length, &[T(b"valve")]), 5);
    assert_eq!(number(O::Find, &[T(b"valve"), T(b"v")]), 1);
    assert_eq!(number(O::Find, &[T(b"valve"), T(b"ve")]), 4);
    assert_eq!(number(O::Find, &[T(b"valve"), T(b"x")]), 0);
    assert_eq!(number(O::Find, &[T(b"valve"), T(b"")]), 0);
    assert_eq!(number(O::Byte, &[T(b"valve"), N(1)]), u64::from(b'v'));
    assert_eq!(number(O::Byte, &[T(b"valve"), N(6)]), 0);
    assert_eq!(number(O::Compare(Comparison::Less), &[T(b"ab"), T(b"b")]), 1);
    assert_eq!(number(O::Compare(Comparison::Less), &[T(b"ab"), T(b"a")]), 0);
}

#[test]
fn lengths_are_cut_to_a_text_and_positions_outside_leave_it_as_it_is() {
    use TextOperand::{Number as N, Text as T};
    use TextOperation as O;
    for size in 0..=5 {
        let whole = &b"abcde"[..size];
        let shown = String::from_utf8_lossy(whole).into_owned();
        for length in -2..=7_i64 {
            for position in [i64::MIN, -1, 0, 1, 2, 3, 4, 5, 6, 7, i64::MAX] {
                let (l, p) = (N(length as u64), N(position as u64));
                let has_position = 1 <= position && position <= size as i64;
                // Character by character: which stand at or behind the position, and which are taken.
                let place = |at: usize| at as i64 + 1;
                let taken = |at: &usize| {
                    has_position && place(*at) >= position && place(*at) - position < length.max(0)
                };
                let part = |wanted: &dyn Fn(&usize) -> bool| -> String {
                    (0..size).filter(wanted).map(|at| char::from(whole[at])).collect()
                };
                let before = part(&|at| place(*at) < position);
                let rest = part(&|at| place(*at) >= position && !taken(at));
                let at = format!("`{shown}`, {length}, {position}");
                assert_eq!(text(O::Middle, &[T(whole), l, p]), part(&taken), "MID {at}");
                assert_eq!(
                    text(O::Delete, &[T(whole), l, p]),
                    part(&|at| !taken(at)),
                    "DELETE {at}"
                );
                let replaced = match has_position {
                    true => format!("{before}XY{rest}"),
                    false => shown.clone(),
                };
                assert_eq!(text(O::Replace, &[T(whole), T(b"XY"), l, p]), replaced, "REPLACE {at}");
                let behind = part(&|at| place(*at) <= position);
                let ahead = part(&|at| place(*at) > position);
                let inserted = match has_position || position == 0 {
                    true => format!("{behind}XY{ahead}"),
                    false => shown.clone(),
                };
                assert_eq!(text(O::Insert, &[T(whole), T(b"XY"), p]), inserted, "INSERT {at}");
                let first = part(&|at| (*at as i64) < length);
                assert_eq!(text(O::Left, &[T(whole), l]), first, "LEFT {at}");
                let last = part(&|at| (size - at) as i64 <= length);
                assert_eq!(text(O::Right, &[T(whole), l]), last, "RIGHT {at}");
            }
        }
    }
}

#[test]
fn numbers_are_written_for_people() {
    let write = |of, stored: u64| text(TextOperation::From(of), &[TextOperand::Number(stored)]);
    let lreal = |value: f64| write(Elementary::Lreal, value.to_bits());
    let real = |value: f32| write(Elementary::Real, u64::from(value.to_bits()));
    let day = 86_400_000_000_000_u64;
    let cases = [
        (write(Elementary::Bool, 1), "TRUE"),
        (write(Elementary::Int, 0xfff9), "-7"),
        (write(Elementary::Word, 0xfff9), "65529"),
        (lreal(0.1), "0.1"),
        (lreal(-2.0), "-2.0"),
        (lreal(1e21), "1.0E21"),
        (lreal(1.5e-9), "1.5E-9"),
        (lreal(f64::NEG_INFINITY), "-INF"),
        (lreal(f64::NAN), "NAN"),
        (real(0.1), "0.1"),
        (write(Elementary::Time, 1_500_000_000), "T#1s500ms"),
        (write(Elementary::Time, (-3_600_000_000_000_i64) as u64), "T#-1h"),
        (write(Elementary::Time, 0), "T#0s"),
        (write(Elementary::Date, 19_782 * day), "D#2024-02-29"),
        (write(Elementary::TimeOfDay, 45_296_500_000_000), "TOD#12:34:56.5"),
        (write(Elementary::DateAndTime, 19_782 * day + 1_000_000_000), "DT#2024-02-29-00:00:01"),
    ];
    for (found, expected) in cases {
        assert_eq!(found, expected);
    }
}

#[test]
fn numbers_are_read_as_they_were_written() {
    let mut random = Random(6);
    for _ in 0..30_000 {
        let of = random.elementary();
        let mut stored = random.value(of);
        if of == Elementary::TimeOfDay {
            stored %= 86_400_000_000_000;
        } else if of == Elementary::Date {
            stored -= stored % 86_400_000_000_000;
            stored = (stored as i64 / 86_400_000_000_000 * 86_400_000_000_000) as u64;
        }
        // Of several NaNs one is written.
        let convert = Operation::Convert(of, of).apply(&[stored]).expect("no fault");
        let written = text(TextOperation::From(of), &[TextOperand::Number(stored)]);
        let padded = format!("  {written} m");
        let operand = TextOperand::Text(padded.as_bytes());
        let read = TextOperation::To(of).apply(&[operand], &mut Vec::new());
        assert_eq!(read, convert, "{of}: {written}");
    }
    let read = |of, text: &str| {
        let operand = TextOperand::Text(text.as_bytes());
        TextOperation::To(of).apply(&[operand], &mut Vec::new())
    };
    assert_eq!(read(Elementary::Int, "12 bar"), 12);
    assert_eq!(read(Elementary::Int, "bar"), 0);
    assert_eq!(read(Elementary::Int, ""), 0);
    assert_eq!(read(Elementary::Lreal, "1e"), 1.0_f64.to_bits());
    assert_eq!(read(Elementary::Lreal, "."), 0);
    assert_eq!(read(Elementary::Lreal, "-1.5E3x"), (-1500.0_f64).to_bits());
    assert_eq!(read(Elementary::Time, "T#1m_30s"), 90_000_000_000);
    assert_eq!(read(Elementary::Time, "\u{e4}"), 0);
}
