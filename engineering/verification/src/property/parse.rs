//! Reading properties: a line each, a formula of CTL or a sentence.
//!
//! ```text
//! formula     = sum { ( "->" | "<->" ) sum }            "->" binds to the right
//! sum         = product { "|" product }
//! product     = unary { "&" unary }
//! unary       = "!" unary | "AX" unary | .. | "EG" unary | ( "ABF" | "EBF" ) "0" ".." number unary
//!             | ( "A" | "E" ) "[" formula "U" formula "]" | "(" formula ")" | "TRUE" | "FALSE" | name
//! ```
//!
//! A line that cannot be read is reported and left out; the lines behind it are read all the same.

use understudy_text::Diagnostic;

use super::lexer::{Sign, Token, tokens};
use super::{Formula, MAXIMUM_NESTING, MAXIMUM_SCANS, Named, Path, Property};

/// What was read from a file of properties.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Properties {
    /// In the order of the file.
    pub properties: Vec<Property>,
    /// Fairness conditions, true infinitely often in every run considered; each refers to one scan.
    pub fair: Vec<Property>,
    /// What is wrong, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a property file: one property per line, `#` begins a comment, `name:` names a property, `fair:` marks a fairness condition.
pub fn read(text: &str) -> Properties {
    let mut found = Properties::default();
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let written = line.split('#').next().unwrap_or_default();
        let (name, body) = match written.split_once(':') {
            Some((name, body)) => (Some(name.trim()), body),
            None => (None, written),
        };
        let start = offset + written.len() - body.len();
        offset += line.len();
        if name.is_none() && body.trim().is_empty() {
            continue;
        }
        let Some(mut property) = read_at(body, start, &mut found.diagnostics) else {
            continue;
        };
        if name != Some("fair") {
            property.name = name.map(str::to_owned);
            found.properties.push(property);
        } else if property.formula.is_of_one_scan() {
            found.fair.push(property);
        } else {
            let place = start + body.len() - body.trim_start().len();
            found.diagnostics.push(not_of_one_scan(place..start + body.trim_end().len()));
        }
    }
    found
}

/// A condition of fairness that looks at other scans.
pub fn not_of_one_scan(span: std::ops::Range<usize>) -> Diagnostic {
    let message = "a fairness condition refers to one scan only";
    Diagnostic::error("U0434", message, span).with_help(
        "leave out AG, EF and the like: a condition p means that p comes again and again",
    )
}

/// Reads one property; what is wrong comes with places in `text`.
///
/// # Errors
/// Everything that is wrong with it (U0430 to U0433).
pub fn read_one(text: &str) -> Result<Property, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    match read_at(text, 0, &mut diagnostics) {
        Some(property) if diagnostics.is_empty() => Ok(property),
        _ => Err(diagnostics),
    }
}

fn read_at(text: &str, offset: usize, diagnostics: &mut Vec<Diagnostic>) -> Option<Property> {
    let before = diagnostics.len();
    let tokens = tokens(text, offset, diagnostics);
    let mut parser = Parser {
        tokens: &tokens,
        at: 0,
        depth: 0,
        end: offset + text.trim_end().len(),
        diagnostics,
    };
    let formula = parser.property()?;
    (diagnostics.len() == before).then(|| Property {
        name: None,
        text: text.trim().to_owned(),
        formula,
    })
}

pub(super) type Read = Formula<Named>;

/// Reads tokens from left to right; the first thing that is wrong ends it.
pub(super) struct Parser<'p, 't> {
    tokens: &'p [Token<'t>],
    at: usize,
    depth: usize,
    end: usize,
    diagnostics: &'p mut Vec<Diagnostic>,
}

impl<'t> Parser<'_, 't> {
    fn property(&mut self) -> Option<Read> {
        let formula = match self.sentence() {
            Some(read) => read?,
            None => self.formula()?,
        };
        if self.at < self.tokens.len() {
            return self.wrong("an end, or one of & | -> <->");
        }
        Some(formula)
    }

    /// A Boolean or temporal formula.
    pub(super) fn formula(&mut self) -> Option<Read> {
        if self.depth == MAXIMUM_NESTING {
            let message = format!("more than {MAXIMUM_NESTING} signs and brackets in each other");
            let span = self.span();
            self.diagnostics.push(Diagnostic::error("U0432", message, span));
            return None;
        }
        self.depth += 1;
        let left = self.sum()?;
        let formula = if self.takes(Sign::Implies) {
            left.implies(self.formula()?)
        } else if self.takes(Sign::Same) {
            Formula::Same(Box::new(left), Box::new(self.formula()?))
        } else {
            left
        };
        self.depth -= 1;
        Some(formula)
    }

    fn sum(&mut self) -> Option<Read> {
        let mut left = self.product()?;
        while self.takes(Sign::Or) {
            left = Formula::Or(Box::new(left), Box::new(self.product()?));
        }
        Some(left)
    }

    fn product(&mut self) -> Option<Read> {
        let mut left = self.unary()?;
        while self.takes(Sign::And) {
            left = left.and(self.unary()?);
        }
        Some(left)
    }

    fn unary(&mut self) -> Option<Read> {
        if self.depth == MAXIMUM_NESTING {
            return self.formula();
        }
        self.depth += 1;
        let formula = self.operand()?;
        self.depth -= 1;
        Some(formula)
    }

    fn operand(&mut self) -> Option<Read> {
        if self.takes(Sign::Not) || self.takes_word("not") {
            return Some(self.unary()?.negated());
        }
        if self.takes(Sign::Open) {
            let inner = self.formula()?;
            return self.takes(Sign::Close).then_some(inner).or_else(|| self.wrong("`)`"));
        }
        let word = self.peek().filter(|token| token.sign == Sign::Word);
        let Some(token) = word.cloned() else {
            return self.wrong("a signal, `!` or `(`");
        };
        self.at += 1;
        let path = match token.text.as_bytes()[0] {
            b'A' => Path::All,
            _ => Path::Some,
        };
        match token.text {
            "TRUE" | "true" => Some(Formula::Constant(true)),
            "FALSE" | "false" => Some(Formula::Constant(false)),
            "AX" | "EX" => Some(Formula::Next(path, Box::new(self.unary()?))),
            "AF" | "EF" => Some(Formula::Eventually(path, Box::new(self.unary()?))),
            "AG" | "EG" => Some(Formula::Always(path, Box::new(self.unary()?))),
            "ABF" | "EBF" => {
                let scans = self.range()?;
                Some(Formula::Within(path, scans, Box::new(self.unary()?)))
            }
            "A" | "E" if self.takes(Sign::OpenSquare) => {
                let left = Box::new(self.formula()?);
                if !self.takes_word("U") {
                    return self.wrong("`U`");
                }
                let right = Box::new(self.formula()?);
                let until = Formula::Until(path, left, right);
                self.takes(Sign::CloseSquare).then_some(until).or_else(|| self.wrong("`]`"))
            }
            name => Some(Formula::Signal(Named { name: name.to_owned(), span: token.span })),
        }
    }

    fn range(&mut self) -> Option<u32> {
        if self.number()? != 0 || !self.takes(Sign::Range) {
            self.at = self.at.saturating_sub(1);
            return self.wrong("`0..` and a number of scans");
        }
        self.number()
    }

    /// A number of scans.
    pub(super) fn number(&mut self) -> Option<u32> {
        let Some(token) = self.peek().filter(|token| token.sign == Sign::Number) else {
            return self.wrong("a number of scans");
        };
        let number = token.text.parse().ok().filter(|&scans| scans <= MAXIMUM_SCANS);
        if number.is_none() {
            let message = format!("{} scans are more than {MAXIMUM_SCANS}", token.text);
            let span = token.span.clone();
            self.diagnostics.push(Diagnostic::error("U0433", message, span));
        }
        self.at += 1;
        number
    }

    fn peek(&self) -> Option<&Token<'t>> {
        self.tokens.get(self.at)
    }

    fn takes(&mut self, sign: Sign) -> bool {
        let taken = self.peek().is_some_and(|token| token.sign == sign);
        self.at += usize::from(taken);
        taken
    }

    /// Takes these words of a sentence, or none of them.
    pub(super) fn takes_words(&mut self, words: &str) -> bool {
        let start = self.at;
        let all = words.split(' ').all(|word| self.takes_word(word));
        if !all {
            self.at = start;
        }
        all
    }

    pub(super) fn takes_word(&mut self, word: &str) -> bool {
        let taken = self.peek().is_some_and(|token| token.sign == Sign::Word && token.text == word);
        self.at += usize::from(taken);
        taken
    }

    /// Whether these words follow somewhere.
    pub(super) fn has_words(&self, words: &str) -> bool {
        let words: Vec<&str> = words.split(' ').collect();
        let rest = &self.tokens[self.at..];
        rest.windows(words.len()).any(|window| {
            let pairs = window.iter().zip(&words);
            pairs.into_iter().all(|(token, word)| token.sign == Sign::Word && token.text == *word)
        })
    }

    fn span(&self) -> std::ops::Range<usize> {
        self.peek().map_or(self.end..self.end, |token| token.span.clone())
    }

    /// Reports what was expected here.
    pub(super) fn wrong<T>(&mut self, expected: &str) -> Option<T> {
        let message = match self.peek() {
            Some(token) => format!("`{}` cannot stand here", token.text),
            None => "the property ends here".to_owned(),
        };
        let span = self.span();
        self.diagnostics.push(
            Diagnostic::error("U0431", message, span).with_label(format!("expected {expected}")),
        );
        None
    }
}
