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
pub fn read_chain(name: &str, text: &str) -> ReadChain {
    let mut reader = Reader::default();
    let chain = reader.read(text);
    reader.findings.sort_by_key(|finding| finding.span.start);
    let report = Report {
        name: name.into(),
        text: text.into(),
        diagnostics: reader.findings,
    };
    ReadChain {
        chain: chain.filter(|_| !report.has_errors()),
        report,
    }
}

#[derive(Default)]
struct Reader {
    findings: Vec<Diagnostic>,
    constants: BTreeMap<String, Constant>,
    states: Vec<(String, Range<usize>)>,
    places: HashMap<String, usize>,
    failures: Vec<bool>,
    start: Option<(usize, Range<usize>)>,
}

struct Constant {
    value: Option<Value>,
    span: Range<usize>,
    used: bool,
}

/// A transition that waits until all states are known.
struct Line<'a> {
    from: &'a str,
    from_span: Range<usize>,
    to: &'a str,
    to_span: Range<usize>,
    per_hour: f64,
    rate_span: Range<usize>,
}

impl Reader {
    fn read(&mut self, text: &str) -> Option<Chain> {
        if text.len() > MAXIMUM_TEXT_BYTES {
            let message = format!(
                "the text has {} bytes, more than {MAXIMUM_TEXT_BYTES}",
                text.len()
            );
            self.findings
                .push(Diagnostic::error("U0730", message, 0..0));
            return None;
        }
        let mut lines = Vec::new();
        let mut offset = 0;
        for line in text.split_inclusive('\n') {
            if self.findings.len() >= MAXIMUM_FINDINGS {
                break;
            }
            let content = line.split('#').next().unwrap_or_default();
            self.line(content, offset, &mut lines);
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
        self.build(&lines, text.len())
    }

    fn line<'a>(&mut self, line: &'a str, offset: usize, lines: &mut Vec<Line<'a>>) {
        let trimmed = line.trim();
        if trimmed.is_empty() {
            return;
        }
        let whole = span_of(line, trimmed, offset);
        let first_word = trimmed.split_whitespace().next().unwrap_or_default();
        if let Some((from, rest)) = line.split_once("->") {
            self.transition(line, from, rest, offset, lines);
        } else if first_word == "state" {
            self.state(line, trimmed, offset);
        } else if let Some((name, value)) = line.split_once('=') {
            self.constant(line, name, value, offset);
        } else {
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
        let constant = Constant {
            value,
            span: span.clone(),
            used: false,
        };
        if let Some(before) = self.constants.get(name) {
            self.findings.push(
                Diagnostic::error(
                    "U0722",
                    format!("the constant {name} is declared twice"),
                    span,
                )
                .with_related(before.span.clone(), "first occurrence"),
            );
        } else {
            self.constants.insert(name.into(), constant);
        }
    }

    fn state(&mut self, line: &str, trimmed: &str, offset: usize) {
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
        if let Some(&place) = self.places.get(name) {
            self.findings.push(
                Diagnostic::error("U0722", format!("the state {name} is declared twice"), span)
                    .with_related(self.states[place].1.clone(), "first occurrence"),
            );
            return;
        }
        let place = self.states.len();
        self.places.insert(name.into(), place);
        self.states.push((name.into(), span.clone()));
        self.failures.push(false);
        for word in words {
            let span = span_of(line, word, offset);
            match (word, &self.start) {
                ("failure", _) => self.failures[place] = true,
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
                    self.findings
                        .push(finding.with_help(suggestion(word, ["start", "failure"])));
                }
            }
        }
    }

    fn transition<'a>(
        &mut self,
        line: &'a str,
        from: &'a str,
        rest: &'a str,
        offset: usize,
        lines: &mut Vec<Line<'a>>,
    ) {
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
            let message = format!(
                "{said} is {}, and a rate is a number over a time",
                value.said()
            );
            self.findings.push(
                Diagnostic::error("U0725", message, rate_span.clone())
                    .with_label("expected a rate")
                    .with_help("write a number over a time, such as `3 / 10000h`"),
            );
        } else if !(value.number > 0.0 && value.number.is_finite()) {
            let message = format!(
                "the rate is {} per hour; it must be positive and finite",
                value.number
            );
            self.findings
                .push(Diagnostic::error("U0724", message, rate_span.clone()));
        } else if named {
            lines.push(Line {
                from,
                from_span,
                to,
                to_span,
                per_hour: value.number,
                rate_span,
            });
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

    fn build(&mut self, lines: &[Line<'_>], end: usize) -> Option<Chain> {
        if self.states.is_empty() {
            self.findings.push(
                Diagnostic::error("U0726", "the chain has no state", end..end)
                    .with_help("write `state name` for each, and `state name failure` where the system has failed"),
            );
            return None;
        }
        let mut builder = ChainBuilder::new();
        for ((name, _), failure) in self.states.iter().zip(&self.failures) {
            if *failure {
                builder.failure(name)
            } else {
                builder.state(name)
            };
        }
        builder.start(self.start.as_ref().map_or(0, |(place, _)| *place));
        for line in lines {
            let (from, to) = (
                self.place(line.from, &line.from_span),
                self.place(line.to, &line.to_span),
            );
            let (Some(from), Some(to)) = (from, to) else {
                continue;
            };
            if from == to {
                let span = line.from_span.start..line.rate_span.end;
                let message = format!("the transition from {} leads to itself", line.from);
                self.findings
                    .push(Diagnostic::error("U0729", message, span));
            } else {
                builder.transition(from, to, line.per_hour);
            }
        }
        if understudy_text::has_errors(&self.findings) {
            return None;
        }
        match builder.build() {
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
        }
    }

    fn place(&mut self, name: &str, span: &Range<usize>) -> Option<usize> {
        let place = self.places.get(name).copied();
        if place.is_none() && self.findings.len() < MAXIMUM_FINDINGS {
            let known = self.states.iter().map(|(name, _)| name.as_str());
            self.findings.push(
                Diagnostic::error("U0723", format!("there is no state {name}"), span.clone())
                    .with_help(suggestion(name, known)),
            );
        }
        place
    }

    fn refuse(&mut self, error: &ReliabilityError, end: usize) {
        let finding = match error {
            ReliabilityError::Unreachable { state } => {
                let span = self
                    .places
                    .get(state)
                    .map_or(end..end, |place| self.states[*place].1.clone());
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
                let span = self
                    .places
                    .get(&state)
                    .map_or(0..0, |place| self.states[*place].1.clone());
                let message = format!(
                    "no failure can be reached from the state {state}: the mean time to failure is infinite"
                );
                self.findings
                    .push(Diagnostic::warning("U0732", message, span));
            }
            Err(_) => self.findings.push(
                Diagnostic::warning(
                    "U0728",
                    "no state is a failure: there is no mean time to failure",
                    self.states[0].1.clone(),
                )
                .with_help(
                    "write `state name failure` for the states in which the system has failed",
                ),
            ),
            Ok(()) => {}
        }
    }
}

/// Position of a part of a line in the text.
fn span_of(line: &str, part: &str, offset: usize) -> Range<usize> {
    let start = offset
        + (part.as_ptr() as usize)
            .saturating_sub(line.as_ptr() as usize)
            .min(line.len());
    start..start + part.len()
}
