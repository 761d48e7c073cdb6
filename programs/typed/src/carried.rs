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
//! A path that only the new program has takes over the value of the one that a declared pair names. A name in both programs is the same variable, so a
//! pair that has done its work does nothing more.
//!
//! A path is that of a variable, of a member of a structure or of a function block, or of elements of an array. What has become of a path depends
//! on the declarations, except where a value has no name in its enumeration, is none of a narrower type or is outside of a declared subrange: that one
//! is dropped. References
//! are bound anew by the calls. The scans since the cold start become those of the same time, rounded up, so that no moment that a retentive variable
//! holds is one of the future.
//!
//! All stations compute the same state, since it is a function of the two programs and of the old state.

mod arrays;
mod renamed;
mod successor;
mod types;

use std::collections::HashMap;

use self::renamed::Moves;
pub use self::renamed::{Renamed, WrongPair};
pub use self::successor::{Origin, Successor, Taken};
use self::types::{Conversion, conversion};
use crate::form::{Program, Variable};
use crate::image::{Declared, Points};
use crate::scan::SCANS;
use crate::types::{Field, Type};

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
    /// The path in the old program, where a declared pair says that it has another name there.
    pub renamed_from: Option<String>,
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
    /// tell is dropped, where the new program reads it. Paths are renamed by pairs.
    ///
    /// # Panics
    /// If `state` is shorter than a state of `before`.
    pub fn carried(
        &self,
        before: &Self,
        state: &[u64],
        told: Told<'_>,
        renamed: &[Renamed],
    ) -> CarriedState {
        let partners = partners(before, self, &HashMap::new());
        let names = Names { partners: &partners, renamed };
        self.carried_from(before, state, told, (&names, true))
    }

    /// As [`Self::carried`], with the variables that [`partners`] finds; the paths have names only where they are listed.
    fn carried_from(
        &self,
        before: &Self,
        state: &[u64],
        told: Told<'_>,
        (names, is_listed): (&Names<'_>, bool),
    ) -> CarriedState {
        let mut walk = Walk::new(before, self, state, told);
        walk.is_listed = is_listed;
        let paths = walk.variables(names);
        if self.is_retentive() && before.is_retentive() {
            let time = i128::from(before.period.max(1)) * i128::from(state[SCANS]);
            let period = i128::from(self.period.max(1));
            let scans = (time + period - 1) / period;
            walk.state[SCANS] = u64::try_from(scans).unwrap_or(u64::MAX);
        }
        CarriedState { state: walk.state, paths }
    }
}

/// Which values of two programs are the same, by their names.
struct Names<'n> {
    /// For each variable of the new program the one of the old program with its name.
    partners: &'n [Option<usize>],
    renamed: &'n [Renamed],
}

impl Points {
    /// Puts the values of points before into an image of these, by name and type: of those in `names`, each with its name before and now, and not where
    /// the type or the subrange of the point does not have the value. Answers with the names before of those whose values are in no point.
    ///
    /// # Panics
    /// If an image is narrower than its points.
    pub fn carry<'n>(
        &self,
        image: &mut [u64],
        before: (&Self, &[u64]),
        names: &'n [[String; 2]],
    ) -> Vec<&'n str> {
        let (points, values) = before;
        let mut carry = |[was, is]: &[String; 2]| {
            let (point, old) = (self.find(is)?, points.find(was)?);
            let (before, now) = (old.declared(), point.declared());
            let stored = old.get(values);
            let value = match before.value_name(stored).filter(|_| now.values.is_some()) {
                Some(name) => now.value_named(name),
                None => types::converted(old.of, point.of, stored),
            };
            let value = value.filter(|value| now.has(*value))?;
            point.set(image, value);
            Some(())
        };
        let lost = names.iter().filter(|names| carry(names).is_none());
        lost.map(|[was, _]| was.as_str()).collect()
    }
}

/// A variable, or a part of one, in the state of its program.
#[derive(Debug, Clone, Copy)]
struct Spot<'p> {
    of: &'p Type,
    slot: u32,
}

impl<'p> From<&'p Variable> for Spot<'p> {
    fn from(variable: &'p Variable) -> Self {
        Self { of: &variable.of, slot: variable.slot }
    }
}

impl<'p> Spot<'p> {
    fn field(self, field: &'p Field) -> Self {
        Self { of: &field.of, slot: self.slot + field.slot }
    }

    fn is_kept(self, program: &Program) -> bool {
        let end = self.slot.saturating_add(self.of.slots() as u32);
        program.retains_any(self.slot..end)
    }
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
    /// What pairs rename.
    moves: Moves<'p>,
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
            moves: Moves::default(),
        }
    }

    /// Notes that a value comes from an address of the old program.
    fn comes_from(&mut self, before: u64, now: u64, conversion: Option<&Conversion>) {
        if let Some(origins) = &mut self.origins {
            let taken = match conversion {
                Some(Conversion::Same) => Taken::Same,
                Some(Conversion::Wider(from, to)) => Taken::Wider(*from, *to),
                _ => Taken::Otherwise,
            };
            origins.push(Origin { before, now, taken });
        }
    }

    /// Takes over each variable.
    fn variables(&mut self, names: &Names<'_>) -> Vec<CarriedPath> {
        let (old, new) = (self.old, self.new);
        self.moves = Moves::new(old, new, names.renamed);
        let known: Vec<&Variable> = old.named().collect();
        let mut is_taken = vec![false; known.len()];
        let mut paths = Vec::new();
        for (variable, partner) in new.named().zip(names.partners) {
            let partner = partner.map(|place| {
                is_taken[place] = true;
                Spot::from(known[place])
            });
            paths.extend(self.named(&variable.name, partner, Spot::from(variable)));
        }
        if old.has_unnamed_retentive() {
            let path = "memory without a name".to_owned();
            paths.push(CarriedPath {
                path,
                fate: Fate::Dropped,
                renamed_from: None,
                before: None,
                now: None,
            });
        }
        for (variable, _) in known.into_iter().zip(is_taken).filter(|(_, taken)| !taken) {
            paths.extend(self.part(&variable.name, Some(Spot::from(variable)), None));
        }
        paths
    }

    /// Takes over what the new program has by a name: from what has the name in the old program, or else from what a pair names.
    fn named(&mut self, path: &str, same: Option<Spot<'p>>, now: Spot<'p>) -> Vec<CarriedPath> {
        let Some(from) = same.is_none().then(|| self.moves.to(path)).flatten() else {
            return self.part(path, same, Some(now));
        };
        let (name, spot) = from;
        if spot.is_kept(self.old) && !now.is_kept(self.new) {
            return vec![self.entry(&name, Fate::Dropped, Some(spot), None)];
        }
        let mut paths = self.part(path, Some(spot), Some(now));
        for part in &mut paths {
            let rest = part.path.strip_prefix(path);
            part.renamed_from = rest.map(|rest| format!("{name}{rest}"));
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
        let old = old.filter(|spot| spot.is_kept(self.old));
        let new = new.filter(|spot| spot.is_kept(self.new));
        let (Some(from), Some(to)) = (old, new) else {
            let fate = match (old, new) {
                (None, None) => return Vec::new(),
                (Some(of), None) if self.moves.takes(of) => return Vec::new(),
                (Some(of), None) if self.moves.takes_of(of) => return self.rest(path, of),
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
                for field in new_type.fields.iter().filter(|field| !field.is_reference) {
                    let mut fields = old_type.fields.iter();
                    let same = fields.find(|known| {
                        !known.is_reference && known.name.eq_ignore_ascii_case(&field.name)
                    });
                    let before = same.map(|same| from.field(same));
                    let path = format!("{path}.{}", field.name);
                    parts.extend(self.named(&path, before, to.field(field)));
                }
                for field in old_type.fields.iter().filter(|field| !field.is_reference) {
                    let is_same = |known: &Field| {
                        !known.is_reference && known.name.eq_ignore_ascii_case(&field.name)
                    };
                    if !new_type.fields.iter().any(is_same) {
                        let path = format!("{path}.{}", field.name);
                        parts.extend(self.part(&path, Some(from.field(field)), None));
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

    /// The parts of what only the old program has, where pairs name others of its parts.
    fn rest(&mut self, path: &str, of: Spot<'p>) -> Vec<CarriedPath> {
        let Type::Structure(id, _) = of.of else { return Vec::new() };
        let fields = self.old.structures[id.0 as usize].fields.iter();
        let parts = fields.filter(|field| !field.is_reference).flat_map(|field| {
            self.part(&format!("{path}.{}", field.name), Some(of.field(field)), None)
        });
        parts.collect()
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
        let is_whole = |fate| {
            fate != Fate::New
                && parts.iter().all(|part| part.fate == fate && part.renamed_from.is_none())
        };
        match parts.first().map(|part| part.fate) {
            Some(fate) if is_whole(fate) => {
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
            let path = String::new();
            return CarriedPath { path, fate, renamed_from: None, before: None, now: None };
        }
        let name = |program: &Program, spot: Spot<'_>| program.type_name(spot.of);
        CarriedPath {
            path: path.to_owned(),
            fate,
            renamed_from: None,
            before: old.map(|spot| name(self.old, spot)),
            now: new.map(|spot| name(self.new, spot)),
        }
    }
}
