//! Text to lexemes. Words keep their letters; case does not matter, so they are compared in capitals.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::MAXIMUM_NAME_LENGTH;
use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use crate::plcopen::literal::duration;

/// What one lexeme is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Lexeme {
    /// A keyword or an identifier, as written.
    Word(String),
    /// A whole number, without its sign.
    Number(i64),
    /// A duration.
    Time(Duration),
    /// `%IX0.3`, without its `%`, in capitals.
    Address(String),
    /// A real number, a text, a date: something that no circuit can hold. Says what.
    Foreign(&'static str),
    /// An operator or a mark of punctuation.
    Sign(&'static str),
    /// Not understood and already diagnosed.
    Faulty,
    End,
}

/// A lexeme with its place and the comments before it.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    pub(super) lexeme: Lexeme,
    pub(super) span: Range<usize>,
    /// Comments on the lines above it, or before it on its line.
    pub(super) comments: Vec<String>,
    /// The comment behind it on its line.
    pub(super) remark: Option<String>,
}

/// The longer of two signs that begin alike comes first.
const SIGNS: [&str; 22] = [
    ":=", "=>", "<>", "<=", ">=", "..", "**", ":", ";", "(", ")", "[", "]", ",", ".", "=", "<",
    ">", "+", "-", "*", "/",
];

/// The longest comment that is kept, in characters.
const MAXIMUM_COMMENT: usize = 1_000;

/// All lexemes of `text` with an [`Lexeme::End`] last, and what was wrong.
pub(super) fn lex(text: &str) -> (Vec<Placed>, Vec<Diagnostic>) {
    let mut lexer = Lexer {
        text,
        place: 0,
        diagnostics: Vec::new(),
    };
    let mut lexemes: Vec<Placed> = Vec::new();
    let mut comments = Vec::new();
    let mut line_broken = true;
    loop {
        if lexer.diagnostics.len() >= MAXIMUM_FINDINGS {
            lexer.diagnostics.push(Diagnostic::too_many(lexer.place));
            break;
        }
        let rest = lexer.rest();
        let Some(character) = rest.chars().next() else {
            break;
        };
        if character.is_whitespace() || character == '\u{feff}' {
            line_broken |= character == '\n';
            lexer.place += character.len_utf8();
        } else if let Some(comment) = lexer.comment() {
            match lexemes.last_mut() {
                Some(last) if !line_broken && last.remark.is_none() => last.remark = comment,
                _ => comments.extend(comment),
            }
        } else {
            let start = lexer.place;
            let lexeme = lexer.lexeme(character);
            lexemes.push(Placed {
                lexeme,
                span: start..lexer.place,
                comments: std::mem::take(&mut comments),
                remark: None,
            });
            line_broken = false;
        }
    }
    lexemes.push(Placed {
        lexeme: Lexeme::End,
        span: text.len()..text.len(),
        comments,
        remark: None,
    });
    (lexemes, lexer.diagnostics)
}

struct Lexer<'a> {
    text: &'a str,
    place: usize,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.place..]
    }

    fn take_while(&mut self, belongs: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let length = rest.find(|character| !belongs(character));
        let taken = &rest[..length.unwrap_or(rest.len())];
        self.place += taken.len();
        taken
    }

    fn error(&mut self, code: &'static str, message: String, start: usize) -> Lexeme {
        let span = start..self.place;
        self.diagnostics
            .push(Diagnostic::error(code, message, span));
        Lexeme::Faulty
    }

    /// Takes a comment or a pragma; the inner option is what it says, if anything.
    fn comment(&mut self) -> Option<Option<String>> {
        let rest = self.rest();
        let (opening, closing) = [("(*", "*)"), ("/*", "*/"), ("//", "\n"), ("{", "}")]
            .into_iter()
            .find(|(opening, _)| rest.starts_with(opening))?;
        let start = self.place;
        let content = &rest[opening.len()..];
        let length = match content.find(closing) {
            // The line's end says that what follows begins on a line of its own.
            Some(length) if closing == "\n" => {
                self.place += opening.len() + length;
                length
            }
            Some(length) => {
                self.place += opening.len() + length + closing.len();
                length
            }
            None => {
                self.place = self.text.len();
                if closing != "\n" {
                    self.place = start + opening.len();
                    self.error(
                        "U1031",
                        format!("a comment that `{opening}` opens does not end"),
                        start,
                    );
                    self.place = self.text.len();
                }
                content.len()
            }
        };
        if opening == "{" {
            return Some(None);
        }
        let words: Vec<&str> = content[..length].split_whitespace().collect();
        let words = words.join(" ");
        let kept: String = words.chars().take(MAXIMUM_COMMENT).collect();
        if kept.len() < words.len() {
            let message =
                format!("of this comment the first {MAXIMUM_COMMENT} characters are kept");
            let warning = Diagnostic::warning("U1055", message, start..self.place);
            self.diagnostics.push(warning);
        }
        Some(Some(kept).filter(|kept| !kept.is_empty()))
    }

    fn lexeme(&mut self, character: char) -> Lexeme {
        let start = self.place;
        match character {
            '0'..='9' => return self.number(start),
            '%' => {
                self.place += 1;
                let rest = self
                    .take_while(|next| next.is_ascii_alphanumeric() || next == '.' || next == '*');
                return Lexeme::Address(rest.to_ascii_uppercase());
            }
            '\'' | '"' => return self.text(character, start),
            '&' => {
                self.place += 1;
                return Lexeme::Word("AND".into());
            }
            _ if character.is_ascii_alphabetic() || character == '_' => return self.word(start),
            _ => {}
        }
        if let Some(sign) = SIGNS.into_iter().find(|sign| self.rest().starts_with(sign)) {
            self.place += sign.len();
            return Lexeme::Sign(sign);
        }
        self.place += character.len_utf8();
        self.error(
            "U1030",
            format!("`{}` does not belong here", character.escape_debug()),
            start,
        )
    }

    fn text(&mut self, quote: char, start: usize) -> Lexeme {
        self.place += 1;
        self.take_while(|next| next != quote && next != '\n');
        if !self.rest().starts_with(quote) {
            return self.error("U1031", "a text does not end on its line".into(), start);
        }
        self.place += 1;
        Lexeme::Foreign("a text")
    }

    fn word(&mut self, start: usize) -> Lexeme {
        let word = self.take_while(|next| next.is_ascii_alphanumeric() || next == '_');
        if self.rest().starts_with('#') {
            return self.typed(word, start);
        }
        if word.len() > MAXIMUM_NAME_LENGTH {
            let message = format!(
                "a name has {} characters; at most {MAXIMUM_NAME_LENGTH} are allowed",
                word.len()
            );
            return self.error("U1030", message, start);
        }
        Lexeme::Word(word.to_owned())
    }

    /// A literal with its type in front: `T#3s`, `BOOL#TRUE`, `INT#16#FF`.
    fn typed(&mut self, word: &str, start: usize) -> Lexeme {
        self.place += 1;
        let value = self.place;
        match word.to_ascii_uppercase().as_str() {
            "T" | "TIME" | "LT" | "LTIME" => {
                let text = self.take_while(|next| {
                    next.is_ascii_alphanumeric() || next == '_' || next == '.' || next == '-'
                });
                match duration(text) {
                    Some(time) => Lexeme::Time(time),
                    None => self.error(
                        "U1032",
                        format!(
                            "invalid duration `{text}`: expected a number with a unit, from 0 to 100 days"
                        ),
                        start,
                    ),
                }
            }
            "D" | "DATE" | "TOD" | "TIME_OF_DAY" | "DT" | "DATE_AND_TIME" => {
                self.take_while(|next| next.is_ascii_alphanumeric() || "-:._".contains(next));
                Lexeme::Foreign("a date")
            }
            "BOOL" => {
                let text = self.take_while(|next| next.is_ascii_alphanumeric());
                match text.to_ascii_uppercase().as_str() {
                    "TRUE" | "1" => Lexeme::Word("TRUE".into()),
                    "FALSE" | "0" => Lexeme::Word("FALSE".into()),
                    _ => self.error(
                        "U1032",
                        format!("`{text}` is neither TRUE nor FALSE"),
                        start,
                    ),
                }
            }
            "REAL" | "LREAL" => {
                self.take_while(|next| next.is_ascii_alphanumeric() || "+-._".contains(next));
                Lexeme::Foreign("a real number")
            }
            "SINT" | "INT" | "DINT" | "USINT" | "UINT" | "UDINT" => {
                let negative = self.rest().starts_with('-');
                self.place += usize::from(negative || self.rest().starts_with('+'));
                match self.number(value) {
                    Lexeme::Number(number) if negative => Lexeme::Number(-number),
                    other => other,
                }
            }
            _ => {
                let text = self.take_while(|next| next.is_ascii_alphanumeric() || next == '_');
                if text.starts_with(|first: char| first.is_ascii_alphabetic()) {
                    // A value of an enumeration with its type in front.
                    return Lexeme::Word(text.to_owned());
                }
                self.error("U1032", format!("unknown literal `{word}#{text}`"), start)
            }
        }
    }

    fn number(&mut self, start: usize) -> Lexeme {
        let digits = self.take_while(|next| next.is_ascii_digit() || next == '_');
        let rest = self.rest();
        let (digits, base) = if rest.starts_with('#') {
            self.place += 1;
            let base = digits
                .parse()
                .ok()
                .filter(|base| matches!(base, 2 | 8 | 16));
            (
                self.take_while(|next| next.is_ascii_alphanumeric() || next == '_'),
                base,
            )
        } else if rest.starts_with('.') && !rest.starts_with("..") || rest.starts_with(['e', 'E']) {
            self.take_while(|next| next.is_ascii_alphanumeric() || next == '.' || next == '_');
            return Lexeme::Foreign("a real number");
        } else {
            (digits, Some(10))
        };
        let plain: String = digits.chars().filter(|digit| *digit != '_').collect();
        let value = base.and_then(|base| i64::from_str_radix(&plain, base).ok());
        match value.filter(|value| *value <= i64::from(u32::MAX)) {
            Some(value) => Lexeme::Number(value),
            None => {
                let text = &self.text[start..self.place];
                self.error(
                    "U1032",
                    format!(
                        "invalid number `{text}`: expected a whole number up to {}",
                        u32::MAX
                    ),
                    start,
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lexemes_and_comments() {
        let (lexemes, diagnostics) = lex("(* above *) a := 16#fF; // behind\n{pragma} B >= 1..2");
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
        let found: Vec<Lexeme> = lexemes.iter().map(|placed| placed.lexeme.clone()).collect();
        let word = |text: &str| Lexeme::Word(text.into());
        let expected = vec![
            word("a"),
            Lexeme::Sign(":="),
            Lexeme::Number(255),
            Lexeme::Sign(";"),
            word("B"),
            Lexeme::Sign(">="),
            Lexeme::Number(1),
            Lexeme::Sign(".."),
            Lexeme::Number(2),
            Lexeme::End,
        ];
        assert_eq!(found, expected);
        assert_eq!(lexemes[0].comments, ["above"]);
        assert_eq!(lexemes[3].remark.as_deref(), Some("behind"));
    }
}
