//! What a program is to keep: formulas of CTL over its signals, and sentences that mean such formulas.
//!
//! A signal is meant as it is after the scan, inputs as they were in it. A step of time is a scan. [`read`] takes a file of properties:
//!
//! ```text
//! # the press
//! fair: part_on_press                       in every run this comes again and again
//! assume: level <= 4095                     in every scan this holds of the inputs
//! exclusion: never ram_down and ram_up
//! AG (start -> AF done)
//! start is followed by done within 5 scans
//! ```

mod lexer;
mod parse;
mod sentence;

use std::fmt;
use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_typed::Comparison;

pub use parse::{Properties, not_of_one_scan, read, read_one};

/// Scans that a bounded property may look ahead.
pub const MAXIMUM_SCANS: u32 = 10_000;

/// Signs and brackets inside each other in one formula.
pub const MAXIMUM_NESTING: usize = 200;

/// Words and signs of one formula: one after the other they nest as deeply as brackets do.
pub const MAXIMUM_WORDS: usize = 2_000;

/// Over which ways on from a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Path {
    /// All of them.
    All,
    /// One at least.
    Some,
}

impl Path {
    fn letter(self) -> char {
        match self {
            Self::All => 'A',
            Self::Some => 'E',
        }
    }
}

/// A formula of computation tree logic (CTL); `S` is a signal, a name while it is read and its number once it is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Formula<S> {
    /// 0 or 1.
    Constant(bool),
    /// The signal is 1.
    Signal(S),
    /// Negation.
    Not(Box<Self>),
    /// Logical product.
    And(Box<Self>, Box<Self>),
    /// Logical sum.
    Or(Box<Self>, Box<Self>),
    /// The second wherever the first.
    Implies(Box<Self>, Box<Self>),
    /// Both or neither.
    Same(Box<Self>, Box<Self>),
    /// `AX`, `EX`: in the next scan.
    Next(Path, Box<Self>),
    /// `AF`, `EF`: now or in some later scan.
    Eventually(Path, Box<Self>),
    /// `AG`, `EG`: now and in every later scan.
    Always(Path, Box<Self>),
    /// `A[p U q]`, `E[p U q]`: q at last, and p until then.
    Until(Path, Box<Self>, Box<Self>),
    /// `ABF 0..n`, `EBF 0..n`: now or in one of the next n scans.
    Within(Path, u32, Box<Self>),
}

impl<S> Formula<S> {
    /// Negation.
    pub fn negated(self) -> Self {
        Self::Not(Box::new(self))
    }

    /// Logical product.
    pub fn and(self, other: Self) -> Self {
        Self::And(Box::new(self), Box::new(other))
    }

    /// `other` wherever this.
    pub fn implies(self, other: Self) -> Self {
        Self::Implies(Box::new(self), Box::new(other))
    }

    /// `AG`: in every scan that can be reached.
    pub fn always(self) -> Self {
        Self::Always(Path::All, Box::new(self))
    }

    /// `EF`: some way on leads there.
    pub fn reachable(self) -> Self {
        Self::Eventually(Path::Some, Box::new(self))
    }

    /// The same with another signal for each, if there is one for each.
    pub fn map<T>(&self, signal: &impl Fn(&S) -> Option<T>) -> Option<Formula<T>> {
        let of = |formula: &Self| formula.map(signal).map(Box::new);
        Some(match self {
            Self::Constant(value) => Formula::Constant(*value),
            Self::Not(inner) => Formula::Not(of(inner)?),
            Self::And(left, right) => Formula::And(of(left)?, of(right)?),
            Self::Or(left, right) => Formula::Or(of(left)?, of(right)?),
            Self::Implies(left, right) => Formula::Implies(of(left)?, of(right)?),
            Self::Same(left, right) => Formula::Same(of(left)?, of(right)?),
            Self::Next(path, inner) => Formula::Next(*path, of(inner)?),
            Self::Eventually(path, inner) => Formula::Eventually(*path, of(inner)?),
            Self::Always(path, inner) => Formula::Always(*path, of(inner)?),
            Self::Until(path, left, right) => Formula::Until(*path, of(left)?, of(right)?),
            Self::Within(path, scans, inner) => Formula::Within(*path, *scans, of(inner)?),
            Self::Signal(name) => Formula::Signal(signal(name)?),
        })
    }

    /// All signals from left to right, with repetitions.
    pub fn signals(&self) -> Vec<&S> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Signal(signal) => vec![signal],
            Self::Not(inner)
            | Self::Next(_, inner)
            | Self::Eventually(_, inner)
            | Self::Always(_, inner)
            | Self::Within(_, _, inner) => inner.signals(),
            Self::And(left, right)
            | Self::Or(left, right)
            | Self::Implies(left, right)
            | Self::Same(left, right)
            | Self::Until(_, left, right) => {
                let mut signals = left.signals();
                signals.extend(right.signals());
                signals
            }
        }
    }

    /// Its value in one scan where these signals are known and all others are not.
    fn value_where(&self, known: &dyn Fn(&S) -> Option<bool>) -> Option<bool> {
        match self {
            Self::Constant(value) => Some(*value),
            Self::Signal(signal) => known(signal),
            Self::Not(inner) => inner.value_where(known).map(|value| !value),
            Self::And(left, right) => match (left.value_where(known), right.value_where(known)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (left, right) => Some(left? && right?),
            },
            Self::Or(left, right) => match (left.value_where(known), right.value_where(known)) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (left, right) => Some(left? || right?),
            },
            Self::Implies(left, right) => {
                match (left.value_where(known), right.value_where(known)) {
                    (Some(false), _) | (_, Some(true)) => Some(true),
                    (left, right) => Some(!left? || right?),
                }
            }
            Self::Same(left, right) => Some(left.value_where(known)? == right.value_where(known)?),
            _ => None,
        }
    }

    /// Whether it speaks of one scan only.
    pub fn is_of_one_scan(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Signal(_) => true,
            Self::Not(inner) => inner.is_of_one_scan(),
            Self::And(left, right)
            | Self::Or(left, right)
            | Self::Implies(left, right)
            | Self::Same(left, right) => left.is_of_one_scan() && right.is_of_one_scan(),
            _ => false,
        }
    }
}

/// As NuSMV reads it, each operand in brackets where it is no single sign.
impl<S: fmt::Display> fmt::Display for Formula<S> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant(value) => formatter.write_str(if *value { "TRUE" } else { "FALSE" }),
            Self::Signal(name) => write!(formatter, "{name}"),
            Self::Not(inner) => write!(formatter, "!{}", Operand(inner)),
            Self::And(left, right) => write!(formatter, "{} & {}", Operand(left), Operand(right)),
            Self::Or(left, right) => write!(formatter, "{} | {}", Operand(left), Operand(right)),
            Self::Implies(left, right) => {
                write!(formatter, "{} -> {}", Operand(left), Operand(right))
            }
            Self::Same(left, right) => {
                write!(formatter, "{} <-> {}", Operand(left), Operand(right))
            }
            Self::Next(path, inner) => write!(formatter, "{}X {}", path.letter(), Operand(inner)),
            Self::Eventually(path, inner) => {
                write!(formatter, "{}F {}", path.letter(), Operand(inner))
            }
            Self::Always(path, inner) => {
                write!(formatter, "{}G {}", path.letter(), Operand(inner))
            }
            Self::Until(path, left, right) => {
                write!(formatter, "{}[{} U {}]", path.letter(), Operand(left), Operand(right))
            }
            Self::Within(path, scans, inner) => {
                write!(formatter, "{}BF 0..{scans} {}", path.letter(), Operand(inner))
            }
        }
    }
}

struct Operand<'a, S>(&'a Formula<S>);

impl<S: fmt::Display> fmt::Display for Operand<'_, S> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Formula::Constant(_) | Formula::Not(_) => write!(formatter, "{}", self.0),
            // A comparison has signs in it.
            Formula::Signal(signal) => match signal.to_string() {
                compared if compared.contains(' ') => write!(formatter, "({compared})"),
                name => formatter.write_str(&name),
            },
            _ => write!(formatter, "({})", self.0),
        }
    }
}

/// What a formula asks of one scan: the value of a BOOL, or the comparison of a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// The name of the signal.
    pub name: String,
    /// With what it is compared, where it is a number.
    pub compared: Option<Compared>,
    /// Position in the text.
    pub span: Range<usize>,
}

/// With what a number is compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Compared {
    /// How.
    pub comparison: Comparison,
    /// A value as a person writes it, or the name of another number.
    pub with: String,
}

impl fmt::Display for Named {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.name)?;
        match &self.compared {
            Some(Compared { comparison, with }) => {
                write!(formatter, " {} {with}", comparison.sign())
            }
            None => Ok(()),
        }
    }
}

/// What properties and assumptions ask of a program, besides the signals that it has: known before it is made ready for questions.
#[derive(Debug, Clone, Default)]
pub struct Asked<'a> {
    /// Comparisons of numbers.
    pub(crate) compared: Vec<&'a Named>,
    /// What is assumed of the inputs in every scan.
    pub(crate) assumed: Vec<&'a Property>,
}

impl<'a> Asked<'a> {
    /// What is asked by what was read.
    pub fn of(read: impl IntoIterator<Item = &'a Properties>) -> Self {
        let mut asked = Self::default();
        for found in read {
            let all = found.properties.iter().chain(&found.fair).chain(&found.assumed);
            let named = all.flat_map(|property| property.formula.signals());
            asked.compared.extend(named.filter(|named| named.compared.is_some()));
            asked.assumed.extend(&found.assumed);
        }
        asked
    }
}

impl Property {
    /// What keeps it from being an assumption about inputs, in one scan.
    pub(crate) fn wrong_assumption(&self, is_input: &dyn Fn(&Named) -> bool) -> Vec<Diagnostic> {
        let names = self.formula.signals().into_iter().filter(|named| !is_input(named));
        let mut wrong: Vec<Diagnostic> = names
            .map(|named| {
                let message = format!("`{named}` is not about inputs alone, and is assumed");
                Diagnostic::error("U0435", message, named.span.clone()).with_help(
                    "an assumption is about what the field does; what a program does is proved",
                )
            })
            .collect();
        let names = self.formula.signals().into_iter();
        let place = names.map(|named| named.span.clone()).reduce(|all, next| all.start..next.end);
        if !self.formula.is_of_one_scan() {
            wrong.push(not_of_one_scan("an assumption", place.unwrap_or_default()));
        }
        wrong
    }
}

impl Property {
    /// Whether a BOOL is FALSE in each scan in which this holds, whatever the others are.
    pub(crate) fn forbids(&self, name: &str) -> bool {
        let is_it = |named: &Named| named.compared.is_none() && named.name == name;
        self.formula.value_where(&|named| is_it(named).then_some(true)) == Some(false)
    }
}

/// One property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name, where it was given one.
    pub name: Option<String>,
    /// As it was written.
    pub text: String,
    /// What it means.
    pub formula: Formula<Named>,
}
