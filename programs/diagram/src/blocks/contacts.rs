//! Contacts in series and in parallel, as a ladder has them.

use crate::{CHARACTER, width};

/// Height of a row of contacts.
pub const CONTACT_ROW: i64 = 44;
/// From the upper edge of a row to its wire; the names are between them.
pub const CONTACT_HEAD: i64 = 28;
/// Width of the two bars of a contact, with what is between them.
pub(crate) const BARS: i64 = 12;
/// From a wire to the branches that it leads to.
pub const BRANCH: i64 = 12;
/// Width of a wire without contacts.
const BARE: i64 = 48;

/// A Boolean value as contacts: it is TRUE where the power passes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Contacts {
    /// The power passes while a variable is TRUE, or while it is FALSE.
    Contact {
        /// The variable.
        name: String,
        /// Whether the power passes while it is FALSE.
        negated: bool,
        /// The variable in the scan.
        value: Option<bool>,
    },
    /// One behind the other; without any, a wire.
    Series(Vec<Contacts>),
    /// Side by side.
    Parallel(Vec<Contacts>),
    /// The power of an input of the object, by its number. It is the first of its branch, and the inputs are in the order of their branches.
    /// Where one branch begins so, all do; else the object begins at the rail.
    Power(usize),
}

impl Contacts {
    /// Whether the power passes, with that of the inputs in a scan; nothing where a value is not known.
    pub fn passes(&self, inputs: &[Option<bool>]) -> Option<bool> {
        self.behind(Some(true), inputs)
    }

    /// The power behind these contacts.
    pub(crate) fn behind(&self, before: Option<bool>, inputs: &[Option<bool>]) -> Option<bool> {
        match self {
            Self::Contact { negated, value, .. } => and(before, value.map(|it| it != *negated)),
            Self::Series(all) => all.iter().fold(before, |at, it| it.behind(at, inputs)),
            Self::Parallel(all) => {
                let mut branches = all.iter().map(|it| it.behind(before, inputs));
                let mut unknown = false;
                let passes = branches.any(|it| {
                    unknown |= it.is_none();
                    it == Some(true)
                });
                match passes {
                    true => Some(true),
                    false if unknown => None,
                    false => Some(false),
                }
            }
            Self::Power(input) => inputs.get(*input).copied().flatten(),
        }
    }

    /// Calls `of` with each variable and the place of its value.
    pub fn each(&mut self, of: &mut dyn FnMut(&str, &mut Option<bool>)) {
        match self {
            Self::Contact { name, value, .. } => of(name, value),
            Self::Series(all) | Self::Parallel(all) => all.iter_mut().for_each(|it| it.each(of)),
            Self::Power(_) => {}
        }
    }

    /// How wide it is drawn.
    pub fn width(&self) -> i64 {
        match self {
            Self::Contact { name, .. } => width(name).max(BARS + 2 * BRANCH) + 2 * CHARACTER,
            Self::Series(all) if all.is_empty() => BARE,
            Self::Series(all) => all.iter().map(Self::width).sum(),
            Self::Parallel(all) => all.iter().map(Self::width).max().unwrap_or(0) + 2 * BRANCH,
            Self::Power(_) => 0,
        }
    }

    /// How many rows it has.
    pub fn rows(&self) -> i64 {
        match self {
            Self::Contact { .. } | Self::Power(_) => 1,
            Self::Series(all) => all.iter().map(Self::rows).max().unwrap_or(1),
            Self::Parallel(all) => all.iter().map(Self::rows).sum::<i64>().max(1),
        }
    }

    /// The rows of the inputs, counted from `first`.
    pub(crate) fn inputs(&self, first: i64) -> Vec<i64> {
        match self {
            Self::Contact { .. } => Vec::new(),
            Self::Power(_) => vec![first],
            Self::Series(all) => all.iter().flat_map(|it| it.inputs(first)).collect(),
            Self::Parallel(all) => {
                let branches = all.iter().scan(first, |row, branch| {
                    let own = *row;
                    *row += branch.rows();
                    Some(branch.inputs(own))
                });
                branches.flatten().collect()
            }
        }
    }
}

fn and(one: Option<bool>, other: Option<bool>) -> Option<bool> {
    match (one, other) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}
