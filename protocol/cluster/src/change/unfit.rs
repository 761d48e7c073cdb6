//! Why a program cannot take the place of another one while it runs.

use std::fmt;

use understudy_typed::{Fate, WrongPair};

use super::point_fates::ChangedPoint;
use super::points::FixedPoints;
use crate::code::{Code, Unnamed, Way};

/// Why a program cannot be replaced by another one while it runs.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// The points of a program differ.
    #[error("the inputs or outputs of `{program}` differ: {point}")]
    Points {
        /// Name of the controller.
        program: String,
        /// The first point that differs.
        point: String,
    },
    /// The points of a program differ, and cannot while it runs.
    #[error("the inputs or outputs of `{program}` cannot change while it runs: {why}")]
    Fixed {
        /// Name of the controller.
        program: String,
        /// Why.
        why: FixedPoints,
    },
    /// The points of a program differ, and the program does not: without a change mark nothing tells from which cycle on they count.
    #[error(
        "inputs or outputs of `{program}` change, and its program does not: only a changed program brings others while it runs ({points})"
    )]
    Unmarked {
        /// Name of the controller.
        program: String,
        /// What becomes of them.
        points: PointList,
    },
    /// States of the program before or after cannot be converted.
    #[error("`{program}` cannot change while it runs: one of the two programs {why}")]
    Memory {
        /// Name of the controller.
        program: String,
        /// Why.
        why: Unnamed,
    },
    /// A pair of `renamed` names what it cannot.
    #[error("`{program}`: the old variable `{old}` is not renamed to the new one `{new}`: {why}")]
    Pair {
        /// Name of the controller.
        program: String,
        /// Path in the program before.
        old: String,
        /// Path in the program after.
        new: String,
        /// Why.
        why: PairReason,
    },
}

/// Points that change, as a message lists them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointList(Vec<ChangedPoint>);

/// Points that a message lists, at most.
const MOST_POINTS: usize = 8;

impl From<Vec<ChangedPoint>> for PointList {
    fn from(points: Vec<ChangedPoint>) -> Self {
        Self(points)
    }
}

impl fmt::Display for PointList {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(points) = self;
        if points.is_empty() {
            return formatter.write_str("the order of `inputs`");
        }
        let told = points.iter().take(MOST_POINTS);
        let told: Vec<String> = told.map(|it| format!("{} {it}", it.fate.word())).collect();
        formatter.write_str(&told.join("; "))?;
        match points.len().saturating_sub(MOST_POINTS) {
            0 => Ok(()),
            more => write!(formatter, "; and {more} more"),
        }
    }
}

/// Why a pair of `renamed` does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PairReason {
    /// Its names.
    #[error(transparent)]
    Names(#[from] WrongPair),
    /// A value of one type is none of the other one.
    #[error("its type changes from {before} to {now}, which does not have its values")]
    Types {
        /// Type in the program before.
        before: String,
        /// Type in the program after.
        now: String,
    },
}

impl Unfit {
    /// The code of its page.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Points { .. }
            | Self::Fixed { .. }
            | Self::Unmarked { .. }
            | Self::Memory { .. } => "U0630",
            Self::Pair { .. } => "U0637",
        }
    }

    pub(super) fn points(name: &str, before: &Code, after: &Code) -> Option<Self> {
        let point = different_point(before, after)?;
        Some(Self::Points { program: name.to_owned(), point })
    }

    pub(super) fn memory(name: &str, before: &Code, after: &Code) -> Option<Self> {
        let why = before.why_not_changed().or_else(|| after.why_not_changed())?;
        Some(Self::Memory { program: name.to_owned(), why })
    }

    /// All pairs of the program after that do not fit.
    pub(super) fn pairs(name: &str, before: &Code, after: &Code) -> Vec<Self> {
        let pairs = &after.source().renamed;
        if pairs.is_empty() {
            return Vec::new();
        }
        let paths = after.fates(before, Way::There);
        let types = |(old, new): &(String, String)| {
            let path = paths.iter().find(|path| {
                let is_old = path.renamed_from.as_ref().is_some_and(|from| from == old);
                path.path.eq_ignore_ascii_case(new) && is_old && path.fate == Fate::Dropped
            })?;
            let (before, now) = (path.before.clone()?, path.now.clone()?);
            Some(PairReason::Types { before, now })
        };
        let wrong = pairs.iter().filter_map(|pair| {
            let names = after.typed().judge_pair(before.typed(), pair);
            let why = names.err().map(PairReason::from).or_else(|| types(pair))?;
            let (old, new) = pair.clone();
            Some(Self::Pair { program: name.to_owned(), old, new, why })
        });
        wrong.collect()
    }
}

/// The first point that is not equal in both, in words.
pub(super) fn different_point(before: &Code, after: &Code) -> Option<String> {
    let (old, new) = (before.interface(), after.interface());
    let sides = [("input", &old.inputs, &new.inputs), ("output", &old.outputs, &new.outputs)];
    for (side, old, new) in sides {
        let (old, new): (Vec<_>, Vec<_>) = (old.iter().collect(), new.iter().collect());
        for place in 0..old.len().max(new.len()) {
            let both = old.get(place).zip(new.get(place));
            let is_equal = both.is_some_and(|(one, other)| {
                (&one.name, one.of, one.bit, one.range)
                    == (&other.name, other.of, other.bit, other.range)
            });
            // What an operator, a signal or a device has in the image keeps its number.
            if let Some((one, other)) = both.filter(|_| is_equal)
                && !other.declared().takes(&one.declared())
            {
                let name = &other.name;
                return Some(format!("values of {side} `{name}` have other names or numbers"));
            }
            if !is_equal {
                let point = new.get(place).or(old.get(place))?;
                return Some(format!("{side} `{}` of type {}", point.name, point.declared()));
            }
        }
    }
    None
}
