//! Values in the text of a chain: numbers, times and rates, with their dimension.

use std::ops::Range;

use understudy_text::Diagnostic;

use crate::quantity::unit_length;

/// Parentheses and signs within each other, at most.
const MAXIMUM_DEPTH: u32 = 64;

/// A number of hours to a power: 0 a pure number, 1 a time, -1 a rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Value {
    pub(super) number: f64,
    pub(super) dimension: i32,
}

impl Value {
    /// What it is, for people.
    pub(super) fn said(self) -> String {
        match self.dimension {
            0 => "a number without a unit".into(),
            1 => "a time".into(),
            -1 => "a rate".into(),
            other => format!("hours to the power {other}"),
        }
    }
}

/// Error in a value; `unknown` is an undeclared name.
pub(super) struct Wrong {
    pub(super) diagnostic: Diagnostic,
    pub(super) unknown: Option<String>,
}

impl Wrong {
    fn new(code: &'static str, message: String, span: Range<usize>) -> Box<Self> {
        Box::new(Self { diagnostic: Diagnostic::error(code, message, span), unknown: None })
    }
}

type Parsed = Result<Option<Value>, Box<Wrong>>;

/// The value of `text`, which stands at `offset`. `constant` gives a named one: nothing where there is none, and nothing inside where
/// there is one that could not be read, for that was said already.
pub(super) fn evaluate(
    text: &str,
    offset: usize,
    constant: impl FnMut(&str) -> Option<Option<Value>>,
) -> Parsed {
    let mut parser = Parser { text: text.trim_end(), at: 0, offset, constant };
    let value = parser.sum(0)?;
    parser.blank();
    match parser.peek() {
        None => Ok(value),
        Some(character) => {
            let span = parser.here(character.len_utf8());
            Err(Wrong::new("U0721", format!("{character} is not expected here"), span))
        }
    }
}

/// Letters, digits and _ at the beginning of a text.
fn word(text: &str) -> &str {
    let is_part = |character: char| character.is_alphanumeric() || character == '_';
    let end = text.find(|character: char| !is_part(character));
    &text[..end.unwrap_or(text.len())]
}

struct Parser<'a, Constant> {
    text: &'a str,
    at: usize,
    offset: usize,
    constant: Constant,
}

impl<Constant: FnMut(&str) -> Option<Option<Value>>> Parser<'_, Constant> {
    fn sum(&mut self, depth: u32) -> Parsed {
        let start = self.at;
        let mut left = self.product(depth)?;
        loop {
            self.blank();
            let sign = match self.peek() {
                Some('+') => 1.0,
                Some('-') => -1.0,
                _ => return Ok(left),
            };
            self.at += 1;
            let right = self.product(depth)?;
            left = match (left, right) {
                (Some(a), Some(b)) if a.dimension != b.dimension => {
                    let span = self.offset + start..self.offset + self.at;
                    let message = format!("{} and {} cannot be added", a.said(), b.said());
                    return Err(Wrong::new("U0725", message, span));
                }
                (Some(a), Some(b)) => {
                    Some(Value { number: a.number + sign * b.number, dimension: a.dimension })
                }
                _ => None,
            };
        }
    }

    fn product(&mut self, depth: u32) -> Parsed {
        let mut left = self.factor(depth)?;
        loop {
            self.blank();
            let over = match self.peek() {
                Some('*') => false,
                Some('/') => true,
                _ => return Ok(left),
            };
            self.at += 1;
            let right = self.factor(depth)?;
            left = left.zip(right).map(|(a, b)| Value {
                number: if over { a.number / b.number } else { a.number * b.number },
                dimension: a
                    .dimension
                    .saturating_add(if over { -b.dimension } else { b.dimension })
                    .clamp(-99, 99),
            });
        }
    }

    fn factor(&mut self, depth: u32) -> Parsed {
        self.blank();
        if depth > MAXIMUM_DEPTH {
            let message = format!("the value is nested deeper than {MAXIMUM_DEPTH}");
            return Err(Wrong::new("U0730", message, self.here(0)));
        }
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let value = self.sum(depth + 1)?;
                self.blank();
                if self.peek() != Some(')') {
                    return Err(Wrong::new("U0721", "expected )".into(), self.here(0)));
                }
                self.at += 1;
                Ok(value)
            }
            Some('-') => {
                self.at += 1;
                let value = self.factor(depth + 1)?;
                Ok(value.map(|value| Value { number: -value.number, ..value }))
            }
            Some(first) if first.is_ascii_digit() || first == '.' => self.number().map(Some),
            Some(first) if first.is_alphabetic() || first == '_' => self.name(),
            Some(other) => {
                let span = self.here(other.len_utf8());
                Err(Wrong::new("U0721", format!("expected a value and found {other}"), span))
            }
            None => Err(Wrong::new("U0721", "expected a value".into(), self.here(0))),
        }
    }

    /// `3`, `1.5e-4`, `24h`.
    fn number(&mut self) -> Result<Value, Box<Wrong>> {
        let rest = &self.text[self.at..];
        let bytes = rest.as_bytes();
        let digits =
            |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let mut length = digits(0);
        if bytes.get(length) == Some(&b'.') {
            length += 1 + digits(length + 1);
        }
        if matches!(bytes.get(length), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
            let exponent = digits((length + 1 + sign).min(bytes.len()));
            if exponent > 0 {
                length += 1 + sign + exponent;
            }
        }
        let span = self.here(length);
        let Ok(number) = rest[..length].parse::<f64>() else {
            return Err(Wrong::new("U0721", format!("{} is not a number", &rest[..length]), span));
        };
        self.at += length;
        let spaces =
            self.text[self.at..].len() - self.text[self.at..].trim_start_matches(' ').len();
        let unit_at = self.at + spaces;
        let unit = word(&self.text[unit_at..]);
        if unit.is_empty() {
            return Ok(Value { number, dimension: 0 });
        }
        self.at = unit_at;
        let span = self.here(unit.len());
        self.at += unit.len();
        match unit_length(unit) {
            Some(length) => Ok(Value { number: number * length, dimension: 1 }),
            None => {
                let mut wrong = Wrong::new("U0725", format!("{unit} is not a unit of time"), span);
                wrong.diagnostic.help = Some(
                    "there are us, ms, s, min, h, d and y; a product is written with *".into(),
                );
                Err(wrong)
            }
        }
    }

    fn name(&mut self) -> Parsed {
        let name = word(&self.text[self.at..]);
        let span = self.here(name.len());
        self.at += name.len();
        match (self.constant)(name) {
            Some(value) => Ok(value),
            None => {
                let mut wrong = Wrong::new(
                    "U0723",
                    format!("there is no constant {name} above this line"),
                    span,
                );
                wrong.unknown = Some(name.to_owned());
                Err(wrong)
            }
        }
    }

    fn blank(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn here(&self, length: usize) -> Range<usize> {
        let start = self.offset + self.at;
        start..start + length
    }
}
