//! Chains as text.
//!
//! ```text
//! # Three controllers and an understudy; each failure is masked with probability c.
//! mtbf = 10000h
//! mttr = 24h
//! c = 0.999
//!
//! state whole start
//! state degraded
//! state failed failure
//!
//! whole -> degraded : 4 * c / mtbf
//! whole -> failed : 4 * (1 - c) / mtbf
//! degraded -> whole : 1 / mttr
//! degraded -> failed : 3 / mtbf
//! ```
//!
//! A line is a constant, a state or a transition; `#` starts a comment. A constant is named before it is used, a state may be named
//! anywhere. The first state is the start unless another one says so. Numbers, times with their unit, names, `+ - * /` and
//! parentheses make a value. A rate is a number over a time: dimensions are checked, so that a rate without a unit is found.
//!
//! Reading gives all errors at once: U0721 a line or value that cannot be read, U0722 a name twice, U0723 an unknown name, U0724 a rate
//! that is not positive and finite, U0725 a wrong dimension, U0726 two starts or no state, U0727 a state that cannot be reached, U0728
//! no failure state (a warning), U0729 a transition from a state to itself, U0730 too large, U0731 a constant that is not used
//! (a warning), U0732 a state that never fails (a warning).

mod value;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use understudy_text::spelling::suggestion;

use understudy_text::{Diagnostic, Report};

use crate::chain::{Chain, ChainBuilder};
use crate::error::ReliabilityError;
use value::{Value, evaluate};

/// Bytes of one text, at most.
pub const MAXIMUM_TEXT_BYTES: usize = 64 << 20;

/// Findings of one text, at most; the rest is not looked for.
const MAXIMUM_FINDINGS: usize = 200;

/// The result of reading a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadChain {
    /// The chain, if it is valid.
    pub chain: Option<Chain>,
    /// The text with all that was found.
    pub report: Report,
}

/// Reads the chain in `text`; `name` is for the report.
pub fn read_chain(name: &str, text: impl Into<String>) -> ReadChain {
    let text = text.into();
    let (chain, mut diagnostics) = Reader::new(&text).read();
    diagnostics.sort_by_key(|finding| finding.span.start);
    let report = Report { name: name.into(), text, diagnostics };
    ReadChain { chain: chain.filter(|_| !report.has_errors()), report }
}

/// A chain of millions of states is read too: what there is of each state or transition is small, and names are parts of the text.
#[derive(Default)]
struct Reader<'a> {
    text: &'a str,
    findings: Vec<Diagnostic>,
    constants: BTreeMap<String, Constant>,
    /// The place of each name among the states.
    places: HashMap<&'a str, u32>,
    /// Where each state is declared in the text.
    declared: Vec<Span>,
    builder: ChainBuilder,
    /// The state that the last transition leaves.
    last: u32,
    /// Transitions of states that are declared later, or not at all.
    open: Vec<Line<'a>>,
    start: Option<(usize, Range<usize>)>,
}

/// A part of a text of at most [`MAXIMUM_TEXT_BYTES`].
#[derive(Debug, Clone, Copy)]
struct Span {
    start: u32,
    end: u32,
}

impl From<&Range<usize>> for Span {
    fn from(range: &Range<usize>) -> Self {
        Self { start: range.start as u32, end: range.end as u32 }
    }
}

impl From<Span> for Range<usize> {
    fn from(span: Span) -> Self {
        span.start as usize..span.end as usize
    }
}

struct Constant {
    value: Option<Value>,
    span: Range<usize>,
    used: bool,
}

/// A transition.
struct Line<'a> {
    from: &'a str,
    from_span: Range<usize>,
    to: &'a str,
    to_span: Range<usize>,
    per_hour: f64,
    rate_span: Range<usize>,
}

impl<'a> Reader<'a> {
    fn new(text: &'a str) -> Self {
        Self { text, ..Self::default() }
    }

    /// The chain of the text, and what was found in it.
    fn read(mut self) -> (Option<Chain>, Vec<Diagnostic>) {
        let text = self.text;
        if text.len() > MAXIMUM_TEXT_BYTES {
            let message =
                format!("the text has {} bytes, more than {MAXIMUM_TEXT_BYTES}", text.len());
            self.findings.push(Diagnostic::error("U0730", message, 0..0));
            return (None, self.findings);
        }
        self.builder.reserve(text.matches("->").count());
        let mut offset = 0;
        for line in text.split_inclusive('\n') {
            if self.findings.len() >= MAXIMUM_FINDINGS {
                break;
            }
            let content = line.split('#').next().unwrap_or_default();
            self.line(content, offset);
            offset += line.len();
        }
        let constants = self.constants.iter();
        let unused = constants.filter(|(_, constant)| !constant.used && constant.value.is_some());
        let unused: Vec<_> = unused
            .map(|(name, constant)| {
                Diagnostic::warning(
                    "U0731",
                    format!("the constant {name} is not used"),
                    constant.span.clone(),
                )
            })
            .collect();
        self.findings.extend(unused);
        self.build(text.len())
    }

    fn line(&mut self, line: &'a str, offset: usize) {
        let trimmed = line.trim();
        if trimmed.is_empty() {
            return;
        }
        if let Some((from, rest)) = split_at_arrow(line) {
            self.transition(line, from, rest, offset);
        } else if trimmed.split_whitespace().next() == Some("state") {
            self.state(line, trimmed, offset);
        } else if let Some((name, value)) = line.split_once('=') {
            self.constant(line, name, value, offset);
        } else {
            let whole = span_of(line, trimmed, offset);
            self.findings.push(
                Diagnostic::error("U0721", "this is not a line of a chain", whole).with_help(
                    "write `name = 10000h`, `state name`, `state name start`, `state name failure` or `from -> to : 1 / 24h`",
                ),
            );
        }
    }

    fn constant(&mut self, line: &str, name: &str, text: &str, offset: usize) {
        let name = name.trim();
        let span = span_of(line, name, offset);
        if !self.check_name(name, &span) {
            return;
        }
        let at = offset + line.len() - text.len();
        let value = self.value(text, at);
        let constant = Constant { value, span: span.clone(), used: false };
        if let Some(before) = self.constants.get(name) {
            self.findings.push(
                Diagnostic::error("U0722", format!("the constant {name} is declared twice"), span)
                    .with_related(before.span.clone(), "first occurrence"),
            );
        } else {
            self.constants.insert(name.into(), constant);
        }
    }

    fn state(&mut self, line: &'a str, trimmed: &'a str, offset: usize) {
        let mut words = trimmed.split_whitespace().skip(1);
        let Some(name) = words.next() else {
            let span = span_of(line, trimmed, offset);
            let finding = Diagnostic::error("U0721", "the state has no name", span);
            self.findings.push(finding.with_help("write `state name`"));
            return;
        };
        let span = span_of(line, name, offset);
        if !self.check_name(name, &span) {
            return;
        }
        let place = self.declared.len();
        let known = *self.places.entry(name).or_insert(place as u32) as usize;
        if known != place {
            self.findings.push(
                Diagnostic::error("U0722", format!("the state {name} is declared twice"), span)
                    .with_related(self.declared[known].into(), "first occurrence"),
            );
            return;
        }
        self.builder.state(name);
        self.declared.push(Span::from(&span));
        for word in words {
            let span = span_of(line, word, offset);
            match (word, &self.start) {
                ("failure", _) => self.builder.fails(place),
                ("start", None) => self.start = Some((place, span)),
                ("start", Some((_, before))) => self.findings.push(
                    Diagnostic::error("U0726", "a chain has one start", span)
                        .with_related(before.clone(), "first start"),
                ),
                _ => {
                    let finding = Diagnostic::error(
                        "U0721",
                        format!("{word} is not a property of a state"),
                        span,
                    );
                    self.findings.push(finding.with_help(suggestion(word, ["start", "failure"])));
                }
            }
        }
    }

    fn transition(&mut self, line: &'a str, from: &'a str, rest: &'a str, offset: usize) {
        let Some((to, rate)) = rest.split_once(':') else {
            let end = offset + line.trim_end().len();
            self.findings.push(
                Diagnostic::error("U0721", "the transition has no rate", end..end)
                    .with_help("write `from -> to : 1 / 24h`"),
            );
            return;
        };
        let (from, to) = (from.trim(), to.trim());
        let (from_span, to_span) = (span_of(line, from, offset), span_of(line, to, offset));
        let rate_span = span_of(line, rate.trim(), offset);
        let value = self.value(rate, offset + line.len() - rate.len());
        let named = self.check_name(from, &from_span) & self.check_name(to, &to_span);
        let Some(value) = value else { return };
        let said = rate.trim();
        if value.dimension != -1 {
            let message = format!("{said} is {}, and a rate is a number over a time", value.said());
            self.findings.push(
                Diagnostic::error("U0725", message, rate_span.clone())
                    .with_label("expected a rate")
                    .with_help("write a number over a time, such as `3 / 10000h`"),
            );
        } else if !(value.number > 0.0 && value.number.is_finite()) {
            let message =
                format!("the rate is {} per hour; it must be positive and finite", value.number);
            self.findings.push(Diagnostic::error("U0724", message, rate_span.clone()));
        } else if named {
            let line = Line { from, from_span, to, to_span, per_hour: value.number, rate_span };
            let from = self.place(from);
            self.last = from.unwrap_or(self.last);
            match (from, self.place(to)) {
                (Some(from), Some(to)) => self.add(&line, from, to),
                _ => self.open.push(line),
            }
        }
    }

    fn value(&mut self, text: &str, offset: usize) -> Option<Value> {
        let constants = &mut self.constants;
        let found = evaluate(text, offset, |name| {
            let constant = constants.get_mut(name)?;
            constant.used = true;
            Some(constant.value)
        });
        match found {
            Ok(value) => value,
            Err(finding) => {
                let known = self.constants.keys().map(String::as_str);
                let finding = match finding.unknown {
                    Some(name) => finding.diagnostic.with_help(suggestion(&name, known)),
                    None => finding.diagnostic,
                };
                self.findings.push(finding);
                None
            }
        }
    }

    fn check_name(&mut self, name: &str, span: &Range<usize>) -> bool {
        let mut characters = name.chars();
        let first = characters.next();
        let good = first.is_some_and(|first| first.is_alphabetic() || first == '_')
            && characters.all(|character| character.is_alphanumeric() || character == '_');
        if !good {
            self.findings.push(
                Diagnostic::error("U0721", format!("{name:?} is no name"), span.clone())
                    .with_help("a name has letters, digits and _, and does not start with a digit"),
            );
        }
        good
    }

    /// Adds a transition between two known states.
    fn add(&mut self, line: &Line<'_>, from: u32, to: u32) {
        if from == to {
            let span = line.from_span.start..line.rate_span.end;
            let message = format!("the transition from {} leads to itself", line.from);
            self.findings.push(Diagnostic::error("U0729", message, span));
        } else {
            let (from, to) = (from as usize, to as usize);
            self.builder.transition(from, to, line.per_hour);
        }
    }

    fn build(mut self, end: usize) -> (Option<Chain>, Vec<Diagnostic>) {
        if self.declared.is_empty() {
            self.findings
                .push(Diagnostic::error("U0726", "the chain has no state", end..end).with_help(
                "write `state name` for each, and `state name failure` where the system has failed",
            ));
            return (None, self.findings);
        }
        for line in std::mem::take(&mut self.open) {
            let (from, to) = (
                self.declared_place(line.from, &line.from_span),
                self.declared_place(line.to, &line.to_span),
            );
            if let (Some(from), Some(to)) = (from, to) {
                self.add(&line, from, to);
            }
        }
        if understudy_text::has_errors(&self.findings) {
            return (None, self.findings);
        }
        let start = self.start.as_ref().map_or(0, |(place, _)| *place);
        self.builder.start(start);
        let chain = match std::mem::take(&mut self.builder).build() {
            Ok(chain) => {
                self.warn(&chain);
                Some(chain)
            }
            Err(errors) => {
                for error in errors {
                    self.refuse(&error, end);
                }
                None
            }
        };
        (chain, self.findings)
    }

    /// The place of a state that is declared before. Most lines name the state of the line before or a neighbour of it, so these are
    /// compared first: a look into the table of a million names is slow.
    fn place(&self, name: &str) -> Option<u32> {
        let last = self.last;
        let near = [last, last.wrapping_add(1), last.wrapping_sub(1)];
        let is_meant = |place: &u32| self.name(*place) == Some(name);
        let near = near.into_iter().find(is_meant);
        near.or_else(|| self.places.get(name).copied())
    }

    fn name(&self, place: u32) -> Option<&'a str> {
        let span = self.declared.get(place as usize)?;
        Some(&self.text[Range::<usize>::from(*span)])
    }

    /// As [`Self::place`] when all states are declared.
    fn declared_place(&mut self, name: &str, span: &Range<usize>) -> Option<u32> {
        let place = self.place(name);
        if place.is_none() && self.findings.len() < MAXIMUM_FINDINGS {
            let known = (0..self.declared.len()).filter_map(|place| self.name(place as u32));
            self.findings.push(
                Diagnostic::error("U0723", format!("there is no state {name}"), span.clone())
                    .with_help(suggestion(name, known)),
            );
        }
        place
    }

    /// Where a state is declared.
    fn declaration(&self, name: &str) -> Option<Range<usize>> {
        let place = self.places.get(name)?;
        Some(self.declared[*place as usize].into())
    }

    fn refuse(&mut self, error: &ReliabilityError, end: usize) {
        let finding = match error {
            ReliabilityError::Unreachable { state } => {
                let span = self.declaration(state).unwrap_or(end..end);
                Diagnostic::error(
                    "U0727",
                    format!("the state {state} cannot be reached from the start"),
                    span,
                )
                .with_help("add a transition that leads there, or remove the state")
            }
            error => Diagnostic::error("U0730", error.to_string(), end..end),
        };
        self.findings.push(finding);
    }

    /// What allows a steady state and no mean time to failure.
    fn warn(&mut self, chain: &Chain) {
        match chain.check_fails() {
            Err(ReliabilityError::NeverFails { state }) => {
                let span = self.declaration(&state).unwrap_or(0..0);
                let message = format!(
                    "no failure can be reached from the state {state}: the mean time to failure is infinite"
                );
                self.findings.push(Diagnostic::warning("U0732", message, span));
            }
            Err(_) => self.findings.push(
                Diagnostic::warning(
                    "U0728",
                    "no state is a failure: there is no mean time to failure",
                    self.declared[0].into(),
                )
                .with_help(
                    "write `state name failure` for the states in which the system has failed",
                ),
            ),
            Ok(()) => {}
        }
    }
}

/// What is before and behind the first `->`.
fn split_at_arrow(line: &str) -> Option<(&str, &str)> {
    let mut heads = line.match_indices('>').map(|(place, _)| place);
    let head = heads.find(|head| line[..*head].ends_with('-'))?;
    Some((&line[..head - 1], &line[head + 1..]))
}

/// Position of a part of a line in the text.
fn span_of(line: &str, part: &str, offset: usize) -> Range<usize> {
    let start =
        offset + (part.as_ptr() as usize).saturating_sub(line.as_ptr() as usize).min(line.len());
    start..start + part.len()
}
