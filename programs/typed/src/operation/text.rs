//! What each operation on texts gives. A text is a row of bytes.

use std::fmt::Write as _;

use crate::operation::{TextOperation, number_text};
use crate::types::Elementary;

/// A value that an operation on texts takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextOperand<'a> {
    /// An elementary value, as it is stored.
    Number(u64),
    /// A text.
    Text(&'a [u8]),
}

impl<'a> TextOperand<'a> {
    fn text(self) -> &'a [u8] {
        match self {
            Self::Text(text) => text,
            Self::Number(_) => &[],
        }
    }

    fn number(self) -> u64 {
        match self {
            Self::Number(number) => number,
            Self::Text(_) => 0,
        }
    }
}

impl TextOperation {
    /// The result: a number is returned, as it is stored; a text is appended to `result`, and the answer is 0.
    ///
    /// # Panics
    /// If there are fewer operands than [`crate::Operation::signature`] wants.
    pub fn apply(self, operands: &[TextOperand<'_>], result: &mut Vec<u8>) -> u64 {
        let text = |index: usize| operands[index].text();
        // A length, cut to a text.
        let cut = |index: usize, text: &[u8]| {
            let number = (operands[index].number() as i64).max(0) as u64;
            number.min(text.len() as u64) as usize
        };
        // The text before a position and the text from there, where the text has the position.
        let split = |index: usize| {
            let position = usize::try_from(operands[index].number() as i64).ok()?;
            let before = position.checked_sub(1).filter(|before| *before < text(0).len())?;
            Some(text(0).split_at(before))
        };
        match self {
            Self::Length => return text(0).len() as u64,
            Self::Left => result.extend_from_slice(&text(0)[..cut(1, text(0))]),
            Self::Right => {
                let text = text(0);
                result.extend_from_slice(&text[text.len() - cut(1, text)..]);
            }
            Self::Middle => {
                let rest = split(2).map_or(&[][..], |(_, rest)| rest);
                result.extend_from_slice(&rest[..cut(1, rest)]);
            }
            Self::Concatenate => {
                for operand in operands {
                    result.extend_from_slice(operand.text());
                }
            }
            Self::Insert => {
                let position = usize::try_from(operands[2].number() as i64).ok();
                let parts = position.and_then(|position| text(0).split_at_checked(position));
                let (first, rest) = parts.unwrap_or((text(0), &[]));
                let inserted = if parts.is_some() { text(1) } else { &[] };
                for part in [first, inserted, rest] {
                    result.extend_from_slice(part);
                }
            }
            Self::Delete => {
                let (first, rest) = split(2).unwrap_or((text(0), &[]));
                result.extend_from_slice(first);
                result.extend_from_slice(&rest[cut(1, rest)..]);
            }
            Self::Replace => {
                let parts = split(3);
                let (first, rest) = parts.unwrap_or((text(0), &[]));
                let by = if parts.is_some() { text(1) } else { &[] };
                for part in [first, by, &rest[cut(2, rest)..]] {
                    result.extend_from_slice(part);
                }
            }
            Self::Find => return find(text(0), text(1)),
            Self::Compare(comparison) => {
                return u64::from(comparison.holds(text(0), text(1)));
            }
            Self::Select => {
                result.extend_from_slice(text(1 + usize::from(operands[0].number() != 0)));
            }
            Self::From(of) => number_text::append(of, operands[0].number(), result),
            Self::To(of) => return number_text::read(of, text(0)),
            Self::Byte => {
                let position = usize::try_from(operands[1].number() as i64).unwrap_or(0);
                let byte = position.checked_sub(1).and_then(|at| text(0).get(at));
                return u64::from(byte.copied().unwrap_or(0));
            }
            Self::UpperCase => result.extend(text(0).iter().map(u8::to_ascii_uppercase)),
            Self::LowerCase => result.extend(text(0).iter().map(u8::to_ascii_lowercase)),
        }
        0
    }

    /// What the result is stored as, where it is a number.
    pub fn number(self) -> Option<Elementary> {
        match self {
            Self::Length | Self::Find => Some(Elementary::Lint),
            Self::Compare(_) => Some(Elementary::Bool),
            Self::To(of) => Some(of),
            Self::Byte => Some(Elementary::Byte),
            _ => None,
        }
    }
}

/// The position of the first occurrence, from 1; 0 where there is none, or where nothing is sought.
fn find(text: &[u8], sought: &[u8]) -> u64 {
    if sought.is_empty() {
        return 0;
    }
    let at = text.windows(sought.len()).position(|window| window == sought);
    at.map_or(0, |at| at as u64 + 1)
}

/// A text as a literal of IEC 61131-3: `'it$'s'`, or in double quotes where it is a WSTRING.
pub fn text_literal(bytes: &[u8], wide: bool) -> String {
    let quote = if wide { '"' } else { '\'' };
    let mut text = String::from(quote);
    for byte in bytes {
        let character = char::from(*byte);
        match byte {
            b'$' => text.push_str("$$"),
            0x0A => text.push_str("$L"),
            0x0C => text.push_str("$P"),
            0x0D => text.push_str("$R"),
            0x09 => text.push_str("$T"),
            _ if character == quote => {
                text.push('$');
                text.push(quote);
            }
            0x20..=0x7E => text.push(character),
            _ if wide => {
                let _ = write!(text, "${byte:04X}");
            }
            _ => {
                let _ = write!(text, "${byte:02X}");
            }
        }
    }
    text.push(quote);
    text
}
