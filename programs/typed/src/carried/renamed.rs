//! Paths that have another name in the new program, by declared pairs.

use super::Spot;
use crate::form::Program;
use crate::types::Type;

/// A path of the old program, and the one that it has in the new program.
pub type Renamed = (String, String);

/// What is wrong with a pair for two programs.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongPair {
    /// The old program has neither of the two paths.
    #[error("the program before has no `{0}`; a pair is `old = \"new\"`")]
    NoSuchPath(String),
    /// The new program has the old path too.
    #[error("the program after has `{0}` too, so that is no other name; a pair is `old = \"new\"`")]
    StillThere(String),
}

/// The pairs that count for two programs.
#[derive(Debug, Default)]
pub(super) struct Moves<'p>(Vec<Move<'p>>);

/// A pair that counts, with what it names in the old program.
#[derive(Debug)]
struct Move<'p> {
    before: String,
    now: String,
    spot: Spot<'p>,
}

/// A variable, or a member of structures in one. Elements of arrays keep their indices.
fn spot<'p>(program: &'p Program, path: &str) -> Option<Spot<'p>> {
    let named = || program.named();
    let same = named().find(|variable| variable.name == path);
    let other = || named().find(|variable| variable.name.eq_ignore_ascii_case(path));
    if let Some(variable) = same.or_else(other) {
        return Some(variable.into());
    }
    let (whole, name) = path.rsplit_once('.')?;
    let whole = spot(program, whole)?;
    let Type::Structure(id, _) = whole.of else { return None };
    let mut fields = program.structures.get(id.0 as usize)?.fields.iter();
    let field =
        fields.find(|field| !field.is_reference && field.name.eq_ignore_ascii_case(name))?;
    Some(whole.field(field))
}

impl Program {
    /// Whether a pair can name the path: that of a variable, or of a member of structures in one.
    pub fn has_path(&self, path: &str) -> bool {
        spot(self, path).is_some()
    }

    /// What is wrong with a pair that names the path of this program and what it was in the program before. Nothing is where that has the new path
    /// already.
    ///
    /// # Errors
    /// [`WrongPair`].
    pub fn judge_pair(&self, before: &Self, (old, new): &Renamed) -> Result<(), WrongPair> {
        if before.has_path(new) {
            Ok(())
        } else if !before.has_path(old) {
            Err(WrongPair::NoSuchPath(old.clone()))
        } else if self.has_path(old) {
            Err(WrongPair::StillThere(old.clone()))
        } else {
            Ok(())
        }
    }
}

impl<'p> Moves<'p> {
    pub(super) fn new(old: &'p Program, new: &Program, renamed: &[Renamed]) -> Self {
        let mut moves: Vec<Move<'p>> = Vec::new();
        for (before, now) in renamed {
            let counts = new.has_path(now) && !new.has_path(before) && !old.has_path(now);
            let is_first = moves.iter().all(|known| !known.now.eq_ignore_ascii_case(now));
            let Some(spot) = spot(old, before).filter(|_| counts && is_first) else { continue };
            moves.push(Move { before: before.clone(), now: now.clone(), spot });
            // What sees the edges of a signal has a name behind that of the signal.
            let rest = |name: &str| {
                let (whole, rest) = name.split_at_checked(before.len())?;
                let is_of = whole.eq_ignore_ascii_case(before) && rest.starts_with('.');
                is_of.then(|| rest.to_owned())
            };
            for variable in old.named() {
                let Some(rest) = rest(&variable.name) else { continue };
                let now = format!("{now}{rest}");
                if new.has_path(&now) && !old.has_path(&now) {
                    moves.push(Move { before: variable.name.clone(), now, spot: variable.into() });
                }
            }
        }
        Self(moves)
    }

    /// What a path of the new program takes over by a pair: its name in the old program, and where that is.
    pub(super) fn to(&self, path: &str) -> Option<(String, Spot<'p>)> {
        let found = self.0.iter().find(|known| known.now.eq_ignore_ascii_case(path))?;
        Some((found.before.clone(), found.spot))
    }

    /// Whether a pair takes all of what the old program has there.
    pub(super) fn takes(&self, of: Spot<'_>) -> bool {
        let is =
            |known: &Move<'_>| (known.spot.slot, known.spot.of.slots()) == (of.slot, of.of.slots());
        self.0.iter().any(is)
    }

    /// Whether a pair takes a part of it.
    pub(super) fn takes_of(&self, of: Spot<'_>) -> bool {
        let slots = u64::from(of.slot)..u64::from(of.slot) + of.of.slots();
        self.0.iter().any(|known| slots.contains(&known.spot.slot.into()))
    }
}
