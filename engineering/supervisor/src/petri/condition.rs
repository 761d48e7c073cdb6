//! Conditions as text: contacts and branches as in the ladder format.
//!
//! ```text
//! body_present /stop [ +start | -door ]
//! ```
//!
//! `a` holds while the signal is 1, `/a` while it is 0, `+a` in the scan in which it has become 1, `-a` in which it has become
//! 0; one behind the other all have to hold, of branches one.

use std::fmt;

use understudy_ladder::Name;

use super::net::Condition;
use crate::form::{Form, Word};
use crate::ladder::{ILLEGAL_NAME, When, is_legal};
use understudy_text::Diagnostic;

/// Brackets nest no deeper.
const MAXIMUM_NESTING: usize = 64;

const SIGNS: [(char, When); 3] = [('/', When::Low), ('+', When::Rising), ('-', When::Falling)];

/// Reads a condition; `place` is that of its first letter. U0888 for an invalid condition, U0855 for an invalid name.
pub(super) fn parse_condition(form: &mut Form<'_>, (text, place): Word<'_>) -> Condition {
    let mut parser = Parser { form, text, start: place.start, at: 0, depth: 0 };
    let condition = parser.series();
    if parser.at < text.len() {
        parser.wrong("a `]` or `|` without its `[`", 1);
    }
    condition
}

struct Parser<'p, 't> {
    form: &'p mut Form<'t>,
    text: &'p str,
    /// Position of the text in its file.
    start: usize,
    at: usize,
    depth: usize,
}

impl Parser<'_, '_> {
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn wrong(&mut self, what: &str, length: usize) {
        let place = self.start + self.at;
        let message = format!("this is no condition: {what}");
        self.form.diagnostics.push(
            Diagnostic::error("U0888", message, place..place + length)
                .with_help("a condition looks like \"body_present /stop [ +start | -door ]\""),
        );
        // The rest is ignored.
        self.at = self.text.len();
    }

    /// { contact | branches }
    fn series(&mut self) -> Condition {
        let mut parts = Vec::new();
        while let Some(next) = self.peek() {
            match next {
                '[' => parts.push(self.branches()),
                ']' | '|' => break,
                _ => parts.extend(self.contact()),
            }
        }
        match parts.len() {
            0 => Condition::Always,
            1 => parts.swap_remove(0),
            _ => Condition::All(parts),
        }
    }

    /// "[", series, { "|", series }, "]"
    fn branches(&mut self) -> Condition {
        let opened = self.at;
        self.depth += 1;
        if self.depth > MAXIMUM_NESTING {
            self.wrong("brackets nest deeper than 64", 1);
            return Condition::Always;
        }
        let mut branches = Vec::new();
        loop {
            self.at += 1;
            let branch = self.series();
            if branch == Condition::Always && self.at < self.text.len() {
                self.wrong("a branch is empty", 1);
            }
            branches.push(branch);
            match self.peek() {
                Some('|') => {}
                Some(_) => {
                    self.at += 1;
                    break;
                }
                None => {
                    let is_known = self.form.diagnostics.last();
                    let end = self.start + self.text.len();
                    let reported = is_known.is_some_and(|found| {
                        found.code == "U0888" && (self.start..=end).contains(&found.span.start)
                    });
                    if !reported {
                        self.at = opened;
                        self.wrong("this bracket is not closed", 1);
                    }
                    break;
                }
            }
        }
        self.depth -= 1;
        match branches.len() {
            1 => branches.swap_remove(0),
            _ => Condition::Any(branches),
        }
    }

    /// [ "/" | "+" | "-" ], name
    fn contact(&mut self) -> Option<Condition> {
        let begin = self.at;
        let sign = self.peek();
        let sign = SIGNS.iter().find(|(letter, _)| Some(*letter) == sign);
        if sign.is_some() {
            self.at += 1;
            self.peek();
        }
        let rest = &self.text[self.at..];
        let length = rest.find(|letter: char| letter.is_whitespace() || "[]|/+-".contains(letter));
        let name = &rest[..length.unwrap_or(rest.len())];
        if name.is_empty() {
            self.at = begin;
            self.wrong("a sign stands before a signal", 1);
            return None;
        }
        let place = self.start + self.at..self.start + self.at + name.len();
        self.at += name.len();
        if !is_legal(name) {
            let message = format!("{name:?} cannot be a name in a ladder");
            self.form
                .diagnostics
                .push(Diagnostic::error("U0855", message, place.clone()).with_help(ILLEGAL_NAME));
        }
        let when = sign.map_or(When::High, |(_, when)| *when);
        Some(Condition::Signal(Name::at(name, place), when))
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let texts =
            |parts: &[Self]| -> Vec<String> { parts.iter().map(ToString::to_string).collect() };
        match self {
            Self::Always => Ok(()),
            Self::Signal(name, when) => {
                let sign = SIGNS.iter().find(|(_, known)| known == when);
                let sign = sign.map_or(String::new(), |(letter, _)| letter.to_string());
                write!(formatter, "{sign}{name}")
            }
            Self::All(parts) => {
                let mut texts = texts(parts);
                texts.retain(|text| !text.is_empty());
                formatter.write_str(&texts.join(" "))
            }
            Self::Any(parts) => {
                let texts = texts(parts);
                // One that always holds makes all of them hold.
                if texts.iter().any(String::is_empty) {
                    return Ok(());
                }
                write!(formatter, "[ {} ]", texts.join(" | "))
            }
        }
    }
}
