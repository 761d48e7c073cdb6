//! Formulas in the few operators that are computed: each speaks of some way on, the others are their negations.

use super::{Resolved, Signal};
use crate::property::{Formula, Path};

/// A formula of CTL in existential form.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Core {
    Constant(bool),
    Signal(Signal),
    Not(Box<Core>),
    And(Box<Core>, Box<Core>),
    /// EX
    Next(Box<Core>),
    /// E[p U q]
    Until(Box<Core>, Box<Core>),
    /// EG
    Always(Box<Core>),
    /// On some way on, in one of this and the next n scans.
    Reaches(u32, Box<Core>),
    /// On some way on, in all of this and the next n scans.
    Stays(u32, Box<Core>),
}

impl Core {
    pub(super) fn not(self) -> Self {
        match self {
            Self::Not(inner) => *inner,
            Self::Constant(value) => Self::Constant(!value),
            other => Self::Not(Box::new(other)),
        }
    }

    fn and(self, other: Self) -> Self {
        Self::And(Box::new(self), Box::new(other))
    }

    fn or(self, other: Self) -> Self {
        self.not().and(other.not()).not()
    }

    fn until(self, end: Self) -> Self {
        Self::Until(Box::new(self), Box::new(end))
    }

    fn reachable(self) -> Self {
        Self::Constant(true).until(self)
    }

    fn globally(self) -> Self {
        Self::Always(Box::new(self))
    }

    pub(crate) fn of(formula: &Resolved) -> Self {
        let of = |formula: &Resolved| Self::of(formula);
        match formula {
            Formula::Constant(value) => Self::Constant(*value),
            Formula::Signal(signal) => Self::Signal(*signal),
            Formula::Not(inner) => of(inner).not(),
            Formula::And(left, right) => of(left).and(of(right)),
            Formula::Or(left, right) => of(left).or(of(right)),
            Formula::Implies(left, right) => of(left).and(of(right).not()).not(),
            Formula::Same(left, right) => {
                let (left, right) = (of(left), of(right));
                let both = left.clone().and(right.clone());
                both.or(left.not().and(right.not()))
            }
            Formula::Next(Path::Some, inner) => Self::Next(Box::new(of(inner))),
            Formula::Next(Path::All, inner) => Self::Next(Box::new(of(inner).not())).not(),
            Formula::Eventually(Path::Some, inner) => of(inner).reachable(),
            Formula::Eventually(Path::All, inner) => of(inner).not().globally().not(),
            Formula::Always(Path::Some, inner) => of(inner).globally(),
            Formula::Always(Path::All, inner) => of(inner).not().reachable().not(),
            Formula::Until(Path::Some, left, right) => of(left).until(of(right)),
            Formula::Until(Path::All, left, right) => {
                let (not_left, not_right) = (of(left).not(), of(right).not());
                let lost = not_right.clone().until(not_left.and(not_right.clone()));
                lost.or(not_right.globally()).not()
            }
            Formula::Within(Path::Some, scans, inner) => Self::Reaches(*scans, Box::new(of(inner))),
            Formula::Within(Path::All, scans, inner) => {
                Self::Stays(*scans, Box::new(of(inner).not())).not()
            }
        }
    }

    /// Whether it says something of later scans.
    pub(super) fn is_temporal(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Signal(_) => false,
            Self::Not(inner) => inner.is_temporal(),
            Self::And(left, right) => left.is_temporal() || right.is_temporal(),
            _ => true,
        }
    }
}
