//! Words and signs of a property, each with its place.

use std::ops::Range;

use understudy_text::Diagnostic;

/// What a [`Token`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    /// A name or a word.
    Word,
    /// A number.
    Number,
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

const SIGNS: [(&str, Sign); 11] = [
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
            let end = rest.find(|next: char| !next.is_ascii_digit());
            push(Sign::Number, end.unwrap_or(rest.len()))
        } else if first.is_alphabetic() || first == '_' {
            push(Sign::Word, word_length(rest))
        } else {
            let place = offset + at..offset + at + first.len_utf8();
            let message = format!("{first:?} is not allowed in a property");
            diagnostics.push(
                Diagnostic::error("U0430", message, place)
                    .with_help("the signs are ! & | -> <-> ( ) [ ] and .."),
            );
            first.len_utf8()
        };
    }
    tokens
}

/// Letters, digits and underscores, and a dot that stands before another such character (`pause.Q`).
fn word_length(text: &str) -> usize {
    let part = |character: char| character.is_alphanumeric() || character == '_';
    let mut characters = text.char_indices().peekable();
    while let Some((at, character)) = characters.next() {
        let dot = character == '.' && characters.peek().is_some_and(|&(_, next)| part(next));
        if !part(character) && !dot {
            return at;
        }
    }
    text.len()
}
