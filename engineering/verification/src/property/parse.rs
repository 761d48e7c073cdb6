//! Reading properties: a line each, a formula of CTL or a sentence.
//!
//! ```text
//! formula     = sum { ( "->" | "<->" ) sum }            "->" binds to the right
//! sum         = product { "|" product }
//! product     = unary { "&" unary }
//! unary       = "!" unary | "AX" unary | .. | "EG" unary | ( "ABF" | "EBF" ) "0" ".." number unary
//!             | ( "A" | "E" ) "[" formula "U" formula "]" | "(" formula ")" | "TRUE" | "FALSE" | name | comparison
//! comparison  = ( name | value ) ( "=" | "<>" | "<" | "<=" | ">" | ">=" ) ( name | value )      one of them is a name
//! value       = [ "-" ] ( "12" | "12.5" | "16#FF" | "1m30s" | "T#2s" | .. )
//! ```
//!
//! A line that cannot be read is reported and left out; the lines behind it are read all the same.

use std::ops::Range;
use std::time::Duration;

use understudy_text::{Diagnostic, duration};
use understudy_typed::Comparison;

use super::lexer::{Sign, Token, tokens};
use super::{
    Compared, Formula, MAXIMUM_NESTING, MAXIMUM_SCANS, MAXIMUM_WORDS, Named, Path, Property,
};

/// What was read from a file of properties.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Properties {
    /// In the order of the file.
    pub properties: Vec<Property>,
    /// Fairness conditions, true infinitely often in every run considered; each refers to one scan.
    pub fair: Vec<Property>,
    /// What is assumed of the inputs in every scan of every run considered; each refers to one scan.
    pub assumed: Vec<Property>,
    /// What is wrong, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a property file: one property per line, `#` begins a comment where it does not stand in a value, `name:` names a property, `fair:` marks a fairness condition, `assume:` an
/// assumption about inputs. A duration is as many scans of `period` as are whole in it.
pub fn read(text: &str, period: Duration) -> Properties {
    let mut found = Properties::default();
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let written = &line[..comment(line)];
        let (name, body) = match written.split_once(':') {
            // `within 2s of p: q` has the sign in the middle.
            Some((name, body)) if !name.trim_start().starts_with("within ") => {
                (Some(name.trim()), body)
            }
            _ => (None, written),
        };
        let start = offset + written.len() - body.len();
        offset += line.len();
        if name.is_none() && body.trim().is_empty() {
            continue;
        }
        let Some(mut property) = read_at(body, start, period, &mut found.diagnostics) else {
            continue;
        };
        let place = start + body.len() - body.trim_start().len();
        let place = place..start + body.trim_end().len();
        let is_of_one_scan = property.formula.is_of_one_scan();
        match name {
            Some("fair") if is_of_one_scan => found.fair.push(property),
            Some("assume") if is_of_one_scan => found.assumed.push(property),
            Some("fair") => found.diagnostics.push(not_of_one_scan("a fairness condition", place)),
            Some("assume") => found.diagnostics.push(not_of_one_scan("an assumption", place)),
            _ => {
                property.name = name.map(str::to_owned);
                found.properties.push(property);
            }
        }
    }
    found
}

/// Where the comment of a line begins: at a `#` that does not stand in a value such as `T#2s`.
fn comment(line: &str) -> usize {
    let mut signs = line.match_indices('#').map(|(at, _)| at);
    let begins = |at: &usize| !line[..*at].ends_with(|last: char| last.is_alphanumeric());
    signs.find(begins).unwrap_or(line.len())
}

/// A condition of fairness or an assumption that looks at other scans.
pub fn not_of_one_scan(what: &str, span: Range<usize>) -> Diagnostic {
    let message = format!("{what} refers to one scan only");
    Diagnostic::error("U0434", message, span).with_help(
        "leave out AG, EF and the like: a condition p comes again and again, an assumption p holds in every scan",
    )
}

/// Reads one property as [`read`] does; what is wrong comes with places in `text`.
///
/// # Errors
/// Everything that is wrong with it (U0430 to U0433).
pub fn read_one(text: &str, period: Duration) -> Result<Property, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    match read_at(text, 0, period, &mut diagnostics) {
        Some(property) if diagnostics.is_empty() => Ok(property),
        _ => Err(diagnostics),
    }
}

fn read_at(
    text: &str,
    offset: usize,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Property> {
    let before = diagnostics.len();
    let tokens = tokens(text, offset, diagnostics);
    if let Some(beyond) = tokens.get(MAXIMUM_WORDS) {
        let message = format!("more than {MAXIMUM_WORDS} words and signs in a property");
        let error = Diagnostic::error("U0432", message, beyond.span.clone());
        diagnostics.push(error.with_help("divide it: `never a & b` and `never a & c` are two"));
        return None;
    }
    let mut parser = Parser {
        tokens: &tokens,
        at: 0,
        depth: 0,
        end: offset + text.trim_end().len(),
        period,
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
    period: Duration,
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
            let is_value =
                self.peek().is_some_and(|it| matches!(it.sign, Sign::Number | Sign::Minus));
            return if is_value { self.value_first() } else { self.wrong("a signal, `!` or `(`") };
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
            name => self.signal(name, token.span),
        }
    }

    /// A BOOL, or the number at the left of a comparison.
    fn signal(&mut self, name: &str, mut span: Range<usize>) -> Option<Read> {
        let mut compared = None;
        if let Some(comparison) = self.takes_comparison() {
            let (with, end) = self.compared_with()?;
            span.end = end;
            compared = Some(Compared { comparison, with });
        }
        Some(Formula::Signal(Named { name: name.to_owned(), compared, span }))
    }

    /// A comparison whose value stands at the left.
    fn value_first(&mut self) -> Option<Read> {
        let start = self.span().start;
        let (with, _) = self.compared_with()?;
        let Some(comparison) = self.takes_comparison() else {
            return self.wrong("a comparison, such as `<=`");
        };
        let word = self.peek().filter(|token| token.sign == Sign::Word).cloned();
        let Some(Token { text, span, .. }) = word else {
            return self.wrong("the name of a number");
        };
        self.at += 1;
        let compared = Some(Compared { comparison: comparison.mirrored(), with });
        Some(Formula::Signal(Named { name: text.to_owned(), compared, span: start..span.end }))
    }

    fn takes_comparison(&mut self) -> Option<Comparison> {
        let Sign::Compared(comparison) = self.peek()?.sign else {
            return None;
        };
        self.at += 1;
        Some(comparison)
    }

    /// A value or a name, and where it ends.
    fn compared_with(&mut self) -> Option<(String, usize)> {
        let sign = if self.takes(Sign::Minus) { "-" } else { "" };
        let is_value = |token: &&Token<'_>| {
            token.sign == Sign::Number || (sign.is_empty() && token.sign == Sign::Word)
        };
        let Some(token) = self.peek().filter(is_value).cloned() else {
            return self.wrong("a value or the name of a number");
        };
        self.at += 1;
        Some((format!("{sign}{}", token.text), token.span.end))
    }

    fn range(&mut self) -> Option<u32> {
        if self.number()? != 0 || !self.takes(Sign::Range) {
            self.at = self.at.saturating_sub(1);
            return self.wrong("`0..` and a number of scans");
        }
        self.number()
    }

    /// `5 scans`, or a duration: the whole scans in it.
    pub(super) fn scans(&mut self) -> Option<u32> {
        let is_number = |token: &&Token<'_>| token.sign == Sign::Number;
        let token = self.peek().filter(is_number).cloned();
        let time = token.as_ref().and_then(|token| duration::parse(token.text).ok());
        if let (Some(Token { text, span, .. }), Some(time)) = (token, time) {
            self.at += 1;
            let scans = time.as_nanos() / self.period.as_nanos().max(1);
            let few = u32::try_from(scans).ok().filter(|&scans| scans <= MAXIMUM_SCANS);
            return few.or_else(|| {
                let each = duration::text(self.period);
                self.too_many(&format!("{text}, {scans} scans of {each},"), span)
            });
        }
        let scans = self.number()?;
        match self.takes_word("scans") || self.takes_word("scan") {
            true => Some(scans),
            false => self.wrong("`scans`, or a duration such as 2s in place of the number"),
        }
    }

    /// A number of scans.
    fn number(&mut self) -> Option<u32> {
        let is_whole = |token: &&Token<'_>| {
            token.sign == Sign::Number && token.text.bytes().all(|digit| digit.is_ascii_digit())
        };
        let Some(Token { text, span, .. }) = self.peek().filter(is_whole).cloned() else {
            return self.wrong("a number of scans");
        };
        self.at += 1;
        let number = text.parse().ok().filter(|&scans| scans <= MAXIMUM_SCANS);
        number.or_else(|| self.too_many(&format!("{text} scans"), span))
    }

    fn too_many<T>(&mut self, what: &str, span: Range<usize>) -> Option<T> {
        let message = format!("{what} are more than {MAXIMUM_SCANS}");
        self.diagnostics.push(Diagnostic::error("U0433", message, span));
        None
    }

    fn peek(&self) -> Option<&Token<'t>> {
        self.tokens.get(self.at)
    }

    pub(super) fn takes(&mut self, sign: Sign) -> bool {
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

    fn span(&self) -> Range<usize> {
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
