//! What a changed program takes over: the retentive values of the program before it, by full path and type.
//!
//! ```text
//!   retentive in both, of one type                         kept
//!   the same, and the type has become wider                converted: INT to DINT or REAL, WORD to DWORD, the values of an enumeration by their names
//!   the same, and the type has become narrower, or an
//!   enumeration lacks names of before                      narrowed: converted, where the new type has the value
//!   retentive in the new program only                      new: it has its initial value
//!   retentive in the old program only, or of a value that
//!   the new type does not have                             dropped
//! ```
//!
//! A path is that of a variable, of a member of a structure or of a function block, or of elements of an array. What has become of a path depends
//! on the declarations, except where a value has no name in its enumeration, is none of a narrower type or is outside of a declared subrange: that one
//! is dropped. References
//! are bound anew by the calls. The scans since the cold start become those of the same time, rounded up, so that no moment that a retentive variable
//! holds is one of the future.
//!
//! All stations compute the same state, since it is a function of the two programs and of the old state.

mod arrays;
mod types;

use std::collections::HashMap;

use self::types::{Conversion, conversion};
use crate::form::Program;
use crate::image::{Declared, Points};
use crate::scan::SCANS;
use crate::types::Type;

/// A state of the new program, and what has become of each retentive path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CarriedState {
    /// The initial state with the values that are taken over.
    pub state: Vec<u64>,
    /// The retentive paths of both programs, each once; a path stands for all its parts.
    pub paths: Vec<CarriedPath>,
}

/// What a state of the old program tells, and what of it the new program can read: addresses of the two states.
#[derive(Clone, Copy)]
pub struct Told<'a> {
    /// Whether the old state has the value at an address.
    pub is_known: &'a dyn Fn(u64) -> bool,
    /// Whether a scan of the new program may read the value at an address before it writes it.
    pub is_read: &'a dyn Fn(u64) -> bool,
}

impl Told<'_> {
    /// Everything.
    pub const ALL: Self = Self { is_known: &|_| true, is_read: &|_| true };
}

/// What has become of a retentive path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CarriedPath {
    /// The path, such as `pump.hours` or `table[0..4]`.
    pub path: String,
    /// What has become of it.
    pub fate: Fate,
    /// Its type in the old program, where it is retentive there.
    pub before: Option<String>,
    /// Its type in the new program, where it is retentive there.
    pub now: Option<String>,
}

/// What becomes of a retentive value where the program changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Fate {
    /// The new program has the value.
    Kept,
    /// The new program has the value, in another type.
    Converted,
    /// The new program has the value, in a type that does not have all values: another one is dropped.
    Narrowed,
    /// The new program has its initial value.
    New,
    /// The new program does not have the value.
    Dropped,
}

impl Fate {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Converted => "converted",
            Self::Narrowed => "narrowed",
            Self::New => "new",
            Self::Dropped => "dropped",
        }
    }
}

impl CarriedState {
    /// The paths whose values the new program does not have.
    pub fn dropped(&self) -> impl Iterator<Item = &CarriedPath> {
        self.paths.iter().filter(|path| path.fate == Fate::Dropped)
    }
}

impl Program {
    /// The state with which this program starts warm from a state of the program before it. What that state does not
    /// tell is dropped, where the new program reads it.
    ///
    /// # Panics
    /// If `state` is shorter than a state of `before`.
    pub fn carried(&self, before: &Self, state: &[u64], told: Told<'_>) -> CarriedState {
        let partners = partners(before, self, &HashMap::new());
        self.carried_from(before, state, told, (&partners, true))
    }

    /// As [`Self::carried`], with the variables that [`partners`] finds; the paths have names only where they are listed.
    fn carried_from(
        &self,
        before: &Self,
        state: &[u64],
        told: Told<'_>,
        (partners, is_listed): (&[Option<usize>], bool),
    ) -> CarriedState {
        let mut walk = Walk::new(before, self, state, told);
        walk.is_listed = is_listed;
        let paths = walk.variables(partners);
        if self.is_retentive() && before.is_retentive() {
            let time = i128::from(before.period.max(1)) * i128::from(state[SCANS]);
            let period = i128::from(self.period.max(1));
            let scans = (time + period - 1) / period;
            walk.state[SCANS] = u64::try_from(scans).unwrap_or(u64::MAX);
        }
        CarriedState { state: walk.state, paths }
    }
}

/// A value of a new program that is one of the old program, by the addresses of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Address in the state of the old program.
    pub before: u64,
    /// Address in the state of the new program.
    pub now: u64,
    /// Whether it is stored alike in both.
    pub is_same: bool,
}

/// A program in the place of another one, in an online change: it takes over the values of all variables, and not of the retentive ones alone. A program
/// that a fault has stopped stays stopped.
#[derive(Debug, Clone)]
pub struct Successor {
    old: Program,
    new: Program,
    partners: Vec<Option<usize>>,
}

impl Successor {
    /// `new` in the place of `old`. Variables of `new` that `old` does not have take over those of other names in `old`, by their own.
    pub fn new(old: &Program, new: &Program, others: &HashMap<String, String>) -> Self {
        let partners = partners(old, new, others);
        Self { old: old.all_retentive(), new: new.all_retentive(), partners }
    }

    /// The new program, all of whose variables are retentive.
    pub fn program(&self) -> &Program {
        &self.new
    }

    /// The state with which the new program goes on from a state of the old one.
    ///
    /// # Panics
    /// If `state` is shorter than a state of the old program.
    pub fn state(&self, state: &[u64], told: Told<'_>) -> Vec<u64> {
        self.take(state, told, false).state
    }

    /// The same, with what has become of each path.
    ///
    /// # Panics
    /// As [`Self::state`].
    pub fn carried(&self, state: &[u64], told: Told<'_>) -> CarriedState {
        self.take(state, told, true)
    }

    /// Where the values of the new program come from; those of all others are the initial ones, but for the slots of the header, which are kept.
    pub fn origins(&self) -> Vec<Origin> {
        let state = self.old.initial_state();
        let mut walk = Walk::new(&self.old, &self.new, &state, Told::ALL);
        walk.origins = Some(Vec::new());
        walk.variables(&self.partners);
        walk.origins.unwrap_or_default()
    }

    fn take(&self, state: &[u64], told: Told<'_>, is_listed: bool) -> CarriedState {
        let mut changed =
            self.new.carried_from(&self.old, state, told, (&self.partners, is_listed));
        changed.state[..SCANS].copy_from_slice(&state[..SCANS]);
        changed
    }
}

impl Points {
    /// Puts the values of points before into an image of these, by name and type: of those in `names`, and not where the type or the subrange of the
    /// point does not have the value. Answers with those of `names` whose values are in no point.
    ///
    /// # Panics
    /// If an image is narrower than its points.
    pub fn carry<'n>(
        &self,
        image: &mut [u64],
        before: (&Self, &[u64]),
        names: &'n [String],
    ) -> Vec<&'n str> {
        let (points, values) = before;
        let mut carry = |name: &str| {
            let (point, old) = (self.find(name)?, points.find(name)?);
            let value = types::converted(old.of, point.of, old.get(values))?;
            let value = Some(value).filter(|value| point.declared().contains(*value))?;
            point.set(image, value);
            Some(())
        };
        names.iter().map(String::as_str).filter(|name| carry(name).is_none()).collect()
    }
}

/// A variable, or a part of one, in the state of its program.
#[derive(Debug, Clone, Copy)]
struct Spot<'p> {
    of: &'p Type,
    slot: u32,
}

/// What has become of a value that is taken over by a conversion.
fn taken(conversion: &Conversion) -> Fate {
    match conversion {
        Conversion::Same => Fate::Kept,
        Conversion::Narrower(..) | Conversion::ByName(_, false) => Fate::Narrowed,
        Conversion::Wider(..) | Conversion::ByName(_, true) => Fate::Converted,
    }
}

/// For each variable of the new program the one of the old program that it takes over: of its name, or else of the same name in another case, or else
/// that of `others`.
fn partners(old: &Program, new: &Program, others: &HashMap<String, String>) -> Vec<Option<usize>> {
    let all: HashMap<&str, usize> = if others.is_empty() {
        HashMap::new()
    } else {
        let names = old.named().map(|variable| variable.name.as_str());
        names.zip(0..).collect()
    };
    let mut known: HashMap<&str, usize> = HashMap::new();
    // The names of a ladder may differ in their case alone, those of all other languages do not.
    let mut folded: HashMap<String, &str> = HashMap::new();
    for (place, variable) in old.named().enumerate() {
        known.insert(&variable.name, place);
        folded.insert(variable.name.to_ascii_lowercase(), &variable.name);
    }
    let names: Vec<&str> = new.named().map(|variable| variable.name.as_str()).collect();
    let names = names.into_iter();
    let exact: Vec<Option<usize>> = names.clone().map(|name| known.remove(name)).collect();
    let in_other_case = |(name, exact): (&str, Option<usize>)| {
        exact
            .or_else(|| {
                let name = folded.get(&name.to_ascii_lowercase())?;
                known.remove(name)
            })
            .or_else(|| all.get(others.get(name)?.as_str()).copied())
    };
    names.zip(exact).map(in_other_case).collect()
}

struct Walk<'p> {
    old: &'p Program,
    new: &'p Program,
    kept: &'p [u64],
    told: Told<'p>,
    /// Whether the paths are named.
    is_listed: bool,
    state: Vec<u64>,
    /// Points of the new program with a subrange, by their slots.
    declared: HashMap<u32, Declared>,
    /// Where values come from, if that is asked for.
    origins: Option<Vec<Origin>>,
}

impl<'p> Walk<'p> {
    fn new(old: &'p Program, new: &'p Program, kept: &'p [u64], told: Told<'p>) -> Self {
        let points = new.inputs.iter().chain(&new.outputs).filter(|point| point.range.is_some());
        Self {
            old,
            new,
            kept,
            told,
            is_listed: false,
            state: new.initial_state(),
            declared: points.map(|point| (point.slot, point.declared())).collect(),
            origins: None,
        }
    }

    /// Notes that a value comes from an address of the old program.
    fn comes_from(&mut self, before: u64, now: u64, conversion: Option<&Conversion>) {
        if let Some(origins) = &mut self.origins {
            origins.push(Origin { before, now, is_same: conversion == Some(&Conversion::Same) });
        }
    }

    /// Takes over each variable; `partners` are those of the new program in the old one.
    fn variables(&mut self, partners: &[Option<usize>]) -> Vec<CarriedPath> {
        let (old, new) = (self.old, self.new);
        let spot = |of: &'p crate::form::Variable| Spot { of: &of.of, slot: of.slot };
        let known: Vec<&crate::form::Variable> = old.named().collect();
        let mut is_taken = vec![false; known.len()];
        let mut paths = Vec::new();
        for (variable, partner) in new.named().zip(partners) {
            let partner = partner.map(|place| {
                is_taken[place] = true;
                spot(known[place])
            });
            paths.extend(self.part(&variable.name, partner, Some(spot(variable))));
        }
        if old.has_unnamed_retentive() {
            let path = "memory without a name".to_owned();
            paths.push(CarriedPath { path, fate: Fate::Dropped, before: None, now: None });
        }
        for (variable, _) in known.into_iter().zip(is_taken).filter(|(_, taken)| !taken) {
            paths.extend(self.part(&variable.name, Some(spot(variable)), None));
        }
        paths
    }

    /// Takes over what has a path, or the parts of it; one entry where all parts have the same fate.
    fn part(
        &mut self,
        path: &str,
        old: Option<Spot<'p>>,
        new: Option<Spot<'p>>,
    ) -> Vec<CarriedPath> {
        let is_kept = |program: &Program, spot: &Spot<'_>| {
            let end = spot.slot.saturating_add(spot.of.slots() as u32);
            program.retains_any(spot.slot..end)
        };
        let old = old.filter(|spot| is_kept(self.old, spot));
        let new = new.filter(|spot| is_kept(self.new, spot));
        let (Some(from), Some(to)) = (old, new) else {
            let fate = match (old, new) {
                (None, None) => return Vec::new(),
                (_, None) => Fate::Dropped,
                (None, _) => Fate::New,
                (Some(_), Some(_)) => unreachable!("both were there"),
            };
            return vec![self.entry(path, fate, old, new)];
        };
        match (from.of, to.of) {
            (Type::Structure(one, _), Type::Structure(other, _)) => {
                let (old_type, new_type) =
                    (&self.old.structures[one.0 as usize], &self.new.structures[other.0 as usize]);
                if !old_type.name.eq_ignore_ascii_case(&new_type.name) {
                    return vec![self.entry(path, Fate::Dropped, old, new)];
                }
                let mut parts = Vec::new();
                let spot = |first: u32, field: &'p crate::types::Field| Spot {
                    of: &field.of,
                    slot: first + field.slot,
                };
                for field in new_type.fields.iter().filter(|field| !field.is_reference) {
                    let mut fields = old_type.fields.iter();
                    let same = fields.find(|known| {
                        !known.is_reference && known.name.eq_ignore_ascii_case(&field.name)
                    });
                    let before = same.map(|same| spot(from.slot, same));
                    let path = format!("{path}.{}", field.name);
                    parts.extend(self.part(&path, before, Some(spot(to.slot, field))));
                }
                for field in old_type.fields.iter().filter(|field| !field.is_reference) {
                    let is_same = |known: &crate::types::Field| {
                        !known.is_reference && known.name.eq_ignore_ascii_case(&field.name)
                    };
                    if !new_type.fields.iter().any(is_same) {
                        let path = format!("{path}.{}", field.name);
                        parts.extend(self.part(&path, Some(spot(from.slot, field)), None));
                    }
                }
                self.together(path, parts, (from, to))
            }
            (Type::Array(_), Type::Array(_)) => self.array(path, from, to),
            _ => {
                let fate = self.value(from, to);
                vec![self.entry(path, fate, old, new)]
            }
        }
    }

    /// Takes over a value without parts.
    fn value(&mut self, from: Spot<'_>, to: Spot<'_>) -> Fate {
        let (first, second) = (from.slot as usize, to.slot as usize);
        if !(self.told.is_known)(64 * u64::from(from.slot)) {
            return if (self.told.is_read)(64 * u64::from(to.slot)) {
                Fate::Dropped
            } else {
                Fate::Kept
            };
        }
        if let (Type::Text(before), Type::Text(now)) = (from.of, to.of) {
            self.comes_from(64 * first as u64, 64 * second as u64, None);
            if before > now {
                return Fate::Dropped;
            }
            let slots = from.of.slots() as usize;
            self.state[second..second + to.of.slots() as usize].fill(0);
            self.state[second..second + slots].copy_from_slice(&self.kept[first..first + slots]);
            return if before == now { Fate::Kept } else { Fate::Converted };
        }
        let Some(conversion) = conversion((self.old, from.of), (self.new, to.of)) else {
            return Fate::Dropped;
        };
        self.comes_from(64 * first as u64, 64 * second as u64, Some(&conversion));
        let value = conversion.of(self.kept[first]);
        let declared = self.declared.get(&to.slot);
        let value = value.filter(|value| declared.is_none_or(|range| range.contains(*value)));
        let Some(value) = value else {
            return Fate::Dropped;
        };
        self.state[second] = value;
        taken(&conversion)
    }

    /// The parts of a path, or the path alone where all of it has the same fate.
    fn together(
        &self,
        path: &str,
        parts: Vec<CarriedPath>,
        (from, to): (Spot<'_>, Spot<'_>),
    ) -> Vec<CarriedPath> {
        match parts.first().map(|part| part.fate) {
            Some(fate) if fate != Fate::New && parts.iter().all(|part| part.fate == fate) => {
                vec![self.entry(path, fate, Some(from), Some(to))]
            }
            _ => parts,
        }
    }

    fn entry(
        &self,
        path: &str,
        fate: Fate,
        old: Option<Spot<'_>>,
        new: Option<Spot<'_>>,
    ) -> CarriedPath {
        if !self.is_listed {
            return CarriedPath { path: String::new(), fate, before: None, now: None };
        }
        let name = |program: &Program, spot: Spot<'_>| program.type_name(spot.of);
        CarriedPath {
            path: path.to_owned(),
            fate,
            before: old.map(|spot| name(self.old, spot)),
            now: new.map(|spot| name(self.new, spot)),
        }
    }
}
