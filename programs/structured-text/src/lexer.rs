//! Text to lexemes. Words keep their letters; case does not matter, so they are compared without it.
//!
//! What is read past here, by rule and without a warning: comments of every dialect, pragmas that no execution depends on
//! (`{attribute …}`, `{region …}`, `{ S7_Optimized_Access := 'TRUE' }`), `REGION title` and `END_REGION` of Siemens SCL, and
//! the `#` in front of a local variable.

mod literal;
mod moment;
mod pragma;

use std::ops::Range;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use crate::syntax::Literal;

pub(crate) use moment::calendar;
pub(crate) use pragma::code_refused;
use pragma::is_foreign_code;

/// What one lexeme is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Lexeme<'a> {
    /// A keyword or an identifier, as written.
    Word(&'a str),
    /// `Type#name`, as written.
    Qualified(&'a str),
    /// A value written out.
    Literal(Box<Literal>),
    /// `%IX0.3`, as written.
    Address(&'a str),
    /// An operator or a punctuation mark.
    Sign(&'static str),
    /// C code that can write variables, as written.
    Code(&'a str),
    /// Not understood and already diagnosed.
    Faulty,
    /// The end of the text.
    End,
}

/// Comments around a lexeme.
#[derive(Debug, Clone, Default)]
pub(crate) struct Comments {
    /// On the lines above it, or before it on its line.
    pub(crate) above: Vec<String>,
    /// Behind it on its line.
    pub(crate) behind: Option<String>,
}

/// A lexeme with its place.
#[derive(Debug, Clone)]
pub(crate) struct Placed<'a> {
    pub(crate) lexeme: Lexeme<'a>,
    pub(crate) span: Range<usize>,
    /// In the text that was read, where that stands in a larger one.
    pub(crate) within: Range<usize>,
    /// Whether it is the first on its line.
    pub(crate) starts_line: bool,
    /// None where there are none.
    pub(crate) comments: Option<Box<Comments>>,
}

/// All lexemes of a text.
pub(crate) struct Lexemes<'a> {
    /// [`Lexeme::End`] is the last.
    pub(crate) placed: Vec<Placed<'a>>,
    /// Whether a `#` is in front of a variable, as in Siemens SCL.
    pub(crate) has_local_marks: bool,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// The longer of two signs that begin alike comes first.
const SIGNS: [&str; 29] = [
    ":=", "=>", "<>", "<=", ">=", "..", "**", "+=", "-=", "*=", "/=", "?=", ":", ";", "(", ")",
    "[", "]", ",", ".", "=", "<", ">", "+", "-", "*", "/", "^", "&",
];

/// The longest comment that is kept, in characters.
const MAXIMUM_COMMENT: usize = 1_000;

/// The longest name, in characters.
pub(crate) const MAXIMUM_NAME_LENGTH: usize = 120;

/// Lexemes of one text at most.
const MAXIMUM_LEXEMES: usize = 4 << 20;

/// All lexemes of `text`, and what was wrong.
pub(crate) fn lex(text: &str) -> Lexemes<'_> {
    let mut lexer = Lexer {
        text,
        place: 0,
        debugger: debugger_lines(text),
        nests: true,
        has_local_marks: false,
        diagnostics: Vec::new(),
    };
    let mut placed: Vec<Placed> = Vec::new();
    let mut above = Vec::new();
    let mut line_broken = true;
    while let Some(character) = lexer.rest().chars().next() {
        if lexer.diagnostics.len() >= MAXIMUM_FINDINGS {
            lexer.diagnostics.push(Diagnostic::too_many(lexer.place));
            break;
        }
        if placed.len() >= MAXIMUM_LEXEMES {
            let message = format!("the text has more than {MAXIMUM_LEXEMES} words and signs");
            let place = lexer.place..lexer.place;
            lexer.diagnostics.push(Diagnostic::error("U1033", message, place));
            break;
        }
        if character.is_whitespace() || character == '\u{feff}' {
            line_broken |= character == '\n';
            lexer.place += character.len_utf8();
        } else if let Some(length) = debugger_line(&text[..lexer.place], lexer.rest()) {
            lexer.place += length;
        } else if let Some(name) = lexer.current_time() {
            let start = lexer.place - name.within.len();
            let words = [Lexeme::Word(name.variable), Lexeme::Sign(":="), Lexeme::Word("TIME")];
            let signs = ["(", ")", ";"].map(Lexeme::Sign);
            for lexeme in words.into_iter().chain(signs) {
                placed.push(Placed {
                    lexeme,
                    span: start..lexer.place,
                    within: start..lexer.place,
                    starts_line: std::mem::take(&mut line_broken),
                    comments: boxed(&mut above),
                });
            }
        } else if let Some(code) = lexer.code() {
            let start = lexer.place - code.len();
            placed.push(Placed {
                lexeme: Lexeme::Code(code),
                span: start..lexer.place,
                within: start..lexer.place,
                starts_line: std::mem::take(&mut line_broken),
                comments: boxed(&mut above),
            });
        } else if let Some(comment) = lexer.comment().or_else(|| lexer.region()) {
            match placed.last_mut().filter(|_| !line_broken) {
                Some(last) if comment.is_some() => {
                    let comments = last.comments.get_or_insert_default();
                    match comments.behind {
                        None => comments.behind = comment,
                        Some(_) => above.extend(comment),
                    }
                }
                _ => above.extend(comment),
            }
        } else {
            let start = lexer.place;
            let lexeme = lexer.lexeme(character);
            placed.push(Placed {
                lexeme,
                span: start..lexer.place,
                within: start..lexer.place,
                starts_line: line_broken,
                comments: boxed(&mut above),
            });
            line_broken = false;
        }
    }
    placed.push(Placed {
        lexeme: Lexeme::End,
        span: text.len()..text.len(),
        within: text.len()..text.len(),
        starts_line: true,
        comments: boxed(&mut above),
    });
    Lexemes { placed, has_local_marks: lexer.has_local_marks, diagnostics: lexer.diagnostics }
}

/// The start of each line that OpenPLC Editor writes for its debugger: C code, which is not a comment of the standard where it has
/// the end of one in it. OpenPLC takes these lines out before it compiles, whatever is around them.
const DEBUGGER: &str = "(*DBG:";

/// The length of a line for the debugger that begins here: it ends with the end of a comment.
fn debugger_line(before: &str, rest: &str) -> Option<usize> {
    if !rest.starts_with(DEBUGGER) || !(before.is_empty() || before.ends_with('\n')) {
        return None;
    }
    let line = rest.split('\n').next().unwrap_or(rest);
    line.trim_end().ends_with("*)").then_some(line.len())
}

fn debugger_lines(text: &str) -> Vec<usize> {
    let starts = text.match_indices(DEBUGGER).map(|(start, _)| start);
    starts.filter(|start| debugger_line(&text[..*start], &text[*start..]).is_some()).collect()
}

/// The pragma by which the standard blocks of matiec read the time.
struct CurrentTime<'a> {
    within: &'a str,
    variable: &'a str,
}

fn boxed(above: &mut Vec<String>) -> Option<Box<Comments>> {
    (!above.is_empty()).then(|| Box::new(Comments { above: std::mem::take(above), behind: None }))
}

struct Lexer<'a> {
    text: &'a str,
    place: usize,
    /// Where lines of a debugger begin.
    debugger: Vec<usize>,
    /// Whether comments in comments are closed, as far as is known.
    nests: bool,
    has_local_marks: bool,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.place..]
    }

    fn since(&self, start: usize) -> &'a str {
        &self.text[start..self.place]
    }

    fn take_while(&mut self, belongs: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let length = rest.find(|character| !belongs(character));
        let taken = &rest[..length.unwrap_or(rest.len())];
        self.place += taken.len();
        taken
    }

    fn error(&mut self, code: &'static str, message: String, start: usize) -> Lexeme<'a> {
        let span = start..self.place;
        self.diagnostics.push(Diagnostic::error(code, message, span));
        Lexeme::Faulty
    }

    fn warn(&mut self, message: String, start: usize) {
        let span = start..self.place;
        self.diagnostics.push(Diagnostic::warning("U1055", message, span));
    }

    /// `{__SET_VAR(data__->,CURRENT_TIME,,__CURRENT_TIME)}`, which is `CURRENT_TIME := TIME();`.
    fn current_time(&mut self) -> Option<CurrentTime<'a>> {
        let rest = self.rest();
        let content = rest.strip_prefix("{__SET_VAR(data__->,")?;
        let length = content.find(|next: char| !next.is_ascii_alphanumeric() && next != '_')?;
        let (variable, behind) = content.split_at(length);
        let behind = behind.strip_prefix(",,__CURRENT_TIME)")?;
        let behind = behind.strip_prefix(';').unwrap_or(behind).strip_prefix('}')?;
        let within = &rest[..rest.len() - behind.len()];
        self.place += within.len();
        Some(CurrentTime { within, variable })
    }

    /// Takes a comment or a pragma; the inner option is what it says, if anything.
    fn comment(&mut self) -> Option<Option<String>> {
        let rest = self.rest();
        let (opening, closing) =
            [("(*", "*)"), ("/*", "*/"), ("//", "\n"), ("{{", "}}"), ("{", "}")]
                .into_iter()
                .find(|(opening, _)| rest.starts_with(opening))?;
        let start = self.place;
        let content = &rest[opening.len()..];
        let next = self.debugger.partition_point(|line| *line < start + opening.len());
        let end = self.debugger.get(next).copied().unwrap_or(self.text.len());
        let own = &content[..end - start - opening.len()];
        let length = self.comment_length(own, opening, closing);
        let length = match length.or_else(|| self.comment_length(content, opening, closing)) {
            Some(length) => length,
            None if closing == "\n" => content.len(),
            None => {
                self.place = start + opening.len();
                let what = match opening {
                    "{" | "{{" => "pragma",
                    _ => "comment",
                };
                let message = format!("a {what} that `{opening}` opens does not end");
                self.error("U1031", message, start);
                self.place = self.text.len();
                return Some(None);
            }
        };
        // The line's end says that what follows begins on a line of its own.
        let closing_length = if closing == "\n" { 0 } else { closing.len() };
        self.place += opening.len() + length + closing_length;
        let content = &content[..length];
        if opening == "{{" || opening == "{" && is_foreign_code(content) {
            let message = "this C code is not executed; it writes no variable of the program";
            self.warn(message.to_owned(), start);
            return Some(None);
        }
        if opening == "{" {
            self.pragma(content, start);
            return Some(None);
        }
        // Exporters of CODESYS write such notes to themselves.
        if content.trim_start().starts_with('@') && content.contains(":=") {
            return Some(None);
        }
        let words: Vec<&str> = content.split_whitespace().collect();
        let words = words.join(" ");
        let kept: String = words.chars().take(MAXIMUM_COMMENT).collect();
        if kept.len() < words.len() {
            let message =
                format!("of this comment the first {MAXIMUM_COMMENT} characters are kept");
            self.warn(message, start);
        }
        Some(Some(kept).filter(|kept| !kept.is_empty()))
    }

    /// Bytes up to the end of a comment. One that contains others ends with the last of them; where that would never end, as
    /// in texts of compilers that do not nest comments, it ends at the first end.
    fn comment_length(&mut self, content: &str, opening: &str, closing: &str) -> Option<usize> {
        let first = content.find(closing)?;
        let can_nest = matches!(opening, "(*" | "/*") && self.nests;
        if !can_nest || !content[..first].contains(opening) {
            return Some(first);
        }
        let mut depth = 1;
        let mut place = 0;
        while let Some(found) = content[place..].find(['*', '(', '/']) {
            place += found;
            if content[place..].starts_with(closing) {
                depth -= 1;
                if depth == 0 {
                    return Some(place);
                }
                place += closing.len();
            } else if content[place..].starts_with(opening) {
                depth += 1;
                place += opening.len();
            } else {
                place += 1;
            }
        }
        self.nests = false;
        Some(first)
    }

    /// `REGION title`, whose title becomes a comment, or `END_REGION`, of Siemens SCL.
    fn region(&mut self) -> Option<Option<String>> {
        let rest = self.rest();
        if !rest.starts_with(['R', 'r', 'E', 'e']) {
            return None;
        }
        let length = rest.find(|next: char| !next.is_ascii_alphanumeric() && next != '_');
        let word = &rest[..length.unwrap_or(rest.len())];
        if word.eq_ignore_ascii_case("END_REGION") {
            self.place += word.len();
            return Some(None);
        }
        let behind = rest[word.len()..].trim_start_matches([' ', '\t']);
        let of_a_variable = [':', '.', '(', '[', ',', ';', '=', '<', '>', ')', '+', '-'];
        if !word.eq_ignore_ascii_case("REGION") || behind.starts_with(of_a_variable) {
            return None;
        }
        self.place += word.len();
        let title = self.take_while(|next| next != '\n');
        let words: Vec<&str> = title.split_whitespace().collect();
        let kept: String = words.join(" ").chars().take(MAXIMUM_COMMENT).collect();
        Some(Some(kept).filter(|kept| !kept.is_empty()))
    }

    fn lexeme(&mut self, character: char) -> Lexeme<'a> {
        let start = self.place;
        match character {
            '0'..='9' => return self.number(start),
            '%' => {
                self.place += 1;
                // Behind a point it is a part, which further points follow.
                let is_part = self.text[..start].ends_with('.');
                let others = if is_part { "" } else { ".*_" };
                self.take_while(|next| next.is_ascii_alphanumeric() || others.contains(next));
                return Lexeme::Address(self.since(start));
            }
            '\'' | '"' => return self.quoted(character, start),
            '#' if self.rest()[1..]
                .starts_with(|next: char| is_word_start(next) || next == '"') =>
            {
                self.place += 1;
                self.has_local_marks = true;
                return match self.rest().starts_with('"') {
                    true => self.quoted('"', start + 1),
                    false => self.plain_word(),
                };
            }
            _ if is_word_start(character) => return self.word(start),
            _ => {}
        }
        if let Some(sign) = SIGNS.into_iter().find(|sign| self.rest().starts_with(sign)) {
            self.place += sign.len();
            return Lexeme::Sign(sign);
        }
        self.place += character.len_utf8();
        let message = format!("`{}` does not belong here", character.escape_debug());
        self.error("U1030", message, start)
    }

    fn word(&mut self, start: usize) -> Lexeme<'a> {
        let lexeme = self.plain_word();
        match lexeme {
            Lexeme::Word(word) if self.rest().starts_with('#') => self.typed(word, start),
            lexeme => lexeme,
        }
    }

    fn plain_word(&mut self) -> Lexeme<'a> {
        let start = self.place;
        let word = self.take_while(|next| is_word_start(next) || next.is_numeric());
        if !word.is_ascii() {
            let message = format!("the name `{word}` has letters other than A to Z");
            return self.error("U1030", message, start);
        }
        if word.len() > MAXIMUM_NAME_LENGTH {
            let message = format!(
                "a name has {} characters; at most {MAXIMUM_NAME_LENGTH} are allowed",
                word.len()
            );
            return self.error("U1030", message, start);
        }
        Lexeme::Word(word)
    }
}

fn is_word_start(character: char) -> bool {
    character.is_ascii_alphabetic()
        || character == '_'
        || (!character.is_ascii() && character.is_alphabetic())
}

#[cfg(test)]
mod tests;
