//! Words and signs of a property, each with its place.

use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_typed::Comparison;

/// What a [`Token`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    /// A name or a word.
    Word,
    /// A number, with or without a fraction, or a duration.
    Number,
    /// `=`, `<=` and their like.
    Compared(Comparison),
    /// `-`
    Minus,
    /// `:`
    Colon,
    /// `!`
    Not,
    /// `&`
    And,
    /// `|`
    Or,
    /// `->`
    Implies,
    /// `<->`
    Same,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `[`
    OpenSquare,
    /// `]`
    CloseSquare,
    /// `..`
    Range,
}

/// One word or sign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token<'t> {
    pub(super) sign: Sign,
    pub(super) text: &'t str,
    pub(super) span: Range<usize>,
}

const SIGNS: [(&str, Sign); 19] = [
    ("<->", Sign::Same),
    ("->", Sign::Implies),
    ("..", Sign::Range),
    ("&", Sign::And),
    ("|", Sign::Or),
    ("!", Sign::Not),
    ("(", Sign::Open),
    (")", Sign::Close),
    ("[", Sign::OpenSquare),
    ("]", Sign::CloseSquare),
    // As before a contact in the text of a ladder.
    ("/", Sign::Not),
    ("<>", Sign::Compared(Comparison::NotEqual)),
    ("<=", Sign::Compared(Comparison::LessOrEqual)),
    (">=", Sign::Compared(Comparison::GreaterOrEqual)),
    ("<", Sign::Compared(Comparison::Less)),
    (">", Sign::Compared(Comparison::Greater)),
    ("=", Sign::Compared(Comparison::Equal)),
    ("-", Sign::Minus),
    (":", Sign::Colon),
];

/// Tokens of `text`, at `offset` in its file.
pub(super) fn tokens<'t>(
    text: &'t str,
    offset: usize,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Token<'t>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let mut push = |sign, length: usize| {
            tokens.push(Token {
                sign,
                text: &rest[..length],
                span: offset + at..offset + at + length,
            });
            length
        };
        at += if first.is_whitespace() {
            first.len_utf8()
        } else if let Some((sign, kind)) = SIGNS.iter().find(|(sign, _)| rest.starts_with(sign)) {
            push(*kind, sign.len())
        } else if first.is_ascii_digit() {
            push(Sign::Number, number_length(rest))
        } else if first.is_alphabetic() || matches!(first, '_' | '%') {
            push(Sign::Word, word_length(rest))
        } else {
            let place = offset + at..offset + at + first.len_utf8();
            let message = format!("{first:?} is not allowed in a property");
            diagnostics.push(
                Diagnostic::error("U0430", message, place)
                    .with_help("the signs are ! & | -> <-> = <> < <= > >= ( ) [ ] : and .."),
            );
            first.len_utf8()
        };
    }
    tokens
}

/// The length of a number or a duration: `12`, `12.5`, `1.5e-3`, `16#FF`, `1m30s`, `2.5s`.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let is_exponent = |at: usize| at > 0 && matches!(bytes[at - 1], b'e' | b'E');
        let is_part = match byte {
            b'.' => is_digit(at + 1),
            b'+' | b'-' => is_exponent(at) && is_digit(at - 2) && is_digit(at + 1),
            _ => byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'#'),
        };
        if !is_part {
            break;
        }
        at += 1;
    }
    at
}

/// A name: letters, digits and underscores, a dot that stands before another such character (`pause.Q`), the index of an element (`step[3].done`), and
/// the sign of an address in front (`%QX1.1`).
fn word_length(text: &str) -> usize {
    if let Some(length) = moment_length(text) {
        return length;
    }
    let part = |character: char| character.is_alphanumeric() || character == '_';
    let mut at = usize::from(text.starts_with('%'));
    loop {
        let mut characters = text[at..].chars();
        at += match characters.next() {
            Some(character) if part(character) => character.len_utf8(),
            // A value with its type in front: `T#1s`.
            Some('#') if characters.next().is_some_and(part) => 1,
            Some('.') if characters.next().is_some_and(part) => 1,
            Some('[') => match index_length(&text[at..]) {
                0 => return at,
                length => length,
            },
            _ => return at,
        };
    }
}

/// The length of a date, a time of day or both with its type in front: `D#2024-02-29`, `TOD#12:34:56.5`, `DT#2024-02-29-12:34:56`.
fn moment_length(text: &str) -> Option<usize> {
    let (of, moment) = text.split_once('#')?;
    let types = ["D", "DATE", "TOD", "TIME_OF_DAY", "DT", "DATE_AND_TIME"];
    if !types.iter().any(|known| known.eq_ignore_ascii_case(of)) {
        return None;
    }
    let is_part = |sign: char| sign.is_ascii_digit() || "-:.".contains(sign);
    let end = moment.find(|sign| !is_part(sign)).unwrap_or(moment.len());
    let moment = moment[..end].trim_end_matches(|sign: char| !sign.is_ascii_digit());
    Some(of.len() + 1 + moment.len()).filter(|_| !moment.is_empty())
}

/// The length of `[3]` or `[-1,2]`; 0 of other brackets, such as those of `A[p U q]`.
fn index_length(text: &str) -> usize {
    let Some(end) = text.find(']') else {
        return 0;
    };
    let index = &text[1..end];
    let is_number = |number: &str| number.parse::<i64>().is_ok();
    if index.split(',').all(is_number) { end + 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_parts_indices_and_addresses() {
        let words = |text: &str| {
            let mut found = Vec::new();
            let tokens = tokens(text, 0, &mut found);
            assert_eq!(found, [], "{text}");
            tokens.iter().map(|token| token.text.to_owned()).collect::<Vec<String>>()
        };
        for name in ["a", "pause.Q", "step[3].done", "c[-1,2]", "t[0][1].Q", "%QX1.1", "%IW4"] {
            assert_eq!(words(&format!("never {name}")), ["never", name]);
            assert_eq!(words(&format!("AG !({name}&b)")), ["AG", "!", "(", name, "&", "b", ")"]);
        }
        assert_eq!(words("A[p U q]"), ["A", "[", "p", "U", "q", "]"]);
        assert_eq!(words("ABF 0..5 p"), ["ABF", "0", "..", "5", "p"]);
    }
}
