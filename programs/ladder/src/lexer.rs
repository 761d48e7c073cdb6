//! Text to lexemes. Every byte belongs to exactly one lexeme, to white space, or to a diagnosed error.

use std::iter::Peekable;
use std::ops::Range;
use std::str::CharIndices;
use std::time::Duration;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS, duration};

use crate::program::{Address, Area};

/// The longest name in characters.
pub const MAXIMUM_NAME_LENGTH: usize = 120;

/// The longest preset time.
pub const MAXIMUM_PRESET_TIME: Duration = duration::MAXIMUM;

/// What one lexeme is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Lexeme {
    Word(String),
    Number(u64),
    Time(Duration),
    Address(Address),
    Text(String),
    /// One of `[ ] | ( ) { } / + - = <> < <= > >=`.
    Sign(&'static str),
    Comment(String),
    /// Not understood and already diagnosed.
    Faulty,
    End,
}

/// A lexeme with its place.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    pub(crate) lexeme: Lexeme,
    pub(crate) span: Range<usize>,
    /// Nothing but white space before it on its line.
    pub(crate) starts_line: bool,
}

/// The longer of two signs that begin alike comes first.
const SIGNS: [&str; 16] =
    ["<>", "<=", ">=", "[", "]", "|", "(", ")", "{", "}", "/", "+", "=", "<", ">", ","];

/// All lexemes of `text` with an [`Lexeme::End`] last, and what was wrong.
pub(crate) fn lex(text: &str) -> (Vec<Placed>, Vec<Diagnostic>) {
    let mut lexer =
        Lexer { text, characters: text.char_indices().peekable(), diagnostics: Vec::new() };
    let mut lexemes = Vec::new();
    let mut starts_line = true;
    while let Some(&(start, character)) = lexer.characters.peek() {
        if lexer.diagnostics.len() >= MAXIMUM_FINDINGS {
            lexer.diagnostics.push(Diagnostic::too_many(start));
            break;
        }
        if character.is_whitespace() || (start == 0 && character == '\u{feff}') {
            starts_line |= character == '\n';
            lexer.characters.next();
            continue;
        }
        let lexeme = lexer.lexeme(start, character);
        lexemes.push(Placed { lexeme, span: start..lexer.place(), starts_line });
        starts_line = false;
    }
    lexemes.push(Placed { lexeme: Lexeme::End, span: text.len()..text.len(), starts_line: true });
    (lexemes, lexer.diagnostics)
}

struct Lexer<'a> {
    text: &'a str,
    characters: Peekable<CharIndices<'a>>,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Lexer<'a> {
    fn place(&mut self) -> usize {
        self.characters.peek().map_or(self.text.len(), |&(place, _)| place)
    }

    fn take_while(&mut self, belongs: impl Fn(char) -> bool) -> &'a str {
        let start = self.place();
        while self.characters.next_if(|&(_, character)| belongs(character)).is_some() {}
        let end = self.place();
        &self.text[start..end]
    }

    fn lexeme(&mut self, start: usize, character: char) -> Lexeme {
        if self.text[start..].starts_with("--") {
            let line = self.take_while(|character| character != '\n');
            return Lexeme::Comment(line[2..].trim().to_owned());
        }
        if character == '-' {
            self.characters.next();
            return Lexeme::Sign("-");
        }
        if let Some(sign) = SIGNS.into_iter().find(|sign| self.text[start..].starts_with(sign)) {
            for _ in sign.chars() {
                self.characters.next();
            }
            return Lexeme::Sign(sign);
        }
        match character {
            '"' => self.text(start),
            '%' => self.address(start),
            '0'..='9' => self.number(start),
            _ if is_name_start(character) => self.word(start),
            _ => self.strange(start, character),
        }
    }

    fn strange(&mut self, start: usize, character: char) -> Lexeme {
        self.characters.next();
        let span = start..start + character.len_utf8();
        let diagnostic = Diagnostic::error(
            "U0101",
            format!("`{}` does not belong here", character.escape_debug()),
            span,
        );
        self.diagnostics.push(match character {
            '!' | '~' | '\u{ac}' => {
                diagnostic.with_help("a normally closed contact is written /name")
            }
            '^' => diagnostic.with_help("a rising edge is written +name, a falling edge -name"),
            '#' | ';' => diagnostic.with_help("a comment begins with --"),
            _ => diagnostic,
        });
        Lexeme::Faulty
    }

    fn word(&mut self, start: usize) -> Lexeme {
        let word = self.take_while(|character| is_name_part(character) || character == '.');
        let length = word.chars().count();
        if length > MAXIMUM_NAME_LENGTH {
            self.diagnostics.push(
                Diagnostic::error(
                    "U0114",
                    format!(
                        "a name has {length} characters; at most {MAXIMUM_NAME_LENGTH} are allowed"
                    ),
                    start..start + word.len(),
                )
                .with_help("shorten the name"),
            );
            return Lexeme::Faulty;
        }
        if word.ends_with('.') || word.contains("..") {
            self.diagnostics.push(Diagnostic::error(
                "U0101",
                format!("invalid name `{word}`: a dot separates two parts"),
                start..start + word.len(),
            ));
            return Lexeme::Faulty;
        }
        Lexeme::Word(word.to_owned())
    }

    /// A text in quotes on one line; `\"` and `\\` stand for a quote and a backslash.
    fn text(&mut self, start: usize) -> Lexeme {
        self.characters.next();
        let mut content = String::new();
        while let Some((_, character)) = self.characters.next_if(|&(_, next)| next != '\n') {
            match character {
                '"' => return Lexeme::Text(content),
                '\\' => match self.characters.next_if(|&(_, next)| next != '\n') {
                    Some((_, escaped)) => content.push(escaped),
                    None => content.push('\\'),
                },
                _ => content.push(character),
            }
        }
        let end = self.place();
        self.diagnostics.push(
            Diagnostic::error("U0103", "a text in quotes does not end on its line", start..end)
                .with_help("close it with \""),
        );
        Lexeme::Text(content)
    }

    fn address(&mut self, start: usize) -> Lexeme {
        self.characters.next();
        let rest =
            self.take_while(|character| character.is_ascii_alphanumeric() || character == '.');
        match parse_address(rest) {
            Some(address) => Lexeme::Address(address),
            None => {
                self.diagnostics.push(
                    Diagnostic::error(
                        "U0109",
                        format!("`%{rest}` is not the address of a bit"),
                        start..start + 1 + rest.len(),
                    )
                    .with_help("addresses look like %IX0.3, %QX1.0 or %MX2.7"),
                );
                Lexeme::Faulty
            }
        }
    }

    fn number(&mut self, start: usize) -> Lexeme {
        let word = self.take_while(|character| is_name_part(character) || character == '.');
        if word.bytes().all(|byte| byte.is_ascii_digit())
            && let Ok(number) = word.parse()
        {
            return Lexeme::Number(number);
        }
        match duration::parse(word) {
            Ok(time) => Lexeme::Time(time),
            Err(_) => {
                let message = format!("`{word}` is neither a number nor a duration");
                self.diagnostics
                    .push(Diagnostic::error("U0110", message, start..start + word.len()).with_help(
                    "write a duration such as 300ms, 1.5s or 1m30s (units d, h, m, s, ms, us and \
                         ns, the larger first), at most 100 days; names begin with a letter or _",
                ));
                Lexeme::Faulty
            }
        }
    }
}

/// Whether a name can begin with it.
pub(crate) fn is_name_start(character: char) -> bool {
    character.is_alphabetic() || character == '_'
}

/// Whether it can stand inside a name (dots join names and are treated apart).
pub(crate) fn is_name_part(character: char) -> bool {
    character.is_alphanumeric() || character == '_'
}

/// The address of a bit, without its `%`; `None` where the text is not an address.
pub fn parse_address(text: &str) -> Option<Address> {
    let mut characters = text.chars();
    let area = match characters.next()? {
        'I' => Area::Input,
        'Q' => Area::Output,
        'M' => Area::Memory,
        _ => return None,
    };
    let rest = characters.as_str();
    let path = rest
        .strip_prefix('X')
        .unwrap_or(rest)
        .split('.')
        .map(|part| {
            let digits = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            if digits { part.parse().ok() } else { None }
        })
        .collect::<Option<Vec<u32>>>()?;
    Some(Address { area, path })
}
