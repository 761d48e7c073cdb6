//! Lines of a journal, packed: each line as its difference to the last line that looks the same but for its numbers.
//!
//! ```text
//!   line      {"at_ns":7001,"name":"robot","event":{"event":"published","cycle":8}}
//!   pattern   {"at_ns":·,"name":"robot","event":{"event":"published","cycle":·}}
//!   numbers          7001                                                      8
//!   packed    [numbers that differ from the forecast, and whether the pattern is the forecast one] [pattern] [differences]
//! ```
//!
//! A pattern is written where it occurs first; each number is forecast from the last two of its place, either as the last one again or as
//! the last one and its last step, whichever was nearer before. So a line of an undisturbed cycle is a few bytes: how much later it came
//! than the one before, and what changed.
//!
//! Invariant: [`unpacked`] of [`packed`] is the same text, whatever the text; [`unpacked`] of any bytes is at most as long as it is told.

use std::collections::HashMap;

/// Numbers of a line whose change is one bit each; further ones are always written.
const MARKED: usize = 56;

/// Bytes that [`packed`] did not make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Damaged;

/// Packs lines. Each call stands alone.
pub(crate) fn packed(text: &[u8]) -> Vec<u8> {
    let mut patterns: HashMap<Vec<&[u8]>, usize> = HashMap::new();
    let mut known = Known::default();
    let mut bytes = Vec::new();
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let (parts, numbers) = split(line);
        let found = patterns.get(&parts).copied();
        let is_forecast = found.is_some() && found == known.forecast();
        let place = found.unwrap_or_else(|| known.add(numbers.len()));
        let pattern = &mut known.patterns[place];
        let marked = numbers.iter().zip(&pattern.numbers).take(MARKED);
        let marks = marked
            .rev()
            .fold(0, |marks, (number, track)| marks << 1 | u64::from(*number != track.forecast()));
        put(&mut bytes, marks << 1 | u64::from(is_forecast));
        if found.is_none() {
            put(&mut bytes, 0);
            put(&mut bytes, parts.len() as u64);
            for part in &parts {
                put(&mut bytes, part.len() as u64);
                bytes.extend_from_slice(part);
            }
        } else if !is_forecast {
            put(&mut bytes, place as u64 + 1);
        }
        for (index, (number, track)) in numbers.iter().zip(&mut pattern.numbers).enumerate() {
            let difference = number.wrapping_sub(track.forecast());
            if index >= MARKED || difference != 0 {
                put(&mut bytes, folded(difference));
            }
            track.note(*number);
        }
        known.follows(place);
        patterns.insert(parts, place);
    }
    bytes
}

/// The lines again, of `length` bytes.
///
/// # Errors
/// [`Damaged`].
pub(crate) fn unpacked(mut bytes: &[u8], length: usize) -> Result<Vec<u8>, Damaged> {
    let mut patterns: Vec<Vec<&[u8]>> = Vec::new();
    let mut known = Known::default();
    let mut text = Vec::new();
    while !bytes.is_empty() {
        let head = take(&mut bytes)?;
        let mut marks = head >> 1;
        let place = if head & 1 == 1 {
            known.forecast().ok_or(Damaged)?
        } else {
            match take(&mut bytes)? {
                0 => {
                    let parts = taken_parts(&mut bytes)?;
                    let place = known.add(parts.len() - 1);
                    patterns.push(parts);
                    place
                }
                place => usize::try_from(place - 1).map_err(|_| Damaged)?,
            }
        };
        let parts = patterns.get(place).ok_or(Damaged)?;
        let pattern = known.patterns.get_mut(place).ok_or(Damaged)?;
        for (index, part) in parts.iter().enumerate() {
            text.extend_from_slice(part);
            let Some(track) = pattern.numbers.get_mut(index) else {
                break;
            };
            let is_written = index >= MARKED || marks & 1 == 1;
            marks >>= 1;
            let difference = if is_written { take(&mut bytes)? } else { 0 };
            let number = track.forecast().wrapping_add(unfolded(difference));
            track.note(number);
            push_number(&mut text, number);
        }
        if text.len() > length {
            return Err(Damaged);
        }
        known.follows(place);
    }
    if text.len() == length { Ok(text) } else { Err(Damaged) }
}

/// What packer and unpacker both know from the lines before.
#[derive(Debug, Default)]
struct Known {
    patterns: Vec<Pattern>,
    last: Option<usize>,
}

/// Lines that are the same but for their numbers.
#[derive(Debug)]
struct Pattern {
    numbers: Vec<Track>,
    /// The pattern that followed last.
    next: Option<usize>,
}

impl Known {
    fn forecast(&self) -> Option<usize> {
        self.patterns[self.last?].next
    }

    fn add(&mut self, numbers: usize) -> usize {
        self.patterns.push(Pattern { numbers: vec![Track::default(); numbers], next: None });
        self.patterns.len() - 1
    }

    fn follows(&mut self, place: usize) {
        if let Some(last) = self.last.replace(place) {
            self.patterns[last].next = Some(place);
        }
    }
}

/// The numbers at one place of a pattern.
#[derive(Debug, Clone, Copy, Default)]
struct Track {
    last: u64,
    step: u64,
    /// Above 0 where the step would have been the better forecast.
    steady: i8,
}

impl Track {
    fn forecast(&self) -> u64 {
        if self.steady > 0 { self.last.wrapping_add(self.step) } else { self.last }
    }

    fn note(&mut self, number: u64) {
        let step = number.wrapping_sub(self.last);
        let error = folded(step.wrapping_sub(self.step));
        let better = error.cmp(&folded(step)).reverse() as i8;
        self.steady = (self.steady + better).clamp(-2, 2);
        (self.last, self.step) = (number, step);
    }
}

/// A line as the parts between its numbers, and these. A number is a row of digits that is written as a program would write it.
fn split(line: &[u8]) -> (Vec<&[u8]>, Vec<u64>) {
    let (mut parts, mut numbers) = (Vec::new(), Vec::new());
    let (mut part, mut at) = (0, 0);
    while at < line.len() {
        if !line[at].is_ascii_digit() {
            at += 1;
            continue;
        }
        let digits = line[at..].iter().take_while(|byte| byte.is_ascii_digit());
        let end = at + digits.count();
        if let Some(number) = number_of(&line[at..end]) {
            parts.push(&line[part..at]);
            numbers.push(number);
            part = end;
        }
        at = end;
    }
    parts.push(&line[part..]);
    (parts, numbers)
}

fn number_of(digits: &[u8]) -> Option<u64> {
    if digits.len() > 1 && digits[0] == b'0' {
        return None;
    }
    digits.iter().try_fold(0_u64, |number, digit| {
        let number = number.checked_mul(10)?;
        number.checked_add(u64::from(digit - b'0'))
    })
}

fn push_number(text: &mut Vec<u8>, mut number: u64) {
    let mut digits = [0; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[at..]);
}

fn taken_parts<'bytes>(bytes: &mut &'bytes [u8]) -> Result<Vec<&'bytes [u8]>, Damaged> {
    let count = take(bytes)?;
    if count == 0 || count > bytes.len() as u64 {
        return Err(Damaged);
    }
    (0..count)
        .map(|_| {
            let length = usize::try_from(take(bytes)?).map_err(|_| Damaged)?;
            let (part, rest) = bytes.split_at_checked(length).ok_or(Damaged)?;
            *bytes = rest;
            Ok(part)
        })
        .collect()
}

/// Small differences of both signs become small numbers.
fn folded(difference: u64) -> u64 {
    difference << 1 ^ (((difference as i64) >> 63) as u64)
}

fn unfolded(number: u64) -> u64 {
    number >> 1 ^ (number & 1).wrapping_neg()
}

/// 7 bits a byte; the leading ones of the first byte say how many bytes follow.
fn put(bytes: &mut Vec<u8>, number: u64) {
    let bits = 64 - number.leading_zeros() as usize;
    let length = bits.div_ceil(7).max(1);
    if length > 8 {
        bytes.push(0xff);
        bytes.extend_from_slice(&number.to_be_bytes());
        return;
    }
    let leading = !(0xff_u64 >> (length - 1)) & 0xff;
    let marked = number | leading << (8 * (length - 1));
    bytes.extend_from_slice(&marked.to_be_bytes()[8 - length..]);
}

fn take(bytes: &mut &[u8]) -> Result<u64, Damaged> {
    let first = *bytes.first().ok_or(Damaged)?;
    let more = first.leading_ones() as usize;
    let (own, rest) = bytes.split_at_checked(more + 1).ok_or(Damaged)?;
    *bytes = rest;
    let high = u64::from(first) & (0x7f_u64 >> more.min(7));
    let high = if more >= 7 { 0 } else { high };
    Ok(own[1..].iter().fold(high, |number, byte| number << 8 | u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[track_caller]
    fn check(text: &[u8]) -> usize {
        let bytes = packed(text);
        assert_eq!(unpacked(&bytes, text.len()).as_deref(), Ok(text));
        bytes.len()
    }

    #[test]
    fn any_text_comes_back() {
        check(b"");
        check(b"\n\n\n");
        check(
            b"{\"at_ns\":18446744073709551615}\n{\"at_ns\":0}\n{\"at_ns\":18446744073709551616}\n",
        );
        check(b"007 00 0 -5 1.05 1.50\nwithout an end 12");
        check(b"\xff\xfe 1 \x00\n\xff\xfe 2 \x00\n");
        let many: String = (0..200).map(|number| format!("{number},")).collect();
        check(many.repeat(3).as_bytes());
        check(format!("{many}\n").repeat(3).as_bytes());
        for bits in 0..64 {
            for near in [0, 1, u64::MAX] {
                check(format!("{}\n0\n", (1_u64 << bits).wrapping_add(near)).as_bytes());
            }
        }
    }

    #[test]
    fn lines_that_differ_by_a_steady_step_are_two_bytes_each() {
        let line = |cycle: u64| {
            format!("{{\"at_ns\":{},\"cycle\":{cycle},\"u\":[5]}}\n", cycle * 10_000_000)
        };
        let text: String = (0..1000).map(line).collect();
        assert!(check(text.as_bytes()) < 2100);
    }

    #[test]
    fn damaged_bytes_are_refused_or_yield_some_text_and_never_more() {
        let text = b"{\"at_ns\":1,\"n\":5}\n{\"at_ns\":2,\"n\":5}\nother\n{\"at_ns\":9,\"n\":7}\n";
        let bytes = packed(text);
        for cut in 0..bytes.len() {
            assert_eq!(unpacked(&bytes[..cut], text.len()), Err(Damaged), "{cut}");
            for bit in 0..8 {
                let mut changed = bytes.clone();
                changed[cut] ^= 1 << bit;
                if let Ok(found) = unpacked(&changed, text.len()) {
                    assert_eq!(found.len(), text.len());
                }
            }
        }
    }

    proptest! {
        #[test]
        fn any_bytes_come_back(text in proptest::collection::vec(any::<u8>(), 0..400)) {
            check(&text);
        }

        #[test]
        fn lines_of_numbers_come_back(text in "([{a-c\":]{0,3}[0-9]{0,21}){0,20}\n?([a-b][0-9]{0,3}\n){0,30}") {
            check(text.as_bytes());
        }

        #[test]
        fn any_bytes_are_unpacked_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200), length in 0_usize..300) {
            if let Ok(text) = unpacked(&bytes, length) {
                prop_assert_eq!(text.len(), length);
            }
        }
    }
}
