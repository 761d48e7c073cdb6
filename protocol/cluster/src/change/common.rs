//! The points that two versions of a program have in common: those whose values mean the same in both.
//!
//! ```text
//!   same name, or one that the cluster files pair with it, and same type    one point: its value goes on
//!   same name, or a paired one, and another type                            two points: what the bits of the one would mean in the other is not known
//! ```
//!
//! Names are found as those of variables are ([`understudy_typed::Program::carried`]): exactly, or in another case of letters, or by a pair.

use understudy_bits::SameNames;
use understudy_typed::{Declared, Point, Points, Renamed};

use crate::cluster::Controller;
use crate::code::{Code, Way};

/// The points that two versions of a program have in common.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CommonPoints {
    /// Inputs, as the version before and the one after declare them.
    pub inputs: Vec<[Point; 2]>,
    /// Outputs, likewise.
    pub outputs: Vec<[Point; 2]>,
}

impl CommonPoints {
    /// Those of a program and the one that takes its place.
    pub fn of(before: &Controller, after: &Controller, way: Way) -> Self {
        let pairs = after.code.renamed(&before.code, way);
        let [old, new] = [&before.interface, &after.interface];
        Self {
            inputs: common(&old.inputs, &new.inputs, &pairs),
            outputs: common(&old.outputs, &new.outputs, &pairs),
        }
    }

    /// Their names, for proofs.
    pub fn names(&self) -> SameNames {
        let names = |points: &[[Point; 2]]| {
            points.iter().map(|both| both.each_ref().map(|point| point.name.clone())).collect()
        };
        SameNames { inputs: names(&self.inputs), outputs: names(&self.outputs) }
    }
}

fn common(old: &Points, new: &Points, pairs: &[Renamed]) -> Vec<[Point; 2]> {
    let both = old.iter().filter_map(|was| {
        let is = named_after(was, (old, new), pairs).filter(|is| stays(was, is))?;
        Some([was.clone(), is.clone()])
    });
    both.collect()
}

/// The point after with the name of a point before, or with one that is paired with it.
pub(super) fn named_after<'a>(
    was: &Point,
    (old, new): (&Points, &'a Points),
    pairs: &[Renamed],
) -> Option<&'a Point> {
    let only_new = |name: &str| {
        let found = new.iter().find(|is| is.name.eq_ignore_ascii_case(name));
        found.filter(|is| old.find(&is.name).is_none())
    };
    let paired = || {
        pairs.iter().find_map(|(before, now)| {
            let (whole, rest) = was.name.split_at_checked(before.len())?;
            let is_part = rest.is_empty() || rest.starts_with(['.', '[']);
            (is_part && whole.eq_ignore_ascii_case(before))
                .then(|| only_new(&format!("{now}{rest}")))?
        })
    };
    new.find(&was.name).or_else(|| only_new(&was.name)).or_else(paired)
}

/// The name in a program of an input of the program before it; the same one where it has none of it.
pub fn input_name_after(before: &Code, after: &Code, name: &str) -> String {
    let (old, new) = (before.interface().inputs, after.interface().inputs);
    let is = |was| {
        named_after(was, (&old, &new), &after.renamed(before, Way::There)).map(|is| is.name.clone())
    };
    old.find(name).and_then(is).unwrap_or_else(|| name.to_owned())
}

/// The point of these that a point of another version of the program is, of those that keep their names: that of its name and type.
pub fn same_point<'a>(point: &Point, others: &'a Points) -> Option<&'a Point> {
    others.find(&point.name).filter(|other| stays(point, other))
}

/// Whether a point of another version is of the same type; an enumeration is where its names have the same numbers.
pub(super) fn stays(before: &Point, after: &Point) -> bool {
    let [before, after] = [before, after].map(|it| Declared { range: None, ..it.declared() });
    before.takes(&after) && after.takes(&before)
}
